r"""Formulas as MathML, which browsers draw without scripts; their numbers come from ``\tag{...}``, as on GitHub."""

import re
from xml.etree import ElementTree

from docutils.nodes import SkipNode
from latex2mathml.converter import convert

TAG = re.compile(r"\\tag\{([^}]*)\}")
BARS = ("|", "‖", "∥")
SPACE = "{http://www.w3.org/1998/Math/MathML}"
ElementTree.register_namespace("", SPACE[1:-1])


def drawn(formula, display):
    """A formula whose primes stand beside their letters: fonts have them raised, and raised once more they vanish."""
    math = ElementTree.fromstring(convert(formula, display=display))
    for part in [*math.iter(f"{SPACE}msup"), *math.iter(f"{SPACE}msubsup")]:
        letter, *index, raised = part
        signs = [*raised] if raised.tag == f"{SPACE}mrow" else [raised]
        primes = [sign for sign in signs if sign.text and not sign.text.strip("′")]
        if primes:
            above = [sign for sign in signs if sign not in primes]
            part.tag = SPACE + (f"m{'sub' if index else ''}{'sup' if above else ''}" if index or above else "mrow")
            for prime in primes:
                prime.tag = f"{SPACE}mo"
                prime.attrib |= {"lspace": "0.12em", "rspace": "0"}  # italic letters lean over
            part[:] = [row([letter, *primes]), *index, *([row(above)] if above else [])]
    for bar in math.iter(f"{SPACE}mo"):
        if bar.text in BARS:
            bar.attrib.setdefault("stretchy", "false")  # \left and \right say that one is to stretch
    return ElementTree.tostring(math, encoding="unicode")


def row(parts):
    row = ElementTree.Element(f"{SPACE}mrow")
    row.extend(parts)
    return row


def inline(translator, node):
    translator.body.append(drawn(node.astext(), "inline"))
    raise SkipNode


def displayed(translator, node):
    formula = node.astext()
    tag = TAG.search(formula)
    number = f'<span class="number">({tag[1]})</span>' if tag else ""
    anchor = f' id="equation-{tag[1]}"' if tag else ""
    shown = drawn(TAG.sub("", formula).strip(), "block")
    translator.body.append(f'<div class="equation"{anchor}>{shown}{number}</div>')
    raise SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", inline_renderers=(inline, None), block_renderers=(displayed, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
