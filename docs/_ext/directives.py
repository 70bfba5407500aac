"""The directive `{generated}`: what `generated.py` makes of the code, as part of a page."""

from __future__ import annotations

import re

import generated
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class Generated(SphinxDirective):
    """`{generated} NAME ARGUMENTS`: the Markdown that `generated.NAME_markdown(*ARGUMENTS)` gives."""

    required_arguments = 1
    optional_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        """The parsed Markdown."""
        make = getattr(generated, f"{self.arguments[0]}_markdown")
        given = " ".join(self.arguments[1:]).split()
        text = make(given) if self.arguments[0] == "api" else make(*given)
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def _literal_bars(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Docstrings are plain text: |g| is a norm and no substitution, x* no emphasis."""
    lines[:] = [re.sub(r"(?<!`)([|*])", r"\\\1", line) for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    """Make the directive known."""
    app.add_directive("generated", Generated)
    app.connect("autodoc-process-docstring", _literal_bars, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
