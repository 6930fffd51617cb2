"""The fuzzer: a few of its cases, and that it finds what is there to be found."""

import os
import signal
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from glsk_o3d import Skeleton, skeletonize
from glsk_o3d.samples import torus

ARRAYS, FILES = 30, 400


@pytest.fixture(scope="module")
def tool(benchmark):
    with benchmark("fuzz") as module:
        yield module


@pytest.fixture(scope="module")
def parts(tool):
    from _fuzz import arrays, clouds, files, workers

    return SimpleNamespace(arrays=arrays, clouds=clouds, files=files, workers=workers)


@pytest.fixture(scope="module")
def ring():
    return skeletonize(torus(300).points)


@pytest.mark.parametrize(("what", "cases"), [("arrays", ARRAYS), ("files", FILES)])
def test_nothing_is_found(call, what, cases):
    told = call(what, "--runs", cases, "--seed", 1)
    *_, number, findings = told.split()
    assert int(findings) == 0
    assert sum(map(int, told.strip().splitlines()[-1].split()[1:])) == cases
    assert int(number) > 0


def test_every_kind_of_cloud_is_drawn_again_alike(parts):
    for draw in parts.clouds.KINDS.values():
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


def test_damage_can_be_repeated_and_is_some(parts):
    data = bytes(range(256)) * 4
    made = [parts.files.damaged(data, np.random.default_rng(seed)) for seed in range(50)]
    assert made == [parts.files.damaged(data, np.random.default_rng(seed)) for seed in range(50)]
    assert len({*made}) > 45
    assert all(made)


class TestWhatIsWrongIsFound:
    def spoilt(self, ring, **changes):
        """A skeleton that no constructor has checked."""
        other = object.__new__(Skeleton)
        other.__dict__.update({**ring.__dict__, **changes})
        return other

    def test_a_sound_skeleton_has_nothing(self, parts, ring):
        assert parts.arrays.unsound(ring, ring.points, 0.05) == []
        assert parts.arrays.unlike(ring, ring, 1.0) == []

    def test_vertices(self, parts, ring):
        far, none = ring.vertices.copy(), ring.vertices.copy()
        far[0, 0], none[0, 0] = 9, np.nan
        assert "out" in parts.arrays.unsound(self.spoilt(ring, vertices=far), ring.points, 0.05)[0]
        assert "no numbers" in parts.arrays.unsound(self.spoilt(ring, vertices=none), ring.points, 0.05)[0]

    def test_indices(self, parts, ring):
        owner, edges = ring.vertex_of_point.copy(), ring.edges.copy()
        owner[3], edges[2] = len(ring.vertices), [4, 4]
        assert "vertex_of_point" in parts.arrays.unsound(self.spoilt(ring, vertex_of_point=owner), ring.points, 1)[0]
        assert "edges" in parts.arrays.unsound(self.spoilt(ring, edges=edges), ring.points, 1)[0]

    def test_order(self, parts, ring):
        open_ring = self.spoilt(ring, edges=ring.edges[1:])
        assert "n_loops" in parts.arrays.unlike(ring, open_ring, 1.0)[0]
        moved = self.spoilt(ring, vertices=ring.vertices + 1e-3)
        assert "moves vertices" in parts.arrays.unlike(ring, moved, 1.0)[0]

    def test_errors_and_warnings_and_memory_that_is_not_there(self, parts, tmp_path, monkeypatch):
        for wrong in (KeyError("it"), MemoryError(), RecursionError(), RuntimeWarning("overflow")):
            monkeypatch.setattr(parts.workers, "file_case", self.raising(wrong))
            (finding,) = parts.workers.one_case("files", 0, 5, tmp_path).findings
            assert finding.startswith(f"{type(wrong).__name__} at test_fuzz_benchmark.py:")

    @staticmethod
    def raising(wrong):
        def case(rng, folder):
            raise wrong

        return case

    def test_a_process_that_dies_is_a_finding_of_its_case_and_the_others_are_run(self, parts, monkeypatch):
        monkeypatch.setattr(parts.workers, "_work", dies_at_the_third)
        outcomes = list(parts.workers.run_cases("files", 0, range(5)))
        assert [outcome.number for outcome in outcomes] == [*range(5)]
        assert [outcome.findings for outcome in outcomes] == [[], [], ["its process died: SIGABRT"], [], []]

    def test_one_that_hangs(self, parts, monkeypatch):
        monkeypatch.setattr(parts.workers, "_work", hangs_at_the_third)
        monkeypatch.setattr(parts.workers, "LIMIT_S", 2)
        outcomes = list(parts.workers.run_cases("files", 0, range(4)))
        assert [outcome.findings for outcome in outcomes] == [[], [], ["not done after 2 s"], []]

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


def work(sender, numbers, third):
    sender.send(None)
    for number in numbers:
        if number == 2:
            third()
        sender.send(SimpleNamespace(number=number, findings=[]))


def dies_at_the_third(sender, what, seed, numbers):
    work(sender, numbers, lambda: os.kill(os.getpid(), signal.SIGABRT))


def hangs_at_the_third(sender, what, seed, numbers):
    work(sender, numbers, lambda: signal.pause())


def test_one_case_alone(call):
    assert call("files", "--case", 3, "--seed", 1).split(":")[-1].strip() in ("read", "refused")
    assert Path("ledger.jsonl").exists() is False
