"""The fuzzer: a few of its cases, and that it finds what is there to be found."""

import pytest
from glsk_studies import damaged, degenerate, fuzz

from glsk_o3d import Skeleton, skeletonize
from glsk_o3d.samples import torus

STUDY = fuzz


@pytest.mark.parametrize(("what", "cases"), [("arrays", 8), ("files", 80)])
def test_a_few_cases_have_no_findings(call, what, cases):
    printed = call(what, "--runs", cases, "--seed", 1)
    _, *counts, findings = printed.strip().splitlines()[-1].split()
    assert int(findings) == 0
    assert sum(map(int, counts)) == cases
    assert int(counts[-1]) > 0


def test_every_reader_reads_the_files_that_are_to_be_damaged(tmp_path):
    for name, data in damaged.seeds().items():
        kind, ending = name.split()[:2]
        path = tmp_path / ("ledger.jsonl" if kind == "ledger" else f"f{ending}")
        path.write_bytes(data)
        damaged.READERS[kind](path)
    assert {name.split()[0] for name in damaged.seeds()} == set(damaged.READERS)


def test_an_unsound_skeleton_is_a_finding():
    """In a skeleton that no constructor has checked."""
    ring = skeletonize(torus(300).points)
    far, owner, edges = (each.copy() for each in (ring.vertices, ring.vertex_of_point, ring.edges))
    far[0, 0], owner[3], edges[2] = 9, len(ring.vertices), [4, 4]
    wrong = {"outside": dict(vertices=far), "vertex_of_point": dict(vertex_of_point=owner), "edges": dict(edges=edges)}
    for said, changes in wrong.items():
        spoilt = object.__new__(Skeleton)
        spoilt.__dict__.update({**ring.__dict__, **changes})
        assert said in degenerate.unsound(spoilt, ring.points, 0.05)[0]
    assert degenerate.unsound(ring, ring.points, 0.05) == []
