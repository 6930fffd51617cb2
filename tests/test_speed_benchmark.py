"""The speed benchmark: its stopwatch, its arithmetic, its table of stages, and its commands on tiny clouds."""

import json
import math
import mmap
import sys
from itertools import count
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from glsk_o3d import Contractor, Skeleton, pipelines
from glsk_o3d.numerics.cores import cores
from glsk_o3d.samples import sauropod


@pytest.fixture(scope="module")
def tool(benchmark):
    with benchmark("speed") as module:
        yield module


@pytest.fixture(scope="module")
def parts(tool):
    """The modules that it is made of, by their names."""
    return SimpleNamespace(**{it: sys.modules[f"_{it}"] for it in ("stages", "figures", "large", "runs", "tables")})


@pytest.fixture(scope="module")
def stopwatch(tool):
    return sys.modules["_stopwatch"]


@pytest.fixture
def call(call, stopwatch, monkeypatch):
    """Run a command, small clouds only as often as asked for; gives what it printed."""
    monkeypatch.setattr(stopwatch, "LEAST", 0.0)
    return call


@pytest.fixture
def played(stopwatch, monkeypatch):
    """A module of the package whose functions take a time that they say; gives its functions, and the clock."""
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(stopwatch, "_clocks", lambda: (clock.now, 10 * clock.now))
    module = ModuleType("glsk_o3d.played")
    monkeypatch.setitem(sys.modules, module.__name__, module)

    def spend(seconds):
        clock.now += seconds

    def inner(fail=False):
        spend(3)
        if fail:
            raise ValueError("no")

    def outer(fail=False):
        spend(1)
        module.inner(fail)
        spend(2)
        return "done"

    vars(module).update(outer=outer, inner=inner)
    return module, spend


def shares(watch):
    return {name: (share.calls, share.cpu) for name, share in watch.shares.items() if share.cpu}


class TestStopwatch:
    @pytest.mark.parametrize(
        ("open_", "after", "expected"),
        [
            (True, None, {"all": (1, 3.0), "part": (2, 6.0), "rest": (0, 0.5)}),  # what is inside counts for itself
            (False, None, {"all": (1, 6.0), "part": (1, 3.0), "rest": (0, 0.5)}),
            (True, ("all", "part"), {"all": (1, 1.0), "part": (2, 6.0), "after": (1, 2.0), "rest": (0, 0.5)}),
        ],
    )
    def test_stages_in_stages(self, stopwatch, played, open_, after, expected):
        module, spend = played
        stages = dict(all=stopwatch.Stage("played:outer", open=open_), part=stopwatch.Stage("played:inner"))
        if after:
            stages["after"] = stopwatch.Stage(after=after)
        with stopwatch.Stopwatch(stages) as watch:
            spend(0.5)
            assert module.outer() == "done"
            module.inner()
        assert shares(watch) == expected
        assert (watch.cpu, watch.wall) == (9.5, 95.0)

    def test_everything_is_as_before_also_after_an_error(self, stopwatch, played):
        module, _ = played
        originals = dict(vars(module))
        stages = dict(all=stopwatch.Stage("played:outer", open=True), part=stopwatch.Stage("played:inner"))
        watch = stopwatch.Stopwatch(stages)
        with pytest.raises(ValueError, match="no"), watch:
            module.outer(fail=True)
        assert vars(module) == originals
        assert shares(watch) == {"all": (1, 1.0), "part": (1, 3.0)}

    def test_peaks(self, stopwatch, played):
        if not stopwatch.reset_peak():
            pytest.skip("this system cannot reset the peak of a process")
        module, _ = played

        def fill(size):  # straight from the system: an array may be memory that was freed before and is still resident
            with mmap.mmap(-1, size * stopwatch.MB) as block:
                for _ in range(size):
                    block.write(bytes(stopwatch.MB))

        module.inner = lambda: fill(64)
        module.outer = lambda: (module.inner(), fill(16))
        stages = dict(all=stopwatch.Stage("played:outer", open=True), part=stopwatch.Stage("played:inner"))
        before = stopwatch.resident()
        with stopwatch.Stopwatch(stages, memory=True) as watch:
            module.outer()
        grown = {name: (share.peak - before) / stopwatch.MB for name, share in watch.shares.items()}
        assert grown["part"] == pytest.approx(64, abs=4)
        assert grown["all"] == pytest.approx(16, abs=4)
        assert grown["rest"] < 4

    @pytest.mark.parametrize("path", ["numerics.rings:no_such", "no_such:star_rings", "contractor:Contractor.__or__"])
    def test_a_function_that_is_no_more_is_named(self, stopwatch, path):
        with pytest.raises(LookupError, match=f"'rings'.* no function {path} of its own"):
            stopwatch.find({"rings": stopwatch.Stage(path)})

    def test_the_default_pipeline_goes_through_every_stage(self, stopwatch, monkeypatch):
        points = sauropod(2400, noise=0.01).points
        pipelines.default()(points)  # so that nothing is imported below
        ticks = count()
        monkeypatch.setattr(stopwatch, "_clocks", lambda: (next(ticks), 0.0))
        with stopwatch.Stopwatch(stopwatch.STAGES) as watch:
            skeleton = pipelines.default()(points)
        calls = {name: share.calls for name, share in watch.shares.items() if name != stopwatch.REST}
        assert min(calls.values()) > 0, calls
        assert calls["Laplacian"] == len(skeleton.report.iterations) == calls["refinement of the solve"]
        assert all(share.cpu > 0 for share in watch.shares.values())
        assert watch.cpu == next(ticks) - 1  # nothing is lost, nothing counts twice
        shown = [stage for stages, _ in stopwatch.SHARES.values() for stage in stages]
        assert sorted(shown) == sorted([*stopwatch.STAGES, stopwatch.REST])

    def test_turns(self, stopwatch, monkeypatch):
        monkeypatch.setattr(stopwatch, "LEAST", 0.0)
        order = []
        found = stopwatch.in_turns({name: lambda name=name: order.append(name) or name for name in "ab"}, 3)
        assert order == [*"ababab"]
        assert {name: (result, facts["runs"]) for name, (result, facts) in found.items()} == {
            "a": ("a", 3),
            "b": ("b", 3),
        }
        now = iter(range(100))
        monkeypatch.setattr(stopwatch, "LEAST", 8.0)
        monkeypatch.setattr(stopwatch, "_clocks", lambda: (0.0, 0.0))
        monkeypatch.setattr(stopwatch.time, "process_time", lambda: float(next(now)))
        assert stopwatch.in_turns({"a": str}, 1)["a"][1]["runs"] == 8


