// Play, scrub, speed: the controls of the clock.

import { SPEEDS, type Clock } from "./clock";
import { element, icon, iconButton, labelled } from "./dom";
import { decimalsOf } from "./units";

const PLAY = "M7 4.5v15l12-7.5z";
const PAUSE = "M6 5h4v14H6zM14 5h4v14h-4z";
const BACK = "M16 5v14l-9-7zM5 5h2v14H5z";
const ON = "M8 5v14l9-7zM17 5h2v14h-2z";
const RESET = "M12 5V1.5L6.5 6 12 10.5V7a5.5 5.5 0 1 1-5.5 5.5h-2A7.5 7.5 0 1 0 12 5z";
const EDGES = "M12 2.5 21.5 19h-19zm0 4.2L6 17h12zm-.7 2h1.4v9h-1.4z";

export interface Actions {
  reset: () => void;
  toggleEdges: () => boolean;
}

export class Transport {
  readonly root = element("div", { class: "transport" });
  readonly keys: Record<string, () => void>;
  private readonly play: HTMLButtonElement;
  private readonly slider = element("input", {
    type: "range",
    min: "0",
    step: "1",
    "aria-label": "Time step",
  });
  private readonly speed = element("select", { id: "speed" });
  private readonly marks = element("div", { class: "marks", "aria-hidden": "true" });
  private readonly readout = element("output", { class: "readout" });
  private decimals = 3;
  private steps: number[] = [];
  private failed = new Set<number>();

  constructor(
    private readonly clock: Clock,
    actions: Actions,
    edges: boolean,
  ) {
    for (const speed of SPEEDS) this.speed.append(element("option", { value: String(speed) }, `${speed}×`));
    this.speed.addEventListener("change", () => clock.chooseSpeed(Number(this.speed.value)));
    this.play = iconButton("Play", PLAY, "space", () => clock.toggle());
    this.play.classList.add("play");
    const lines = iconButton("Mesh edges", EDGES, "E", () => toggleEdges());
    const toggleEdges = () => lines.setAttribute("aria-pressed", String(actions.toggleEdges()));
    lines.setAttribute("aria-pressed", String(edges));
    this.slider.addEventListener("input", () => {
      const index = Number(this.slider.value);
      clock.pause();
      clock.goTo(index);
    });
    const track = element("div", { class: "track" }, this.slider, this.marks);
    this.root.append(
      this.play,
      iconButton("One frame back", BACK, "left arrow", () => clock.step(-1)),
      iconButton("One frame on", ON, "right arrow", () => clock.step(1)),
      track,
      this.readout,
      labelled("Speed", this.speed),
      lines,
      iconButton("Reset view", RESET, "R", actions.reset),
    );
    this.keys = {
      " ": () => clock.toggle(),
      ArrowLeft: () => clock.step(-1),
      ArrowRight: () => clock.step(1),
      Home: () => clock.step(-clock.count),
      End: () => clock.step(clock.count),
      r: actions.reset,
      e: toggleEdges,
    };
  }

  /** The steps of frames, their times, and which steps failed. */
  setFrames(steps: number[], times: number[], failed: number[]): void {
    this.steps = steps;
    this.failed = new Set(failed);
    this.decimals = decimalsOf(times);
    this.slider.max = String(Math.max(0, steps.length - 1));
    const marks = steps.flatMap((step, k) =>
      this.failed.has(step) ? [k / Math.max(1, steps.length - 1)] : [],
    );
    this.marks.replaceChildren(
      ...marks.map((at) => {
        const mark = element("i");
        mark.style.left = `${100 * at}%`;
        return mark;
      }),
    );
  }

  update(time: number): void {
    const { index, playing } = this.clock;
    const step = this.steps[index];
    this.slider.value = String(index);
    this.speed.value = String(this.clock.speed);
    const bad = this.failed.has(step);
    const text = `step ${step}, t = ${time.toFixed(this.decimals)} s`;
    this.slider.setAttribute("aria-valuetext", text);
    this.readout.textContent = bad ? `${text}, not converged` : text;
    this.readout.classList.toggle("bad", bad);
    const name = playing ? "Pause" : "Play";
    if (this.play.getAttribute("aria-label") === name) return;
    this.play.setAttribute("aria-label", name);
    this.play.title = `${name} (space)`;
    this.play.innerHTML = icon(playing ? PAUSE : PLAY);
  }
}
