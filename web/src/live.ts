// Asks the server of a run for what is new, for as long as there may be more.

import type { Animation } from "./animation";
import { NEW_CHARTS, NEW_FRAMES, type Update } from "./data";

/** Between two questions [s], and how much longer the pause is than what the server needs of a core. */
const SHORTEST_PAUSE = 0.5;
const REST = 10;

export function follow(animation: Animation, framesChanged: () => void): void {
  let after = animation.frames[animation.frames.length - 1].step;

  const ask = async () => {
    let update: Update | null;
    try {
      const answer = await fetch(`/update?after=${after}`);
      update = answer.ok ? ((await answer.json()) as Update) : null;
    } catch {
      headline(
        "warn",
        "The server has ended.",
        "What is shown here stays; the run's folder holds the report.",
      );
      return;
    }
    if (!update) {
      window.setTimeout(ask, 1000 * SHORTEST_PAUSE);
      return;
    }
    animation.head.failedSteps = update.failedSteps;
    if (update.chunk) {
      after = update.chunk.steps[update.chunk.steps.length - 1];
      await animation.add(update.chunk);
      document.dispatchEvent(new CustomEvent(NEW_FRAMES, { detail: update.chunk }));
      framesChanged();
    }
    document.dispatchEvent(new CustomEvent(NEW_CHARTS, { detail: update.charts }));
    headline(update.level, update.headline, update.detail);
    showFacts(update.facts);
    if (update.status === "running")
      window.setTimeout(ask, 1000 * Math.max(SHORTEST_PAUSE, REST * update.seconds));
  };
  void ask();
}

function headline(level: string, text: string, detail: string): void {
  const verdict = document.querySelector(".verdict");
  if (!verdict) return;
  verdict.className = `verdict ${level}`;
  const strong = document.createElement("strong");
  strong.textContent = text;
  verdict.replaceChildren(strong, ` ${detail}`);
}

function showFacts(facts: Record<string, string>): void {
  for (const fact of document.querySelectorAll(".facts li")) {
    const value = facts[fact.querySelector("span")?.textContent ?? ""];
    const shown = fact.querySelector("b");
    if (value !== undefined && shown) shown.textContent = value;
  }
}
