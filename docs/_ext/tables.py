"""Tables from the code: the directive ``options`` of a filter and ``steering`` of all numbers; and cells of tables.

Cells with sentences are marked, so that on a phone they keep a width that can be read, and the table scrolls. Intervals
stay in one piece: a line may end before one, and not in it.
"""

import dataclasses
import re

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.addnodes import index
from steering import steering

from glsk_o3d import pipelines
from glsk_o3d.parameters import allowed_values
from glsk_o3d.pipeline import parts
from glsk_o3d.recipes.catalogue import BUILTIN

SENTENCE = 40  # characters and more
INTERVAL = re.compile(r"(\[[^\[\], ]+,) ([^\[\], ]+\])")


def as_written(value):
    """A value as users write it."""
    return repr(value) if isinstance(value, str | bool | int | float | None) else f"{type(value).__name__}()"


def published(cls, name, default):
    """The values of an option in the published pipelines that are not its default, in words."""
    return [
        f"{as_written(getattr(part, name))} in {pipeline.__name__}"
        for pipeline in (pipelines.wen2024, pipelines.cao2010)
        for part in parts(pipeline())
        if type(part) is cls and as_written(getattr(part, name)) != as_written(default)
    ]


class Options(Directive):
    """``{options} RingBuilder`` and a line ``name: when to touch it`` for every parameter."""

    required_arguments = 1
    has_content = True

    def run(self):
        cls = BUILTIN[self.arguments[0]]
        notes = dict(line.split(": ", 1) for line in self.content if line)
        names = [field.name for field in dataclasses.fields(cls)]
        if list(notes) != names:
            raise self.error(f"{cls.__name__} has the options {', '.join(names)}, in this order")
        items = [self.item(cls, field, notes[field.name]) for field in dataclasses.fields(cls)]
        return [nodes.definition_list("", *items, classes=["options"])]

    def item(self, cls, field, note):
        """The entry of one option, which the search can lead to."""
        place = f"{cls.__name__}.{field.name}"
        entry = index(entries=[("single", field.name, place, "main", None)])
        term = nodes.term("", "", entry, nodes.literal(text=field.name), nodes.Text("  "))
        default = f"default {as_written(field.default)}"
        facts = [allowed_values(field.metadata), default, *published(cls, field.name, field.default)]
        term += nodes.inline(text="; ".join(facts), classes=["kind"])
        text, _ = self.state.inline_text(field.metadata["doc"], self.lineno)
        touch, _ = self.state.inline_text(note, self.lineno)
        when = nodes.paragraph("", "", nodes.emphasis(text="When to touch it: "), *touch)
        definition = nodes.definition("", nodes.paragraph("", "", *text), when)
        return nodes.definition_list_item("", term, definition, ids=[place])


class Steering(Directive):
    """``{steering}``: the numbers that steer the skeleton of a cloud."""

    def run(self):
        rows = [(number.place, number.name, number.value, number.origin, number.what) for number in steering()]
        group = nodes.tgroup("", *(nodes.colspec(colwidth=width) for width in (18, 20, 10, 10, 60)), cols=5)
        group += nodes.thead("", table_row(("where", "number", "value", "origin", "what")))
        group += nodes.tbody("", *(table_row(row, code=(1, 2)) for row in rows))
        return [nodes.paragraph(text=f"{len(rows)} numbers:"), nodes.table("", group, classes=["numbers"])]


def table_row(texts, code=()):
    """A row of a table, with these columns as code."""
    shown = [nodes.literal(text=text) if i in code else nodes.Text(text) for i, text in enumerate(texts)]
    return nodes.row("", *(nodes.entry("", nodes.paragraph("", "", text)) for text in shown))


def mark_cells(app, doctree):
    for cell in doctree.findall(nodes.entry):
        words = [text for text in [*cell.findall(nodes.Text)] if not isinstance(text.parent, nodes.literal)]
        if len("".join(words)) >= SENTENCE:
            cell["classes"].append("sentence")
        for text in words:
            if (whole := INTERVAL.sub("\\1\N{NO-BREAK SPACE}\\2", text)) != text:
                text.parent.replace(text, nodes.Text(whole))


def setup(app):
    app.add_directive("options", Options)
    app.add_directive("steering", Steering)
    app.connect("doctree-read", mark_cells)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
