"""The directive ``options``: what a filter's parameters are, from the code, and when to touch them, from the page."""

import dataclasses

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.addnodes import index

from glsk_o3d import pipelines
from glsk_o3d.parameters import allowed_values
from glsk_o3d.pipeline import parts
from glsk_o3d.recipes.catalogue import BUILTIN


def plain(value):
    """A value as users write it."""
    return repr(value) if isinstance(value, str | bool | int | float | None) else f"{type(value).__name__}()"


def published(cls, name, default):
    """What the published pipelines have where it is not the default, in words."""
    said = []
    for pipeline in (pipelines.wen2024, pipelines.cao2010):
        for part in parts(pipeline()):
            if type(part) is cls and plain(getattr(part, name)) != plain(default):
                said.append(f"{plain(getattr(part, name))} in {pipeline.__name__}")
    return said


class Options(Directive):
    """``{options} RingBuilder`` and a line ``name: when to touch it`` for every parameter."""

    required_arguments = 1
    has_content = True

    def run(self):
        cls = BUILTIN[self.arguments[0]]
        notes = dict(line.split(": ", 1) for line in self.content if line)
        fields = dataclasses.fields(cls)
        if list(notes) != [field.name for field in fields]:
            raise self.error(
                f"{cls.__name__} has the options {', '.join(field.name for field in fields)}, in this order"
            )
        shown = nodes.definition_list(classes=["options"])
        for field in fields:
            facts, default = field.metadata, [f"default {plain(field.default)}"]
            place = f"{cls.__name__}.{field.name}"
            entry = index(entries=[("single", field.name, place, "main", None)])  # whom the search leads here
            term = nodes.term("", "", entry, nodes.literal(text=field.name), nodes.Text("  "))
            words = "; ".join([allowed_values(facts), *default, *published(cls, field.name, field.default)])
            term += nodes.inline(text=words, classes=["kind"])
            text, _ = self.state.inline_text(facts["doc"], self.lineno)
            touch, _ = self.state.inline_text(notes[field.name], self.lineno)
            told = nodes.paragraph("", "", nodes.emphasis(text="When to touch it: "), *touch)
            shown += nodes.definition_list_item(
                "",
                term,
                nodes.definition("", nodes.paragraph("", "", *text), told),
                ids=[place],
            )
        return [shown]


def setup(app):
    app.add_directive("options", Options)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
