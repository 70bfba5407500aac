// Reads what src/qlb/results/page/packing.py writes.

import type { Quantised } from "./data";

type Unsigned = Uint8Array | Uint16Array | Uint32Array;

/** Unsigned integers of `size` bytes, in rows of `columns`. */
export async function unpack(text: string, size: 1 | 2 | 4, columns: number): Promise<Unsigned> {
  if (text === "") return new Uint8Array(0);
  const bytes = await inflate(base64Bytes(text));
  const count = bytes.length / size;
  const folded =
    size === 1 ? new Uint8Array(count) : size === 2 ? new Uint16Array(count) : new Uint32Array(count);
  for (let plane = 0; plane < size; plane++) {
    const first = plane * count;
    for (let i = 0; i < count; i++) folded[i] |= bytes[first + i] << (8 * plane);
  }
  for (let i = 0; i < count; i++) {
    const difference = (folded[i] >>> 1) ^ -(folded[i] & 1);
    folded[i] = difference + (i < columns ? 0 : folded[i - columns]); // wraps around, as it should
  }
  return folded;
}

/** Positions x, y, z of each vertex, one array for each frame. */
export async function unpackPositions(data: Quantised<number[]>, vertices: number): Promise<Float32Array[]> {
  const integers = await unpack(data.data, 2, 3 * vertices);
  const frames: Float32Array[] = [];
  for (let begin = 0; begin < integers.length; begin += 3 * vertices) {
    const positions = new Float32Array(3 * vertices);
    for (let axis = 0; axis < 3; axis++) {
      const low = data.low[axis];
      const scale = (data.high[axis] - low) / 65535;
      const first = begin + axis * vertices;
      for (let v = 0; v < vertices; v++) positions[3 * v + axis] = low + scale * integers[first + v];
    }
    frames.push(positions);
  }
  return frames;
}

export function base64Bytes(text: string): Uint8Array<ArrayBuffer> {
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

async function inflate(bytes: Uint8Array<ArrayBuffer>): Promise<Uint8Array> {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
