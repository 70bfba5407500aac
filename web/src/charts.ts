// What the plots of a run show: traces and axes for plotly.

import type { Charts, Curve } from "./data";
import { base64Bytes } from "./packing";
import { short } from "./units";

type Settings = Record<string, unknown>;

export interface Plot {
  id: string;
  title: string;
  note: string;
  height: number;
  wide: boolean;
  legend: boolean;
  /** whether x is the time step */
  overSteps: boolean;
  traces: Settings[];
  axes: Record<string, Settings>;
  layout: Settings;
  /** where the legend is, if not above */
  legendAt?: Settings;
}

const BLUE = "#2b8fd0";
export const RED = "#d0453c";
const FACTOR = "#E69F00";
export const CURVES = [BLUE, RED, "#009E73", "#CC79A7", "#E69F00", "#8C510A"];
const HOVER_STEP = "step %{x}: %{y}<extra>%{fullData.name}</extra>";

export function plot(own: Partial<Plot> & Pick<Plot, "id" | "title" | "traces" | "axes">): Plot {
  return { note: "", height: 380, wide: false, legend: true, overSteps: true, layout: {}, ...own };
}

export function ofOneRun(charts: Charts, palette: string): Plot[] {
  return [
    iterations(charts),
    residuals(charts, palette),
    seconds(charts),
    ...(charts.contact ? [contact(charts.contact)] : []),
  ];
}

/** Whole numbers of small size get ticks at whole numbers. */
function counts(values: number[]): Settings {
  const most = Math.max(1, ...values);
  return most <= 6 ? { dtick: 1, rangemode: "tozero" } : { rangemode: "tozero" };
}

export function steps(curve: { steps: number[]; values: (number | null)[] }, own: Settings): Settings {
  const few = curve.steps.length < 3;
  return {
    type: "scatter",
    mode: few ? "lines+markers" : "lines",
    x: curve.steps,
    y: curve.values,
    hovertemplate: HOVER_STEP,
    ...own,
    line: { shape: "hvh", width: 1.6, ...(own.line as Settings) },
  };
}

export function meanAndMax(curve: Curve): string {
  const { values } = curve;
  if (values.length === 0) return "no steps";
  const mean = values.reduce((a, b) => a + b, 0) / values.length;
  return `mean ${short(mean)}, max ${Math.max(...values)}`;
}

function iterations(charts: Charts): Plot {
  const traces = charts.iterations.map((curve, k) =>
    steps(curve, {
      name: `${curve.name}: ${meanAndMax(curve)}`,
      line: { color: CURVES[k], width: k === 0 && charts.iterations.length > 1 ? 3 : 1.6 },
      hovertemplate: `step %{x}: %{y} iterations<extra>${curve.name}</extra>`,
    }),
  );
  const failed = failures(charts);
  const made = charts.factorizations;
  const factors = {
    type: "bar",
    name: `factorizations: ${made.values.reduce((a, b) => a + b, 0)}`,
    x: made.steps,
    y: made.values,
    yaxis: "y2",
    marker: { color: FACTOR, line: { width: 0 } },
    hovertemplate: "step %{x}: %{y} factorizations<extra></extra>",
  };
  return plot({
    id: "iterations",
    title: "Nonlinear iterations and factorizations",
    height: 380,
    traces: [...traces, ...failed, factors],
    axes: {
      xaxis: { title: "time step", anchor: "y2" },
      yaxis: {
        title: "iterations",
        domain: [0.36, 1],
        ...counts(charts.iterations.flatMap((c) => c.values)),
      },
      yaxis2: { title: "factorizations", domain: [0, 0.28], ...counts(made.values) },
    },
  });
}

/** Crosses at steps that did not converge, on the first curve. */
export function failures(charts: Charts): Settings[] {
  if (charts.failedSteps.length === 0) return [];
  const all = charts.iterations;
  const most = (step: number) => Math.max(...all.map((c) => c.values[c.steps.indexOf(step)] ?? 0));
  const marker = { symbol: "x-thin", size: 9, color: RED, line: { width: 2, color: RED } };
  return [
    {
      type: "scatter",
      mode: "markers",
      name: `not converged: ${charts.failedSteps.length}`,
      x: charts.failedSteps,
      y: charts.failedSteps.map(most),
      marker,
      hovertemplate: "step %{x} did not converge<extra></extra>",
    },
  ];
}

const GROUPS = 10;

