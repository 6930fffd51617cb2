"""A skeleton and its run as HTML in which every text is escaped: for a notebook, and the parts of the page."""

import base64
import io
import json
import math
from collections import Counter
from collections.abc import Iterable
from html import escape

import numpy as np

from ..analysis.branches import branch_table
from ..analysis.summary import ITERATION_COLUMNS, iteration_rows, point_count, structure, summary
from ..decisions import coordinates
from ..errors import MissingPackageError
from ..interop.packages import require
from ..io.colors import shades
from ..report import Report, html_table
from ..skeleton import Skeleton
from .figures import DPI
from .preview import draw

NOTEBOOK_SIZE = (1200, 500)
NOTEBOOK_MARGIN = 16  # in pixels
NOTEBOOK_COLOURS = 48  # of the picture: greys, red, and what lies between; a third of the bytes of the full range
MOST_LISTED_ROWS = 12  # of a table
_BRANCH_COLUMNS = ("branch", "kind", "length", "mean_radius", "tortuosity", "confidence", "points")
_EXTRA = ("held", "e", "w_L", "solver error", "seconds", "tortuosity", "confidence")
"""Columns that a narrow screen has no room for."""
_WIDTH, _HEIGHT, _LEFT, _TOP, _BOTTOM = 320, 150, 46, 12, 22  # of a chart and of what surrounds its curve


def picture(skeleton: Skeleton) -> str:
    """The preview as a ``data:`` address, for an HTML image."""
    require("PIL", "pillow")
    from PIL import Image

    figure, stream = draw(skeleton, NOTEBOOK_SIZE, None, caption=False), io.BytesIO()
    figure.set_dpi(DPI)
    figure.canvas.draw()
    drawn = np.asarray(figure.canvas.buffer_rgba())[..., :3]
    rows = np.flatnonzero((drawn < 250).any(axis=(1, 2)))  # without the white bands above and below flat drawings
    drawn = drawn[max(rows[0] - NOTEBOOK_MARGIN, 0) : rows[-1] + NOTEBOOK_MARGIN]
    image = Image.fromarray(drawn.copy()).quantize(NOTEBOOK_COLOURS, method=Image.Quantize.MEDIANCUT)
    image.save(stream, format="png", optimize=True)
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()


def counts(skeleton: Skeleton) -> dict[str, str]:
    """The counts of a skeleton and its length, as people read them."""
    facts = {"points": point_count(skeleton), **structure(skeleton)}
    return {name: f"{value:.4g}" if name == "length" else f"{value:,}" for name, value in facts.items()}


def to_html(skeleton: Skeleton) -> str:
    """A picture from three sides and the numbers, as a piece of HTML that needs nothing else.

    Without what draws pictures, the numbers and what to install.
    """
    table = html_table([list(counts(skeleton).values())], list(counts(skeleton)), "right")
    image, missing = "", []
    try:
        style = 'style="width:100%;background:#fff;border-radius:4px"'
        image = f'<img alt="{escape(repr(skeleton))}" {style} src="{picture(skeleton)}">'
    except MissingPackageError as error:
        missing = [str(error)]
    style = 'style="margin:4px 0;border-left:3px solid #c77700;padding-left:8px"'
    messages = dict.fromkeys([*missing, *skeleton.report.warnings])
    warnings = "".join(f"<p {style}>{escape(text)}</p>" for text in messages)
    return f'<div style="max-width:1100px;font:13px/1.5 system-ui,sans-serif">{image}{table}{warnings}</div>'


def figures(skeleton: Skeleton) -> str:
    """The skeleton and its run in a few numbers."""
    numbers = counts(skeleton)
    if skeleton.report.seconds:
        numbers["seconds"] = f"{sum(skeleton.report.seconds.values()):.2f}"
    return "".join(f"<div><dt>{name.capitalize()}</dt><dd>{value}</dd></div>" for name, value in numbers.items())


def warnings(messages: Iterable[str]) -> str:
    """The warnings, each once."""
    rows = "".join(f"<li>{escape(text)}</li>" for text in dict.fromkeys(messages))
    return f'<div class="warnings" role="note"><strong>Warnings</strong><ul>{rows}</ul></div>' if rows else ""


def contraction(report: Report) -> str:
    """Why the contraction stopped, and how it went: charts and a table."""
    records = report.iterations
    if not report.stages and not records:
        return ""
    end = escape(f"{'Converged' if report.converged else 'Not converged'}: {report.stop_reason}.")
    told = f"<h2>Contraction</h2><p>{end}</p>"
    if not records:
        return told
    charts = [
        _chart("Points solved for, <i>n</i>", records, "n_points", ",.10g"),
        _chart("Change of the explained score, <i>De</i>", records, "explained_change", ".3g"),
        _chart("Ring ratio, <i>a</i>", records, "ring_ratio", ".3g"),
    ]
    marks = [f' data-solve="{record.iteration:d}"' for record in records]
    table = _table(ITERATION_COLUMNS, iteration_rows(records), marks=marks)
    return f'{told}<div class="charts">{"".join(charts)}</div><h2>Solve by solve</h2>{table}'


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
    table = _table(("done", "question", "probability"), rows, "topology", marks)
    return told + table + _rest(listed, "clearer")


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


