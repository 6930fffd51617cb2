"""Crowns without a surface are set aside while the rest is refined, and come back behind it."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import Refiner, Skeleton, samples, skeletonize
from glsk_o3d.curve.curve import Curve
from glsk_o3d.curve.thin.deferred import Deferred

pytestmark = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")
ALL = ("vertices", "radii", "confidence", "half_width", "half_thickness", "support")


@pytest.fixture(scope="module")
def crown():
    """Before it is refined, with all that is asked about it."""
    with pytest.MonkeyPatch.context() as patched:
        asked = seen(patched)
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


def test_a_crown_comes_back_as_it_was(crown):
    _, aside = crown
    whole, rest = aside.whole, aside.rest()
    back = aside.put_back(rest)
    assert rest.vertex_of_point.max() < len(rest.vertices) == (~aside.gone).sum()
    np.testing.assert_array_equal(rest.points, whole.points[aside.rows])
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


def test_small_crowns_and_loops_are_not_set_aside():
    net = grid(24)
    assert Deferred.of(Curve.of(net), 0.65) is None
    assert Deferred.of(Curve.of(comb(12)), 0.65) is None
    assert Deferred.of(Curve.of(comb()), 0.65).gone.all()


def comb(n=24, more=()):
    """Lines without a surface that hang on one, and perhaps more links between them."""
    net = grid(n)
    edges = net.edges[(np.diff(net.edges)[:, 0] == 1) | (net.edges[:, 0] % n == 0)]
    return replace(net, edges=np.concatenate([edges, np.reshape(more, (-1, 2)).astype(int)]))


def seen(monkeypatch):
    """What is set aside from now on."""
    results, look = [], Deferred.of

    def watch(*args):
        results.append(look(*args))
        return results[-1]

    monkeypatch.setattr(Deferred, "of", watch)
    return results


def test_points_without_a_vertex_stay_without_one():
    lines = comb()
    owner = np.where(np.arange(len(lines.points)) % 7, lines.vertex_of_point, -1)
    aside = Deferred.of(Curve.of(replace(lines, vertex_of_point=owner)), 0.65)
    np.testing.assert_array_equal(aside.put_back(aside.rest()).vertex_of_point, owner)


def test_a_loop_of_a_crown_is_opened_unless_all_loops_are_kept(monkeypatch):
    lines = comb(more=[(5 * 24 + 20, 6 * 24 + 20)])
    assert lines.n_loops == 1
    assert Refiner(recentre=0)(lines).n_loops == 0
    assert Refiner(recentre=0, handle=0, limb=0)(lines).n_loops == 1
    monkeypatch.setattr(Deferred, "of", lambda *_: pytest.fail("asked"))
    assert len(Refiner(set_aside=False)(lines).edges)
    assert len(Refiner(recentre=0, handle=0, limb=0)(lines).edges)
