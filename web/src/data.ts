// What a page holds, as written by src/qlb/results/page. Units are SI.

/** Integers as `packing.ts` reads them, standing for numbers between `low` and `high`. */
export interface Quantised<Bound = number> {
  low: Bound;
  high: Bound;
  data: string;
}

export interface Field {
  name: string;
  label: string;
  unit: string;
}

export interface Triangles {
  count: number;
  data: string;
}

/** What does not change from frame to frame. */
export interface Head {
  vertices: number;
  triangles: Triangles;
  rest: Quantised<number[]>;
  /** the first is the displacement, which is taken from the positions */
  fields: Field[];
  /** names, perhaps empty */
  bodies: string[];
  bodyOfVertex: string;
  obstacles: { vertices: number; triangles: Triangles };
  /** of planes, out of the solid */
  normals: number[][];
  failedSteps: number[];
}

/** Frames that are quantised together. */
export interface Chunk {
  steps: number[];
  times: number[];
  positions: Quantised<number[]>;
  /** in the order of `Head.fields`, without the displacement */
  fields: (Quantised & { name: string; largest: number })[];
  obstacles: (Quantised<number[]> & { frames: number }) | null;
  /** where it is known */
  history: History | null;
  /** of each frame, a point on each plane */
  planePoints: number[][][];
}

export interface AnimationData {
  label: string;
  head: Head;
  chunks: Chunk[];
  note: string;
}

export interface Curve {
  name: string;
  steps: number[];
  values: number[];
}

export interface Charts {
  iterations: Curve[];
  factorizations: { steps: number[]; values: number[] };
  residuals: {
    lines: { step: number; failed: boolean; iterations: number[]; values: number[] }[];
    solves: number;
    tolerance: number | null;
  };
  seconds: {
    steps: number[];
    parts: { name: string; colour: string; total: number; values: number[] }[];
  };
  contact: { steps: number[]; contacts: number[]; gaps: (number | null)[]; dhat: number } | null;
  failedSteps: number[];
}

/** Of each frame of a chunk. */
export interface History {
  /** by kind, and their total [J] */
  energies: Record<string, number[]>;
  /** [kg m/s] */
  momentum: number[][];
  /** about the origin [kg m^2/s] */
  angularMomentum: number[][];
}

/** One combination of values; null where it has no run. */
export interface SweepCase {
  name: string;
  /** in the order of the keys, as they were written */
  values: string[];
  /** whether all its steps converged */
  good: boolean;
  /** nonlinear iterations a step */
  mean: number | null;
  max: number | null;
  factorizations: number | null;
  /** [s] */
  cpu: number | null;
}

export interface Sweep {
  keys: string[];
  cases: SweepCase[];
}

/** One run in a figure. */
export interface Panel {
  /** a curve for each stage of the integrator, two at most */
  stages: Curve[];
  failed: { steps: number[]; values: number[] };
  /** its mean and maximum */
  counts: string;
  /** how many steps failed, if any */
  trouble: string;
}

/** Rows are a variation, columns the solvers. */
export interface FigureData {
  number: number;
  solvers: string[];
  rows: { label: string; panels: (Panel | null)[] }[];
}

export interface PageData {
  /** sRGB bytes of the colours from low to high, base64 */
  palette: string;
  /** of bodies and of runs */
  colours: string[];
  animations: AnimationData[];
  charts: { label: string; charts: Charts }[];
  /** whether a server sends more */
  live: boolean;
  /** of the page of a sweep, which has nothing else */
  sweep?: Sweep;
  /** of the page of figures, which has nothing else */
  figures?: FigureData[];
}

/** What the server of a live run answers. */
export interface Update {
  status: string;
  /** how the run is going, in a line */
  headline: string;
  detail: string;
  /** like a verdict's: good, bad or warn */
  level: string;
  facts: Record<string, string>;
  chunk: Chunk | null;
  charts: Charts;
  failedSteps: number[];
  /** that the server needed */
  seconds: number;
}

/** Names of events on `document` by which the scripts of a page talk to each other. */
export const SHOW_STEP = "qlb:step";
export const NEW_CHARTS = "qlb:charts";
export const NEW_FRAMES = "qlb:frames";

export function pageData(): PageData {
  const element = document.getElementById("qlb-data");
  return JSON.parse(element?.textContent ?? "{}") as PageData;
}
