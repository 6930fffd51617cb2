"""The font of the formulas, from STIXMath-Regular.otf: what mathematics needs of it, under a name of its own.

python docs/_ext/mathfont.py STIXMath-Regular.otf docs/_static/fonts/glsk-math.woff2

Needs fonttools and brotli, which nothing else here does; Debian's package fonts-stix has the font.
"""

import sys

from fontTools import subset

NAME = "Glsk Math"  # its licence reserves the name of the original
BLOCKS = (
    *((0x20, 0x17F), (0x2B0, 0x3FF)),  # Latin, marks, Greek
    *((0x2000, 0x23FF), (0x27E0, 0x27EF), (0x2A00, 0x2AFF)),  # punctuation, letterlike, arrows, operators, brackets
    *((0x1D400, 0x1D467), (0x1D49C, 0x1D4CF), (0x1D538, 0x1D56B), (0x1D6A4, 0x1D71B)),  # bold, italic, script, double
)


def write(source, target):
    """Keep these blocks, what they grow into (the table MATH) and whose font it is."""
    options = subset.Options(flavor="woff2", layout_features=["*"], name_IDs=["*"], hinting=False, drop_tables=["FFTM"])
    font = subset.load_font(source, options)
    chosen = subset.Subsetter(options)
    chosen.populate(unicodes=[code for first, last in BLOCKS for code in range(first, last + 1)])
    chosen.subset(font)
    table = font["CFF "].cff
    table.fontNames = [NAME.replace(" ", "")]
    table[0].FamilyName = table[0].FullName = NAME
    for record in font["name"].names:
        if record.nameID in (1, 3, 4, 6, 16):  # family, identity, full name, PostScript's name
            record.string = NAME.replace(" ", "") if record.nameID == 6 else NAME
    subset.save_font(font, target, options)


if __name__ == "__main__":
    write(*sys.argv[1:])
