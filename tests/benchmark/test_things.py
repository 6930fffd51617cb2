"""Things: distances and areas in closed form, what is known of their axes, what is refused, and the same for ever."""

import networkx as nx
import numpy as np
import pytest
from glsk_bench.clouds import cloud, coverage
from glsk_bench.shapes import FAMILIES, Thing
from glsk_bench.shapes.curves import generator
from glsk_bench.shapes.things.fairness import fault_of
from glsk_bench.shapes.things.field import distance, surface_of
from glsk_bench.shapes.things.lines import X, Y
from glsk_bench.shapes.things.rings import _block, _Ring
from glsk_bench.shapes.things.section import half_axes, section_radius, unit_area
from glsk_bench.shapes.things.solid import ROUND_ENDS, Solid
from glsk_bench.truths import THING_ARRAYS
from scipy.spatial import cKDTree

from glsk_o3d.samples.capsules import capsule_distance

EACH = [(family, seed) for family in FAMILIES["v3"] for seed in (0, 1)]
FINGERPRINTS = {
    "prisms": ["fb41f81cbe425ceb", "b2d82c30aa6c9da3", "08ec40c659437e7d", "975a58e20b502098"],
    "implements": ["4126e85541819406", "d4e4924ec0f80929", "9dae3835291f106b", "51207185fbb7ab91"],
    "animals": ["661d00ec2d7e8d31", "fa508742e6a638a4", "e72d9159186e86c8", "56390e61dde05a92"],
    "plates": ["9ed078b79dd48475", "1c2e2fdf821ae43b", "9a543c09c2dbcb28", "475a94c121430db8"],
    "blades": ["076505c426d87059", "9ebd5c97c653d376", "809764596e689506", "6ebe92f4f30b54c3"],
    "mugs": ["3a2fb2847c72ba3b", "c59d671510e808be", "906d30c225ddf9f6", "1590655500b39644"],
    "toys": ["8c535af97068cba9", "00c5e13fc92f09e2", "a3527dc086158b1f", "d2e5869cf9528f51"],
    "rings": ["64c88d4d4854df5b", "6f56046f6a49f7e3", "2d549ff6ebf5958d", "b9d43f855b9418e4"],
}
"""Of shapes with seed 0 and of three of their clouds, coordinates to four decimals."""


@pytest.mark.parametrize("family", FAMILIES["v3"])
def test_fingerprints(family, drawn, fingerprint):
    one = drawn(family, 0)
    truth = (one.nodes, one.radii, one.edges, one.points, one.normals, *(getattr(one, name) for name in THING_ARRAYS))
    clouds = [cloud(one, variant, 1000, 5) for variant in ("noise1", "scan2", "depth2")]
    assert [fingerprint(*truth), *map(fingerprint, clouds)] == FINGERPRINTS[family]


def inside(one, places):
    """Whether places are inside the surface, as the normal of the nearest point of it tells."""
    nearest = cKDTree(one.points).query(places)[1]
    return ((one.points[nearest] - places) * one.normals[nearest]).sum(axis=1) > 0


@pytest.mark.parametrize(("family", "seed"), EACH)
def test_what_is_told_is_so(family, seed, drawn):
    one = drawn(family, seed)
    assert isinstance(one, Thing)
    low, high = one.points.min(axis=0), one.points.max(axis=0)
    assert np.linalg.norm(high - low) == pytest.approx(1)
    np.testing.assert_allclose(low, -high, atol=1e-12)
    judged = np.unique(one.edges[one.judged])
    out = judged[~inside(one, one.nodes[judged])]
    if family == "plates":  # where a sheet is bent, the centroid of the section, an L, is beside it
        assert (cKDTree(one.points).query(one.nodes[out])[0] < 0.5 * one.half_width[out]).all()
        assert len(out) in (0, 3)
    else:
        assert len(out) == 0
    assert (one.half_width > 0.88 * one.radii).all()  # the square has 4 half axes squared, the circle pi radii squared
    facts = one.facts
    assert (facts["n_flat"], facts["judged_share"]) == (len(one.flat), one.judged.mean())
    assert facts["symmetric"] == (len(one.mirror) == 2)
    degree = np.bincount(one.edges.ravel())
    assert (degree[one.flat] == 1).all()
    assert one.judged.all() == (family != "mugs")
    assert coverage(one, one.points) == 1