def contracted(parts, shape="tube", n=1024, **changed):
    """A row of `figures`: every contraction costs 8 s and takes four solves, but for those named."""
    runs = []
    for key in parts.figures.contractors(4):
        name = "_".join([key[0], "lpr" if key[1] else "all", key[2]])
        run = dict(key=list(key), cpu=8.0, wall=8.0, left=n // 2, contracted=n, solves=4, refused=False)
        runs.append(run | changed.get(name, {}))
    whole = {name: 10.0 + i for i, name in enumerate(parts.figures.WHOLE)}
    return dict(measure="figures", n=n, shape=shape, fixed=4, runs=runs, whole=whole)


class TestArithmetic:
    def test_growth_of_powers(self, parts):
        sizes = [256, 1024, 4096, 16384, 65536, 262144]
        assert parts.stages.growth(sizes, [3e-6 * n**1.7 for n in sizes]) == pytest.approx(1.7)
        bent = [n**0.5 if n < 4096 else n**1.25 for n in sizes]
        assert parts.stages.growth(sizes, bent, *parts.stages.MIDDLE) == pytest.approx(1.25)
        assert math.isnan(parts.stages.growth([256, 4096], [0, 2]))

    def test_named_contractions_are_the_pipelines(self, parts):
        found = parts.figures.contractors(4)
        for name, key in parts.figures.shown().items():
            ahead, contractor = found[key]
            *rings, same = getattr(pipelines, name)().stages[: len(ahead.stages) + 1]
            assert ahead.stages == (*rings,)
            assert isinstance(same, Contractor)
            for field in vars(same):
                assert getattr(contractor, field) == getattr(same, field), (name, field)

    def test_ratios_are_paired(self, parts):
        rows = [
            contracted(parts, wen2024_lpr_own=dict(cpu=2.0), wen2024_all_own=dict(cpu=4.0)),
            contracted(parts, wen2024_lpr_own=dict(cpu=1.0), wen2024_all_own=dict(cpu=4.0)),
            contracted(parts, wen2024_lpr_fixed=dict(cpu=2.0)),
            contracted(parts, wen2024_lpr_fixed=dict(cpu=4.0, solves=3, refused=True)),
        ]
        own, plain = ("wen2024", True, "own"), ("wen2024", False, "own")
        np.testing.assert_allclose(parts.figures.ratios(rows, own, plain), [0.5, 0.25, 1, 1])
        fixed = parts.figures.ratios(rows, ("wen2024", True, "fixed"), ("wen2024", False, "fixed"))
        np.testing.assert_allclose(fixed, [1, 1, 0.25])  # not the one that was refused a solve

    def test_the_gain_is_that_of_the_reduction_times_that_of_the_rule(self, parts):
        row = contracted(parts, wen2024_lpr_own=dict(cpu=3.0), wen2024_all_own=dict(cpu=6.0))
        other = contracted(parts, "mug", wen2024_lpr_own=dict(cpu=3.0), wen2024_all_own=dict(cpu=6.0))
        other["whole"] = dict(other["whole"], default=16.0)
        failed = dict(n=1024, shape="cup", fixed=4, failure="ValueError: no")
        (_, header, (line,)), *_, whole, failures = parts.figures.figure_tables([row, other, failed])
        cells = dict(zip(header, line, strict=True))
        assert cells["against cao2010"] == "0.38 (0.38 to 0.38)"
        assert cells["LPR, own rule"] == "0.50 (0.50 to 0.50)"
        assert cells["own rule, no LPR"] == "0.75 (0.75 to 0.75)"
        assert (cells["clouds"], cells["paper"], cells["of these"]) == ("2", "about 1", "2")
        assert whole[2][0] == ["cao2010", "1024", "10.0 (10.0 to 10.0)", "10.0", "10.0"]
        assert whole[2][2] == ["default", "1024", "14.0 (13.0 to 15.0)", "14.0", "16.0"]
        assert failures[2] == [["1024", "cup", "ValueError: no"]]

    def test_failures_are_lines(self, parts, tmp_path):
        failed = dict(n=300, shape="tube", pipeline="default", failure="ValueError: no")
        tables = parts.stages.stage_tables([failed])
        assert tables[0][2] == [["default", "300", *"-" * 8, "tube: ValueError: no"]]
        parts.stages.draw_growth(tables, tmp_path)
        parts.stages.draw_shares(tables, tmp_path)
        assert list(tmp_path.iterdir()) == []
        ((_, header, (line,)),) = parts.large.large_tables([failed])
        assert line == ["tube", "300", *"-" * 9, "ValueError: no"]
        assert len(header) == len(line)

    def test_distance_of_curves(self, parts):
        ends = np.array([[0.0, 0, 0], [10, 0, 0]])
        curve, beside = (Skeleton(ends + [0, y, 0], np.array([[0, 1]]), np.ones(2), (), (), ()) for y in (0, 1))
        assert parts.large.apart(curve, beside, 20) == pytest.approx((5, 5))
        longer = Skeleton(ends * 2, curve.edges, curve.radii, (), (), ())
        mean, most = parts.large.apart(longer, curve, 20)
        assert most == pytest.approx(50, abs=0.1)
        assert mean == pytest.approx((100 * 5 / 20 / 2 + 0) / 2, abs=0.1)  # half of it is 5 away on average, back none


class TestCommands:
    def test_figures_of_a_folder_and_of_scans(self, call, parts, tmp_path, monkeypatch):
        shape = sauropod(300)
        axis = dict(nodes=shape.nodes, edges=shape.edges, radii=shape.radii)
        np.savez(tmp_path / "shape.npz", **axis, clean_256=shape.points[:256])
        np.savetxt(tmp_path / "scan.xyz", shape.points)
        listed = [dict(name="scan", path="../scan.xyz", n_points=300), dict(name="few", path="few.xyz", n_points=200)]
        (tmp_path / "data").mkdir()
        (tmp_path / "data" / "manifest.json").write_text(json.dumps(listed))
        monkeypatch.setenv("GLSK_DATA", str(tmp_path / "data"))
        out = tmp_path / "out.json"
        printed = call("figures", tmp_path, "--sizes", 256, "--jobs", 0, "-o", out, "--pictures", tmp_path / "new")
        assert "left out: 1 clouds of less than 256 points" in printed
        assert {path.name for path in (tmp_path / "new").iterdir()} == {"contraction_256.png"}
        rows = json.loads(out.read_text())["rows"]
        assert [(row["shape"], row["n"]) for row in rows] == [("shape", 256), ("scan", 256)]
        for row in rows:
            left = {name: parts.figures.take(row, key)["left"] for name, key in parts.figures.shown().items()}
            assert left["cao2010"] == row["n"] > left["wen2024"]
            assert all(run["solves"] == 4 for run in row["runs"] if run["key"][2] == "fixed" and not run["refused"])

        monkeypatch.setenv("GLSK_DATA", str(tmp_path / "none"))  # sizes that a folder lacks are of built-in shapes
        found = parts.figures.objects(tmp_path, False, "", [256, 512])
        names = sys.modules["_clouds"].BUILTIN
        assert [(n, cloud.shape) for n, cloud in found] == [(256, "shape"), *((512, name) for name in names)]

        monkeypatch.setattr(parts.figures, "clouds", lambda folders, sizes: [("shapes", *found[0])])
        printed = call("scans", "--sizes", 256, "--jobs", 0, "--repeat", 1, "--markdown")
        assert printed.count("| shapes | 256 | ") == 2

    def test_all_fill_a_page(self, call, tmp_path, root):
        page, out = tmp_path / "speed.md", tmp_path / "out.json"
        page.write_text((root / "docs" / "speed.md").read_text().partition("## Clouds as scanners")[0])
        (tmp_path / "images").mkdir()
        words = ("--sizes", "256,512", "--figure-sizes", "256", "--published-to", 256, "--shapes", "tube")
        printed = call("all", page, "--builtin", *words, "--repeat", 1, "--jobs", 0, "--markdown", "-o", out)
        assert "left out: wen2024, cao2010 on 512 points" in printed
        text = page.read_text()
        assert text.count("| default | 512 |") == text.count("| wen2024 | 256 |") - 2 == 1
        assert text.count("\nMeasured on ") == 1
        assert text.count("<!-- end -->") == 4
        assert "| 16384 |" not in text  # what was there before
        assert "| LPR |" not in text.partition("cao2010: CPU")[2].partition("<!-- end -->")[0]
        tables = [[line for line in each.splitlines() if line.startswith("|")] for each in (printed, text)]
        assert tables[0] == tables[1]
        pictures = {path.stem for path in (tmp_path / "images").iterdir()}
        assert pictures == {"contraction_256", "speed_growth", "speed_shares"}
        rows = json.loads(out.read_text())["rows"]
        for row in (row for row in rows if row["measure"] == "stages"):
            assert row["cpu"] == pytest.approx(sum(part["cpu"] for part in row["stages"].values()), rel=1e-6)
            assert min(row["cpu"], row["knn_cpu"], row["iterations"], row["vertices"]) > 0
        rates = [row for row in rows if row["measure"] == "rate"]
        assert [row["threads"] for row in rates] == sorted({1, cores()})
        for row in rates:
            assert 0 < row["import_wall"] + row["first_wall"] < row["process_wall"]

    def test_large(self, call, tmp_path):
        page, out = tmp_path / "speed.md", tmp_path / "out.json"
        page.write_text("before\n<!-- large -->\nold\n<!-- end -->\nafter\n")
        words = ("--sizes", "400,300", "--shapes", "torus", "--file", "--jobs", 0, "--markdown")
        printed = call("large", page, *words, "-o", out)
        first, second = json.loads(out.read_text())["rows"]
        assert [(row["n"], row["sampled"], row["loops"]) for row in (first, second)] == [(300, 300, 1), (400, 400, 1)]
        assert (second["base"], second["same_loops"]) == (300, True)
        assert 0 < second["mean"] < second["most"] < 10
        assert min(second["file_cpu"], second["file_wall"]) > 0
        assert 100 < second["file_peak"] < 2000
        lines = [line for line in printed.splitlines() if line.startswith("|")]
        assert len(lines) == 4
        assert [line for line in page.read_text().splitlines() if line.startswith("|")] == lines
        assert "old" not in page.read_text()

    def test_huge(self, call, tmp_path):
        pytest.importorskip("laspy")
        out = tmp_path / "out.json"
        words = ("--endings", ".ply,.laz", "--labelled", ".laz", "--folder", tmp_path)
        call("huge", "--points", 9000, "--against", 5000, *words, "-o", out)
        small, *rows = json.loads(out.read_text())["rows"]
        assert (small["n"], small["loops"], small["components"]) == (5000, 1, 1)
        assert [row["file"] for row in rows] == [".ply", ".laz", ".laz: labels"]
        assert rows[2]["size"] > rows[0]["size"]  # of what is written
        for row in rows[:2]:
            assert (row["n"], row["loops"], row["components"]) == (9000, 1, 1)
            assert 0 < row["mean"] < row["most"] < 10
        assert {path.name for path in tmp_path.glob("huge_*")} == {f"huge_9000.{it}" for it in ("laz", "npz", "ply")}
        assert not (tmp_path / "labelled.ply").exists()

    @pytest.mark.parametrize(
        "wrong",
        [
            ("stages", "--sizes", "1k"),
            ("stages", "--pipeline", "wen2023"),
            ("large", "README.md"),
            ("large", "--shapes", "teapot"),
            ("all", "no_such_page.md", "--builtin"),
        ],
    )
    def test_wrong_usage_is_found_at_once(self, call, wrong, root, monkeypatch):
        monkeypatch.chdir(root)
        assert "Invalid value" in call(*wrong, code=2)