def origin(skeleton: Skeleton) -> str:
    """What it takes to repeat the run: the recipe, the counts and times of the run, the versions."""
    report, seconds = skeleton.report, skeleton.report.seconds
    text = json.dumps(report.recipe, indent=2, ensure_ascii=False) if report.recipe else "\n".join(report.stages)
    recipe = f"<details><summary>Recipe</summary><pre>{escape(text)}</pre></details>" if text else ""
    facts = summary(skeleton, 0.0) if report.n_input else {}
    facts = {name: value for name, value in facts.items() if type(value) is int and name not in structure(skeleton)}
    run = {name.replace("_", " "): f"{value:,}" for name, value in facts.items()}
    run |= {f"{name}, seconds": f"{value:.3f}" for name, value in seconds.items()}
    return f'{recipe}<div class="pair">{_facts("The run", run, "number")}{_facts("Versions", report.versions)}</div>'


def _table(heads, rows, kind: str = "", marks=None) -> str:
    """A table of HTML texts, nothing without rows; `marks` are attributes of the rows."""
    if not rows:
        return ""
    classes = [' class="extra"' if head in _EXTRA else "" for head in heads]

    def cells(tag, texts):
        return "".join(f"<{tag}{extra}>{text}</{tag}>" for extra, text in zip(classes, texts, strict=True))

    marked = zip(marks or [""] * len(rows), rows, strict=True)
    body = "".join(f"<tr{mark}>{cells('td', row)}</tr>" for mark, row in marked)
    head = f"<thead><tr>{cells('th', heads)}</tr></thead>"
    return f'<div class="wide {kind}"><table>{head}<tbody>{body}</tbody></table></div>'


def _rest(listed, which: str) -> str:
    """How many more there are than the rows of a table."""
    rest = len(listed) - MOST_LISTED_ROWS
    return f'<p class="muted small">and {rest:,} {which} ones</p>' if rest > 0 else ""


def _facts(heading: str, told: dict[str, str], kind: str = "") -> str:
    rows = "".join(f'<tr><th>{escape(name)}</th><td class="{kind}">{escape(told[name])}</td></tr>' for name in told)
    return f'<div><h2>{heading}</h2><table class="facts"><tbody>{rows}</tbody></table></div>' if rows else ""


def _chart(caption: str, records, name: str, form: str) -> str:
    """A number per solve, from zero, as SVG; what is not finite is left out."""
    solves = [record.iteration for record in records]
    values = {record.iteration: float(getattr(record, name)) for record in records}
    values = {solve: value for solve, value in values.items() if math.isfinite(value)}
    highest = _round_up(max(values.values(), default=1.0))

    def x(solve):
        share = (solve - solves[0]) / max(solves[-1] - solves[0], 1)
        return f"{_LEFT + 12 + share * (_WIDTH - _LEFT - 24):.1f}"

    def y(value, below=0):
        return f"{_HEIGHT - _BOTTOM - value / highest * (_HEIGHT - _BOTTOM - _TOP) + below:.1f}"

    grid = "".join(
        f'<line class="grid" x1="{_LEFT}" x2="{_WIDTH}" y1="{y(value)}" y2="{y(value)}"/>'
        f'<text x="{_LEFT - 7}" y="{y(value, 4)}" text-anchor="end">{value:{form}}</text>'
        for value in (0, highest / 2, highest)
    )
    ticks = "".join(
        f'<text x="{x(solve)}" y="{_HEIGHT - 5}" text-anchor="middle">{solve}</text>'
        for solve in solves[:: -(-len(solves) // 10)]
    )
    cursor = f'<line class="cursor" x1="0" x2="0" y1="{_TOP}" y2="{_HEIGHT - _BOTTOM}"/>'
    curve = " ".join(f"{x(solve)},{y(value)}" for solve, value in values.items())
    dots = "".join(
        f'<circle data-at="{solve}" cx="{x(solve)}" cy="{y(value)}" r="4">'
        f"<title>solve {solve}: {value:{form}}</title></circle>"
        for solve, value in values.items()
    )
    return (
        f'<figure><figcaption>{caption}</figcaption><svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img">'
        f'{grid}{ticks}{cursor}<polyline class="curve" points="{curve}"/>{dots}</svg></figure>'
    )


def _round_up(value: float) -> float:
    """The next of 1, 2, 3, 4, 5, 6, 8, 10 times a power of ten: its half is a short number, too."""
    if not value > 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (1, 2, 3, 4, 5, 6, 8, 10) if step * power >= value * (1 - 1e-9))
