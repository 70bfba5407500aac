// One 3D view: the bodies of a run, obstacles and planes, drawn when something changed.

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  DoubleSide,
  HemisphereLight,
  Mesh,
  MeshLambertMaterial,
  PerspectiveCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import type { Animation, Frame } from "./animation";
import { Body } from "./body";
import { flat } from "./flat";
import { Plane } from "./plane";

/** From the bodies to the camera; y is up. As in pictures (src/qlb/results/picture.py). */
const LOOK_FROM = new Vector3(0.45, 0.35, 1).normalize();
const FIELD_OF_VIEW = 30;
/** Around what moves. */
const MARGIN = 1.12;

export interface Look {
  /** colours of the surface are a texture from low to high */
  palette: Uint8Array;
  /** of bodies, sRGB */
  bodyColours: string[];
}

export class View {
  readonly canvas: HTMLCanvasElement;
  readonly controls: OrbitControls;
  readonly camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 100);
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly sun = new DirectionalLight(0xffffff, 1.7);
  private readonly sky = new HemisphereLight(0xffffff, 0xc4cbd4, 2.8);
  private readonly body: Body;
  private readonly obstacles: Mesh<BufferGeometry, MeshLambertMaterial> | null;
  private readonly planes: Plane[];
  private wanted = false;
  private sized = false;
  private touched = false;
  private frame: Frame;

  constructor(
    readonly animation: Animation,
    look: Look,
    label: string,
  ) {
    this.renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.canvas = this.renderer.domElement;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", label);
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = animation.head.normals.length > 0;
    this.body = new Body(animation, look.palette, look.bodyColours);
    this.obstacles = obstaclesOf(animation);
    this.planes = animation.head.normals.map((normal) => new Plane(normal));
    this.frame = animation.frames[0];
    this.body.outline.visible = this.planes.length === 0 && !this.obstacles;
    this.scene.add(this.sky, this.sun, this.sun.target, this.body.mesh, this.body.edges, this.body.outline);
    for (const plane of this.planes) this.scene.add(plane.group);
    if (this.obstacles) this.scene.add(this.obstacles);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableZoom = false; // until it has the focus
    this.controls.addEventListener("change", () => this.redraw());
    this.controls.addEventListener("start", () => (this.touched = true));
    this.show(this.frame);
  }

  /** The camera to where it holds all of the motion. */
  reset(): void {
    this.touched = false;
    const { centre, radius } = this.extent();
    const distance = this.distance(centre);
    this.camera.position.copy(centre).addScaledVector(LOOK_FROM, distance);
    this.camera.near = Math.max(distance - 2 * radius, 0) / 10 + distance / 200;
    this.camera.far = distance * 20;
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(centre);
    this.controls.minDistance = radius / 20;
    this.controls.maxDistance = distance * 5;
    this.controls.update();
    this.place(centre, radius);
    this.redraw();
  }

  /** There are more frames: hold them in sight, unless the camera was moved by hand. */
  framesChanged(): void {
    if (!this.touched && this.sized) this.reset();
  }

  /** From `centre`, at which all points of all frames are in sight. */
  private distance(centre: Vector3): number {
    const right = new Vector3(0, 1, 0).cross(LOOK_FROM).normalize();
    const up = LOOK_FROM.clone().cross(right);
    const tall = Math.tan(((FIELD_OF_VIEW / 2) * Math.PI) / 180) / MARGIN;
    const wide = tall * this.camera.aspect;
    const point = new Vector3();
    let distance = 0;
    for (const { positions } of this.animation.frames) {
      for (let i = 0; i < positions.length; i += 3) {
        point.fromArray(positions, i).sub(centre);
        const needed = Math.max(Math.abs(point.dot(right)) / wide, Math.abs(point.dot(up)) / tall);
        distance = Math.max(distance, point.dot(LOOK_FROM) + needed);
      }
    }
    return distance || 1;
  }

  /** Light and planes to where the bodies move. */
  private place(centre: Vector3, radius: number): void {
    const up = this.planes[0]?.normal ?? new Vector3(0, 1, 0);
    const side = new Vector3(0.35, 0.15, 0.45);
    this.sun.position
      .copy(centre)
      .addScaledVector(up, 3 * radius)
      .addScaledVector(side, 2 * radius);
    this.sun.target.position.copy(centre);
    this.sun.castShadow = this.planes.length > 0;
    const seen = this.sun.shadow.camera;
    [seen.left, seen.right, seen.bottom, seen.top] = [-1.8, 1.8, -1.8, 1.8].map((k) => k * radius);
    [seen.near, seen.far] = [0.1 * radius, 8 * radius];
    seen.updateProjectionMatrix();
    this.sun.shadow.mapSize.set(1024, 1024);
    this.sun.shadow.radius = 4;
    this.sun.shadow.normalBias = 0.01 * radius;
    for (const plane of this.planes) plane.resize(centre, radius);
  }

  private extent(): { centre: Vector3; radius: number } {
    const low = new Vector3(Infinity, Infinity, Infinity);
    const high = new Vector3(-Infinity, -Infinity, -Infinity);
    const point = new Vector3();
    for (const frame of this.animation.frames) {
      for (let i = 0; i < frame.positions.length; i += 3) {
        point.fromArray(frame.positions, i);
        low.min(point);
        high.max(point);
      }
    }
    const centre = low.clone().add(high).multiplyScalar(0.5);
    return { centre, radius: Math.max(0.5 * low.distanceTo(high), 1e-9) };
  }

  show(frame: Frame): void {
    this.frame = frame;
    this.body.show(frame);
    if (this.obstacles && frame.obstacles)
      flat(this.obstacles.geometry, this.animation.obstacleTriangles, frame.obstacles);
    this.planes.forEach((plane, k) => plane.move(frame.planePoints[k]));
    this.redraw();
  }

  /** What the surface is coloured by, and the value at the upper end of the colours. */
  colourBy(field: string, high: number): void {
    this.body.colourBy(field, high);
    this.body.show(this.frame);
    this.redraw();
  }

  showEdges(visible: boolean): void {
    this.body.edges.visible = visible;
    this.redraw();
  }

  setColours(background: string, ground: string): void {
    this.scene.background = new Color(background);
    for (const plane of this.planes) plane.setColour(ground);
    this.redraw();
  }

  resize(width: number, height: number): void {
    const first = !this.sized;
    this.sized = true;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(1, height);
    this.camera.updateProjectionMatrix();
    if (first) this.reset();
    this.redraw();
  }

  /** Like another view's. */
  takeCamera(other: View): void {
    this.camera.position.copy(other.camera.position);
    this.controls.target.copy(other.controls.target);
    this.camera.lookAt(this.controls.target);
    this.redraw();
  }

  redraw(): void {
    if (this.wanted) return;
    this.wanted = true;
    requestAnimationFrame(() => {
      this.wanted = false;
      for (const plane of this.planes) plane.face(this.camera.position);
      this.renderer.render(this.scene, this.camera);
    });
  }
}

function obstaclesOf(animation: Animation): Mesh<BufferGeometry, MeshLambertMaterial> | null {
  const corners = animation.obstacleTriangles.length;
  if (corners === 0) return null;
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * corners), 3));
  geometry.setAttribute("normal", new BufferAttribute(new Float32Array(3 * corners), 3));
  const material = new MeshLambertMaterial({ color: "#949da8", side: DoubleSide });
  const mesh = new Mesh(geometry, material);
  mesh.frustumCulled = false;
  mesh.castShadow = mesh.receiveShadow = true;
  return mesh;
}
