r"""Formulas as MathML, which browsers draw without scripts; their numbers come from ``\tag{...}``, as on GitHub.

    python docs/_ext/mathml.py STIXMath-Regular.otf docs/_static/fonts/glsk-math.woff2

writes the font that they are drawn with. That needs fonttools and brotli; Debian's package fonts-stix has the font.
"""

import re
import sys
from xml.etree import ElementTree

from docutils.nodes import SkipNode
from latex2mathml.converter import convert

TAG = re.compile(r"\\tag\{([^}]*)\}")
BARS = ("|", "‖", "∥")
SPACE = "{http://www.w3.org/1998/Math/MathML}"
ElementTree.register_namespace("", SPACE[1:-1])
FONT = "Glsk Math"  # its licence reserves the name of the original
BLOCKS = (
    *((0x20, 0x17F), (0x2B0, 0x3FF)),  # Latin, marks, Greek
    *((0x2000, 0x23FF), (0x27E0, 0x27EF), (0x2A00, 0x2AFF)),  # punctuation, letterlike, arrows, operators, brackets
    *((0x1D400, 0x1D467), (0x1D49C, 0x1D4CF), (0x1D538, 0x1D56B), (0x1D6A4, 0x1D71B)),  # bold, italic, script, double
)


def mathml(formula, display):
    """A formula with primes beside their letters, because fonts have raised primes and a raised one would vanish."""
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
            bar.attrib.setdefault("stretchy", "false")  # \left and \right ask for one that stretches
    return ElementTree.tostring(math, encoding="unicode")


def row(parts):
    row = ElementTree.Element(f"{SPACE}mrow")
    row.extend(parts)
    return row


def inline(translator, node):
    translator.body.append(mathml(node.astext(), "inline"))
    raise SkipNode


def displayed(translator, node):
    formula = node.astext()
    tag = TAG.search(formula)
    number = f'<span class="number">({tag[1]})</span>' if tag else ""
    anchor = f' id="equation-{tag[1]}"' if tag else ""
    shown = mathml(TAG.sub("", formula).strip(), "block")
    translator.body.append(f'<div class="equation"{anchor}>{shown}{number}</div>')
    raise SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", inline_renderers=(inline, None), block_renderers=(displayed, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write_font(source, target):
    """A subset of a font for formulas, with the table MATH and the licence, under a name of its own."""
    from fontTools import subset

    options = subset.Options(flavor="woff2", layout_features=["*"], name_IDs=["*"], hinting=False, drop_tables=["FFTM"])
    font = subset.load_font(source, options)
    chosen = subset.Subsetter(options)
    chosen.populate(unicodes=[code for first, last in BLOCKS for code in range(first, last + 1)])
    chosen.subset(font)
    table = font["CFF "].cff
    table.fontNames = [FONT.replace(" ", "")]
    table[0].FamilyName = table[0].FullName = FONT
    for record in font["name"].names:
        if record.nameID in (1, 3, 4, 6, 16):  # family, identity, full name, PostScript's name
            record.string = FONT.replace(" ", "") if record.nameID == 6 else FONT
    subset.save_font(font, target, options)


if __name__ == "__main__":
    write_font(*sys.argv[1:])
