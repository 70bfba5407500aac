// Surfaces with faces that each have their own normal.

import type { BufferGeometry } from "three";

/** Give a geometry without index the corners of triangles, and normals of the faces. */
export function flat(geometry: BufferGeometry, triangles: Uint32Array, vertices: Float32Array): void {
  const positions = geometry.getAttribute("position");
  for (let corner = 0; corner < triangles.length; corner++) {
    const v = 3 * triangles[corner];
    positions.setXYZ(corner, vertices[v], vertices[v + 1], vertices[v + 2]);
  }
  positions.needsUpdate = true;
  geometry.computeVertexNormals();
}
