// The frames of one run, decoded.

import type { AnimationData, Chunk, Field, Head } from "./data";
import { unpack, unpackPositions } from "./packing";

/** Values in 8 bits between 0 and `high`. */
interface Bytes {
  high: number;
  bytes: Uint8Array;
}

export interface Frame {
  step: number;
  time: number;
  positions: Float32Array;
  values: Map<string, Bytes>;
  obstacles: Float32Array | null;
  planePoints: number[][];
}

export interface Range {
  high: number;
  /** the largest value, where some lie above `high` */
  largest: number;
}

/** More frames than this are thinned out while a run is followed. */
const MOST_FRAMES = 600;

export class Animation {
  frames: Frame[] = [];
  private ranges = new Map<string, Range>();

  private constructor(
    readonly label: string,
    readonly note: string,
    readonly head: Head,
    readonly triangles: Uint32Array,
    readonly rest: Float32Array,
    readonly bodyOfVertex: Uint16Array,
    readonly obstacleTriangles: Uint32Array,
  ) {}

  static async from(data: AnimationData): Promise<Animation> {
    const { head } = data;
    const animation = new Animation(
      data.label,
      data.note,
      head,
      new Uint32Array(await unpack(head.triangles.data, 4, 3)),
      (await unpackPositions(head.rest, head.vertices))[0],
      new Uint16Array(await unpack(head.bodyOfVertex, 2, 1)),
      new Uint32Array(await unpack(head.obstacles.triangles.data, 4, 3)),
    );
    for (const chunk of data.chunks) await animation.add(chunk);
    return animation;
  }

  /** Frames that follow those that are there. */
  async add(chunk: Chunk): Promise<void> {
    const { vertices, obstacles } = this.head;
    const positions = await unpackPositions(chunk.positions, vertices);
    const values = await Promise.all(chunk.fields.map((field) => unpack(field.data, 1, vertices)));
    const around = chunk.obstacles ? await unpackPositions(chunk.obstacles, obstacles.vertices) : [];
    for (const field of chunk.fields) this.widen(field.name, field.high, field.largest);
    positions.forEach((x, k) => {
      const byName = new Map<string, Bytes>();
      chunk.fields.forEach((field, i) => {
        const bytes = values[i].subarray(k * vertices, (k + 1) * vertices) as Uint8Array;
        byName.set(field.name, { high: field.high, bytes });
      });
      const farthest = this.farthest(x);
      this.widen("displacement", farthest, farthest);
      this.frames.push({
        step: chunk.steps[k],
        time: chunk.times[k],
        positions: x,
        values: byName,
        obstacles: around[Math.min(k, around.length - 1)] ?? null,
        planePoints: chunk.planePoints[k],
      });
    });
    if (this.frames.length > MOST_FRAMES) this.thin();
  }

  /** Every other frame goes, but for the last. */
  private thin(): void {
    const last = this.frames.length - 1;
    this.frames = this.frames.filter((_, k) => k % 2 === 0 || k === last);
  }

  get fields(): Field[] {
    return this.head.fields;
  }

  /** Of a field, over all frames. */
  range(field: string): Range {
    return this.ranges.get(field) ?? { high: 0, largest: 0 };
  }

  /** A field at the vertices, into `out`. */
  values(frame: Frame, field: string, out: Float32Array): void {
    if (field === "displacement") {
      for (let v = 0; v < out.length; v++) out[v] = this.displacement(frame.positions, v);
      return;
    }
    const values = frame.values.get(field);
    if (!values) {
      out.fill(0);
      return;
    }
    for (let v = 0; v < out.length; v++) out[v] = (values.bytes[v] * values.high) / 255;
  }

  /** The last frame at or before a time. */
  frameAt(time: number): Frame {
    let low = 0;
    let high = this.frames.length - 1;
    const reached = time + 1e-9 * Math.max(1, Math.abs(time));
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.frames[middle].time <= reached) low = middle;
      else high = middle - 1;
    }
    return this.frames[low];
  }

  private displacement(x: Float32Array, v: number): number {
    const i = 3 * v;
    return Math.hypot(x[i] - this.rest[i], x[i + 1] - this.rest[i + 1], x[i + 2] - this.rest[i + 2]);
  }

  private farthest(x: Float32Array): number {
    let most = 0;
    for (let v = 0; v < this.head.vertices; v++) most = Math.max(most, this.displacement(x, v));
    return most;
  }

  private widen(field: string, high: number, largest: number): void {
    const before = this.range(field);
    this.ranges.set(field, { high: Math.max(before.high, high), largest: Math.max(before.largest, largest) });
  }
}
