"""A run as one page for the browser: it holds all it needs, and asks no network for anything."""

import base64
import hashlib
import json
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timezone
from importlib.resources import files
from itertools import zip_longest
from typing import Any

import numpy as np

from ..analysis.segmentation import branch_of_edge, branch_of_point, branch_of_vertex
from ..analysis.summary import ITERATION_COLUMNS, iteration_rows
from ..curve.detail import all_limbs, pruning_order
from ..data.decisions import coordinates
from ..data.report import Markup, Report, markup
from ..data.skeleton import Skeleton
from ..interop.atomic import check_ending, write_atomically
from ..interop.packages import require
from ..io.colors import shades
from .figures import MOST_DRAWN_POINTS, thinned
from .preview import counts

FLAT_SIDE = 0.85  # a box whose least side is less than this share of the next is flat
MOST_LISTED_ROWS = 12  # of a table


def save_report(
    skeleton: Skeleton,
    path: str | os.PathLike[str],
    *,
    title: str = "Curve skeleton",
    facts: Mapping[str, Mapping[str, str]] | None = None,
) -> None:
    """Write a page that shows a skeleton and the run that made it.

    The page is one HTML file that works offline in any browser with WebGL 2: cloud, skeleton and radius tubes to turn
    and zoom, the run's numbers, warnings, recipe and versions. Of larger clouds 20 000 points are shown, drawn at
    random.

    Parameters
    ----------
    skeleton : Skeleton
    path : path-like
        HTML; it appears complete or not at all.
    title : str
        Shown literally.
    facts : dict of str to dict of str to str, optional
        More sections: a table of names and texts below each heading, such as the numbers of a cross-check.

    Raises
    ------
    FileFormatError, OSError
        The ending is neither ``.html`` nor ``.htm``, or the file cannot be written.

    Examples
    --------
    >>> import glsk_o3d as glsk
    >>> from glsk_o3d.samples import torus
    >>> glsk.save_report(glsk.skeletonize(torus(600).points), "report.html", title="A torus")  # doctest: +SKIP
    """
    check_ending(path, "report is a page", ".html", ".htm")
    page = _page(skeleton.whole, title, facts or {}).encode("utf-8", "replace")  # a file name may be no Unicode
    write_atomically(path, lambda temporary: temporary.write_bytes(page))


def _page(skeleton: Skeleton, title: str, facts: Mapping[str, Mapping[str, str]]) -> str:
    shown = thinned(skeleton.points, MOST_DRAWN_POINTS)
    finite = np.isfinite(skeleton.points).all(axis=1).sum()
    assets = files(__package__) / "assets"
    html, css, script = ((assets / f"report.{ending}").read_text("utf-8") for ending in ("html", "css", "js"))
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    report, kind = skeleton.report, "Curve skeleton" if len(skeleton.vertices) else "Point cloud"
    now = datetime.now(timezone.utc).strftime("%d %B %Y, %H:%M UTC")
    thinning = f"The view shows {len(shown):,} of {finite:,} points, drawn at random."
    more = [section(heading, rows) for heading, rows in facts.items()]
    below = [*more, contraction(report), topology(report), support(report), origin(report)]
    return markup(
        html,
        title=title,
        subtitle=f"{kind} · glsk-o3d {report.versions.get('glsk-o3d', '')} · {now}",
        digest=digest,  # of the one script that may run
        style=Markup(css),
        figures=figures(skeleton),
        warnings=warnings(report.warnings),
        thinning=thinning if len(shown) < finite else "",
        sections=below,
        # no "<" in it, so that nothing in it can end the script element
        data=Markup(json.dumps(_data(skeleton, shown), allow_nan=False).replace("<", "\\u003c")),
        script=Markup(script),
    )


