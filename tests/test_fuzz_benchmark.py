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


def test_every_kind_of_cloud_is_drawn_again_alike(parts):
    for draw in parts.arrays.KINDS.values():
        first, again = (draw(np.random.default_rng(3)) for _ in range(2))
        np.testing.assert_array_equal(first, again)
        assert first.ndim == 2
        assert first.shape[1] == 3


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


def test_damage_can_be_repeated_and_is_some(parts):
    data = bytes(range(256)) * 4
    made, again = ([parts.files.damaged(data, np.random.default_rng(seed)) for seed in range(50)] for _ in range(2))
    assert made == again
    assert len({*made}) > 45


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

    def test_order(self, parts, ring):
        assert parts.arrays.unlike(ring, ring, 1.0) == []
        open_ring = self.spoilt(ring, edges=ring.edges[1:])
        assert "n_loops" in parts.arrays.unlike(ring, open_ring, 1.0)[0]
        moved = self.spoilt(ring, vertices=ring.vertices + 1e-3)
        assert "moves vertices" in parts.arrays.unlike(ring, moved, 1.0)[0]

    def test_errors_and_warnings_and_memory_that_is_not_there(self, parts, tmp_path, monkeypatch):
        for wrong in (KeyError("it"), MemoryError(), RuntimeWarning("overflow")):

            def case(rng, folder, wrong=wrong):
                raise wrong

            monkeypatch.setattr(parts.workers, "file_case", case)
            (finding,) = parts.workers.one_case("files", 0, 5, tmp_path).findings
            assert finding.startswith(f"{type(wrong).__name__} at test_fuzz_benchmark.py:")

    def test_a_process_that_dies_or_hangs_is_a_finding_and_the_others_are_run(self, parts, monkeypatch):
        monkeypatch.setattr(parts.workers, "_work", dies_and_hangs)
        monkeypatch.setattr(parts.workers, "LIMIT_S", 2)
        outcomes = list(parts.workers.run_cases("files", 0, range(5)))
        assert [outcome.number for outcome in outcomes] == [*range(5)]
        found = [outcome.findings for outcome in outcomes]
        assert found == [[], ["its process died: SIGABRT"], [], ["not done after 2 s"], []]

    def test_findings_are_told_with_how_to_repeat_them(self, tool, parts, monkeypatch):
        from typer.testing import CliRunner

        wrong = parts.workers.Outcome(7, "list .txt", "failed", ["KeyError at x.py:3: 'it'"])
        monkeypatch.setattr(tool, "run_cases", lambda *_: iter([wrong]))
        result = CliRunner().invoke(tool.app, ["files", "--seed", "4"])
        assert result.exit_code == 1
        assert result.output.splitlines()[-1] == (
            "benchmarks/fuzz.py files --seed 4 --case 7  # KeyError at x.py:3: 'it'"
        )
        assert CliRunner().invoke(tool.app, ["both", "--minutes", "0"]).exit_code == 1


def dies_and_hangs(sender, what, seed, numbers):
    sender.send(None)
    for number in numbers:
        if number == 1:
            os.kill(os.getpid(), signal.SIGABRT)
        if number == 3:
            signal.pause()
        sender.send(SimpleNamespace(number=number, findings=[]))
