"""Skeletons in files with one field unsound, or nearly none, and all that can be done with those that are read."""

from __future__ import annotations

import json
import math
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import glsk_o3d as glsk
from glsk_o3d import GlskError, Skeleton, SkeletonWarning, analysis, editing, samples
from glsk_o3d.analysis.support import with_support
from glsk_o3d.data.skeleton import ARRAYS
from glsk_o3d.io.formats.fields import FORMAT, FORMAT_VERSION, dumps
from glsk_o3d.io.skeletons import FORMATS

RARE = 0.1  # share of the cases in which what takes long is done
NUMBERS = (math.nan, math.inf, -math.inf, -1.0, -0.0, 0.0, 5e-324, 1e-160, 0.5, 1.5, 1e149, 1e155, 1e308)
WHOLE = (-(2**63), -2, -1, 0, 1, 10**6, 2**31, 2**63 - 1)
ODD = (None, True, "", "x" * 10_000, "nan", [], {}, [[]], {"a": 1}, 10**400, 0, -1, 1.5, [None], ["x"], [[1], [1, 2]])
Fields = dict[str, Any]


def unsound_case(rng: np.random.Generator, folder: Path) -> tuple[str, str, list[str]]:
    """Spoil a field of a skeleton, write and read it, and do all with it: its kind, what came of it, and findings."""
    names = [*seeds()]
    name = names[rng.integers(len(names))]
    fields = {field: np.copy(value) if field in ARRAYS else value for field, value in seeds()[name].items()}
    field = [*ARRAYS, "report"][rng.integers(len(ARRAYS) + 1)]
    if rng.random() > 0.05:
        (_spoil_report if field == "report" else _spoil)(fields, field, rng)
    path = folder / f"u{rng.choice(['.json', '.npz'])}"
    _write(fields, path)
    kind = f"{path.suffix[1:]} {field}"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", SkeletonWarning)
        warnings.simplefilter("ignore", DeprecationWarning)  # of libraries
        try:
            skeleton = glsk.read_skeleton(path)
        except GlskError as error:
            return kind, "refused", _told_badly(error, path, field)
        finally:
            path.unlink()
        return kind, "read", [*used(skeleton, folder, (*USES, *(SLOW if rng.random() < RARE else ())))]


def _told_badly(error: GlskError, *words: object) -> list[str]:
    missing = [str(word) for word in words if str(word) not in str(error)]
    long = [f"an error of {len(str(error))} characters"] if len(str(error)) > 1000 else []
    return long + [f"an error that does not name {word}: {str(error)[:200]}" for word in missing]


def used(skeleton: Skeleton, folder: Path, uses: Iterable[Callable[[Skeleton, Path], object]]) -> Iterator[str]:
    """All that is public: what is wrong with its errors, and those that are none of the package's."""
    for use in uses:
        try:
            use(skeleton, folder)
        except GlskError as error:
            yield from _told_badly(error)
        except Exception as error:
            frames = [it for it in traceback.extract_tb(error.__traceback__) if "glsk_o3d" in it.filename]
            place = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "here"
            yield f"{type(error).__name__} at {place}: {str(error)[:200]}"


# ------------------------------------------------------------------------------------------------------------- damages


