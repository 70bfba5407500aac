// Numbers as texts, with units.

const PREFIXES: [number, string][] = [
  [1e9, "G"],
  [1e6, "M"],
  [1e3, "k"],
  [1, ""],
  [1e-3, "m"],
  [1e-6, "µ"],
  [1e-9, "n"],
];

export interface Scale {
  /** what to divide by */
  factor: number;
  unit: string;
}

/** A unit in which numbers up to `largest` are easy to read. */
export function scaleFor(largest: number, unit: string): Scale {
  if (!(largest > 0)) return { factor: 1, unit };
  const fitting = PREFIXES.find(([factor]) => largest >= 0.9995 * factor) ?? PREFIXES[PREFIXES.length - 1];
  return { factor: fitting[0], unit: fitting[1] + unit };
}

/** Three digits, plain where that is short. */
export function short(value: number): string {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(2);
  return String(Number(value.toPrecision(3)));
}

/** A time in seconds with as many decimals as tell frames apart. */
export function decimalsOf(times: number[]): number {
  for (let decimals = 0; decimals < 6; decimals++) {
    if (times.every((t) => Math.abs(Number(t.toFixed(decimals)) - t) < 1e-9)) return decimals;
  }
  return 6;
}
