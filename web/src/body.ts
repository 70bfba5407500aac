// The surface of the bodies, coloured by a field.

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DataTexture,
  DoubleSide,
  LineBasicMaterial,
  LineSegments,
  LinearFilter,
  Mesh,
  MeshLambertMaterial,
  SRGBColorSpace,
} from "three";

import type { Animation, Frame } from "./animation";
import { splitAtCreases, vertexNormals, type SplitSurface } from "./creases";

/** Not a field: each body has a colour. */
export const BY_BODY = "body";

export class Body {
  readonly mesh: Mesh<BufferGeometry, MeshLambertMaterial>;
  readonly edges: LineSegments;
  /** sharp edges of the rest shape */
  readonly outline: LineSegments;
  private readonly surface: SplitSurface;
  private readonly values: Float32Array;
  private readonly texture: DataTexture;
  private field = "displacement";
  private high = 1;

  constructor(
    private readonly animation: Animation,
    palette: Uint8Array,
    private readonly bodyColours: string[],
  ) {
    this.surface = splitAtCreases(animation.rest, animation.triangles);
    this.values = new Float32Array(animation.head.vertices);
    this.texture = textureOf(palette);
    const count = this.surface.source.length;
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * count), 3));
    geometry.setAttribute("normal", new BufferAttribute(new Float32Array(3 * count), 3));
    geometry.setAttribute("uv", new BufferAttribute(new Float32Array(2 * count), 2));
    geometry.setAttribute("color", new BufferAttribute(this.colours(), 3));
    geometry.setIndex(new BufferAttribute(this.surface.triangles, 1));
    const shifted = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
    this.mesh = new Mesh(
      geometry,
      new MeshLambertMaterial({ map: this.texture, side: DoubleSide, ...shifted }),
    );
    this.mesh.frustumCulled = false;
    this.mesh.castShadow = true;
    const lines = new BufferGeometry();
    lines.setAttribute("position", geometry.getAttribute("position"));
    lines.setIndex(new BufferAttribute(this.surface.edges, 1));
    const ink = new LineBasicMaterial({ color: "#10161d", transparent: true, opacity: 0.28 });
    this.edges = new LineSegments(lines, ink);
    this.edges.frustumCulled = false;
    this.outline = outlineOf(animation.rest, this.surface.creases);
  }

  colourBy(field: string, high: number): void {
    this.field = field;
    this.high = high > 0 ? high : 1;
    const { material } = this.mesh;
    const byBody = field === BY_BODY;
    material.map = byBody ? null : this.texture;
    material.vertexColors = byBody;
    material.needsUpdate = true;
  }

  show(frame: Frame): void {
    const { geometry } = this.mesh;
    const { source, triangles } = this.surface;
    const positions = geometry.getAttribute("position").array as Float32Array;
    for (let v = 0; v < source.length; v++) {
      const from = 3 * source[v];
      for (let axis = 0; axis < 3; axis++) positions[3 * v + axis] = frame.positions[from + axis];
    }
    vertexNormals(positions, triangles, geometry.getAttribute("normal").array as Float32Array);
    geometry.getAttribute("position").needsUpdate = true;
    geometry.getAttribute("normal").needsUpdate = true;
    if (this.field !== BY_BODY) this.showValues(frame);
  }

  private showValues(frame: Frame): void {
    this.animation.values(frame, this.field, this.values);
    const places = this.mesh.geometry.getAttribute("uv");
    const { source } = this.surface;
    for (let v = 0; v < source.length; v++) {
      places.setX(v, (0.5 + 255 * Math.min(1, this.values[source[v]] / this.high)) / 256);
    }
    places.needsUpdate = true;
  }

  /** Of drawn vertices, by body. */
  private colours(): Float32Array {
    const colours = this.bodyColours.map((colour) => new Color(colour));
    const out = new Float32Array(3 * this.surface.source.length);
    this.surface.source.forEach((vertex, v) => {
      colours[this.animation.bodyOfVertex[vertex] % colours.length].toArray(out, 3 * v);
    });
    return out;
  }
}

function outlineOf(rest: Float32Array, creases: Uint32Array): LineSegments {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(rest, 3));
  geometry.setIndex(new BufferAttribute(creases, 1));
  return new LineSegments(
    geometry,
    new LineBasicMaterial({ color: "#8b97a4", transparent: true, opacity: 0.6 }),
  );
}

function textureOf(palette: Uint8Array): DataTexture {
  const colours = palette.length / 3;
  const texels = new Uint8Array(4 * colours).fill(255);
  for (let i = 0; i < colours; i++) texels.set(palette.subarray(3 * i, 3 * i + 3), 4 * i);
  const texture = new DataTexture(texels, colours, 1);
  texture.colorSpace = SRGBColorSpace;
  texture.magFilter = texture.minFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}
