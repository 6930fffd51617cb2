"""A run as one page for the browser: it holds all it needs, and asks no network for anything."""

import json
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timezone
from importlib.resources import files
from typing import Any

import numpy as np

from ..analysis.forestry import TreeMeasures, measures_of_grown
from ..analysis.summary import ITERATION_COLUMNS, iteration_rows
from ..curve.detail import with_limbs
from ..data.decisions import coordinates
from ..data.report import Markup, Report, markup
from ..data.skeleton import Skeleton
from ..geometry.vectors import box
from ..interop.atomic import check_ending, write_atomically
from ..interop.packages import require
from ..io.colors import shades
from ..io.geometry import to_tubes
from .figures import MOST_DRAWN_POINTS, counts, thinned

MOST_LISTED_ROWS = 12  # of a table
MOST_SLIDING = 1000  # vertices of a skeleton with a slider, which holds ten of them
LIMB_STEPS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)  # of the slider
EYE = dict(x=0.9, y=-1.5, z=0.7)  # fitted to the eye: in front, somewhat to the right and above
HOVER = (
    "vertex %{customdata[0]} · branch %{customdata[1]} · radius %{customdata[2]:.4g} · confidence %{customdata[3]:.2f}"
    "<extra></extra>"
)
WITH_TRACED = "Traced parts have no surface: with them, length is that of paths through points, and volume an estimate."


def save_report(
    skeleton: Skeleton,
    path: str | os.PathLike[str],
    *,
    title: str = "Curve skeleton",
    facts: Mapping[str, Mapping[str, str]] | None = None,
    unit: float = 1.0,
    up: str | None = None,
) -> None:
    """Write a page that shows a skeleton and the run that made it.

    The page is one HTML file of 5 MB that works offline in any browser with WebGL: cloud, skeleton and radius tubes to
    turn and zoom by plotly, which comes with Open3D, with a slider for limbs; the run's numbers, warnings, recipe and
    versions; of a tree that was grown from a root, its measures. Of larger clouds 20 000 points are shown, drawn at
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
    unit, up : float, str, optional
        One unit of the cloud in metres, and the axis that points up, for the measures of a tree; see `tree_measures`.

    Raises
    ------
    FileFormatError, MissingPackageError, OSError
        The ending is neither ``.html`` nor ``.htm``, matplotlib is not installed, or the file cannot be written.

    Examples
    --------
    >>> import glsk_o3d as glsk
    >>> from glsk_o3d.samples import torus
    >>> glsk.save_report(glsk.skeletonize(torus(600).points), "report.html", title="A torus")  # doctest: +SKIP
    """
    check_ending(path, "report is a page", ".html", ".htm")
    page = _page(skeleton.whole, title, facts or {}, measures_of_grown(skeleton, unit, up)).encode(
        "utf-8", "replace"
    )  # a file name may be no Unicode
    write_atomically(path, lambda temporary: temporary.write_bytes(page))


def _page(skeleton: Skeleton, title: str, facts: Mapping[str, Mapping[str, str]], measures: TreeMeasures | None) -> str:
    shown = thinned(skeleton.points, MOST_DRAWN_POINTS)
    finite = np.isfinite(skeleton.points).all(axis=1).sum()
    report, kind = skeleton.report, "Curve skeleton" if len(skeleton.vertices) else "Point cloud"
    reasons = skeleton.reasons if len(skeleton.vertices) else report.reasons  # a cloud has no verdict
    date = datetime.now(timezone.utc).strftime("%d %B %Y, %H:%M UTC")
    more = [_section(heading, _table((), list(rows.items()))) for heading, rows in facts.items()]
    assets = files(__package__) / "assets"
    return markup(
        (assets / "report.html").read_text("utf-8"),
        title=title,
        subtitle=f"{kind} · glsk-o3d {report.versions.get('glsk-o3d', '')} · {date}",
        style=Markup((assets / "report.css").read_text("utf-8")),
        counts=[
            markup("<div><dt>{}</dt><dd>{}</dd></div>", *item)
            for item in {**counts(skeleton), **verdict(skeleton)}.items()
        ],
        warnings=warnings([*map(str, reasons), *(measures.doubts if measures else ())]),
        view=Markup(_view(skeleton, skeleton.points[shown])),
        thinning=f"The view shows {len(shown):,} of {finite:,} points." if len(shown) < finite else "",
        sections=[*more, tree(measures), contraction(report), topology(report), support(report), origin(report)],
    )


# ------------------------------------------------------------------------------------------------------------ the view


