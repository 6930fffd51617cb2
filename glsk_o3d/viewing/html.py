"""A skeleton and its run as the parts of the page: HTML, all of it by `markup`, which escapes every text."""

import json
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import zip_longest

from ..analysis.summary import ITERATION_COLUMNS, iteration_rows
from ..decisions import coordinates
from ..report import Markup, Report, markup
from ..skeleton import Skeleton
from .preview import counts

MOST_LISTED_ROWS = 12  # of a table


def figures(skeleton: Skeleton) -> Markup:
    """The counts of the skeleton."""
    row = "<div><dt>{}</dt><dd>{}</dd></div>"
    return markup("{}", [markup(row, name.capitalize(), value) for name, value in counts(skeleton).items()])


def warnings(messages: Iterable[str]) -> Markup:
    """The warnings, each once."""
    rows = [markup("<li>{}</li>", text) for text in dict.fromkeys(messages)]
    return markup('<div class="warnings" role="note"><strong>Warnings</strong><ul>{}</ul></div>' if rows else "", rows)


def contraction(report: Report) -> Markup:
    """Why the contraction stopped, and how it went, solve by solve."""
    records = report.iterations
    if not report.stages and not records:
        return Markup()
    end = f"{'Converged' if report.converged else 'Not converged'}: {report.stop_reason}."
    return markup("<h2>Contraction</h2><p>{}</p>{}", end, _table(ITERATION_COLUMNS, iteration_rows(records)))


def topology(report: Report) -> Markup:
    """What was closed, cut and bridged, and what was kept or left by a narrow margin: the least certain first."""
    if not report.decisions:
        return Markup()
    counts = Counter(it.outcome for it in report.decisions)
    done = ", ".join(f"{outcome}: {n:,}" for outcome, n in sorted(counts.items()))
    calls = f"{done}; {len(report.uncertain):,} of {len(report.decisions):,} close calls."
    listed = [it for it in report.decisions if it.changed or it.is_uncertain]
    listed.sort(key=lambda it: abs(it.probability - 0.5))
    rows = [(it.outcome, it.question, f"{it.probability:.2f}") for it in listed[:MOST_LISTED_ROWS]]
    marks = [Markup(' class="uncertain"' if it.is_uncertain else "") for it in listed[:MOST_LISTED_ROWS]]
    rest = len(listed) - MOST_LISTED_ROWS
    more = markup('<p class="muted small">and {} clearer ones</p>' if rest > 0 else "", f"{rest:,}")
    table = _table(("done", "question", "probability"), rows, "topology", marks)
    return markup("<h2>Topology</h2><p>{}</p>{}{}", calls, table, more)


def support(report: Report) -> Markup:
    """How many samples have the same graph, and what many of them do not show: the most doubtful first."""
    if not report.n_draws:
        return Markup()
    rows = [
        (f"{it.about} at ({coordinates(it.place)})", "yes" if it.present else "no", f"{it.share:.0%}")
        for it in report.unsupported[:MOST_LISTED_ROWS]
    ]
    share = f"{report.n_agreeing:,} of {report.n_draws:,} samples of the cloud have the same graph."
    return markup("<h2>Support</h2><p>{}</p>{}", share, _table(("part", "here", "samples"), rows, "support"))


def origin(report: Report) -> Markup:
    """The run in a table, and what it takes to repeat it: the recipe, or else the stages."""
    text = json.dumps(report.recipe, indent=2, ensure_ascii=False) if report.recipe else "\n".join(report.stages)
    recipe = markup("<details><summary>Recipe</summary><pre>{}</pre></details>" if text else "", text)
    return markup('<h2>The run</h2><div class="run">{}</div>{}', report._repr_html_(), recipe)


def _table(heads: Iterable[str], rows: Sequence[Sequence[str]], kind: str = "", marks: Sequence[str] = ()) -> Markup:
    """A table of texts, nothing without rows; `marks` are attributes of the rows."""
    if not rows:
        return Markup()
    head = [markup("<th>{}</th>", each) for each in heads]
    body = [
        markup("<tr{}>{}</tr>", mark, [markup("<td>{}</td>", cell) for cell in row])
        for mark, row in zip_longest(marks, rows, fillvalue="")
    ]
    table = '<div class="wide {}"><table><thead><tr>{}</tr></thead><tbody>{}</tbody></table></div>'
    return markup(table, kind, head, body)