/** Lines coloured by step: all of a colour are one trace, with gaps between them. */
function residuals({ residuals: data }: Charts, palette: string): Plot {
  const last = data.lines.reduce((most, line) => Math.max(most, line.step), 1);
  const colours = paletteColours(palette, GROUPS);
  const traces = colours.map((colour, group) => {
    const x: (number | null)[] = [];
    const y: (number | null)[] = [];
    const text: string[] = [];
    for (const line of data.lines) {
      if (Math.min(GROUPS - 1, Math.floor((GROUPS * (line.step - 1)) / last)) !== group) continue;
      x.push(...line.iterations, null);
      y.push(...line.values, null);
      text.push(...line.iterations.map(() => `step ${line.step}`), "");
    }
    const hovertemplate = "%{text}, iteration %{x}: %{y:.2e}<extra></extra>";
    return {
      type: "scatter",
      mode: "lines",
      x,
      y,
      text,
      hovertemplate,
      line: { color: colour, width: 1 },
      showlegend: false,
    };
  });
  const scale = {
    type: "scatter",
    mode: "markers",
    x: [null],
    y: [null],
    hoverinfo: "skip",
    showlegend: false,
    marker: {
      color: [1, last],
      colorscale: colours.map((colour, k) => [k / (GROUPS - 1), colour]),
      cmin: 1,
      cmax: Math.max(2, last),
      showscale: true,
      colorbar: { title: { text: "step", side: "top" }, thickness: 10, outlinewidth: 0, len: 0.9 },
    },
  };
  const few =
    data.lines.length < data.solves ? ` ${data.lines.length} of ${data.solves} solves are drawn.` : "";
  const bar = data.tolerance ? `Dashed: relative tolerance ${data.tolerance.toExponential()}.` : "";
  const axes = {
    xaxis: { title: "nonlinear iteration", rangemode: "tozero" },
    yaxis: { title: "|g| / |g(x<sub>k</sub>)|", type: "log", exponentformat: "power", dtick: 1 },
  };
  if (data.lines.length && tooManyDecades(data.lines.flatMap((line) => line.values))) axes.yaxis.dtick = 2;
  return plot({
    id: "residuals",
    title: "Residual over the iterations of each solve",
    note: (bar + few).trim(),
    height: 380,
    legend: false,
    overSteps: false,
    traces: [...traces.filter((trace) => trace.x.length > 0), ...failedEnds(data), scale],
    axes,
    layout: data.tolerance
      ? { shapes: [{ type: "line", xref: "paper", x0: 0, x1: 1, y0: data.tolerance, y1: data.tolerance }] }
      : {},
  });
}

function tooManyDecades(values: number[]): boolean {
  let [low, high] = [Infinity, 0];
  for (const value of values) [low, high] = [Math.min(low, value), Math.max(high, value)];
  return Math.log10(high / low) > 9;
}

function failedEnds(data: Charts["residuals"]): Settings[] {
  const bad = data.lines.filter((line) => line.failed);
  if (bad.length === 0) return [];
  return [
    {
      type: "scatter",
      mode: "markers",
      x: bad.map((line) => line.iterations[line.iterations.length - 1]),
      y: bad.map((line) => line.values[line.values.length - 1]),
      text: bad.map((line) => `step ${line.step} did not converge`),
      hovertemplate: "%{text}<extra></extra>",
      marker: { symbol: "x-thin", size: 8, line: { width: 2, color: RED } },
      showlegend: false,
    },
  ];
}

function seconds({ seconds: data }: Charts): Plot {
  const whole = data.parts.reduce((sum, part) => sum + part.total, 0) || 1;
  const traces = data.parts.map((part) => ({
    type: "bar",
    name: `${part.name} ${Math.round((100 * part.total) / whole)} %`,
    x: data.steps,
    y: part.values.map((value) => 1e3 * value),
    marker: { color: part.colour, line: { width: 0 } },
    hovertemplate: `step %{x}: %{y:.3g} ms<extra>${part.name}</extra>`,
  }));
  const each = data.steps.map((_, k) => data.parts.reduce((sum, part) => sum + 1e3 * part.values[k], 0));
  const top = clip(each);
  const out = each.filter((height) => height > top).length;
  const sticking =
    out === 0
      ? ""
      : ` ${out} step${out > 1 ? "s" : ""} stick${out > 1 ? "" : "s"} out, up to ${short(Math.max(...each))} ms.`;
  return plot({
    id: "seconds",
    title: "Where the time went",
    note: `${short(whole)} s in the time loop, wall clock.${sticking}`,
    traces,
    axes: {
      xaxis: { title: "time step", showgrid: false },
      yaxis: { title: "time of the step [ms]", ...(out ? { range: [0, top] } : { rangemode: "tozero" }) },
    },
    layout: { barmode: "stack", bargap: data.steps.length > 60 ? 0 : 0.1 },
  });
}

/** What most steps stay under. */
function clip(each: number[]): number {
  const sorted = [...each].sort((a, b) => a - b);
  return 2.5 * (sorted[Math.floor(0.95 * (sorted.length - 1))] ?? 0) || Infinity;
}

function contact(data: NonNullable<Charts["contact"]>): Plot {
  const count = steps(
    { steps: data.steps, values: data.contacts },
    {
      name: "contacts",
      line: { color: BLUE },
      hovertemplate: "step %{x}: %{y} contacts<extra></extra>",
    },
  );
  const gap = {
    type: "scatter",
    mode: "markers",
    name: "smallest gap",
    x: data.steps,
    y: data.gaps,
    yaxis: "y2",
    marker: { size: 5, color: CURVES[2] },
    hovertemplate: "step %{x}: %{y:.3g} m<extra></extra>",
  };
  const shape = { type: "line", xref: "paper", x0: 0, x1: 1, yref: "y2", y0: data.dhat, y1: data.dhat };
  return plot({
    id: "contact",
    title: "Contacts and the smallest gap at the end of each step",
    note: `Dashed: the distance at which contact begins, dhat = ${short(data.dhat)} m.`,
    height: 380,
    traces: [count, gap],
    axes: {
      xaxis: { title: "time step", anchor: "y2", range: [0, 1.02 * Math.max(1, ...data.steps.slice(-1))] },
      yaxis: { title: "contacts", domain: [0.55, 1], ...counts(data.contacts) },
      yaxis2: { title: "gap [m]", domain: [0, 0.45], type: "log", exponentformat: "power", nticks: 5 },
    },
    layout: { shapes: [shape] },
  });
}

function paletteColours(palette: string, count: number): string[] {
  const bytes = base64Bytes(palette);
  const last = bytes.length / 3 - 1;
  return Array.from({ length: count }, (_, k) => {
    const at = 3 * Math.round((last * (count - 1 - k)) / (count - 1));
    return `rgb(${bytes[at]}, ${bytes[at + 1]}, ${bytes[at + 2]})`;
  });
}