def _view(skeleton: Skeleton, points: np.ndarray) -> str:
    """Cloud, skeleton and tubes, with plotly itself, as HTML without any text of a file."""
    graph_objects = require("plotly.graph_objects")
    axis = dict(visible=False, showspikes=False)
    scene = dict(xaxis=axis, yaxis=axis, zaxis=axis, aspectmode="data", camera_eye=EYE)
    paper = dict(paper_bgcolor="rgba(0,0,0,0)", margin=dict(l=0, r=0, t=0, b=0), font_color="#808890")
    layout = dict(scene=scene, legend_x=0, sliders=sliders(skeleton, points), **paper)
    figure = graph_objects.Figure(traces(skeleton, points), layout)
    return figure.to_html(full_html=False, include_mathjax=False, config=dict(displaylogo=False), div_id="view")


def traces(skeleton: Skeleton, points: np.ndarray) -> list[Any]:
    """What the view can show, as traces of plotly; its unit is half the diagonal, for float32."""
    graph_objects, frame = require("plotly.graph_objects"), _frame(skeleton, points)
    style = dict(mode="markers", marker=dict(size=1.2, color="#9aa1a8", opacity=0.5), hoverinfo="skip")
    shown = [graph_objects.Scatter3d(**_scaled(points, *frame), name="cloud", **style)] if len(points) else []
    if len(skeleton.vertices):
        places, styles = _curves(skeleton)
        shown += [graph_objects.Scatter3d(**_scaled(places, *frame), **style) for style in styles]
    if len(skeleton.vertices) and np.isfinite(skeleton.radii).all():
        mesh = to_tubes(skeleton, "branch", sides=8)
        corners = dict(zip("ijk", np.asarray(mesh.triangles).T, strict=True))
        style = dict(vertexcolor=_css(np.asarray(mesh.vertex_colors)), visible="legendonly", hoverinfo="skip")
        vertices = _scaled(np.asarray(mesh.vertices), *frame)
        shown.append(graph_objects.Mesh3d(**vertices, **corners, name="radius tubes", showlegend=True, **style))
    return shown


def sliders(skeleton: Skeleton, points: np.ndarray) -> list[dict[str, Any]]:
    """The slider of plotly that shows limbs from another probability on; none if that makes no difference."""
    steps, frame, seen = [], _frame(skeleton, points), set[int]()
    for least in LIMB_STEPS if len(skeleton.vertices) <= MOST_SLIDING else ():
        other = with_limbs(skeleton, least)
        places, (style, *_) = _curves(other)
        curve = {name: [values] for name, values in _scaled(places, *frame).items()}
        curve |= {"line.color": [style["line"]["color"]], "marker.color": [style["marker"]["color"]]}
        curve["customdata"] = [style["customdata"]]
        steps.append(dict(label=f"{least:.1f}", method="restyle", args=[curve, [int(len(points) > 0)]]))
        seen.add(len(other.vertices))
    current = dict(prefix="limbs from a probability of ")
    return (
        [dict(steps=steps, active=LIMB_STEPS.index(0.5), currentvalue=current, pad=dict(l=20, r=20, b=30))]
        if len(seen) > 1
        else []
    )


