r"""Formulas as MathML, which browsers draw without scripts; their numbers come from ``\tag{...}``, as on GitHub."""

import re

from docutils.nodes import SkipNode
from latex2mathml.converter import convert

TAG = re.compile(r"\\tag\{([^}]*)\}")


def inline(translator, node):
    translator.body.append(convert(node.astext()))
    raise SkipNode


def displayed(translator, node):
    formula = node.astext()
    tag = TAG.search(formula)
    drawn = convert(TAG.sub("", formula).strip(), display="block")
    number = f'<span class="number">({tag[1]})</span>' if tag else ""
    anchor = f' id="equation-{tag[1]}"' if tag else ""
    translator.body.append(f'<div class="equation"{anchor}>{drawn}{number}</div>')
    raise SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", inline_renderers=(inline, None), block_renderers=(displayed, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
