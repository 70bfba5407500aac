// Which field colours the surface, and what the colours mean.

import type { Animation, Range } from "./animation";
import { BY_BODY } from "./body";
import type { Field } from "./data";
import { element, labelled } from "./dom";
import { scaleFor, short } from "./units";

const TICKS = 5;

export class ColourBar {
  readonly root = element("div", { class: "colours" });
  readonly select = element("select", { id: "colour-by" });
  private readonly scale = element("div", { class: "scale" });
  private readonly ticks = element("div", { class: "ticks" });
  private readonly fields: Field[];

  /** `changed` is called with a field and the value at the upper end of the colours. */
  constructor(
    private readonly animations: Animation[],
    palette: Uint8Array,
    bodyColours: string[],
    private readonly changed: (field: string, high: number) => void,
  ) {
    this.fields = animations[0].fields.filter((field) =>
      animations.every((a) => a.fields.some((f) => f.name === field.name)),
    );
    for (const { name, label } of this.fields) this.select.append(element("option", { value: name }, label));
    const { bodies } = animations[0].head;
    if (bodies.length > 1) this.select.append(element("option", { value: BY_BODY }, "Body"));
    this.select.addEventListener("change", () => this.update());
    const ramp = element("div", { class: "ramp" });
    ramp.style.background = gradient(palette);
    this.scale.append(ramp, this.ticks);
    this.root.append(labelled("Colour", this.select), this.scale, namesOf(bodies, bodyColours));
  }

  /** To what the animations hold now. */
  update(): void {
    const field = this.fields.find((f) => f.name === this.select.value);
    this.root.dataset.by = field ? "field" : BY_BODY;
    if (!field) {
      this.changed(BY_BODY, 1);
      return;
    }
    const range = this.range(field.name);
    const { factor, unit } = scaleFor(range.high, field.unit);
    const texts = Array.from({ length: TICKS }, (_, k) => short((range.high * k) / (TICKS - 1) / factor));
    if (range.largest > range.high * 1.001) texts[TICKS - 1] = `≥ ${texts[TICKS - 1]}`;
    this.ticks.replaceChildren(...texts.map((text) => element("span", {}, text)));
    this.ticks.append(element("b", {}, unit));
    const most = scaleFor(range.largest, field.unit);
    this.scale.title = `${field.label}: at most ${short(range.largest / most.factor)} ${most.unit} in the frames shown`;
    this.changed(field.name, range.high);
  }

  private range(field: string): Range {
    const ranges = this.animations.map((animation) => animation.range(field));
    return {
      high: Math.max(...ranges.map((range) => range.high)),
      largest: Math.max(...ranges.map((range) => range.largest)),
    };
  }
}

function gradient(palette: Uint8Array): string {
  const stops: string[] = [];
  for (let i = 0; i < palette.length; i += 3 * 15)
    stops.push(`rgb(${palette[i]} ${palette[i + 1]} ${palette[i + 2]})`);
  return `linear-gradient(to right, ${stops.join(", ")})`;
}

function namesOf(bodies: string[], colours: string[]): HTMLElement {
  const list = element("ul", { class: "names" });
  bodies.forEach((name, k) => {
    const mark = element("i");
    mark.style.background = colours[k % colours.length];
    list.append(element("li", {}, mark, name || `body ${k}`));
  });
  return list;
}
