"""The foot of each image of a video: the time, and what the colours mean."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from matplotlib import font_manager
from matplotlib.figure import Figure
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from qlb.results import style
from qlb.results.rendering import Image
from qlb.results.shown import ShownBodies

_DPI_PER_PIXEL = 1.27
"""Dots per inch for each pixel of height: letters grow with the image."""


class Foot:
    """A strip of `size` (width, height) [pixels]; drawn once, but for the time."""

    def __init__(self, bodies: ShownBodies, largest: float, size: tuple[int, int]) -> None:
        width, self.height = size
        dpi = max(30.0, _DPI_PER_PIXEL * self.height)
        with style.look():
            figure = Figure(figsize=(width / dpi, self.height / dpi), dpi=dpi, facecolor="white")
            bodies.add_key(figure, (0.35, 0.62, 0.3, 0.16), largest)
            drawn = BytesIO()
            figure.savefig(drawn, format="png")
            self._strip = Pillow.open(drawn).convert("RGB").resize(size)
            self._font = ImageFont.truetype(font_manager.findfont("DejaVu Sans"), max(8, int(0.28 * self.height)))

    def at(self, time: float) -> Image:
        """The strip at a time [s], shape (height, width, 3)."""
        strip = self._strip.copy()
        place = (0.03 * strip.width, 0.42 * strip.height)
        ImageDraw.Draw(strip).text(place, f"t = {time:.3f} s", fill=style.INK, font=self._font)
        return np.asarray(strip, dtype=np.uint8)
