// Normals that are smooth but for sharp edges of the rest shape.

/** Faces that meet at a larger angle than this are not smoothed into each other. */
const CREASE = Math.cos((40 * Math.PI) / 180);

export interface SplitSurface {
  /** the vertex of the surface that each drawn vertex stands for */
  source: Uint32Array;
  /** drawn vertices of each triangle */
  triangles: Uint32Array;
  /** pairs of drawn vertices */
  edges: Uint32Array;
  /** pairs of vertices of the surface, at creases */
  creases: Uint32Array;
}

/** Split vertices where faces meet at a crease. */
export function splitAtCreases(rest: Float32Array, triangles: Uint32Array): SplitSurface {
  const faces = triangles.length / 3;
  const normals = faceNormals(rest, triangles);
  const corners = new Disjoint(triangles.length);
  const edges = new Map<number, number>();
  const drawnEdges: number[] = [];
  const creases: number[] = [];
  const vertices = rest.length / 3;
  for (let face = 0; face < faces; face++) {
    for (let k = 0; k < 3; k++) {
      const begin = 3 * face + k;
      const end = 3 * face + ((k + 1) % 3);
      const [a, b] = [triangles[begin], triangles[end]];
      const key = Math.min(a, b) * vertices + Math.max(a, b);
      const other = edges.get(key);
      if (other === undefined) {
        edges.set(key, begin);
        drawnEdges.push(begin, end);
        continue;
      }
      if (dot(normals, face, Math.floor(other / 3)) < CREASE) {
        creases.push(a, b);
        continue;
      }
      const otherEnd = 3 * Math.floor(other / 3) + ((other + 1) % 3);
      const same = triangles[other] === a;
      corners.join(begin, same ? other : otherEnd);
      corners.join(end, same ? otherEnd : other);
    }
  }
  return { ...numbered(corners, triangles, drawnEdges), creases: Uint32Array.from(creases) };
}

function numbered(corners: Disjoint, triangles: Uint32Array, edges: number[]): Omit<SplitSurface, "creases"> {
  const number = new Map<number, number>();
  const source: number[] = [];
  const drawn = new Uint32Array(triangles.length);
  for (let corner = 0; corner < triangles.length; corner++) {
    const root = corners.root(corner);
    let index = number.get(root);
    if (index === undefined) {
      index = source.length;
      number.set(root, index);
      source.push(triangles[corner]);
    }
    drawn[corner] = index;
  }
  return {
    source: Uint32Array.from(source),
    triangles: drawn,
    edges: Uint32Array.from(edges, (corner) => drawn[corner]),
  };
}

/** Normals of drawn vertices, weighted by the areas of their faces, into `out`. */
export function vertexNormals(positions: Float32Array, triangles: Uint32Array, out: Float32Array): void {
  out.fill(0);
  const n = [0, 0, 0];
  for (let t = 0; t < triangles.length; t += 3) {
    cross(positions, triangles[t], triangles[t + 1], triangles[t + 2], n);
    for (let k = 0; k < 3; k++) {
      const v = 3 * triangles[t + k];
      for (let axis = 0; axis < 3; axis++) out[v + axis] += n[axis];
    }
  }
  for (let v = 0; v < out.length; v += 3) {
    const length = Math.hypot(out[v], out[v + 1], out[v + 2]) || 1;
    for (let axis = 0; axis < 3; axis++) out[v + axis] /= length;
  }
}

function faceNormals(positions: Float32Array, triangles: Uint32Array): Float32Array {
  const normals = new Float32Array(triangles.length);
  const n = [0, 0, 0];
  for (let t = 0; t < triangles.length; t += 3) {
    cross(positions, triangles[t], triangles[t + 1], triangles[t + 2], n);
    const length = Math.hypot(n[0], n[1], n[2]) || 1;
    for (let axis = 0; axis < 3; axis++) normals[t + axis] = n[axis] / length;
  }
  return normals;
}

function cross(x: Float32Array, a: number, b: number, c: number, out: number[]): void {
  const [i, j, k] = [3 * a, 3 * b, 3 * c];
  const [ux, uy, uz] = [x[j] - x[i], x[j + 1] - x[i + 1], x[j + 2] - x[i + 2]];
  const [vx, vy, vz] = [x[k] - x[i], x[k + 1] - x[i + 1], x[k + 2] - x[i + 2]];
  out[0] = uy * vz - uz * vy;
  out[1] = uz * vx - ux * vz;
  out[2] = ux * vy - uy * vx;
}

function dot(normals: Float32Array, a: number, b: number): number {
  return [0, 1, 2].reduce((sum, axis) => sum + normals[3 * a + axis] * normals[3 * b + axis], 0);
}

/** Sets that can be joined. */
class Disjoint {
  private readonly parents: Uint32Array;

  constructor(size: number) {
    this.parents = Uint32Array.from({ length: size }, (_, i) => i);
  }

  root(i: number): number {
    while (this.parents[i] !== i) {
      this.parents[i] = this.parents[this.parents[i]];
      i = this.parents[i];
    }
    return i;
  }

  join(i: number, j: number): void {
    this.parents[this.root(i)] = this.root(j);
  }
}
