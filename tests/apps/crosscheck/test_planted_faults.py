"""Mistakes in the Laplacian, and skeletons that are wrong: the cross-check disagrees with each."""

from dataclasses import replace

import numpy as np
import pytest

from glsk_o3d import editing
from glsk_o3d.analysis.agreement import compare_skeletons
from glsk_o3d.apps.crosscheck.agreement import judge
from glsk_o3d.data.skeleton import Skeleton
from glsk_o3d.geometry.cotangent import ring_operator
from glsk_o3d.geometry.rings import Rings


def test_nothing_is_wrong_with_the_shape_itself(bench):
    verdict, probability, reasons = bench.judged()
    assert (verdict, reasons) == ("agrees", ())
    assert probability > 0.9


FAULTS = {
    "a sign flipped": lambda item: item._replace(laplacian=-item.laplacian),
    "weights halved": lambda item: item._replace(laplacian=item.laplacian / 2),
    "weights doubled": lambda item: item._replace(laplacian=item.laplacian * 2),
    "mass forgotten": lambda item: item._replace(area=np.ones(len(item.area))),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_laplacian_is_not_trusted(bench, fault):
    verdict, probability, reasons = bench.judged(ours=FAULTS[fault](bench.ours))
    assert verdict == "do not trust"
    assert probability < 0.5
    assert any(word in " ".join(reasons) for word in ("eigenvalues", "turned", "times as long", "mapped"))


def test_one_ring_out_of_order_is_enough(bench):
    rings = bench.rings
    row = np.flatnonzero(rings.closed & (rings.sizes >= 6))[100]
    indices, start = rings.indices.copy(), rings.indptr[row]
    indices[[start + 1, start + 4]] = indices[[start + 4, start + 1]]
    permuted = Rings(rings.indptr, indices, rings.closed)
    verdict, _, reasons = bench.judged(rings=permuted, ours=ring_operator(bench.ours.places, permuted))
    assert (verdict, reasons[0]) == ("do not trust", "rings that do not go once around their point: 1")


def test_a_limb_cut_off_is_named_with_its_place(bench):
    skeleton = bench.skeleton
    limb = max((path for path in skeleton.branches if (skeleton.degree[path] == 1).any()), key=lambda path: len(path))
    tip = limb[0] if skeleton.degree[limb[0]] == 1 else limb[-1]
    remaining = np.setdiff1d(np.arange(len(skeleton.vertices)), limb[1:-1].tolist() + [tip])
    number = np.full(len(skeleton.vertices), -1)
    number[remaining] = np.arange(len(remaining))
    edges = number[skeleton.edges]
    edges = edges[(edges >= 0).all(axis=1)]
    cut = Skeleton(skeleton.vertices[remaining], edges, skeleton.radii[remaining], (), (), (), report=skeleton.report)
    verdict, _, reasons = bench.judged(skeleton=cut)
    assert verdict != "agrees"
    place = np.array(reasons[0].split("(")[1].split(")")[0].split(", "), float)
    assert reasons[0].startswith("the mesh's skeleton ends at (")
    assert np.linalg.norm(place - skeleton.vertices[tip]) < 2.5 * skeleton.radii[tip]


def test_a_loop_that_the_object_does_not_have(bench):
    skeleton: Skeleton = bench.skeleton
    a, b = skeleton.leaves[:2]
    closed = replace(skeleton, edges=np.vstack([skeleton.edges, [[min(a, b), max(a, b)]]]))
    verdict, probability, reasons = bench.judged(skeleton=closed)
    assert verdict == "do not trust"
    assert probability < 0.75
    assert "loops: 2 in the skeleton, 1 in the mesh" in reasons


def test_a_loop_of_the_object_that_was_cut_open(check):
    opened, _ = editing.cut_loops(check.skeleton)
    skeletons = compare_skeletons(opened, check.mesh_skeleton, 0.003)
    verdict, _, reasons = judge(check.rows, skeletons, check.solid, check.mesh)
    assert verdict == "do not trust"
    assert "loops: 0 in the skeleton, 1 in the mesh" in reasons