@pytest.mark.parametrize(("family", "seed"), EACH)
def test_the_axis_ends_half_a_radius_inside_of_flat_faces(family, seed, drawn):
    one = drawn(family, seed)
    tree = cKDTree(one.points)
    for tip in one.flat:
        edge = one.edges[(one.edges == tip).any(axis=1)][0]
        out = one.nodes[tip] - one.nodes[edge[edge != tip][0]]
        out, radius = out / np.linalg.norm(out), one.radii[tip]
        near = np.array(tree.query_ball_point(one.nodes[tip], 1.2 * radius))
        offset = one.points[near] - one.nodes[tip]
        along = offset @ out
        ahead = np.linalg.norm(offset - np.outer(along, out), axis=1) < 0.3 * radius
        face = ahead & (along > 0) & (one.normals[near] @ out > 0.97)
        assert face.sum() >= 3
        np.testing.assert_allclose(
            along[face], 0.5 * radius, rtol=0.15
        )  # that of the face is less in a limb that tapers


@pytest.mark.parametrize(
    ("family", "seed"), [("animals", 0), ("animals", 2), ("blades", 1), ("blades", 3), ("toys", 1)]
)
def test_a_mirror_is_one(family, seed, drawn):
    one = drawn(family, seed)
    place, normal = one.mirror
    assert np.linalg.norm(normal) == pytest.approx(1)
    nodes, points = (each - 2 * np.outer((each - place) @ normal, normal) for each in (one.nodes, one.points))
    assert cKDTree(one.nodes).query(nodes)[0].max() < 1e-9
    assert cKDTree(one.points).query(points)[0].max() < 5 * one.spacing
    assert drawn("animals", 1).mirror.shape == (0, 3)


@pytest.mark.parametrize("seed", range(4))
def test_toys_are_stout(seed, drawn):
    one = drawn("toys", seed)
    degree = np.bincount(one.edges.ravel())
    assert one.facts["cycle_rank"] == 0
    assert (degree == 1).sum() >= 5
    body = one.half_width.max()
    assert body > 0.13  # of the diagonal
    assert (one.radii[degree == 1] > 0.13 * body).all()  # ears are the thinnest: of the head, which is thinner itself


@pytest.mark.parametrize("seed", [101, 104, 108, 110])  # a washer, a roll of tape and two nuts
def test_holes_of_rings_are_no_wider_than_bars(seed, drawn):
    one = drawn("rings", seed)
    middle = one.nodes.mean(axis=0)
    size = np.linalg.norm(one.nodes - middle, axis=1)
    hole = cKDTree(one.points).query(middle)[0]
    assert one.facts["cycle_rank"] == 1
    assert not inside(one, middle[None])[0]
    assert (hole / (size - hole)).min() > 0.35
    assert (hole / (size - hole)).max() < 1.2


def block(counts):
    """A block with so many holes, as it is drawn."""
    for seed in range(100):
        ring = _Ring(Solid(), np.random.default_rng(seed), 1.0, 10.0)
        _block(ring)
        spots = np.array([void.places[0, :2] for void in ring.solid.voids]).round(9)
        if tuple(len(np.unique(column)) for column in spots.T) == counts:
            return ring.solid
    raise AssertionError


@pytest.mark.parametrize(("counts", "junctions"), [((1, 1), 0), ((3, 1), 4), ((2, 2), 5)])
def test_the_axis_of_a_block_has_a_loop_for_each_hole(counts, junctions):
    solid = block(counts)
    graph = nx.Graph(solid.links)
    assert graph.number_of_edges() - len(graph) + 1 == np.prod(counts)
    assert sum(degree > 2 for _, degree in graph.degree) == junctions
    for void in solid.voids:
        middle = void.places.mean(axis=0)
        assert np.linalg.norm(solid.nodes - middle, axis=1).min() > void.a[0] + 0.5


# ----------------------------------------------------------------------------------------------------- sections, sweeps


@pytest.mark.parametrize("power", [2, 3.7, 10])
def test_sections_have_the_area_that_is_asked_for(power):
    a, b = half_axes(0.3, 2.5, power)
    assert (a / b, section_radius(a, b, power)) == (pytest.approx(2.5), pytest.approx(0.3))
    assert unit_area(2) == pytest.approx(np.pi)
    x = np.linspace(0, 1, 200_001)
    assert unit_area(power) == pytest.approx(4 * np.trapezoid((1 - x**power) ** (1 / power), x), rel=1e-5)


