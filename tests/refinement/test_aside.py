"""Crowns without a surface are set aside while the rest is refined, and come back behind it."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import Refiner, Skeleton, Tracer, pipelines, samples, skeletonize
from glsk_o3d.refinement.aside import Aside

pytestmark = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
ALL = ("vertices", "radii", "confidence", "half_width", "half_thickness", "support")


@pytest.fixture(scope="module")
def crown():
    """Before it is refined, with all that is asked about it."""
    asked, look = [], Aside.of

    def watch(*args):
        asked.append(look(*args))
        return asked[-1]

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Aside, "of", watch)
        refined = skeletonize(samples.tree(4096, forks=6).points)
    return refined, asked[0]


def test_a_crown_is_set_aside_and_the_trunk_is_not(crown):
    refined, aside = crown
    assert aside is not None
    trunk = np.hypot(*aside.whole.vertices[:, :2].T) + 5 * (aside.whole.vertices[:, 2] > 1.2) < 0.3
    assert trunk.sum() > 10
    assert not aside.gone[trunk].any()
    assert aside.gone.mean() > 0.5
    assert (refined.n_components, refined.n_loops) == (1, 0)
    assert 60 < len(refined.leaves) < 75  # 65 of the tree


def test_it_makes_no_difference_to_what_a_tree_is(crown, monkeypatch):
    monkeypatch.setattr(Aside, "of", lambda *_: None)
    whole = skeletonize(crown[0].points)
    assert abs(len(whole.leaves) - len(crown[0].leaves)) < 5
    assert abs(whole.length / crown[0].length - 1) < 0.02
    trunk = [s.radii[np.argmin(s.vertices[:, 2])] for s in (whole, crown[0])]
    np.testing.assert_allclose(*trunk, rtol=0.05)


def test_it_comes_back_as_it_was(crown):
    _, aside = crown
    whole, back = aside.whole, aside.put_back(aside.rest())
    order = np.concatenate([np.flatnonzero(~aside.gone), np.flatnonzero(aside.gone)])
    for name in ALL:
        np.testing.assert_array_equal(getattr(back, name), getattr(whole, name)[order])
    np.testing.assert_array_equal(order[back.vertex_of_point], whole.vertex_of_point)
    np.testing.assert_array_equal(back.points, whole.points)
    np.testing.assert_array_equal(back.normals, whole.normals)
    edges = {tuple(sorted(edge)) for edge in order[back.edges].tolist()}
    assert edges <= set(map(tuple, whole.edges.tolist()))
    lost = len(whole.edges) - len(edges)
    assert lost <= whole.n_loops  # of what was set aside only a forest is left
    assert back.n_components == whole.n_components


def test_the_rest_has_its_own_points(crown):
    _, aside = crown
    rest = aside.rest()
    assert len(rest.points) == len(aside.rows) == (~aside.gone[aside.whole.vertex_of_point]).sum()
    np.testing.assert_array_equal(rest.points, aside.whole.points[aside.rows])
    assert rest.vertex_of_point.min() == 0
    assert rest.vertex_of_point.max() < len(rest.vertices) == (~aside.gone).sum()


def grid(n):
    """Crossing lines in a plane, n each way, of points with normals that mean nothing."""
    rng = np.random.default_rng(0)
    place = np.arange(n * n)
    right, up = place[place % n < n - 1], place[: n * (n - 1)]
    edges = np.concatenate([np.column_stack([right, right + 1]), np.column_stack([up, up + n])])
    vertices = np.column_stack([place % n, place // n, 0 * place]).astype(float)
    vertex = np.repeat(place, 4)
    points = vertices[vertex] + rng.normal(size=(len(vertex), 3)) * 0.05
    normals = rng.normal(size=points.shape)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    zeros = np.zeros(len(vertices))
    return Skeleton(vertices, edges, zeros + 0.1, vertex, points, normals, confidence=zeros)


def test_what_is_mostly_on_loops_is_not_set_aside():
    net = grid(24)
    assert Aside.of(net, 0.65) is None
    comb = net.edges[(np.diff(net.edges)[:, 0] == 1) | (net.edges[:, 0] % 24 == 0)]
    assert Aside.of(replace(net, edges=comb), 0.65).gone.all()


def test_small_skeletons_are_not_set_aside():
    net = grid(12)
    comb = net.edges[(np.diff(net.edges)[:, 0] == 1) | (net.edges[:, 0] % 12 == 0)]
    assert Aside.of(replace(net, edges=comb), 0.65) is None


def test_nothing_may_be_left():
    """Of a comb of lines without a surface, and a skeleton comes back."""
    net = grid(24)
    comb = replace(net, edges=net.edges[(np.diff(net.edges)[:, 0] == 1) | (net.edges[:, 0] % 24 == 0)])
    back = Aside.of(comb, 0.65).put_back(Aside.of(comb, 0.65).rest())
    np.testing.assert_array_equal(back.edges, comb.edges)
    np.testing.assert_array_equal(back.vertices, comb.vertices)
    refined = Refiner()(comb)
    assert (len(refined.vertices), refined.n_components, refined.n_loops) == (24 * 24, 1, 0)
    assert Tracer()(refined).report.n_traced == len(comb.points)


def test_without_questions_nothing_is_set_aside(monkeypatch):
    monkeypatch.setattr(Aside, "of", lambda *_: pytest.fail("asked"))
    off = {f"Refiner.{option}": 0 for option in ("handle", "limb", "air", "bridge", "recentre")}
    skeleton = pipelines.default().with_options(off)(samples.tree(4096, forks=6).points)
    assert len(skeleton.edges)
