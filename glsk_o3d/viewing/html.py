"""A skeleton and its run as the parts of the page: HTML in which every text is escaped."""

import json
from collections import Counter
from collections.abc import Iterable, Sequence
from html import escape
from itertools import zip_longest

from ..analysis.summary import ITERATION_COLUMNS, iteration_rows
from ..decisions import coordinates
from ..report import Report
from ..skeleton import Skeleton
from .preview import counts

MOST_LISTED_ROWS = 12  # of a table


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
    return told + _table(ITERATION_COLUMNS, iteration_rows(records))


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
    rest = len(listed) - MOST_LISTED_ROWS
    more = f'<p class="muted small">and {rest:,} clearer ones</p>' if rest > 0 else ""
    return told + _table(("done", "question", "probability"), rows, "topology", marks) + more


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
