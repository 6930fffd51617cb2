"""A run as one page for the browser: it holds all it needs, and asks no network for anything."""

import base64
import hashlib
import json
import os
import re
from datetime import datetime, timezone
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np

from ..analysis.segmentation import branch_of_edge, branch_of_point, branch_of_vertex
from ..analysis.summary import point_count
from ..errors import InvalidParameterError
from ..interop.atomic import check_ending, write_atomically
from ..interop.packages import require
from ..skeleton import Skeleton
from ..state import Contraction
from . import html as sections
from .figures import MOST_DRAWN_POINTS, thinned

FLAT_SIDE = 0.85  # a box whose least side is less than this share of the next is flat
_STORED_RANGE = 1.25  # half diagonals that positions are stored as shares of: contracted points may leave the box a bit


class ContractionRecorder:
    """Record the points of a cloud after each solve: pass it as ``on_state``.

    At most `most_points` points are followed, so a record stays small. A merged point has the place of the one it was
    merged into. A second run starts a new record.

    Parameters
    ----------
    most_points : int

    Attributes
    ----------
    shown : (K,) int array
        The input points that are followed, ascending; empty before the first solve.
    positions : list of (K, 3) float64 array
        The input, and then the contracted points after each solve, in the cloud's units.

    Examples
    --------
    >>> from glsk_o3d import Contractor, RingBuilder
    >>> from glsk_o3d.samples import torus
    >>> recorder = ContractionRecorder()
    >>> contracted = (RingBuilder() | Contractor(max_iterations=2))(torus(300).points, on_state=recorder)
    >>> len(recorder.positions), recorder.positions[2].shape
    (3, (300, 3))
    """

    def __init__(self, most_points: int = MOST_DRAWN_POINTS):
        self.most_points = most_points
        self.shown = np.empty(0, int)
        self.positions: list[np.ndarray] = []

    def __call__(self, state: Contraction) -> None:
        if len(state.report.iterations) == 1:
            self.shown = thinned(state.points, self.most_points)
            self.positions = [state.points[self.shown]]
        self.positions.append(state.contracted[state.survivor_of_point[self.shown]])


def save_report(
    skeleton: Skeleton,
    path: str | os.PathLike,
    *,
    recorder: ContractionRecorder | None = None,
    title: str = "Curve skeleton",
) -> None:
    """Write a page that shows a skeleton and the run that made it.

    The page is one HTML file that works offline in any browser with WebGL 2: cloud, skeleton and radius tubes to turn
    and zoom, the contraction on a slider, the run's numbers and charts, warnings, recipe and versions. Without WebGL or
    scripts there is a still picture. Of larger clouds 20 000 points are shown, drawn at random.

    Parameters
    ----------
    skeleton : Skeleton
    path : path-like
        HTML; it appears complete or not at all.
    recorder : ContractionRecorder, optional
        The ``on_state`` of the run that made the skeleton. Without it there is no slider.
    title : str
        Shown literally.

    Raises
    ------
    InvalidParameterError
        The recorder watched another run.
    FileFormatError, OSError
        The ending is neither ``.html`` nor ``.htm``, or the file cannot be written.

    Examples
    --------
    >>> import glsk_o3d as glsk
    >>> from glsk_o3d.samples import torus
    >>> recorder = glsk.ContractionRecorder()
    >>> skeleton = glsk.skeletonize(torus(600).points, on_state=recorder)
    >>> glsk.save_report(skeleton, "report.html", recorder=recorder, title="A torus")  # doctest: +SKIP
    """
    check_ending(path, "report is a page", ".html", ".htm")
    page = _page(skeleton, recorder, title).encode("utf-8", "replace")  # a file name may be no Unicode
    write_atomically(path, lambda temporary: temporary.write_bytes(page))


def _page(skeleton, recorder, title) -> str:
    shown, positions = _followed(skeleton, recorder)
    finite = np.isfinite(skeleton.points).all(axis=1).sum()
    assets = files(__package__) / "assets"
    html, css, script = ((assets / f"report.{ending}").read_text("utf-8") for ending in ("html", "css", "js"))
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    report, kind = skeleton.report, "Curve skeleton" if len(skeleton.vertices) else "Point cloud"
    now = datetime.now(timezone.utc).strftime("%d %B %Y, %H:%M UTC")
    thinning = f"The view shows {len(shown):,} of {finite:,} points, drawn at random."
    below = (
        sections.contraction(report),
        sections.topology(report),
        sections.support(report),
        sections.branches(skeleton),
        sections.origin(report),
    )
    parts = {
        "title": escape(title),
        "subtitle": escape(f"{kind} · glsk-o3d {report.versions.get('glsk-o3d', '')} · {now}"),
        "policy": f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'",
        "style": css,
        "figures": sections.figures(skeleton),
        "warnings": sections.warnings(report.warnings),
        "still": sections.picture(skeleton),
        "thinning": thinning if len(shown) < finite else "",
        "sections": "".join(below),
        # no "<" in it, so that nothing in it can end the script element
        "data": json.dumps(_data(skeleton, shown, positions), allow_nan=False).replace("<", "\\u003c"),
        "script": script,
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda place: parts[place[1]], html)