def rod(ends, places=((0, 0, 0), (1, 0, 0)), radius=0.1, power=2.0, blend=0.0):
    solid = Solid(blend=blend)
    solid.limb(np.array(places, float), radius, None, power, Y, ends)
    return solid


@pytest.mark.parametrize("steps", [1, 20])
@pytest.mark.parametrize("blend", [0, 0.1])
def test_distances_to_a_rod(steps, blend):
    points = np.random.default_rng(0).uniform(-0.4, 1.4, (3000, 3)) * [1, 0.3, 0.3]
    places = np.column_stack([np.linspace(0, 1, steps + 1), np.zeros((steps + 1, 2))])
    found, gradients = distance(rod(ROUND_ENDS, places, blend=blend), points, 1.0)
    expected = np.maximum(capsule_distance(points, *places[[0, -1]], 0.1, 0.1), -0.1)
    np.testing.assert_allclose(found, expected, atol=1e-9)
    step = 1e-6 * np.random.default_rng(1).normal(size=3)
    ahead, _ = distance(rod(ROUND_ENDS, places, blend=blend), points + step, 1.0)
    smooth = found > -0.099
    np.testing.assert_allclose((ahead - found)[smooth], (gradients @ step)[smooth], atol=1e-9)


def test_roundings_decide_nothing_on_the_edges_of_a_flat_end():
    angle, rng = np.linspace(0, 2 * np.pi, 500), np.random.default_rng(0)
    rim = np.column_stack([np.ones(500), 0.1 * np.cos(angle), 0.1 * np.sin(angle)])
    solid = rod(("flat", "flat"), blend=0.1)
    solid.edge = 1e-9
    _, gradients = distance(solid, rim + rng.uniform(-1e-12, 1e-12, rim.shape), 0.1)
    np.testing.assert_allclose(gradients, np.tile(X, (500, 1)), atol=1e-12)
    solid.edge = 0.0  # as in versions before v3
    _, gradients = distance(solid, rim + rng.uniform(-1e-12, 1e-12, rim.shape), 0.1)
    assert 0.1 < gradients[:, 0].mean() < 0.9


@pytest.mark.parametrize(
    ("ends", "area"), [(("flat", "flat"), 2 * np.pi * 0.1 * 1.1), (ROUND_ENDS, 2 * np.pi * 0.1 * 1.2)]
)
def test_points_are_uniform_by_area(ends, area):
    found = surface_of(rod(ends), 20_000, generator("rod"))
    assert found.area == pytest.approx(area, rel=0.03)
    side = np.abs(found.points[:, 0] - 0.5) < 0.49
    assert side.mean() == pytest.approx(2 * np.pi * 0.1 * 0.98 / area, abs=0.02)
    np.testing.assert_allclose(
        found.normals[side, 1:], found.points[side, 1:] / 0.1, atol=1.01 * np.pi / 96
    )  # of facets


# ------------------------------------------------------------------------------------------------------ what is refused


def two(gap):
    solid = rod(("flat", "flat"))
    solid.limb(np.array([[0, 0, 0.2 + gap], [1, 0, 0.2 + gap]]), 0.1, None, 2, Y)
    return solid


def fork(length):
    solid = Solid()
    middle = solid.limb(np.array([[-1, 0, 0], [0, 0, 0], [1, 0, 0.0]]), 0.2, None, 2, Y)[1]
    solid.limb(np.array([[0, 0, 0], [0, 0, length]]), 0.1, None, 2, X, ROUND_ENDS, middle)
    return solid


@pytest.mark.parametrize(
    ("word", "bad", "good", "spacing"),
    [
        ("thin", rod(ROUND_ENDS, radius=0.0119), rod(ROUND_ENDS, radius=0.0121), 0.01),
        ("stub", fork(0.274), fork(0.276), 0.01),
        ("holes", two(-0.02), two(0.1), 0.01),
        ("gap", two(0.04), two(0.06), 0.01),
        ("gap", two(0.09), two(0.12), 0.08),
    ],
)
def test_what_is_refused_and_what_just_is_not(word, bad, good, spacing):
    assert fault_of(bad, spacing) == word
    assert fault_of(good, spacing) is None