def _frame(skeleton: Skeleton, points: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre and half the diagonal of all that is drawn."""
    drawn = np.concatenate([points, skeleton.vertices])
    low, high = box(drawn) if len(drawn) else np.zeros((2, 3))
    return low + (high - low) / 2, float(np.linalg.norm(high - low)) / 2 or 1.0


def _scaled(places: np.ndarray, centre: np.ndarray, unit: float) -> dict[str, np.ndarray]:
    return dict(zip("xyz", ((places - centre) / unit).T, strict=True))


def _curves(skeleton: Skeleton) -> tuple[np.ndarray, list[dict[str, Any]]]:
    """Places along the edges, NaN between them, and how they are drawn: once for each quantity that has colours."""
    detached = np.flatnonzero(skeleton.degree == 0)  # drawn as edges without a length
    edges = np.concatenate([skeleton.edges, np.column_stack([detached, detached])])
    branch = np.concatenate([skeleton.branch_of_edge, len(skeleton.branches) + np.arange(len(detached))])
    vertex = np.column_stack([edges, edges[:, 1]]).ravel()
    places = skeleton.vertices[vertex]
    places[2::3] = np.nan
    facts = np.column_stack([vertex, branch.repeat(3), skeleton.radii[vertex], skeleton.confidence[vertex]])
    is_known = {"radius": np.isfinite(skeleton.radii).all(), "confidence": np.isfinite(skeleton.confidence).any()}
    styles = []
    for quantity in ("branch", *(name for name, known in is_known.items() if known)):
        color = _css(shades(skeleton, quantity, branch, edges).repeat(3, axis=0))  # type: ignore[arg-type]
        style = dict(line=dict(color=color, width=4), marker=dict(color=color, size=2), mode="lines+markers")
        visible = True if quantity == "branch" else "legendonly"
        styles.append(
            dict(name=f"skeleton by {quantity}", visible=visible, customdata=facts, hovertemplate=HOVER) | style
        )
    return places, styles


def _css(colors: np.ndarray) -> list[str]:
    return list(map(require("matplotlib.colors").to_hex, colors))


# ------------------------------------------------------------ the parts, all by `markup`, which escapes every text


def verdict(skeleton: Skeleton) -> dict[str, str]:
    """Whether to rely on the skeleton, with its score."""
    score = "" if np.isnan(skeleton.score) else f", {skeleton.score:.2f}"
    return {"verdict": f"{skeleton.verdict.value}{score}"} if len(skeleton.vertices) else {}


def warnings(messages: Iterable[str]) -> Markup:
    """The warnings, each once."""
    rows = [markup("<li>{}</li>", text) for text in dict.fromkeys(messages)]
    return markup('<div class="warnings" role="note"><strong>Warnings</strong><ul>{}</ul></div>' if rows else "", rows)


def tree(measures: TreeMeasures | None) -> Markup:
    """The measures of a tree, the taper of its stem, and its wood by diameter; nothing without."""
    if measures is None:
        return Markup()
    sums = [(name, value) for name, value in measures.sums().items() if isinstance(value, float) and name != "unit"]
    tables = [_table(("measure", "value"), [(name.replace("_", " "), _number(value)) for name, value in sums])]
    for heading, rows in {"Taper": measures.taper, "Diameter classes": measures.classes}.items():
        heads = [name.replace("_", " ") for name in (rows[0] if rows else ())]
        tables.append(_section(heading, _table(heads, [[*map(_number, row.values())] for row in rows])))
    units = f"In metres, square and cubic metres; the arc is in degrees. One unit of the cloud is {measures.unit:g} m. "
    return _section("Tree", Markup("".join(tables)), f"{units}{WITH_TRACED}")


def _number(value: float) -> str:
    return f"{value:.4g}".replace("nan", "not known")


def contraction(report: Report) -> Markup:
    """Why the contraction stopped, and how it went, solve by solve."""
    if not report.stages and not report.iterations:
        return Markup()
    end = f"{'Converged' if report.converged else 'Not converged'}: {report.stop_reason}."
    return _section("Contraction", _table(ITERATION_COLUMNS, iteration_rows(report.iterations)), end)


def topology(report: Report) -> Markup:
    """What was closed, cut and bridged, and the close calls: the least certain first."""
    if not report.decisions:
        return Markup()
    outcomes = Counter(decision.outcome for decision in report.decisions)
    sums = ", ".join(f"{outcome}: {n:,}" for outcome, n in sorted(outcomes.items()))
    listed = [decision for decision in report.decisions if decision.changed or decision.is_uncertain]
    listed.sort(key=lambda decision: abs(decision.probability - 0.5))
    rows = [(call.outcome, call.question, f"{call.probability:.2f}") for call in listed[:MOST_LISTED_ROWS]]
    hidden = len(listed) - len(rows)
    rows += [(f"and {hidden:,} clearer ones", "", "")] * (hidden > 0)
    summary = f"{sums}; {len(report.uncertain):,} of {len(report.decisions):,} close calls."
    return _section("Topology", _table(("done", "question", "probability"), rows), summary)


def support(report: Report) -> Markup:
    """How many samples have the same graph, and what many of them do not show: the most doubtful first."""
    if not report.n_draws:
        return Markup()
    rows = [
        (f"{part.about} at ({coordinates(part.place)})", "yes" if part.present else "no", f"{part.share:.0%}")
        for part in report.unsupported[:MOST_LISTED_ROWS]
    ]
    share = f"{report.n_agreeing:,} of {report.n_draws:,} samples of the cloud have the same graph."
    return _section("Support", _table(("part", "in the skeleton", "samples"), rows), share)


def origin(report: Report) -> Markup:
    """The run in a table, and what it takes to repeat it: the recipe, or else the stages."""
    text = json.dumps(report.recipe, indent=2, ensure_ascii=False) if report.recipe else "\n".join(report.stages)
    recipe = markup("<details><summary>Recipe</summary><pre>{}</pre></details>" if text else "", text)
    return _section("The run", markup('<div class="run">{}</div>{}', report._repr_html_(), recipe))


def _section(heading: str, content: Markup, sentence: str = "") -> Markup:
    return markup("<h2>{}</h2><p>{}</p>{}", heading, sentence, content)


def _table(heads: Iterable[str], rows: Sequence[Sequence[str]]) -> Markup:
    """A table of texts, nothing without rows."""
    header = [markup("<th>{}</th>", head) for head in heads]
    body = [markup("<tr>{}</tr>", [markup("<td>{}</td>", cell) for cell in row]) for row in rows]
    table = '<div class="wide"><table><thead><tr>{}</tr></thead><tbody>{}</tbody></table></div>'
    return markup(table if rows else "", header, body)
