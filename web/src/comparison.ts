// What the plots of several runs show: a curve of each.

import { CURVES, failures, meanAndMax, plot, steps, type Plot } from "./charts";
import type { Charts } from "./data";
import { totalEnergies, type Times } from "./histories";

type Settings = Record<string, unknown>;

/** Of each run one curve. */
export function compared(runs: { label: string; charts: Charts }[], histories: Times[]): Plot[] {
  const curves = runs.flatMap(({ label, charts }, k) =>
    charts.iterations.map((curve, stage) =>
      steps(curve, {
        name: `${label}${charts.iterations.length > 1 ? `, ${curve.name}` : ""}: ${meanAndMax(curve)}`,
        line: { color: CURVES[k % CURVES.length], dash: stage === 0 ? "solid" : "dot" },
        hovertemplate: `step %{x}: %{y} iterations<extra>${label}</extra>`,
      }),
    ),
  );
  const crosses = runs
    .flatMap(({ charts }) => failures(charts))
    .map((trace, k) => ({ ...trace, showlegend: k === 0 }));
  return [
    plot({
      id: "iterations",
      title: "Nonlinear iterations",
      wide: true,
      height: 360,
      traces: [...curves, ...crosses],
      axes: { xaxis: { title: "time step" }, yaxis: iterationAxis(runs.map(({ charts }) => charts)) },
    }),
    overSteps(runs, "seconds", "Time so far", "wall clock [s]", ({ seconds: data }) =>
      running(data.steps.map((_, k) => data.parts.reduce((sum, part) => sum + part.values[k], 0))),
    ),
    overSteps(runs, "factorizations", "Factorizations so far", "factorizations", (charts) =>
      running(charts.factorizations.values),
    ),
    ...totalEnergies(histories),
  ];
}

function overSteps(
  runs: { label: string; charts: Charts }[],
  id: string,
  title: string,
  axis: string,
  values: (charts: Charts) => number[],
): Plot {
  const traces = runs.map(({ label, charts }, k) =>
    steps(
      { steps: charts.factorizations.steps, values: values(charts) },
      { name: label, line: { shape: "linear", color: CURVES[k % CURVES.length], width: 2 } },
    ),
  );
  return plot({
    id,
    title,
    traces,
    axes: { xaxis: { title: "time step" }, yaxis: { title: axis, rangemode: "tozero" } },
  });
}

/** Logarithmic where means are far apart, as in plots of src/qlb/results/plots.py. */
function iterationAxis(charts: Charts[]): Settings {
  const means = charts.map(({ iterations: [curve] }) =>
    Math.max(1, curve.values.reduce((a, b) => a + b, 0) / (curve.values.length || 1)),
  );
  const far = Math.max(...means) > 12 * Math.min(...means);
  return {
    title: "iterations",
    ...(far ? { type: "log", exponentformat: "power", dtick: 1 } : { rangemode: "tozero" }),
  };
}

function running(values: number[]): number[] {
  let sum = 0;
  return values.map((value) => (sum += value));
}