def _data(skeleton: Skeleton, shown: np.ndarray) -> dict[str, Any]:
    viridis, to_hex = require("matplotlib").colormaps["viridis"], require("matplotlib.colors").to_hex
    points = skeleton.points[shown]
    box = np.concatenate([points, skeleton.vertices])
    low, high = (box.min(axis=0), box.max(axis=0)) if len(box) else np.zeros((2, 3))
    centre = low + (high - low) / 2
    unit = float(np.linalg.norm(high - low)) / 2 or 1.0
    ranges: dict[str, list[float] | None] = {"branch": None}
    for name, values in (("radius", skeleton.radii / unit), ("confidence", skeleton.confidence)):
        finite = values[np.isfinite(values)]
        if len(finite) == len(values) > 0 or (name == "confidence" and len(finite)):
            ranges[name] = [float(finite.min()), float(finite.max())]
    thin, middle, _ = np.sort(high - low)
    across = int(np.argmin(high - low)) if thin < FLAT_SIDE * middle else 2 if np.argmax(high - low) == 1 else 1
    lone = np.flatnonzero(skeleton.degree == 0)  # drawn as edges without a length
    vertex = skeleton.vertex_of_point[shown] if len(skeleton.vertices) else np.full(len(shown), -1)
    label = branch_of_point(skeleton, points, vertex) if len(skeleton.vertices) else vertex
    dots = len(skeleton.branches) + np.arange(len(lone))
    pieces = np.arange(len(skeleton.branches) + len(lone))
    return {
        "view": ("yz", "xz", "xy")[across],  # what is flat from its broad side; else z is up, or y if that is longest
        "unit": unit,
        "palette": list(map(to_hex, shades(skeleton, "branch", pieces, pieces))),  # as in Open3D's windows
        "ramp": list(map(to_hex, viridis(np.linspace(0, 1, 24)))),
        "ranges": ranges,
        "positions": _packed(np.rint(32767 * (points - centre) / unit), "<i2"),
        "vertex_of_point": _packed(vertex, "<i4"),
        "branch_of_point": _packed(label, "<i4"),
        "vertices": _packed((skeleton.vertices - centre) / unit, "<f4"),
        "radii": _packed(np.nan_to_num(skeleton.radii / unit, nan=0.0), "<f4"),
        "confidence": _packed(skeleton.confidence, "<f4"),
        "branch_of_vertex": _packed(branch_of_vertex(skeleton), "<i4"),
        "edges": _packed(np.concatenate([skeleton.edges, np.column_stack([lone, lone])]), "<u4"),
        "branch_of_edge": _packed(np.concatenate([branch_of_edge(skeleton), dots]), "<i4"),
        **_detail(skeleton, len(lone), centre, unit),
    }


def _detail(skeleton: Skeleton, n_lone: int, centre: np.ndarray, unit: float) -> dict[str, Any]:
    """Pieces of pruned branches, and the probabilities by which the view shows all pieces; that from which it does."""
    limbs = all_limbs(skeleton)
    chance = np.ones(len(limbs.vertices))
    for _, probability, path in pruning_order(limbs):
        chance[path[1:]] = probability
    of_edge, of_limb = chance[limbs.edges].min(axis=1), [limb.probability for limb in limbs.judged.values()]
    m, given, now = len(skeleton.vertices), len(skeleton.edges), [limb.changed for limb in limbs.judged.values()]
    most = max((p for p, pruned in zip(of_limb, now, strict=True) if pruned), default=0.0)
    least = min((p for p, pruned in zip(of_limb, now, strict=True) if not pruned), default=1.0)
    spheres = np.column_stack([(limbs.vertices - centre) / unit, np.nan_to_num(limbs.radii / unit)])
    return {
        "pruned": _packed(spheres[limbs.edges[given:]], "<f4"),
        "chance": _packed(np.concatenate([of_edge[:given], np.ones(n_lone), of_edge[given:]]), "<f4"),
        "chance_of_vertex": _packed(chance[:m], "<f4"),
        "limb": 0.5 if most < 0.5 <= least else (most + least) / 2,
    }


def _packed(array: np.ndarray, dtype: str) -> str:
    with np.errstate(over="ignore"):  # radii may be infinitely larger than the cloud
        return base64.b64encode(np.ascontiguousarray(array, dtype).tobytes()).decode()


# ------------------------------------------------------------ the parts, all by `markup`, which escapes every text


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


def section(heading: str, rows: Mapping[str, str]) -> Markup:
    """A section of names and texts."""
    return markup("<h2>{}</h2>{}", heading, _table((), list(rows.items()), "support"))


def origin(report: Report) -> Markup:
    """The run in a table, and what it takes to repeat it: the recipe, or else the stages."""
    text = json.dumps(report.recipe, indent=2, ensure_ascii=False) if report.recipe else "\n".join(report.stages)
    recipe = markup("<details><summary>Recipe</summary><pre>{}</pre></details>" if text else "", text)
    return markup('<h2>The run</h2><div class="run">{}</div>{}', report._repr_html_(), recipe)


def _table(heads: Iterable[str], rows: Sequence[Sequence[str]], kind: str = "", marks: Sequence[str] = ()) -> Markup:
    """A table of texts, nothing without rows; `marks` are attributes of the rows."""
    if not rows:
        return Markup()
    header = [markup("<th>{}</th>", head) for head in heads]
    body = [
        markup("<tr{}>{}</tr>", mark, [markup("<td>{}</td>", cell) for cell in row])
        for mark, row in zip_longest(marks, rows, fillvalue="")
    ]
    table = '<div class="wide {}"><table><thead><tr>{}</tr></thead><tbody>{}</tbody></table></div>'
    return markup(table, kind, header, body)
