// What the plots of a sweep show: counts and seconds over one of the keys, a line for each choice of the others.

import { CURVES, RED, plot, type Plot } from "./charts";
import type { Sweep, SweepCase } from "./data";
import { element, labelled } from "./dom";
import { Boxes, keepDrawn } from "./drawing";

type Settings = Record<string, unknown>;

/** As many values have a tick each. */
const MOST_TICKS = 8;
const COLOURS = CURVES.filter((colour) => colour !== RED); // which is for what failed
const DASHES = ["solid", "dash", "dot", "dashdot"];
/** The legend is beside the first plot where it is as wide [px], else below. */
const ROOM = 700;
/** Axes are logarithmic where values lie further apart than this. */
const FAR = 20;

const CROSS = {
  name: "not converged",
  mode: "markers",
  showlegend: false,
  marker: { symbol: "x-thin", size: 12, line: { width: 2.5, color: RED } },
};

interface Shown {
  id: string;
  title: string;
  axis: string;
  value: (one: SweepCase) => number | null;
}

const SHOWN: Shown[] = [
  { id: "iterations", title: "Nonlinear iterations a step, mean", axis: "iterations", value: (c) => c.mean },
  { id: "factorizations", title: "Factorizations", axis: "factorizations", value: (c) => c.factorizations },
  { id: "seconds", title: "CPU time of the time loop", axis: "CPU time [s]", value: (c) => c.cpu },
];

export class SweepPlots {
  private readonly boxes: Boxes;
  /** indices of keys with more than one value */
  private readonly varied: number[];
  /** that of the key along x */
  private key = 0;

  constructor(
    private readonly root: HTMLElement,
    private readonly sweep: Sweep,
  ) {
    this.varied = sweep.keys.flatMap((_, k) =>
      new Set(sweep.cases.map((c) => c.values[k])).size > 1 ? [k] : [],
    );
    this.key = this.varied[0] ?? 0;
    if (this.varied.length > 1) root.before(this.chooser(this.varied));
    this.boxes = new Boxes(root);
    keepDrawn(root, () => this.draw());
  }

  private chooser(keys: number[]): HTMLElement {
    const select = element("select", { id: "over" });
    for (const k of keys) select.append(element("option", { value: String(k) }, this.sweep.keys[k]));
    select.addEventListener("change", () => {
      this.key = Number(select.value);
      void this.draw();
    });
    return element("p", { class: "chooser" }, labelled("Plots over", select));
  }

  private draw(): Promise<void> {
    const some = this.sweep.keys.length > 0 && this.sweep.cases.some((one) => one.mean !== null);
    return this.boxes.draw(some ? SHOWN.map((shown, k) => this.plotOf(shown, k === 0)) : []);
  }

  private plotOf({ id, title, axis, value }: Shown, first: boolean): Plot {
    const { keys } = this.sweep;
    const cases = this.sweep.cases.filter((one) => value(one) !== null);
    const x = xScale(cases, this.key);
    const lines = new Map<string, SweepCase[]>();
    for (const one of cases) {
      const name = this.nameOf(one);
      lines.set(name, [...(lines.get(name) ?? []), one]);
    }
    const traces = [...lines].map(([name, members], k) => {
      const color = COLOURS[k % COLOURS.length];
      const dash = DASHES[Math.floor(k / COLOURS.length) % DASHES.length];
      return points(members, x, value, {
        name,
        mode: "lines+markers",
        line: { color, dash, width: 1.8 },
        marker: { size: 7 },
      });
    });
    const values = cases.map(value).filter((y): y is number => y !== null && y > 0);
    const far = Math.max(...values) > FAR * Math.min(...values);
    const bad = cases.filter((one) => !one.good);
    return plot({
      id,
      title,
      overSteps: false,
      height: first ? 400 : 340,
      wide: first,
      legend: first && lines.size > 1,
      legendAt:
        this.root.clientWidth > ROOM
          ? { orientation: "v", x: 1.01, y: 1, yanchor: "top" }
          : { y: -0.3, yanchor: "top" },
      note: bad.length ? "Red crosses: not every step converged." : "",
      traces: bad.length ? [...traces, points(bad, x, value, CROSS)] : traces,
      axes: {
        xaxis: { title: keys[this.key], ...x.axis },
        yaxis: {
          title: axis,
          ...(far ? { type: "log", exponentformat: "power", dtick: "D2" } : { rangemode: "tozero" }),
        },
      },
    });
  }

  /** The values of all keys but the one along x. */
  private nameOf({ values }: SweepCase): string {
    return this.varied
      .filter((k) => k !== this.key)
      .map((k) => `${this.sweep.keys[k].split(".").pop()} = ${values[k]}`)
      .join(", ");
  }
}

interface XScale {
  of: (one: SweepCase) => number | string;
  axis: Settings;
}

/** Numbers have an axis of numbers, anything else has its own order. */
function xScale(cases: SweepCase[], key: number): XScale {
  const texts = cases.map((one) => one.values[key]);
  const numbers = texts.map(Number);
  if (!numbers.every(Number.isFinite)) {
    const axis = { type: "category", categoryarray: [...new Set(texts)] };
    return { of: (one) => one.values[key], axis };
  }
  const far = Math.min(...numbers) > 0 && Math.max(...numbers) >= FAR * Math.min(...numbers);
  const ticks = new Map(numbers.map((number, k) => [number, texts[k]]));
  const axis: Settings = far ? { type: "log", exponentformat: "power" } : { type: "linear" };
  if (ticks.size <= MOST_TICKS)
    Object.assign(axis, { tickvals: [...ticks.keys()], ticktext: [...ticks.values()] });
  return { of: (one) => Number(one.values[key]), axis };
}

function points(cases: SweepCase[], x: XScale, value: Shown["value"], own: Settings): Settings {
  const sorted = [...cases];
  if (x.axis.type !== "category") sorted.sort((a, b) => Number(x.of(a)) - Number(x.of(b)));
  return {
    type: "scatter",
    x: sorted.map(x.of),
    y: sorted.map(value),
    text: sorted.map((one) => one.name),
    hovertemplate: "%{text}: %{y:.4g}<extra></extra>",
    ...own,
  };
}
