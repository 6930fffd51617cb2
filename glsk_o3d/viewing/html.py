"""A skeleton and its run as HTML in which every text is escaped: for a notebook, and the parts of the page."""

import base64
import io
import json
from collections import Counter
from collections.abc import Iterable, Sequence
from html import escape
from itertools import zip_longest

import numpy as np

from ..analysis.branches import branch_table
from ..analysis.summary import ITERATION_COLUMNS, iteration_rows
from ..decisions import coordinates
from ..errors import MissingPackageError
from ..interop.packages import require
from ..io.colors import shades
from ..report import Report, html_table
from ..skeleton import Skeleton
from .preview import counts, draw

NOTEBOOK_DPI = 110
NOTEBOOK_COLOURS = 48  # of the picture: greys, red, and what lies between; a third of the bytes of the full range
MOST_LISTED_ROWS = 12  # of a table
_BRANCH_COLUMNS = ("branch", "kind", "length", "mean_radius", "tortuosity", "confidence", "points")


def picture(skeleton: Skeleton) -> str:
    """The preview as a ``data:`` address, for an HTML image."""
    require("matplotlib")
    from PIL import Image  # which comes with matplotlib

    drawn, small = io.BytesIO(), io.BytesIO()
    draw(skeleton, words=False).savefig(drawn, format="png", dpi=NOTEBOOK_DPI)
    Image.open(drawn).convert("RGB").quantize(NOTEBOOK_COLOURS, Image.Quantize.MAXCOVERAGE).save(
        small, format="png", optimize=True
    )
    return "data:image/png;base64," + base64.b64encode(small.getvalue()).decode()


def to_html(skeleton: Skeleton) -> str:
    """A picture from three sides, or what to install for it, and the numbers, as HTML that needs nothing else."""
    table = html_table([list(counts(skeleton).values())], list(counts(skeleton)), "right")
    style = 'style="margin:4px 0;border-left:3px solid #c77700;padding-left:8px"'
    warnings = "".join(f"<p {style}>{escape(text)}</p>" for text in dict.fromkeys(skeleton.report.warnings))
    try:
        image = f'<img alt="{escape(repr(skeleton))}" style="width:100%;background:#fff" src="{picture(skeleton)}">'
    except MissingPackageError as error:
        image = f"<p {style}>{escape(str(error))}</p>"
    return f'<div style="max-width:1100px;font:13px/1.5 system-ui,sans-serif">{image}{table}{warnings}</div>'


def figures(skeleton: Skeleton) -> str:
    """The counts of the skeleton."""
    told = counts(skeleton).items()
    return "".join(f"<div><dt>{name.capitalize()}</dt><dd>{value}</dd></div>" for name, value in told)


def warnings(messages: Iterable[str]) -> str:
    """The warnings, each once."""
    rows = "".join(f"<li>{escape(text)}</li>" for text in dict.fromkeys(messages))
    return f'<div class="warnings" role="note"><strong>Warnings</strong><ul>{rows}</ul></div>' if rows else ""


def contraction(report: Report) -> str:
    """Why the contraction stopped, and how it went, solve by solve."""
    records = report.iterations
    if not report.stages and not records:
        return ""
    end = escape(f"{'Converged' if report.converged else 'Not converged'}: {report.stop_reason}.")
    told = f"<h2>Contraction</h2><p>{end}</p>"
    marks = [f' data-solve="{record.iteration:d}"' for record in records]
    return told + _table(ITERATION_COLUMNS, iteration_rows(records), marks=marks)


def topology(report: Report) -> str:
    """What was closed, cut and bridged, and what was kept or left by a narrow margin: the least certain first."""
    if not report.decisions:
        return ""
    counts = Counter(it.outcome for it in report.decisions)
    told = ", ".join(f"{outcome}: {n:,}" for outcome, n in sorted(counts.items()))
    told = f"<h2>Topology</h2><p>{told}; {len(report.uncertain):,} of {len(report.decisions):,} close calls.</p>"
    listed = [it for it in report.decisions if it.changed or it.is_uncertain]
    listed.sort(key=lambda it: abs(it.probability - 0.5))
    rows = [(it.outcome, it.question, f"{it.probability:.2f}") for it in listed[:MOST_LISTED_ROWS]]
    marks = [' class="uncertain"' if it.is_uncertain else "" for it in listed[:MOST_LISTED_ROWS]]
    return told + _table(("done", "question", "probability"), rows, "topology", marks) + _rest(listed, "clearer")


def support(report: Report) -> str:
    """How many samples have the same graph, and what many of them do not show: the most doubtful first."""
    if not report.n_draws:
        return ""
    told = f"{report.n_agreeing:,} of {report.n_draws:,} samples of the cloud have the same graph."
    rows = [
        (f"{it.about} at ({coordinates(it.place)})", "yes" if it.present else "no", f"{it.share:.0%}")
        for it in report.unsupported[:MOST_LISTED_ROWS]
    ]
    return f"<h2>Support</h2><p>{told}</p>" + _table(("part", "here", "samples"), rows, "support")


def branches(skeleton: Skeleton) -> str:
    """The longest branches, in the colours that they have in the view; numbered as in the table of branches."""
    if len(skeleton.edges) == 0:
        return ""
    table = branch_table(skeleton)
    longest = np.argsort(-table.length[: len(skeleton.branches)], kind="stable").tolist()
    colors, columns = branch_colors(skeleton, len(skeleton.branches)), table.printed()
    rows = [[columns[name][row] for name in _BRANCH_COLUMNS] for row in longest[:MOST_LISTED_ROWS]]
    for row, cells in zip(longest, rows, strict=False):
        cells[0] = f'<span class="swatch" style="background:{colors[row]}"></span>{cells[0]}'
    heads = [name.replace("_", " ") for name in _BRANCH_COLUMNS]
    return f"<h2>Longest branches</h2>{_table(heads, rows, 'branches')}{_rest(longest, 'shorter')}"


def branch_colors(skeleton: Skeleton, n: int) -> list[str]:
    """The colours of the first n branches as ``"#rrggbb"``, the same as in Open3D's windows."""
    return list(map(require("matplotlib.colors").to_hex, shades(skeleton, "branch", np.arange(n), np.arange(n))))


def origin(report: Report) -> str:
    """The run in a table, and what it takes to repeat it: the recipe, or else the stages."""
    text = json.dumps(report.recipe, indent=2, ensure_ascii=False) if report.recipe else "\n".join(report.stages)
    recipe = f"<details><summary>Recipe</summary><pre>{escape(text)}</pre></details>" if text else ""
    return f'<h2>The run</h2><div class="run">{report._repr_html_()}</div>{recipe}'


def _table(heads: Iterable[str], rows: Sequence[Sequence[str]], kind: str = "", marks: Sequence[str] = ()) -> str:
    """A table of HTML texts, nothing without rows; `marks` are attributes of the rows."""
    lines = zip_longest(marks, rows, fillvalue="")
    body = "".join(f"<tr{mark}><td>{'</td><td>'.join(row)}</td></tr>" for mark, row in lines)
    head = f"<thead><tr><th>{'</th><th>'.join(heads)}</th></tr></thead>"
    return f'<div class="wide {kind}"><table>{head}<tbody>{body}</tbody></table></div>' if rows else ""


def _rest(listed, which: str) -> str:
    """How many more there are than the rows of a table."""
    rest = len(listed) - MOST_LISTED_ROWS
    return f'<p class="muted small">and {rest:,} {which} ones</p>' if rest > 0 else ""
