"""The parts of the page below the view: numbers, charts and tables, as HTML in which every text is escaped."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.branches import branch_table
from ..analysis.summary import point_count
from ..io.colors import shades
from ..judgements import coordinates

if TYPE_CHECKING:
    from ..report import Report
    from ..skeleton import Skeleton

MOST_LISTED_ROWS = 12  # of a table
_SOLVE_COLUMNS = {  # by heading: the field of a record, and its format
    "solve": ("iteration", "d"),
    "points": ("n_points", ",d"),
    "merged": ("n_merged", ",d"),
    "e": ("explained", ".4f"),
    "De": ("explained_change", ".4f"),
    "ring ratio": ("ring_ratio", ".4f"),
    "w<sub>L</sub>": ("contraction_weight", ".4g"),
    "solver error": ("solve_error", ".1e"),
    "seconds": ("seconds", ".3f"),
}
_EXTRA = ("held", "e", "w<sub>L</sub>", "solver error", "seconds", "tortuosity", "confidence")
"""Columns that a narrow screen has no room for."""
_WIDTH, _HEIGHT, _LEFT, _TOP, _BOTTOM = 320, 150, 46, 12, 22  # of a chart and of what surrounds its curve


def figures(skeleton: Skeleton) -> str:
    """The run in a few numbers."""
    told = {"Points": f"{point_count(skeleton):,}"} if point_count(skeleton) else {}
    if len(skeleton.vertices):
        told |= {
            "Vertices": f"{len(skeleton.vertices):,}",
            "Branches": f"{len(skeleton.branches):,}",
            "Components": f"{skeleton.n_components:,}",
            "Loops": f"{skeleton.n_loops:,}",
            "Leaves": f"{len(skeleton.leaves):,}",
            "Length": _number(skeleton.length),
        }
    if skeleton.report.seconds:
        told["Seconds"] = f"{sum(skeleton.report.seconds.values()):.2f}"
    return "".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in told.items())


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
        _chart("Change of the explained score, <i>De</i>", records, "explained_change", ".3g", _threshold(report)),
        _chart("Ring ratio, <i>a</i>", records, "ring_ratio", ".3g"),
    ]
    rows = [[f"{getattr(record, name):{form}}" for name, form in _SOLVE_COLUMNS.values()] for record in records]
    marks = [f' data-solve="{record.iteration:d}"' for record in records]
    table = _table(_SOLVE_COLUMNS, rows, marks=marks)
    return f'{told}<div class="charts">{"".join(charts)}</div><h2>Solve by solve</h2>{table}'


def _threshold(report: Report) -> float | None:
    """The De below which the contraction stops, if that is its rule."""
    for stage in report.recipe.get("pipeline", ()):
        rule = stage.get("stop") if isinstance(stage, dict) else None
        if isinstance(rule, dict) and rule.get("rule") == "ExplainedScore":
            value = rule.get("threshold")
            return float(value) if isinstance(value, int | float) and math.isfinite(value) else None
    return None


def topology(report: Report) -> str:
    """What was closed, cut and bridged, and what was kept or left by a narrow margin: the least certain first."""
    if not report.judgements:
        return ""
    counts = Counter(it.outcome for it in report.judgements)
    told = ", ".join(f"{outcome}: {n:,}" for outcome, n in sorted(counts.items()))
    told = f"<h2>Topology</h2><p>{told}; {len(report.uncertain):,} of {len(report.judgements):,} close calls.</p>"
    listed = [it for it in report.judgements if it.changed or it.is_uncertain]
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
    """The longest branches, in the colours that they have in the view; numbered as in `Skeleton.branch_table`."""
    if len(skeleton.edges) == 0:
        return ""
    listed = [row for row in branch_table(skeleton) if row["kind"] != "isolated"]
    listed.sort(key=lambda row: -row["length"])
    colors = branch_colors(skeleton, len(skeleton.branches))
    heads = ("branch", "kind", "length", "mean radius", "tortuosity", "confidence", "points")
    rows = []
    for row in listed[:MOST_LISTED_ROWS]:
        swatch = f'<span class="swatch" style="background:{colors[row["branch"]]}"></span>'
        sizes = _number(row["length"]), _number(row["mean_radius"])
        ratios = _number(row["tortuosity"], ".2f"), _number(row["confidence"], ".2f")
        rows.append((f"{swatch}{row['branch']}", row["kind"], *sizes, *ratios, f"{row['points']:,}"))
    return f"<h2>Longest branches</h2>{_table(heads, rows, 'branches')}{_rest(listed, 'shorter')}"


def branch_colors(skeleton: Skeleton, n: int) -> list[str]:
    """The colours of the first n branches as ``"#rrggbb"``, the same as in Open3D's windows."""
    return hexadecimal(shades(skeleton, "branch", np.arange(n), np.arange(n)))


def hexadecimal(colors: np.ndarray) -> list[str]:
    """Colours from 0 to 1, (n, 3) or (n, 4) float array, as ``"#rrggbb"``."""
    return [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in np.rint(255 * colors[:, :3]).astype(int).tolist()]


def origin(report: Report) -> str:
    """What it takes to repeat the run: the recipe, the counts and times of the run, the versions."""
    text = json.dumps(report.recipe, indent=2, ensure_ascii=False) if report.recipe else "\n".join(report.stages)
    told = f"<details><summary>Recipe</summary><pre>{escape(text)}</pre></details>" if text else ""
    counts = {
        "input points": report.n_input,
        "dropped, not finite": report.n_dropped,
        **({"sampled from a large cloud": report.n_sampled} if report.is_sampled else {}),
        "set aside as outliers": report.n_outliers,
        "distinct points": report.n_distinct,
        "contracted points": report.n_contracted,
        "loops closed": report.n_loops_closed,
        "branches cut in air": report.n_cuts,
        "gaps bridged": report.n_bridges,
        "traced, no surface": report.n_traced,
        "gaps joined": len(report.joined),
    }
    numbers = {name: f"{n:,}" for name, n in counts.items()} if report.n_input else {}
    numbers |= {f"{name}, seconds": f"{seconds:.3f}" for name, seconds in report.seconds.items()}
    return f'{told}<div class="pair">{_facts("The run", numbers, "number")}{_facts("Versions", report.versions)}</div>'


def _number(value: float, form: str = "#.4g") -> str:
    return f"{value:{form}}".rstrip(".") if math.isfinite(value) else "–"


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


def _chart(caption: str, records, name: str, form: str, threshold: float | None = None) -> str:
    """A number per solve, from zero, as SVG; what is not finite is left out."""
    solves = [record.iteration for record in records]
    values = {record.iteration: float(getattr(record, name)) for record in records}
    values = {solve: value for solve, value in values.items() if math.isfinite(value)}
    highest = _round_up(max([*values.values(), *([] if threshold is None else [threshold])], default=1.0))

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
    if threshold is not None:
        grid += (
            f'<line class="threshold" x1="{_LEFT}" x2="{_WIDTH}" y1="{y(threshold)}" y2="{y(threshold)}"/>'
            f'<text x="{_WIDTH}" y="{y(threshold, -4)}" text-anchor="end">stops below {threshold:g}</text>'
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
