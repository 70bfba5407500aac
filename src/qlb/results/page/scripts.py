"""The scripts of pages, built from web/ into results/static, and data for them inside HTML."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

STATIC = Path(__file__).parents[1] / "static"
SCRIPTS_MISSING = (
    "The 3D view and the interactive plots are left out: this qlb was built without the scripts of the page. They need"
    " Node.js with npm while qlb is installed (see CONTRIBUTING)."
)


def page_scripts(names: Sequence[str]) -> list[str] | None:
    """Built scripts by name ("viewer", "plots"), or None where one is missing."""
    paths = [STATIC / f"{name}.js" for name in names]
    if not all(path.is_file() for path in paths):
        return None
    return [path.read_text(encoding="utf-8") for path in paths]


def page_data(data: Mapping[str, Any]) -> str:
    """JSON that may stand inside a script element: no tag can begin in it."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
