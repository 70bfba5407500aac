// Plots in the colours of the page, light or dark.

import Plotly from "plotly.js-basic-dist-min";

import type { Plot } from "./charts";
import { SHOW_STEP } from "./data";
import { cssColour, element } from "./dom";

type Settings = Record<string, unknown>;

const CONFIG = { displaylogo: false, responsive: true, modeBarButtonsToRemove: ["select2d", "lasso2d"] };

export async function drawInto(box: HTMLElement, plot: Plot): Promise<void> {
  await Plotly.react(box, plot.traces, layoutOf(plot), CONFIG);
}

/** Draws now, and again when the page turns dark or light; then `root` says that it is ready. */
export function keepDrawn(root: HTMLElement, draw: () => Promise<void>): void {
  void draw().then(() => (root.dataset.ready = "yes"));
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => void draw());
}

/** Sections with a plot each. */
export class Boxes {
  private readonly boxes = new Map<string, HTMLElement>();

  constructor(private readonly root: HTMLElement) {}

  async draw(plots: Plot[]): Promise<void> {
    for (const plot of plots) this.makeBox(plot); // all of them first: widths depend on how many there are
    for (const plot of plots) await this.drawOne(plot);
  }

  private makeBox(plot: Plot): void {
    if (this.boxes.has(plot.id)) return;
    const box = element("div", { class: "plot" });
    box.style.height = `${plot.height}px`;
    const section = element(
      "section",
      { id: plot.id },
      element("h2", {}, plot.title),
      box,
      element("p", { class: "faint" }),
    );
    if (plot.wide) section.className = "wide";
    this.root.append(section);
    this.boxes.set(plot.id, box);
  }

  private async drawOne(plot: Plot): Promise<void> {
    const box = this.boxes.get(plot.id);
    if (!box) return;
    box.nextElementSibling?.replaceChildren(plot.note);
    await drawInto(box, plot);
    if (plot.overSteps) this.linkToViewer(box);
  }

  /** A click at a step shows it in the 3D view. */
  private linkToViewer(box: HTMLElement): void {
    if (box.dataset.linked) return;
    box.dataset.linked = "yes";
    const plotted = box as HTMLElement & { on: (name: string, call: (event: Clicked) => void) => void };
    plotted.on("plotly_click", ({ points }) => {
      document.dispatchEvent(new CustomEvent(SHOW_STEP, { detail: points[0].x }));
    });
  }
}

interface Clicked {
  points: { x: number }[];
}

function layoutOf(plot: Plot): Settings {
  const ink = cssColour("--ink");
  const axis = {
    gridcolor: cssColour("--line"),
    linecolor: cssColour("--faint"),
    zeroline: false,
    automargin: true,
    title: { standoff: 8 },
  };
  const named: Settings = {};
  for (const [name, own] of Object.entries(plot.axes)) {
    const title = typeof own.title === "string" ? { text: own.title, standoff: 8 } : axis.title;
    named[name] = { ...axis, ...own, title };
  }
  return {
    margin: { l: 52, r: 12, t: 8, b: 44 },
    ...named,
    ...plot.layout,
    shapes: ((plot.layout.shapes ?? []) as Settings[]).map((shape) => ({
      ...shape,
      line: { color: ink, width: 1, dash: "dash" },
    })),
    font: { family: "system-ui, sans-serif", size: 12.5, color: ink },
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    hoverlabel: { bgcolor: cssColour("--card"), bordercolor: cssColour("--line"), font: { color: ink } },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { size: 12 }, ...plot.legendAt },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: cssColour("--faint"), activecolor: ink },
    showlegend: plot.legend,
  };
}
