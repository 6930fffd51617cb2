"""The fuzzer: a few of its cases, and that it finds what is there to be found."""

import pytest
import typer
from glsk_studies import damaged, degenerate, fuzz

from glsk_o3d import Skeleton, skeletonize
from glsk_o3d.samples import torus

STUDY = fuzz


@pytest.mark.parametrize(("what", "cases"), [("arrays", 8), ("files", 80)])
def test_nothing_is_found(call, what, cases):
    told = call(what, "--runs", cases, "--seed", 1)
    _, *counts, findings = told.strip().splitlines()[-1].strip("| ").split(" | ")
    assert int(findings) == 0
    assert sum(map(int, counts)) == cases
    assert int(counts[-1]) > 0


def test_every_reader_reads_the_files_that_are_to_be_damaged():
    for name, data in damaged.seeds().items():
        assert damaged.read(*name.split()[:2], data) == ("read", [])
    assert {name.split()[0] for name in damaged.seeds()} == set(damaged.READERS)


def test_what_is_wrong_is_found():
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


def test_a_crash_is_a_finding_and_the_exit_code_tells(monkeypatch, capsys):
    rows = [dict(number=7, kind="cloud .ply", failure="ZeroDivisionError: no number")]
    monkeypatch.setattr(fuzz, "run_cases", lambda *words: rows)
    with pytest.raises(typer.Exit) as stop:
        fuzz.files(runs=1, seed=3, case=None, jobs=1)
    assert stop.value.exit_code == 1
    assert "fuzz.py files --seed 3 --case 7  # ZeroDivisionError: no number" in capsys.readouterr().out
