// The plots of a page: of one run, of several over each other, of a sweep, or of figures.

import { ofOneRun } from "./charts";
import { compared } from "./comparison";
import { NEW_CHARTS, NEW_FRAMES, pageData, type Charts, type Chunk, type PageData } from "./data";
import { Boxes, keepDrawn } from "./drawing";
import { drawFigures } from "./figures";
import { Times } from "./histories";
import { SweepPlots } from "./sweep";
import { makeSortable } from "./table";

class Plots {
  private readonly boxes: Boxes;
  private readonly histories: Times[];
  private runs: { label: string; charts: Charts }[];

  constructor(
    root: HTMLElement,
    private readonly data: PageData,
  ) {
    this.boxes = new Boxes(root);
    this.runs = data.charts;
    this.histories = data.animations.map(({ label, chunks }) => {
      const history = new Times(label);
      for (const chunk of chunks) history.add(chunk);
      return history;
    });
    keepDrawn(root, () => this.draw());
    document.addEventListener(NEW_FRAMES, (event) =>
      this.histories[0].add((event as CustomEvent<Chunk>).detail),
    );
    document.addEventListener(NEW_CHARTS, (event) => {
      this.runs = [{ label: this.runs[0].label, charts: (event as CustomEvent<Charts>).detail }];
      void this.draw();
    });
  }

  private draw(): Promise<void> {
    return this.boxes.draw(
      this.runs.length === 1
        ? [
            ...ofOneRun(this.runs[0].charts, this.data.palette),
            ...this.histories.flatMap((run) => run.plots()),
          ]
        : compared(this.runs, this.histories),
    );
  }
}

const data = pageData();
const root = document.getElementById("plots-root");
if (root && data.sweep) new SweepPlots(root, data.sweep);
else if (root) new Plots(root, data);
drawFigures(data.figures ?? []);
document.querySelectorAll<HTMLTableElement>("table.sortable").forEach(makeSortable);
