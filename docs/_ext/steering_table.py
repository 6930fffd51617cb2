"""The directive ``steering``: the numbers that steer the skeleton of a cloud, as a table."""

from docutils import nodes
from docutils.parsers.rst import Directive
from steering import steering


class Steering(Directive):
    """``{steering}``: the table."""

    def run(self):
        rows = [(f"{each.place}", each.name, each.value, each.origin, each.what) for each in steering()]
        table = nodes.table(classes=["numbers"])
        group = nodes.tgroup(cols=5)
        table += group
        for width in (18, 20, 10, 10, 60):
            group += nodes.colspec(colwidth=width)
        head, body = nodes.thead(), nodes.tbody()
        group += [head, body]
        for part, lines in ((head, [("where", "number", "value", "origin", "what")]), (body, rows)):
            for line in lines:
                row = nodes.row()
                part += row
                for column, text in enumerate(line):
                    code = part is body and column in (1, 2)
                    shown = nodes.literal(text=text) if code else nodes.Text(text)
                    row += nodes.entry("", nodes.paragraph("", "", shown))
        return [nodes.paragraph(text=f"{len(rows)} numbers:"), table]


def setup(app):
    app.add_directive("steering", Steering)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
