"""Formulas as MathML, made while the site is built: pages need neither a script nor the network to show them."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx


def mathml(tex: str, *, block: bool) -> str:
    """A formula; bars of norms stand close to what is between them."""
    markup = tex2mathml(tex, as_block=block)
    return re.sub(r"<mo[^>]*>([|\u2016\u2223])</mo>", r'<mo lspace="0" rspace="0">\1</mo>', markup)


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(mathml(node.astext(), block=False))
    raise nodes.SkipNode


def _block(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="math">{mathml(node.astext(), block=True)}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Make the renderer known as `mathml`."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
