"""Places, directions, frames, curvature, paths and sections of a curve: against closed forms and brute force."""

import networkx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glsk_o3d import InvalidParameterError, Skeleton, samples, skeletonize
from glsk_o3d.geometry.vectors import norm

RNG = np.random.default_rng(0)


def graph(vertices, edges, **fields):
    m = len(vertices)
    return Skeleton(
        vertices, np.reshape(edges, (-1, 2)), np.ones(m), fields.pop("owner", ()), fields.pop("points", ()), ()
    )


def circle(n=60, radius=2.0):
    turn = 2 * np.pi * np.arange(n) / n
    return graph(
        radius * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]),
        np.sort(np.column_stack([np.arange(n), np.roll(np.arange(n), -1)])),
    )


@pytest.fixture(scope="module")
def animal():
    return skeletonize(samples.sauropod(1500).points)


@st.composite
def graphs(draw):
    m = draw(st.integers(1, 12))
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    pairs = np.transpose(np.triu_indices(m, 1))
    return graph(rng.normal(size=(m, 3)) * 10.0 ** rng.integers(-3, 3), pairs[rng.random(len(pairs)) < 0.3]), rng


@given(graphs())
def test_the_nearest_place_is_nearest_of_all_edges_and_vertices(drawn):
    curve, rng = drawn
    points = rng.normal(size=(40, 3)) * 10.0 ** rng.integers(-3, 3)
    a, b = curve.vertices[np.concatenate([curve.edges, np.tile(np.arange(len(curve.vertices)), (2, 1)).T])].swapaxes(
        0, 1
    )
    along = ((points[:, None] - a) * (b - a)).sum(axis=2) / np.maximum(((b - a) ** 2).sum(axis=1), 1e-300)
    distance = np.linalg.norm(points[:, None] - a - np.clip(along, 0, 1)[..., None] * (b - a), axis=2).min(axis=1)
    places = curve.nearest(points)
    np.testing.assert_allclose(places.distance, distance, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(places.clearance, distance - 1, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(places.branch < 0, places.edge < 0)
    found = places.branch >= 0
    again = curve.places(places.branch[found], places.arc_length[found])
    np.testing.assert_allclose(
        again.position, places.position[found], rtol=1e-6, atol=1e-9 * np.abs(curve.vertices).max()
    )


def test_places_move_along_a_branch_by_their_arc_length(animal):
    for row, path in enumerate(animal.branches):
        length = norm(np.diff(animal.vertices[path], axis=0)).sum()
        places = animal.places(row, np.array([-1, 0, length, length + 1]))
        np.testing.assert_allclose(places.position[[0, 1]], animal.vertices[path[[0, 0]]])
        np.testing.assert_allclose(places.position[[2, 3]], animal.vertices[path[[-1, -1]]], atol=1e-12)
        before, after = (animal.places(row, length / 2 + step).position for step in (-1e-7, 1e-7))
        np.testing.assert_allclose((after - before) / 2e-7, animal.places(row, length / 2).tangent, atol=1e-6)


def test_a_circle_has_the_curvature_and_the_tangents_of_a_circle():
    ring = circle()
    np.testing.assert_allclose(ring.curvature, 1 / 2.0, rtol=1e-12)
    radial = ring.vertices / 2
    np.testing.assert_allclose((ring.tangents * radial).sum(axis=1), 0, atol=1e-12)
    np.testing.assert_allclose(np.abs(np.cross(radial, ring.tangents)[:, 2]), 1)


def test_a_frame_in_a_plane_keeps_the_angle_to_the_plane():
    ring = circle()
    np.testing.assert_allclose(np.ptp(ring.frames[:, 2], axis=0), 0, atol=1e-9)  # the z of each axis


def test_frames_are_rotations_and_turn_no_more_than_the_tangents(animal):
    frames, path = animal.frames, max(animal.branches, key=len)[1:-1]
    np.testing.assert_allclose(
        np.einsum("mji,mjk->mik", frames, frames), np.tile(np.eye(3), (len(frames), 1, 1)), atol=1e-9
    )
    np.testing.assert_allclose(np.linalg.det(frames), 1)
    before, after = frames[path[:-1]], frames[path[1:]]
    turned = np.arccos(np.clip((np.einsum("mij,mij->m", before, after) - 1) / 2, -1, 1))
    bent = np.arccos(np.clip((before[:, :, 0] * after[:, :, 0]).sum(axis=1), -1, 1))
    np.testing.assert_allclose(turned, bent, atol=1e-6)


def test_curvature_is_known_at_vertices_with_two_edges_alone(animal):
    np.testing.assert_array_equal(np.isnan(animal.curvature), animal.degree != 2)
    line = graph([[0, 0, 0], [1, 0, 0], [3, 0, 0]], [[0, 1], [1, 2]])
    assert line.curvature[1] == 0


def test_a_path_is_the_shortest_of_all(animal):
    a, b = animal.leaves[[0, -1]]
    path = animal.path(a, animal.vertices[b] + 1e-6)
    expected = networkx.shortest_path_length(animal.to_networkx(), int(a), int(b), weight="length")
    assert (path[0], path[-1]) == (a, b)
    np.testing.assert_allclose(norm(np.diff(animal.vertices[path], axis=0)).sum(), expected)
    assert animal.path(3, 3).tolist() == [3]


def test_a_section_of_a_tube_is_a_disc():
    tube = skeletonize(samples.tube(6000).points)
    length, radius = tube.edge_lengths.sum(), np.median(tube.radii)
    section = tube.section(0, length / 2)
    np.testing.assert_allclose(section.area, np.pi * radius**2, rtol=0.1)
    np.testing.assert_allclose([section.half_width, section.half_thickness], radius, rtol=0.1)
    height = (tube.points[section.points] - section.position) @ section.tangent
    assert np.abs(height).max() <= 0.25 * radius * 1.001
    np.testing.assert_allclose((section.outline - section.position) @ section.tangent, 0, atol=1e-9)
    assert len(tube.section(0, 0.0).points) < len(section.points)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda s: s.nearest([[0, 0]]), "a row"),
        (lambda s: s.nearest([[0, 0, 0], [0, np.nan, 0]]), "row 1 is not finite"),
        (lambda s: s.nearest("here"), "a row"),
        (lambda s: s.places(9, 0.0), "there are branches 0 to 0"),
        (lambda s: s.places(0, np.inf), "finite"),
        (lambda s: s.section(0, "middle"), "must be a number"),
        (lambda s: s.path(0, 99), "there are vertices 0 to 59"),
        (lambda s: graph([[0, 0, 0], [1, 0, 0]], []).path(0, 1), "different components"),
        (lambda s: graph([], []).nearest([[0, 0, 0]]), "empty"),
    ],
)
def test_a_wrong_question_is_refused(ask, message):
    with pytest.raises(InvalidParameterError, match=message):
        ask(circle())


def test_a_curve_without_edges_has_places_at_its_vertices():
    lone = graph([[0, 0, 0], [4, 0, 0]], [])
    places = lone.nearest([[3, 0, 1]])
    assert (places.branch[0], places.edge[0], places.arc_length[0]) == (-1, -1, 0)
    np.testing.assert_array_equal(places.position, [[4, 0, 0]])
    assert np.isnan(places.tangent).all()
    assert np.isnan(lone.frames).all()
