// Energies and momentum over time.

import { CURVES, plot, type Plot } from "./charts";
import type { Chunk } from "./data";

type Settings = Record<string, unknown>;

/** The energies and momenta of a run's frames. */
export class Times {
  readonly times: number[] = [];
  readonly energies = new Map<string, number[]>();
  readonly momentum: number[][] = [];
  readonly angular: number[][] = [];

  constructor(readonly label: string) {}

  add(chunk: Chunk): void {
    if (!chunk.history) return;
    this.times.push(...chunk.times);
    for (const [kind, values] of Object.entries(chunk.history.energies)) {
      this.energies.set(kind, [...(this.energies.get(kind) ?? []), ...values]);
    }
    this.momentum.push(...chunk.history.momentum);
    this.angular.push(...chunk.history.angularMomentum);
  }

  plots(): Plot[] {
    if (this.times.length === 0) return [];
    const energies = [...this.energies].filter(
      ([kind, values]) => kind === "total" || values.some((v) => v !== 0),
    );
    return [
      overTime("energy", "Energy", "energy [J]", this.times, energies),
      overTime("momentum", "Linear momentum", "momentum [kg m/s]", this.times, components(this.momentum)),
      overTime(
        "angular-momentum",
        "Angular momentum about the origin",
        "angular momentum [kg m²/s]",
        this.times,
        components(this.angular),
      ),
    ];
  }
}

/** The total of each run. */
export function totalEnergies(runs: Times[]): Plot[] {
  const known = runs.filter((run) => run.times.length > 0);
  if (known.length === 0) return [];
  const traces = known.map((run) =>
    line(run.label, run.times, run.energies.get("total") ?? [], CURVES[runs.indexOf(run) % CURVES.length]),
  );
  return [withTraces("energy", "Total energy", "energy [J]", traces)];
}

function components(triples: number[][]): [string, number[]][] {
  return ["x", "y", "z"].map((name, axis) => [name, triples.map((triple) => triple[axis])]);
}

function overTime(
  id: string,
  title: string,
  axis: string,
  times: number[],
  curves: [string, number[]][],
): Plot {
  const traces = curves.map(([name, values], k) =>
    name === "total"
      ? line(name, times, values, "#808a95", 3)
      : line(name, times, values, CURVES[k % CURVES.length]),
  );
  return withTraces(id, title, axis, traces);
}

function withTraces(id: string, title: string, axis: string, traces: Settings[]): Plot {
  const axes = { xaxis: { title: "time [s]" }, yaxis: { title: axis, exponentformat: "power" } };
  return plot({ id, title, overSteps: false, traces, axes });
}

function line(name: string, x: number[], y: number[], color: string, width = 1.8): Settings {
  const mode = x.length < 3 ? "lines+markers" : "lines";
  const hovertemplate = `t = %{x:.4g} s: %{y:.4g}<extra>${name}</extra>`;
  return { type: "scatter", mode, name, x, y, line: { color, width }, hovertemplate };
}