def _spoil(fields: Fields, name: str, rng: np.random.Generator) -> None:
    """Make one array wrong, or only unusual."""
    array = fields[name]
    rows = len(array)
    damages: dict[str, Callable[[], Any]] = {
        "missing": lambda: fields.pop(name),
        "odd": lambda: ODD[rng.integers(len(ODD))],
        "empty": lambda: array[:0],
        "shorter": lambda: array[: rng.integers(rows + 1)],
        "longer": lambda: np.concatenate([array, array[: rng.integers(rows + 1)]]),
        "flat": lambda: array.ravel(),
        "deep": lambda: array[None],
        "narrow": lambda: array[..., :-1],
        "turned": lambda: array.T,
        "words": lambda: array.astype(str),
        "type": lambda: array.astype(rng.choice(["f4", "f8", "i1", "i8", "u1", "u8", "?", "c16", ">f8", ">i4"])),
        "objects": lambda: array.astype(object),
        "shuffled": lambda: rng.permutation(array),
        "same": lambda: np.broadcast_to(array[:1], array.shape),
        "small": lambda: array * 5e-324 if array.dtype == float else array * 0,
        "large": lambda: array * 1e150 if array.dtype == float else array * 2**40,
        "all": lambda: np.full_like(array, rng.choice(NUMBERS if array.dtype == float else WHOLE)),
    }
    if name == "edges":
        damages |= {
            "repeated": lambda: np.concatenate([array, array[:1]]),
            "turned round": lambda: array[:, ::-1],
            "loop": lambda: np.concatenate([array, array[:1, [0, 0]]]),
        }
    chosen = [*damages, *["number"] * 12][rng.integers(len(damages) + 12)]
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if chosen != "number" or not array.size:
            spoilt = damages.get(chosen, damages["odd"])()
        else:
            spoilt = array.copy()
            few = rng.integers(array.size, size=rng.choice([1, 1, 2, 20]))
            spoilt.flat[few] = rng.choice(NUMBERS if array.dtype == float else WHOLE)
    if chosen != "missing":
        fields[name] = spoilt


def _spoil_report(fields: Fields, name: str, rng: np.random.Generator) -> None:
    """Make one entry of a report, or of what is in it, wrong."""
    at = report = json.loads(json.dumps(fields[name]))
    while True:
        keys = [*at] if isinstance(at, dict) else range(len(at))
        key = keys[rng.integers(len(keys))]
        if isinstance(at[key], dict | list) and at[key] and rng.random() < 0.7:
            at = at[key]
            continue
        at[key] = [*ODD, *NUMBERS][rng.integers(len(ODD) + len(NUMBERS))]
        fields[name] = report
        return


def _write(fields: Fields, path: Path) -> None:
    fields = {"format": FORMAT, "format_version": FORMAT_VERSION, **fields}
    if path.suffix == ".json":
        path.write_text(_json(fields))
        return
    stream = BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        np.savez(
            stream,
            **{name: _array(value) for name, value in fields.items() if name != "report"},
            report=_json(fields["report"]),
        )
    path.write_bytes(stream.getvalue())


def _array(value: Any) -> np.ndarray:
    try:
        return np.asarray(value)
    except ValueError:
        return np.asarray(value, object)


def _json(value: Any) -> str:
    """Strict JSON where that holds it."""
    try:
        return dumps(value)
    except (TypeError, ValueError):
        return json.dumps(value, default=lambda it: str(it) if isinstance(it, complex) else it.tolist())


# --------------------------------------------------------------------------------------------------------------- seeds


@cache
def seeds() -> dict[str, Fields]:
    """Sound skeletons as the fields that files hold, the degenerate ones too."""
    ring, fork = (glsk.skeletonize(make(300).points) for make in (samples.torus, samples.y_junction))
    tree = glsk.pipelines.tree()(samples.y_junction(300).points)
    line = np.arange(3.0)[:, None] * [1, 0, 0]
    found = {
        "ring": ring,
        "fork": fork,
        "tree": tree,
        "without a cloud": Skeleton(fork.vertices, fork.edges, fork.radii, (), (), ()),
        "without radii": Skeleton(fork.vertices, fork.edges, (), fork.vertex_of_point, fork.points, ()),
        "without edges": Skeleton(ring.vertices, (), ring.radii, ring.vertex_of_point, ring.points, ring.normals),
        "dot": Skeleton([[1, 2, 3]], (), [1], [0, -1], [[1, 2, 4], [math.nan] * 3], ()),
        "nothing": Skeleton((), (), (), (), (), ()),
        "a cloud alone": Skeleton((), (), (), (), ring.points, ring.normals),
        "dropped": Skeleton(line, [[0, 1], [1, 2]], [1, 0, 2], [-1] * 4, np.full((4, 3), math.nan), ()),
        "in one place": Skeleton(0 * line, [[0, 1], [1, 2], [0, 2]], [0, 0, 0], [0, 1, 2], 0 * line, ()),
    }
    return {
        name: {**{field: getattr(it, field) for field in ARRAYS}, "report": json.loads(dumps(it.report.to_dict()))}
        for name, it in found.items()
    }