def _followed(skeleton, recorder) -> tuple[np.ndarray, list[np.ndarray]]:
    """The points to show, and where they are: at first, and after each solve."""
    if recorder is None or not recorder.positions:
        shown = thinned(skeleton.points, MOST_DRAWN_POINTS)
        return shown, [skeleton.points[shown]]
    shown, positions = recorder.shown, recorder.positions
    same = len(positions) == len(skeleton.report.iterations) + 1 and shown.max(initial=-1) < len(skeleton.points)
    if not same or not np.array_equal(skeleton.points[shown], positions[0]):
        raise InvalidParameterError("the recorder watched another run than the one that made this skeleton")
    return shown, positions


def _data(skeleton, shown, positions) -> dict[str, Any]:
    viridis, to_hex = require("matplotlib").colormaps["viridis"], require("matplotlib.colors").to_hex
    box = np.concatenate([positions[0], skeleton.vertices])
    low, high = (box.min(axis=0), box.max(axis=0)) if len(box) else np.zeros((2, 3))
    centre = low + (high - low) / 2
    unit = _STORED_RANGE * float(np.linalg.norm(high - low)) / 2 or 1.0
    steps = np.clip([(state - centre) / unit for state in positions], -1, 1)
    ranges: dict[str, list[float] | None] = {"branch": None}
    for name, values in (("radius", skeleton.radii / unit), ("confidence", skeleton.confidence)):
        finite = values[np.isfinite(values)]
        if len(finite) == len(values) > 0 or (name == "confidence" and len(finite)):
            ranges[name] = [float(finite.min()), float(finite.max())]
    thin, middle, _ = np.sort(high - low)
    across = int(np.argmin(high - low)) if thin < FLAT_SIDE * middle else 2 if np.argmax(high - low) == 1 else 1
    lone = np.flatnonzero(skeleton.degree == 0)  # drawn as edges without a length
    vertex = skeleton.vertex_of_point[shown] if len(skeleton.vertices) else np.full(len(shown), -1)
    label = branch_of_point(skeleton, skeleton.points[shown], vertex) if len(skeleton.vertices) else vertex
    dots = len(skeleton.branches) + np.arange(len(lone))
    captions, n = [f"Input: {point_count(skeleton):,} points"], len(positions) - 1
    for it in skeleton.report.iterations[:n]:
        captions.append(f"After solve {it.iteration} of {n}: {it.n_points - it.n_merged:,} points left")
    return {
        "captions": captions,
        "view": ("yz", "xz", "xy")[across],  # what is flat from its broad side; else z is up, or y if that is longest
        "unit": unit,
        "palette": sections.branch_colors(skeleton, len(skeleton.branches) + len(lone)),
        "ramp": list(map(to_hex, viridis(np.linspace(0, 1, 24)))),
        "ranges": ranges,
        "positions": _packed(np.rint(32767 * steps), "<i2"),
        "vertex_of_point": _packed(vertex, "<i4"),
        "branch_of_point": _packed(label, "<i4"),
        "vertices": _packed((skeleton.vertices - centre) / unit, "<f4"),
        "radii": _packed(np.nan_to_num(skeleton.radii / unit, nan=0.0), "<f4"),
        "confidence": _packed(skeleton.confidence, "<f4"),
        "branch_of_vertex": _packed(branch_of_vertex(skeleton), "<i4"),
        "edges": _packed(np.concatenate([skeleton.edges, np.column_stack([lone, lone])]), "<u4"),
        "branch_of_edge": _packed(np.concatenate([branch_of_edge(skeleton), dots]), "<i4"),
    }


def _packed(array, dtype) -> str:
    with np.errstate(over="ignore"):  # radii may be infinitely larger than the cloud
        return base64.b64encode(np.ascontiguousarray(array, dtype).tobytes()).decode()
