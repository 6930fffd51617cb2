"""The working curve: what was computed of it is kept where it stays right, and points come back to their vertices."""

from dataclasses import fields, replace

import numpy as np
import pytest

from glsk_o3d import Connector, Contractor, Refiner, pipelines, samples
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.surface import Surface
from glsk_o3d.data.derived import Derived


@pytest.fixture(scope="module")
def raw():
    """A graph of which a part of the points speaks for the others."""
    return (pipelines.rings() | Contractor() | Connector())(samples.y_junction(n=6000).points)


def arrays(value):
    """All numbers in a derived value, by name."""
    if isinstance(value, np.ndarray | float):
        return {"": np.asarray(value)}
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        return {str(i): each for i, each in enumerate(value)}
    names = (name for name in dir(value) if not name.startswith("_"))
    return {name: each for name in names if isinstance(each := getattr(value, name), np.ndarray)}


def derived_of(cls):
    return [name for name in dir(cls) if isinstance(getattr(cls, name), Derived)]


def others(thing):
    """Every field with another value that is possible."""
    rng = np.random.default_rng(0)
    for field in fields(thing):
        value = getattr(thing, field.name)
        if not isinstance(value, np.ndarray):
            continue
        if field.name == "edges":
            yield field.name, value[::2]
        elif field.name == "representative_of_point":
            yield field.name, np.where(np.arange(len(value)) % 3 == 0, -1, value)
        elif field.name in ("normals", "neighbours", "supporting", "vertex_of_point"):
            yield field.name, np.concatenate([value[len(value) // 3 :], value[: len(value) // 3]])
        else:  # a half thickness may not be more than its half width
            yield field.name, value * (1.1 if field.name == "half_width" else rng.uniform(0.5, 1, value.shape))


@pytest.mark.parametrize("what", ["curve", "skeleton", "surface"])
def test_a_changed_curve_keeps_only_what_would_be_computed_again(raw, what):
    raw = replace(raw, vertex_of_point=np.where(raw.vertex_of_point < 9, -1, raw.vertex_of_point))  # some own none
    given = {"curve": Curve.of, "skeleton": lambda it: it, "surface": lambda it: oriented(Curve.of(it))}[what](raw)
    derived, kept = derived_of(type(given)), set()
    for name in derived:
        getattr(given, name)
    for field, value in others(given):
        changed = given.changed(**{field: value})
        fresh = replace(changed)
        assert not vars(fresh).keys() & {*derived}
        for name in vars(changed).keys() & {*derived}:
            kept.add(name)
            one, other = (arrays(getattr(each, name)) for each in (changed, fresh))
            assert one.keys() == other.keys()
            for key in one:
                np.testing.assert_array_equal(one[key], other[key], err_msg=f"{name} after another {field}")
    assert kept == {*derived}
    assert len(derived) >= 4


def oriented(curve):
    return Surface.of(curve).oriented(curve)


def test_a_rewired_curve_has_its_edges_in_order_and_forgets_what_it_does_not_know(raw):
    curve, m = Curve.of(raw), len(raw.vertices)
    shuffled = np.random.default_rng(0).permutation(curve.edges)[:, ::-1]
    np.testing.assert_array_equal(curve.rewired(shuffled).edges, raw.edges)
    doubled = np.repeat(raw.vertices, 2, axis=0)
    changes = dict(vertices=doubled, radii=np.ones(2 * m), vertex_of_point=2 * raw.vertex_of_point)
    skeleton = curve.rewired(2 * shuffled, **changes).to_skeleton()
    assert np.isnan(skeleton.confidence).all()
    assert np.isnan(skeleton.support).all()
    np.testing.assert_array_equal(skeleton.half_width, 1)
    assert skeleton.n_components == raw.n_components + m
    np.testing.assert_array_equal(Curve.of(raw).to_skeleton().vertices, raw.vertices)


def test_lengths_scale_together_and_gaps_with_them(raw):
    curve = Curve.of(raw).with_gaps(np.ones((1, 2, 3)))
    half = curve.scaled(0.5)
    for name in ("vertices", "points", "radii", "half_width", "half_thickness"):
        np.testing.assert_array_equal(getattr(half, name), 0.5 * getattr(curve, name))
    assert half.report.joined == (((0.5,) * 3, (0.5,) * 3),)
    np.testing.assert_allclose(half.sections.half_width, 0.5 * curve.sections.half_width)
    assert np.log2(curve.binary_size) == round(np.log2(np.ptp(raw.vertices, axis=0).max()))
    assert curve.changed(vertices=np.zeros_like(raw.vertices)).binary_size == 1


@pytest.mark.parametrize("options", [{}, dict(recentre=0), dict(recentre=0, handle=0, limb=0, air=0, bridge=0)])
def test_points_without_a_vertex_or_a_normal_keep_none_and_the_others_have_one(raw, options):
    """Also where nobody says which points show the surface."""
    owner, normals = raw.vertex_of_point.copy(), raw.normals.copy()
    owner[::50], normals[1::50] = -1, np.nan
    for representative in (raw.representative_of_point, None):
        given = replace(raw, vertex_of_point=owner, normals=normals, representative_of_point=representative)
        skeleton = Refiner(**options)(given)
        np.testing.assert_array_equal(skeleton.vertex_of_point < 0, owner < 0)
        assert np.isnan(skeleton.normals[1::50]).all()
        assert (skeleton.n_components, len(skeleton.leaves)) == (1, 3)
    blind = Refiner(**options)(replace(raw, normals=None, representative_of_point=None))
    assert (blind.vertex_of_point >= 0).all()
    assert blind.n_components == 1
