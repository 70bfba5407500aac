"""The directive `{generated}`: what `generated.py` makes of the code, as part of a page."""

from __future__ import annotations

import re

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.ext.napoleon import Config, GoogleDocstring
from sphinx.util.docutils import SphinxDirective

import generated


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
        found = self.parse_text_to_nodes(text, allow_section_headings=True)
        for table in (table for node in found for table in node.findall(nodes.table)):
            table["classes"].append(f"columns-{len(next(iter(table.findall(nodes.row))))}")
        return found


def _plain_docstrings(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Docstrings are plain text in Google's form: |g| is a norm and no substitution, x* no emphasis.

    Those of attributes have no form: a colon in them ends no type.
    """
    lines[:] = [re.sub(r"(?<!`)([|*])", r"\\\1", line) for line in lines]
    if what not in ("attribute", "property", "data"):
        lines[:] = GoogleDocstring(lines, Config(), app, what, name, obj, options).lines()


def setup(app: Sphinx) -> dict[str, bool]:
    """Make the directive known."""
    app.add_directive("generated", Generated)
    app.connect("autodoc-process-docstring", _plain_docstrings)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
