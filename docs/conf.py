"""Sphinx: `make docs` builds the site; no network is needed."""

from __future__ import annotations

import sys
from pathlib import Path

import qlb

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "qlb"
author = "the qlb developers"
project_copyright = "2026, the qlb developers"
release = version = qlb.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "directives",
    "mathml",
]
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
autodoc_member_order = "bysource"
autodoc_typehints = "none"
default_role = "literal"
math_numfig = False
exclude_patterns = ["_ext"]

html_theme = "furo"
html_title = "qlb"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["qlb.css"]
html_copy_source = False
html_show_sphinx = False
pygments_style = "tango"
pygments_dark_style = "native"

linkcheck_timeout = 20
linkcheck_retries = 2
linkcheck_anchors = False
