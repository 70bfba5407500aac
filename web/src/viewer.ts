// The moving result of one run, or of several side by side on one clock.

import { Animation } from "./animation";
import { Clock } from "./clock";
import { ColourBar } from "./colourbar";
import { SHOW_STEP, pageData, type PageData } from "./data";
import { cssColour, element } from "./dom";
import { follow } from "./live";
import { base64Bytes } from "./packing";
import { Transport } from "./transport";
import { View } from "./view";

/** Finer surfaces start without their edges. */
const MOST_EDGED_TRIANGLES = 12_000;

export class Viewer {
  private readonly views: View[];
  private readonly clock: Clock;
  private readonly bar: ColourBar;
  private readonly transport: Transport;
  private edges: boolean;

  constructor(
    private readonly root: HTMLElement,
    private readonly animations: Animation[],
    data: PageData,
  ) {
    const palette = base64Bytes(data.palette);
    const look = { palette, bodyColours: data.colours };
    this.views = animations.map(
      (animation) => new View(animation, look, `${animation.label}, moving result in 3D`),
    );
    this.edges = animations[0].triangles.length / 3 <= MOST_EDGED_TRIANGLES;
    this.bar = new ColourBar(animations, palette, data.colours, (field, high) => {
      for (const view of this.views) view.colourBy(field, high);
    });
    this.clock = new Clock(
      this.longest.frames.map((frame) => frame.time),
      () => this.show(),
    );
    const actions = { reset: () => this.reset(), toggleEdges: () => this.toggleEdges() };
    this.transport = new Transport(this.clock, actions, this.edges);
    this.build();
    this.framesChanged();
    this.watch();
  }

  /** Whose frames the slider counts. */
  private get longest(): Animation {
    return this.animations.reduce((a, b) => (b.frames.length > a.frames.length ? b : a));
  }

  framesChanged(): void {
    const { frames } = this.longest;
    const times = frames.map((frame) => frame.time);
    const failed = this.animations.flatMap((animation) => animation.head.failedSteps);
    this.transport.setFrames(
      frames.map((frame) => frame.step),
      times,
      failed,
    );
    this.bar.update();
    for (const view of this.views) view.framesChanged();
    this.clock.setTimes(times);
  }

  private build(): void {
    const stages = this.views.map((view) => {
      const stage = element("div", { class: "stage", tabindex: "0" }, view.canvas);
      const caption = this.views.length > 1 ? [element("figcaption", {}, view.animation.label)] : [];
      stage.addEventListener("pointerdown", () => stage.focus({ preventScroll: true }));
      stage.addEventListener("focus", () => (view.controls.enableZoom = true));
      stage.addEventListener("blur", () => (view.controls.enableZoom = false)); // the wheel scrolls the page
      new ResizeObserver(() => view.resize(stage.clientWidth, stage.clientHeight)).observe(stage);
      return element("div", { class: "view" }, ...caption, stage);
    });
    const notes = [...new Set(this.animations.map(({ note }) => note))].filter((note) => note !== "");
    const views = element("div", { class: "views", "data-count": String(this.views.length) }, ...stages);
    const help = element(
      "p",
      { class: "faint help" },
      "Drag to turn, with the right button to shift; click, then scroll to zoom. Keys: space, arrows, Home, End, E, R.",
    );
    this.root.replaceChildren(
      views,
      this.transport.root,
      this.bar.root,
      help,
      ...notes.map((note) => element("p", { class: "faint help" }, note)),
    );
    for (const view of this.views) view.showEdges(this.edges);
    if (this.views.length > 1) this.linkCameras();
  }

  private show(): void {
    const { time } = this.clock;
    for (const view of this.views) view.show(view.animation.frameAt(time));
    const frame = this.longest.frameAt(time);
    this.transport?.update(frame.time);
    this.root.dataset.step = String(frame.step);
  }

  private reset(): void {
    for (const view of this.views) view.reset();
  }

  private toggleEdges(): boolean {
    this.edges = !this.edges;
    for (const view of this.views) view.showEdges(this.edges);
    return this.edges;
  }

  private linkCameras(): void {
    for (const view of this.views) {
      view.controls.addEventListener("change", () => {
        for (const other of this.views) if (other !== view) other.takeCamera(view);
      });
    }
  }

  private watch(): void {
    const scheme = window.matchMedia("(prefers-color-scheme: dark)");
    const paint = () => {
      for (const view of this.views) view.setColours(cssColour("--stage"), cssColour("--plane"));
    };
    scheme.addEventListener("change", paint);
    paint();
    document.addEventListener("keydown", (event) => this.pressed(event));
    document.addEventListener(SHOW_STEP, (event) => {
      const index = this.longest.frames.findIndex(
        (frame) => frame.step >= (event as CustomEvent<number>).detail,
      );
      this.clock.pause();
      this.clock.goTo(index < 0 ? this.clock.count - 1 : index);
    });
  }

  private pressed(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    const here = target === document.body || this.root.contains(target);
    if (!here || event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented) return;
    if (target instanceof HTMLSelectElement) return;
    if (event.key === " " && (target instanceof HTMLButtonElement || target === document.body)) return;
    const action = this.transport.keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }
}

async function start(): Promise<void> {
  const root = document.getElementById("viewer-root");
  if (!root) return;
  const data = pageData();
  try {
    const animations = await Promise.all(data.animations.map((animation) => Animation.from(animation)));
    const shown = animations.filter((animation) => animation.frames.length > 0);
    const viewer = new Viewer(root, shown, data);
    Object.assign(root, { animations: shown }); // for who asks in the console
    root.dataset.ready = "yes";
    if (data.live) follow(shown[0], () => viewer.framesChanged());
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    root.querySelector(".waiting")?.replaceChildren(`The 3D view cannot be shown by this browser: ${why}`);
    root.dataset.ready = "no";
    if (!(error instanceof Error) || !/webgl/i.test(why)) throw error;
  }
}

void start();
