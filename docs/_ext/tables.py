"""Cells with sentences are marked, so that on a phone they keep a width that can be read, and the table scrolls.

Intervals stay in one piece: a line may end before one, and not in it.
"""

import re

from docutils import nodes

SENTENCE = 40  # characters and more
INTERVAL = re.compile(r"(\[[^\[\], ]+,) ([^\[\], ]+\])")


def mark(app, doctree):
    for cell in doctree.findall(nodes.entry):
        words = [text for text in [*cell.findall(nodes.Text)] if not isinstance(text.parent, nodes.literal)]
        if len("".join(words)) >= SENTENCE:
            cell["classes"].append("sentence")
        for text in words:
            if (whole := INTERVAL.sub("\\1\N{NO-BREAK SPACE}\\2", text)) != text:
                text.parent.replace(text, nodes.Text(whole))


def setup(app):
    app.connect("doctree-read", mark)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
