"""Junctions lie where the axes of straight limbs meet, and nothing else is left of a corner."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

R = 0.1


def towards(angle, length=1.0):
    return length * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0])


def webbed(angles):
    """Limbs from the origin whose curves join half-way to where the sharpest corner's tubes part, on the x axis."""
    turned = np.sort(np.mod(angles, 360))
    sharpest = np.diff(turned, append=turned[0] + 360).min()
    reach = R / np.sin(np.radians(sharpest / 2))
    meet = np.array([reach / 2, 0, 0])
    struts = [((0, 0, 0), towards(angle)) for angle in angles]
    return [[meet, towards(angle, reach), towards(angle)] for angle in angles], struts, meet


@pytest.mark.parametrize("half", [20, 45])
def test_a_sharp_corner_has_no_spur(piped, refine, half):
    """Two struts that meet in a V: the spur into its tip goes, and what is left is one path."""
    paths, struts, meet = webbed([-half, half])
    raw = piped([*paths, [meet, [-R / 2, 0, 0]]], struts)
    assert len(raw.leaves) == 3
    skeleton = refine(raw, limb=0.25)
    assert (len(skeleton.leaves), len(skeleton.junctions), skeleton.n_components) == (2, 0, 1)


@pytest.mark.parametrize("angles", [[-30, 30, 180], [-40, 40, 0], [0, 90, 180], [45, 135, 225, 315]])
def test_junctions_move_to_where_the_axes_meet(piped, refine, angles):
    """Y, three struts in a fan, T and four in a plane."""
    paths, struts, meet = webbed(angles)
    skeleton = refine(piped(paths, struts), recentre=3)
    assert (len(skeleton.junctions), len(skeleton.leaves)) == (1, len(angles))
    assert np.linalg.norm(skeleton.vertices[skeleton.junctions[0]]) < 0.3 * R < np.linalg.norm(meet)
    # and the limbs are straight from there on
    ways = np.array([towards(angle) for angle in angles])
    along = np.clip(skeleton.vertices @ ways.T, 0, None)
    off = np.linalg.norm(skeleton.vertices[:, None] - along[:, :, None] * ways, axis=2).min(axis=1)
    assert off.max() < 0.3 * R


@pytest.mark.parametrize(("apart", "junctions"), [(1.0, 1), (4.0, 2)])
def test_junctions_of_one_corner_become_one(piped, refine, apart, junctions):
    """Four limbs that the contraction joins at two places; of two that are apart each stays."""
    a, b = np.array([-apart * R / 2, 0, 0]), np.array([apart * R / 2, 0, 0])
    ends = [towards(120), towards(240), towards(0), towards(90)]
    root = [a, a, b, b] if apart > 2 else [np.zeros(3)] * 4
    struts = [(r, r + end) for r, end in zip(root, ends, strict=True)] + [(a, b)]
    paths = [[start, r + 3 * R * end, r + end] for start, r, end in zip([a, a, b, b], root, ends, strict=True)]
    skeleton = refine(piped([*paths, [a, b]], struts), recentre=3)
    assert (len(skeleton.junctions), len(skeleton.leaves)) == (junctions, 4)


@pytest.fixture(scope="module")
def quadruped(piped):
    """A trunk along x with a pair of legs at either end; the front legs join it .8 radii apart."""
    back, front, shift = np.array([-0.5, 0, 0]), np.array([0.5, 0, 0]), np.array([0.4 * R, 0, 0])
    hips, roots = [back, back, front, front], [back, back, front - shift, front + shift]
    feet = [hip + [0, y, -0.8] for hip, y in zip(hips, [-0.4, 0.4, -0.4, 0.4], strict=True)]
    struts = [((-1, 0, 0), (1, 0, 0)), *zip(hips, feet, strict=True)]
    paths = [*pairwise([(-1, 0, 0), back, *roots[2:], (1, 0, 0)])]
    paths += [(root, hip + 0.2 * (foot - hip), foot) for root, hip, foot in zip(roots, hips, feet, strict=True)]
    return piped(paths, struts, step=R / 2, spacing=0.01)


def test_limbs_that_meet_a_trunk_within_a_radius_share_a_junction(refine, quadruped):
    skeleton = refine(quadruped, recentre=3)
    assert (len(quadruped.junctions), len(skeleton.junctions), len(skeleton.leaves)) == (3, 2, 6)
    assert (skeleton.n_components, skeleton.n_loops) == (1, 0)
    places = skeleton.vertices[skeleton.junctions]
    np.testing.assert_allclose(places[np.argsort(places[:, 0])], [[-0.5, 0, 0], [0.5, 0, 0]], atol=0.15 * R)
    assert np.isin(skeleton.vertex_of_point, np.arange(len(skeleton.vertices))).all()
    # a symmetric body has a symmetric skeleton
    a, b = skeleton.vertices[skeleton.edges].transpose(1, 0, 2)
    curve = np.concatenate([(1 - t) * a + t * b for t in np.linspace(0, 1, 21)])
    assert cKDTree(curve).query(skeleton.vertices * [1, -1, 1])[0].max() < 0.2 * R
