"""The fuzzer: a few of its cases, and that it finds what is there to be found."""

import numpy as np
import pytest
import typer

from glsk_o3d import Report, Skeleton, skeletonize
from glsk_o3d.data.skeleton import ARRAYS as ARRAYS_OF_SKELETONS
from glsk_o3d.samples import torus

TOOL = "fuzz"


@pytest.mark.parametrize(
    ("what", "cases"), [("arrays", 8), ("files", 80), ("lies", 80), ("named", 15), ("skeletons", 20)]
)
def test_nothing_is_found(call, what, cases):
    told = call(what, "--runs", cases, "--seed", 1)
    _, *counts = told.strip().splitlines()[-1].split()
    findings, counts = counts[-1], counts[:-1] if what == "arrays" else counts[:-3]  # less the seconds and the memory
    assert int(findings) == 0
    assert sum(map(int, counts)) == cases
    assert int(counts[-1]) > 0


def test_every_reader_reads_the_files_that_are_to_be_damaged(parts, tmp_path):
    for name, data in parts.fuzz_files.seeds().items():
        kind, ending = name.split()[:2]
        path = tmp_path / ("ledger.jsonl" if kind == "ledger" else f"f{ending}")
        path.write_bytes(data)
        parts.fuzz_files.READERS[kind](path)
    assert {name.split()[0] for name in parts.fuzz_files.seeds()} == set(parts.fuzz_files.READERS)


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


def test_what_is_wrong_is_found(parts):
    """In a skeleton that no constructor has checked."""
    ring = skeletonize(torus(300).points)
    far, owner, edges = (each.copy() for each in (ring.vertices, ring.vertex_of_point, ring.edges))
    far[0, 0], owner[3], edges[2] = 9, len(ring.vertices), [4, 4]
    wrong = {"outside": dict(vertices=far), "vertex_of_point": dict(vertex_of_point=owner), "edges": dict(edges=edges)}
    for said, changes in wrong.items():
        spoilt = object.__new__(Skeleton)
        spoilt.__dict__.update({**ring.__dict__, **changes})
        assert said in parts.fuzz_arrays.unsound(spoilt, ring.points, 0.05)[0]
    assert parts.fuzz_arrays.unsound(ring, ring.points, 0.05) == []


@pytest.mark.parametrize("n", [300, 1500])
def test_every_kind_that_is_timed_has_about_as_many_points(parts, n):
    for kind, draw in parts.fuzz_times.KINDS.items():
        cloud = draw(n, np.random.default_rng(0))
        assert cloud.shape[1] == 3, kind
        assert np.isfinite(cloud).all(), kind
        assert 0.4 * n < len(cloud) < 2.5 * n, kind
        np.testing.assert_array_equal(cloud, draw(n, np.random.default_rng(0)), kind)
    assert len(parts.fuzz_times.KINDS) * len(parts.fuzz_times.SIZES) >= 300


def test_a_cloud_that_takes_longer_than_others_is_found(tool, parts, monkeypatch, capsys):
    """Once more, to be sure."""
    sizes, kinds = parts.fuzz_times.SIZES, [*parts.fuzz_times.KINDS]
    asked = []

    def outcomes(what, seed, numbers):
        asked.extend(numbers)
        slow = {1: 6.1, len(kinds) + 2: 4.9}
        return [tool.Outcome(number, kinds[0], "skeleton", [], seconds=slow.get(number, 1.0)) for number in numbers]

    monkeypatch.setattr(tool, "run_cases", outcomes)
    for given, slow in ((f"{sizes[0]},{sizes[1]}", True), (f"{sizes[1]}", False)):
        with pytest.raises(typer.Exit) as stop:
            tool.times(seed=3, case=None, sizes=given)
        assert bool(stop.value.exit_code) is slow
    told = capsys.readouterr().out
    assert f"times --seed 3 --case 1  # {kinds[1]} of {sizes[0]} points: 6.1 times" in told
    assert told.count("--case") == 1
    assert asked.count(1) == 2


def test_a_case_is_timed(parts):
    kind, told, seconds = parts.fuzz_times.time_case(0, [*parts.fuzz_times.KINDS].index("even line"))
    assert (kind, told) == (f"{parts.fuzz_times.SIZES[0]} even line", "skeleton")
    assert seconds > 0
