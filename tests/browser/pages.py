"""A page in the browser, and what tests ask of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Browser, ConsoleMessage, Request

SECONDS = 60_000.0
"""That a page may take on a busy machine [ms]."""

# Colours of a canvas, four bytes a pixel, and its width.
PIXELS = """async (canvas) => {
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [160, 120];
  const context = copy.getContext("2d");
  context.drawImage(canvas, 0, 0, copy.width, copy.height);
  return Array.from(context.getImageData(0, 0, copy.width, copy.height).data);
}"""


class OpenPage:
    """A page of which the elements `ready`, such as 3D view and plots, are drawn."""

    def __init__(self, browser: Browser, where: Path | str, width: int, scheme: str, ready: Sequence[str]) -> None:
        self.page = browser.new_page(viewport={"width": width, "height": 700}, color_scheme=scheme)  # type: ignore[arg-type]
        self.page.set_default_timeout(SECONDS)
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", self._said)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", self._asked)
        self.page.goto(where.resolve().as_uri() if isinstance(where, Path) else where)
        for element in ready:
            self.page.wait_for_selector(f"{element}[data-ready=yes]")

    @property
    def step(self) -> int:
        """That the view shows."""
        return int(self.page.get_attribute("#viewer-root", "data-step") or -1)

    def wait_for(self, condition: str, argument: Any = None) -> None:
        """Until a JavaScript function is true."""
        self.page.wait_for_function(condition, arg=argument)

    def press(self, key: str, step: int) -> None:
        """A key, in the first view, after which the view shows a step."""
        self.page.press(".stage", key)
        self.wait_for_step(step)

    def wait_for_step(self, step: int) -> None:
        self.wait_for("(step) => document.getElementById('viewer-root').dataset.step === String(step)", step)

    def pixels(self, view: int = 0) -> np.ndarray:
        """What a view shows, (120, 160, 3)."""
        data = self.page.locator(".stage canvas").nth(view).evaluate(PIXELS)
        return np.reshape(data, (120, 160, 4))[..., :3].astype(float)

    def close(self) -> None:
        self.page.close()

    def _said(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning") and "GPU stall" not in message.text:
            self.complaints.append(message.text)

    def _asked(self, request: Request) -> None:
        if not request.url.startswith(("data:", "blob:")):
            self.requests.append(request.url)


def body_pixels(pixels: np.ndarray) -> np.ndarray:
    """Which pixels are coloured: neither background nor ground nor shadow, which are grey."""
    return np.ptp(pixels, axis=-1) > 40
