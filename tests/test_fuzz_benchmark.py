"""The fuzzer: a few of its cases, and that it finds what is there to be found."""

import os
import signal
from types import SimpleNamespace

import numpy as np
import pytest

from glsk_o3d import Report, Skeleton, skeletonize
from glsk_o3d.samples import torus
from glsk_o3d.skeleton import ARRAYS as ARRAYS_OF_SKELETONS

ARRAYS, FILES, SKELETONS = 15, 200, 40


@pytest.fixture(scope="module")
def tool(benchmark):
    with benchmark("fuzz") as module:
        yield module


@pytest.fixture(scope="module")
def parts(tool):
    import _fuzz_arrays
    import _fuzz_files
    import _unsound

    return SimpleNamespace(arrays=_fuzz_arrays, files=_fuzz_files, unsound=_unsound, workers=tool)


@pytest.fixture(scope="module")
def ring():
    return skeletonize(torus(300).points)


KINDS = [("arrays", ARRAYS), ("files", FILES), ("lies", FILES), ("named", ARRAYS), ("skeletons", SKELETONS)]


@pytest.mark.parametrize(("what", "cases"), KINDS)
def test_nothing_is_found(call, what, cases):
    told = call(what, "--runs", cases, "--seed", 1)
    _, *counts = told.strip().splitlines()[-1].split()
    findings, counts = counts[-1], counts[:-1] if what == "arrays" else counts[:-3]  # less the seconds and the memory
    assert int(findings) == 0
    assert sum(map(int, counts)) == cases
    assert int(counts[-1]) > 0


def test_every_reader_reads_the_files_that_are_to_be_damaged(parts, tmp_path):
    for name, data in parts.files.seeds().items():
        kind, ending = name.split()[:2]
        path = tmp_path / ("ledger.jsonl" if kind == "ledger" else f"f{ending}")
        path.write_bytes(data)
        parts.files.READERS[kind](path)
    assert {name.split()[0] for name in parts.files.seeds()} == set(parts.files.READERS)


@pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning", "ignore::DeprecationWarning")
def test_degenerate_skeletons_and_extreme_ones_can_be_used(parts, tmp_path):
    """Or are refused in a sentence."""
    for name, fields in parts.unsound.seeds().items():
        sound = Skeleton(**{**fields, "report": Report.from_dict(fields["report"])})
        assert list(parts.unsound.used(sound, tmp_path, parts.unsound.USES)) == [], name
    tree = parts.unsound.seeds()["tree"]
    for field, factor in (("vertices", 1e149), ("vertices", 5e-324), ("radii", 1e149), ("radii", 5e-324)):
        arrays = {**{name: tree[name] for name in ARRAYS_OF_SKELETONS}, field: factor * tree[field]}
        sound = Skeleton(**{**arrays, "half_width": (), "half_thickness": ()})
        assert list(parts.unsound.used(sound, tmp_path, parts.unsound.USES)) == [], (field, factor)


class TestWhatIsWrongIsFound:
    def spoilt(self, ring, **changes):
        """A skeleton that no constructor has checked."""
        other = object.__new__(Skeleton)
        other.__dict__.update({**ring.__dict__, **changes})
        return other

    def test_vertices_and_indices(self, parts, ring):
        assert parts.arrays.unsound(ring, ring.points, 0.05) == []
        far, none, owner, edges = (
            each.copy() for each in (ring.vertices, ring.vertices, ring.vertex_of_point, ring.edges)
        )
        far[0, 0], none[0, 0], owner[3], edges[2] = 9, np.nan, len(ring.vertices), [4, 4]
        wrong = {"outside": dict(vertices=far), "no numbers": dict(vertices=none)}
        for said, changes in (
            wrong | dict(vertex_of_point=dict(vertex_of_point=owner), edges=dict(edges=edges))
        ).items():
            assert said in parts.arrays.unsound(self.spoilt(ring, **changes), ring.points, 0.05)[0]

    def test_a_process_that_dies_or_hangs_is_a_finding_and_the_others_are_run(self, parts, monkeypatch):
        monkeypatch.setattr(parts.workers, "_work", dies_and_hangs)
        monkeypatch.setattr(parts.workers, "LIMIT_S", 2)
        outcomes = list(parts.workers.run_cases("files", 0, range(5)))
        assert [outcome.number for outcome in outcomes] == [*range(5)]
        found = [outcome.findings for outcome in outcomes]
        assert found == [[], ["its process died: SIGABRT"], [], ["not done after 2 s"], []]


def dies_and_hangs(sender, what, seed, numbers):
    sender.send(None)
    for number in numbers:
        if number == 1:
            os.kill(os.getpid(), signal.SIGABRT)
        if number == 3:
            signal.pause()
        sender.send(SimpleNamespace(number=number, findings=[]))
