"""Everything that the scripts of a page need, for one run or several side by side."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np

from qlb.errors import InputError
from qlb.results import style
from qlb.results.page.animation import Animation
from qlb.results.page.charts import run_charts
from qlb.results.page.scripts import page_data
from qlb.results.run import Run
from qlb.results.shown import COLOURS

_LEAST_SHARE = 4
"""Animations get at least this part of a page, however long its plots are."""


def page_content(runs: Mapping[str, Run], *, most_bytes: int, live: bool = False) -> str:
    """Animations and plots of runs as JSON that may stand in a script element.

    Args:
        runs: by their labels.
        most_bytes: frames and vertices of animations are thinned out until all of it is about as short.
        live: whether the page asks a server for more; then only the first frame is there.

    Raises:
        InputError: most_bytes < 1, or a file of a run is missing or damaged.
    """
    if most_bytes < 1:
        raise InputError("the page is too small for its scripts: it needs about 2 MB, and more for what moves")
    charts = [{"label": label, "charts": run_charts(run)} for label, run in runs.items()]
    room = max(most_bytes // _LEAST_SHARE, most_bytes - len(page_data({"charts": charts}))) // len(runs)
    return page_data(
        {
            "palette": _palette(),
            "colours": style.LINES,
            "animations": [_animation(label, run, room, live=live) for label, run in runs.items() if run.frame_steps],
            "charts": charts,
            "live": live,
        }
    )


def _animation(label: str, run: Run, most_bytes: int, *, live: bool) -> dict[str, Any]:
    animation = Animation(run, most_bytes=most_bytes)
    chunk, note = (animation.chunk(run.frame_steps[:1]), "") if live else animation.chosen()
    return {"label": label, "head": animation.head(), "chunks": [chunk], "note": note}


def _palette() -> str:
    """The colours of pictures as sRGB bytes (256, 3)."""
    colours = np.rint(255 * COLOURS(np.linspace(0, 1, 256))[:, :3]).astype(np.uint8)
    return base64.b64encode(colours.tobytes()).decode("ascii")
