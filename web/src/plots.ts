// The plots of a page: those of one run, or of several over each other.

import Plotly from "plotly.js-basic-dist-min";

import { ofOneRun, type Plot } from "./charts";
import { compared } from "./comparison";
import { NEW_CHARTS, NEW_FRAMES, SHOW_STEP, pageData, type Charts, type Chunk, type PageData } from "./data";
import { cssColour, element } from "./dom";
import { Times } from "./histories";

type Settings = Record<string, unknown>;

const CONFIG = { displaylogo: false, responsive: true, modeBarButtonsToRemove: ["select2d", "lasso2d"] };

class Plots {
  private readonly boxes = new Map<string, HTMLElement>();
  private readonly histories: Times[];
  private runs: { label: string; charts: Charts }[];

  constructor(
    private readonly root: HTMLElement,
    private readonly data: PageData,
  ) {
    this.runs = data.charts;
    this.histories = data.animations.map(({ label, chunks }) => {
      const history = new Times(label);
      for (const chunk of chunks) history.add(chunk);
      return history;
    });
    void this.draw().then(() => (root.dataset.ready = "yes"));
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => void this.draw());
    document.addEventListener(NEW_FRAMES, (event) =>
      this.histories[0].add((event as CustomEvent<Chunk>).detail),
    );
    document.addEventListener(NEW_CHARTS, (event) => {
      this.runs = [{ label: this.runs[0].label, charts: (event as CustomEvent<Charts>).detail }];
      void this.draw();
    });
  }

  private async draw(): Promise<void> {
    const plots =
      this.runs.length === 1
        ? [
            ...ofOneRun(this.runs[0].charts, this.data.palette),
            ...this.histories.flatMap((run) => run.plots()),
          ]
        : compared(this.runs, this.histories);
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
    await Plotly.react(box, plot.traces, layoutOf(plot), CONFIG);
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
    margin: { l: 52, r: 12, t: 8, b: 44 },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { size: 12 } },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: cssColour("--faint"), activecolor: ink },
    showlegend: plot.legend,
  };
}

const root = document.getElementById("plots-root");
if (root) new Plots(root, pageData());
