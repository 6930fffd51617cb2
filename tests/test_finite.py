"""Nothing between two filters, or two steps of the Refiner, holds a number that is not finite, whatever the cloud."""

from itertools import product

import numpy as np
import pytest

from glsk_o3d import InvalidCloudError, Skeleton, Tracer, pipelines, samples
from glsk_o3d.filters import refiner
from glsk_o3d.pipeline import RunContext

pytestmark = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
UNKNOWN = {"normals": "points without one", "support": "not measured", "points": "checked where they come in"}
STEPS = ("fit_axis", "regrow_ends", "move_junctions", "level_wide_ends", "subdivide_edges", "pull_back_detached")

BEFORE_A_FIT = ("Connector", "pull_back_detached", "subdivide_edges")
"""What gives skeletons whose confidence is not measured yet."""


def lines(n, ways):
    return np.concatenate([np.linspace(0, 1, n)[:, None] * way for way in ways])


def grid(*sizes):
    return np.stack(np.meshgrid(*map(np.arange, sizes)), axis=-1).reshape(-1, 3).astype(float)


def clouds():
    """Shapes without thickness, on grids, in clumps, and few points of ordinary ones."""
    rng = np.random.default_rng(0)
    turn = np.linspace(0, 2 * np.pi, 80, endpoint=False)
    yield "line", lines(60, [(1.0, 2, 3)])
    yield "star", lines(30, rng.normal(size=(6, 3)))
    yield "circle", np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    yield "plane", grid(12, 12, 1)
    yield "block", grid(6, 6, 6)
    yield "clumps", np.concatenate([1000 * rng.normal(size=3) + 1e-3 * rng.normal(size=(40, 3)) for _ in range(4)])
    yield "ball", rng.normal(size=(60, 3))
    yield "dust", rng.normal(size=(12, 3))
    for name in ("two_rings", "torus", "y_junction", "sheet", "tree"):
        yield name, getattr(samples, name)(120).points


def spoilt(points, how, rng):
    size = np.ptp(points, axis=0).max()
    return {
        "as they are": points,
        "copies": np.concatenate([points + 1e-10 * size * rng.normal(size=points.shape) for _ in range(5)]),
        "flat": points * [1, 1, 0],
        "on a grid": np.rint(points / size * 12),
        "far ones": np.concatenate([points, points[:1] + 1e3 * size * rng.normal(size=(3, 3))]),
        "twice, once small": np.concatenate([points, 1e-3 * points[:, [1, 2, 0]]]),
        "tiny": 1e-30 * points,
    }[how]


def check_finite(what, where):
    for name, value in vars(what).items():
        if isinstance(value, np.ndarray) and value.dtype.kind == "f" and name not in UNKNOWN:
            if name == "confidence" and where in BEFORE_A_FIT:
                continue
            assert np.isfinite(value).all(), f"{name} after {where}"


def run(cloud, stages):
    data = cloud
    try:
        for stage in stages:
            data = stage.run(data, RunContext())
            check_finite(data, type(stage).__name__)
    except InvalidCloudError:  # of too few places
        return None
    return data


@pytest.fixture
def watched(monkeypatch):
    """Every step of the Refiner is looked at, and nothing divides by zero or overflows on the way."""

    def looked_at(name, step):
        def look(*given, **options):
            result = step(*given, **options)
            skeleton, decisions = result if isinstance(result, tuple) else (result, [])
            check_finite(skeleton, name)
            assert np.isfinite([(each.probability, *each.place) for each in decisions]).all(), name
            return result

        return look

    for name in STEPS:
        monkeypatch.setattr(refiner, name, looked_at(name, getattr(refiner, name)))
    monkeypatch.setattr(refiner, "ask", looked_at("ask", refiner.ask))
    with np.errstate(divide="raise", over="raise", invalid="raise"):
        yield


HOW = ("as they are", "copies", "flat", "on a grid", "far ones", "twice, once small", "tiny")


@pytest.mark.parametrize("how", HOW)
def test_numbers_of_degenerate_clouds_are_finite(watched, how):
    done = 0
    for (name, points), pipeline in product(clouds(), (pipelines.default(), pipelines.tree())):
        cloud = spoilt(points, how, np.random.default_rng(len(name)))
        skeleton = run(cloud, pipeline.stages)
        done += isinstance(skeleton, Skeleton)
        if skeleton is not None:
            assert (skeleton.radii >= 0).all()
            check_finite(Tracer(root="z").run(skeleton, RunContext()), "Tracer")
    assert done >= 18
