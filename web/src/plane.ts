// A plane, as a square with a grid.

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DoubleSide,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  PlaneGeometry,
  Quaternion,
  ShadowMaterial,
  Vector3,
} from "three";

/** Half the side of the square, in radii of what moves. */
const REACH = 2.6;
const CELLS = 20;

export class Plane {
  readonly group = new Group();
  readonly normal: Vector3;
  private readonly square: Mesh<PlaneGeometry, MeshBasicMaterial>;
  private readonly lines: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly centre = new Vector3();
  private point = new Vector3();

  constructor(normal: number[]) {
    this.normal = new Vector3().fromArray(normal);
    const apart = { polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 2 };
    const look = new MeshBasicMaterial({ side: DoubleSide, transparent: true, ...apart });
    this.square = new Mesh(new PlaneGeometry(2, 2), look);
    const shade = new Mesh(this.square.geometry, new ShadowMaterial({ opacity: 0.22, ...apart }));
    shade.receiveShadow = true;
    this.lines = new LineSegments(grid(), new LineBasicMaterial({ transparent: true, opacity: 0.35 }));
    this.group.add(this.square, shade, this.lines);
    this.group.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), this.normal));
  }

  /** Large enough for bodies that move within a ball. */
  resize(centre: Vector3, radius: number): void {
    this.centre.copy(centre);
    this.group.scale.setScalar(REACH * radius);
    this.update();
  }

  /** To a point that it goes through. */
  move(point: number[]): void {
    this.point.fromArray(point);
    this.update();
  }

  setColour(colour: string): void {
    this.square.material.color = new Color(colour);
    this.lines.material.color = new Color(colour).offsetHSL(0, 0, -0.12);
  }

  /** Faint where the camera is behind it. */
  face(camera: Vector3): void {
    const inFront = camera.clone().sub(this.point).dot(this.normal) > 0;
    this.square.material.opacity = inFront ? 1 : 0.15;
    this.square.material.depthWrite = inFront;
  }

  private update(): void {
    const height = this.centre.clone().sub(this.point).dot(this.normal);
    this.group.position.copy(this.centre).addScaledVector(this.normal, -height);
  }
}

function grid(): BufferGeometry {
  const points: number[] = [];
  for (let i = 0; i <= CELLS; i++) {
    const at = (2 * i) / CELLS - 1;
    points.push(at, -1, 0, at, 1, 0, -1, at, 0, 1, at, 0);
  }
  return new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
}
