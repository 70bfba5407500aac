// The figures of the supplement: a grid of panels each, rows a variation, columns the solvers.

import { CURVES, RED, plot, type Plot } from "./charts";
import type { FigureData, Panel } from "./data";
import { drawInto, keepDrawn } from "./drawing";

type Settings = Record<string, unknown>;

const ROW = 165;
/** Above and below the panels [px]. */
const [HEAD, FOOT] = [64, 48];
/** Columns are logarithmic where their panels lie further apart, as in src/qlb/results/figure_drawing.py. */
const FAR = 12;
/** More failed steps than these are marked at the foot of the panel. */
const MOST_CROSSES = 20;

export function drawFigures(figures: FigureData[]): void {
  for (const figure of figures) {
    const box = document.querySelector<HTMLElement>(`[data-figure="${figure.number}"]`);
    if (!box) continue;
    const made = figurePlot(figure);
    box.style.height = `${made.height}px`;
    keepDrawn(box, () => drawInto(box, made));
  }
}

function figurePlot({ number, solvers, rows }: FigureData): Plot {
  const [traces, annotations]: Settings[][] = [[], []];
  const axes: Record<string, Settings> = {};
  const [wide, high] = [1 / solvers.length, 1 / rows.length];
  const named = new Set<string>();
  const logarithmic = solvers.map((_, column) => liesFarApart(rows.map(({ panels }) => panels[column])));
  rows.forEach(({ label, panels }, row) => {
    const y = [1 - (row + 1) * high + (row + 1 < rows.length ? 0.16 * high : 0), 1 - row * high];
    panels.forEach((panel, column) => {
      const k = row * solvers.length + column + 1;
      const name = k === 1 ? "" : String(k);
      const x = [column * wide + 0.02, (column + 1) * wide - 0.02];
      axes[`xaxis${name}`] = {
        domain: x,
        anchor: `y${name}`,
        matches: k === 1 ? undefined : "x",
        showticklabels: row === rows.length - 1,
        ...(row === rows.length - 1 ? { title: "time step" } : {}),
      };
      axes[`yaxis${name}`] = {
        domain: y,
        anchor: `x${name}`,
        matches: row === 0 ? undefined : `y${column === 0 ? "" : column + 1}`,
        ...(logarithmic[column]
          ? { type: "log", exponentformat: "power", dtick: 1 }
          : { rangemode: "tozero" }),
        ...(column === 0 ? { title: `<b>${label}</b>` } : {}),
      };
      const at = { xref: `x${name} domain`, yref: `y${name} domain`, showarrow: false };
      if (row === 0)
        annotations.push({
          ...at,
          x: 0.5,
          y: 1,
          yanchor: "bottom",
          yshift: 16,
          text: `<b>${solvers[column]}</b>`,
        });
      annotations.push(...wordsOn(panel, at));
      if (panel) traces.push(...curves(panel, name, logarithmic[column], named));
    });
  });
  return plot({
    id: `figure-${number}-plot`,
    title: "",
    overSteps: false,
    height: HEAD + FOOT + ROW * rows.length,
    legend: named.has("second stage") || named.has("did not converge"),
    legendAt: { y: 1, yanchor: "top", yref: "container" },
    traces,
    axes,
    layout: { annotations, margin: { l: 60, r: 8, t: HEAD, b: FOOT } },
  });
}

function wordsOn(panel: Panel | null, at: Settings): Settings[] {
  const font = { size: 11 };
  if (!panel) return [{ ...at, x: 0.5, y: 0.5, text: "no run" }];
  const corner = { ...at, y: 1, yanchor: "bottom", yshift: -1, font };
  return [
    { ...corner, x: 0, xanchor: "left", text: panel.counts },
    ...(panel.trouble
      ? [{ ...corner, x: 1, xanchor: "right", text: panel.trouble, font: { size: 11, color: RED } }]
      : []),
  ];
}

/** On a logarithmic axis what is 0 lies at its foot. */
function curves(panel: Panel, axis: string, log: boolean, named: Set<string>): Settings[] {
  const shown = (values: number[]) => (log ? values.map((value) => Math.max(value, 0.5)) : values);
  const on = (name: string, own: Settings) => {
    const first = !named.has(name);
    named.add(name);
    return {
      type: "scatter",
      name,
      legendgroup: name,
      showlegend: first,
      xaxis: `x${axis}`,
      yaxis: `y${axis}`,
      ...own,
    };
  };
  const lines = panel.stages.map((curve, k) =>
    on(curve.name, {
      mode: curve.steps.length < 3 ? "lines+markers" : "lines",
      x: curve.steps,
      y: shown(curve.values),
      text: curve.values.map(String),
      hovertemplate: `step %{x}: %{text} iterations<extra>${curve.name}</extra>`,
      line: { shape: "hvh", color: CURVES[k], width: k === 0 && panel.stages.length > 1 ? 2.4 : 1.4 },
    }),
  );
  const { steps, values } = panel.failed;
  if (steps.length === 0) return lines;
  const many = steps.length > MOST_CROSSES;
  const crosses = on("did not converge", {
    mode: "markers",
    x: steps,
    y: many ? steps.map(() => (log ? 0.5 : 0)) : shown(values),
    marker: { symbol: many ? "line-ns" : "x-thin", size: 8, line: { width: 1.5, color: RED } },
    hovertemplate: "step %{x} did not converge<extra></extra>",
  });
  return [...lines, crosses];
}

function liesFarApart(panels: (Panel | null)[]): boolean {
  const highest = panels
    .filter((panel) => panel !== null)
    .map(({ stages }) => Math.max(1, ...stages.flatMap((curve) => curve.values)));
  return Math.max(...highest) > FAR * Math.min(...highest);
}