# ---------------------------------------------------------------------------------------------------------------- uses


def _saved(ending: str) -> Callable[[Skeleton, Path], None]:
    def save(skeleton: Skeleton, folder: Path) -> None:
        path = folder / f"s{ending}"
        glsk.save_skeleton(skeleton, path, cut_loops=True)
        if FORMATS[ending].read is not None:
            again = glsk.read_skeleton(path)
            if ending in (".json", ".npz"):
                for name in ARRAYS:
                    np.testing.assert_array_equal(getattr(again, name), getattr(skeleton, name))

    return save


def _page(skeleton: Skeleton, folder: Path) -> None:
    glsk.save_report(skeleton, folder / "page.html")


def _grasps(skeleton: Skeleton, folder: Path) -> None:
    size = float(np.ptp(skeleton.vertices, axis=0).max(initial=0)) if len(skeleton.vertices) else 1.0
    found = analysis.grasp_candidates(skeleton, size or 1.0, min_confidence=0)
    found.to_csv(folder / "grasps.csv")


USES: tuple[Callable[[Skeleton, Path], object], ...] = (
    *map(_saved, FORMATS),
    lambda it, _: repr((it, it.length, it.leaves, it.junctions, it.branches, it.n_loops, it.supporting_points)),
    lambda it, _: it.to_networkx(),
    lambda it, _: it.to_line_set(),
    *(
        lambda it, _, color=color: glsk.to_line_set(it, color)
        for color in ("branch", "order", "radius", "confidence", "support")
    ),
    lambda it, _: glsk.to_tubes(it),
    lambda it, _: glsk.to_tubes(it, radius=0.1),
    lambda it, _: glsk.to_pymeshlab(it),
    lambda it, _: glsk.annotate(it, color="branch"),
    lambda it, _: glsk.annotate(it, np.random.default_rng(0).normal(size=(20, 3)), color="radius"),
    lambda it, folder: (str(table := analysis.branch_table(it)), table.to_csv(folder / "t.csv")),
    *(lambda it, _, root=root: analysis.branch_table(it, root) for root in ("z", "thickest", 0, (0, 0, 0))),
    lambda it, _: analysis.segment(it),
    lambda it, _: analysis.segment(it, np.eye(3)),
    lambda it, _: analysis.tree_measures(it),
    lambda it, folder: analysis.cylinders(it).to_csv(folder / "c.csv"),
    lambda it, _: analysis.assess(it, it.points),
    lambda it, _: analysis.assess(it, samples.torus(100).points),
    lambda it, _: analysis.compare(it, samples.torus(100)),
    lambda it, _: analysis.compare(it, analysis.Truth(it.vertices, it.edges, it.radii)),
    _grasps,
    lambda it, _: editing.prune(it, length=0.1),
    lambda it, _: editing.largest_component(it),
    lambda it, _: editing.cut_loops(it),
    lambda it, _: editing.simplify(it, tolerance=0.1),
    lambda it, _: editing.reroot(it),
    lambda it, _: editing.reroot(editing.cut_loops(it)[0], "thickest"),
    lambda it, _: (it.report.uncertain, it.report.unsupported, it.report.is_sampled, it.report.to_dict()),
)
"""What is public and fast."""
SLOW: tuple[Callable[[Skeleton, Path], object], ...] = (
    _page,
    lambda it, folder: glsk.save_preview(it, folder / "p.png"),
    lambda it, _: plt.close(glsk.plot_skeleton(it, color="radius").figure),
    lambda it, folder: glsk.save_rig(it, folder / "r.glb", cut_loops=True),
    lambda it, _: with_support(it, glsk.pipelines.default(), draws=2, seed=0),
)
"""What takes long."""
