"""The speed benchmark: its stopwatch, its arithmetic, its table of stages, and its commands on tiny clouds."""

import json
import math
import mmap
import os
import sys
from itertools import count
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from glsk_o3d import LPRReducer, Skeleton, contractor, numerics, pipelines
from glsk_o3d.numerics.cores import cores
from glsk_o3d.samples import sauropod


@pytest.fixture(scope="module")
def tool(benchmark):
    with benchmark("speed") as module:
        yield module


@pytest.fixture(scope="module")
def parts(tool):
    """The modules that it is made of, by their names."""
    made_of = {"_speed", "_common"}
    found = ((name.split("."), module) for name, module in sys.modules.items())
    return SimpleNamespace(**{name[1]: module for name, module in found if name[0] in made_of and name[1:]})


@pytest.fixture(scope="module")
def stopwatch(parts):
    return parts.stopwatch


@pytest.fixture
def call(call, parts, monkeypatch):
    """Run a command, small clouds only as often as asked for; gives what it printed."""
    monkeypatch.setattr(parts.timing, "LEAST", 0.0)
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


class TestStopwatch:
    def shares(self, watch):
        return {name: (share.calls, share.cpu) for name, share in watch.shares.items() if share.cpu}

    def test_of_an_open_stage_what_is_inside_counts_for_itself(self, stopwatch, played):
        module, spend = played
        stages = dict(all=stopwatch.Stage("played:outer", open=True), part=stopwatch.Stage("played:inner"))
        with stopwatch.Stopwatch(stages) as watch:
            spend(0.5)
            assert module.outer() == "done"
            module.outer()
        assert self.shares(watch) == {"all": (2, 6.0), "part": (2, 6.0), "rest": (0, 0.5)}
        assert (watch.cpu, watch.wall) == (12.5, 125.0)

    def test_a_closed_stage_has_all_that_is_inside(self, stopwatch, played):
        module, _ = played
        stages = dict(all=stopwatch.Stage("played:outer"), part=stopwatch.Stage("played:inner"))
        with stopwatch.Stopwatch(stages) as watch:
            module.outer()
            module.inner()
        assert self.shares(watch) == {"all": (1, 6.0), "part": (1, 3.0)}

    def test_what_comes_after_an_inner_stage_may_be_another(self, stopwatch, played):
        module, _ = played
        stages = dict(before=stopwatch.Stage("played:outer", open=True), part=stopwatch.Stage("played:inner"))
        stages["after"] = stopwatch.Stage(after=("before", "part"))
        with stopwatch.Stopwatch(stages) as watch:
            module.outer()
            module.inner()
        assert self.shares(watch) == {"before": (1, 1.0), "part": (2, 6.0), "after": (1, 2.0)}

    def test_everything_is_as_before_also_after_an_error(self, stopwatch, played):
        module, _ = played
        originals = dict(vars(module))
        stages = dict(all=stopwatch.Stage("played:outer", open=True), part=stopwatch.Stage("played:inner"))
        watch = stopwatch.Stopwatch(stages)
        with pytest.raises(ValueError, match="no"), watch:
            module.outer(fail=True)
        assert vars(module) == originals
        assert self.shares(watch) == {"all": (1, 1.0), "part": (1, 3.0)}

    def test_functions_are_found_wherever_the_package_knows_them(self, stopwatch, parts):
        linear, run = contractor.cotangent_laplacian, LPRReducer._run
        with stopwatch.Stopwatch(parts.table_of_stages.STAGES):
            assert contractor.cotangent_laplacian is numerics.cotangent.cotangent_laplacian is not linear
            assert LPRReducer._run is not run
        assert contractor.cotangent_laplacian is numerics.cotangent.cotangent_laplacian is linear
        assert LPRReducer._run is run

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


class TestTableOfStages:
    def test_its_functions_exist(self, stopwatch, parts):
        stopwatch.find(parts.table_of_stages.STAGES)

    @pytest.mark.parametrize(
        "path", ["numerics.rings:no_such", "no_such:star_rings", "contractor:Contractor.__or__", "contractor:LINE"]
    )
    def test_a_function_that_is_no_more_is_named(self, stopwatch, path):
        with pytest.raises(LookupError, match=f"'rings'.* no function {path} of its own"):
            stopwatch.find({"rings": stopwatch.Stage(path)})

    def test_a_stage_of_nothing_is_refused(self, stopwatch):
        with pytest.raises(LookupError, match="'rings' needs"):
            stopwatch.find({"rings": stopwatch.Stage()})
        with pytest.raises(LookupError, match="'rings' needs"):
            stopwatch.find({"rings": stopwatch.Stage(after=("no", "such"))})

    def test_the_default_pipeline_goes_through_every_stage(self, stopwatch, parts, monkeypatch):
        points = sauropod(2400, noise=0.01).points
        pipelines.default()(points)  # so that nothing is imported below
        ticks = count()
        monkeypatch.setattr(stopwatch, "_clocks", lambda: (next(ticks), 0.0))
        with stopwatch.Stopwatch(parts.table_of_stages.STAGES) as watch:
            skeleton = pipelines.default()(points)
        calls = {name: share.calls for name, share in watch.shares.items() if name != stopwatch.REST}
        assert min(calls.values()) > 0, calls
        solves = calls["Laplacian"]
        assert solves == len(skeleton.report.iterations) == calls["refinement of the solve"]
        assert all(share.cpu > 0 for share in watch.shares.values())
        assert watch.cpu == next(ticks) - 1  # nothing is lost, nothing counts twice


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
        assert math.isnan(parts.stages.growth([256, 4096], [1, 2], *parts.stages.MIDDLE))
        assert math.isnan(parts.stages.growth([256, 4096], [0, 2]))

    def test_turns(self, parts, monkeypatch):
        monkeypatch.setattr(parts.timing, "LEAST", 0.0)
        order = []
        found = parts.timing.in_turns({name: lambda name=name: order.append(name) or name for name in "ab"}, 3)
        assert order == [*"ababab"]
        assert {name: (result, facts["runs"]) for name, (result, facts) in found.items()} == {
            "a": ("a", 3),
            "b": ("b", 3),
        }

    def test_turns_go_on_while_they_are_short(self, parts, monkeypatch):
        now = iter(range(100))
        monkeypatch.setattr(parts.timing, "LEAST", 8.0)
        monkeypatch.setattr(parts.timing.time, "process_time", lambda: float(next(now)))
        monkeypatch.setattr(parts.stopwatch, "_clocks", lambda: (0.0, 0.0))
        assert parts.timing.in_turns({"a": str}, 1)["a"][1]["runs"] == 8

    def test_short(self, parts):
        assert [parts.tables.short(value) for value in (0.1234, 9.876, 98.76, 987.6)] == ["0.12", "9.88", "98.8", "988"]

    def test_named_contractions_are_the_pipelines(self, parts):
        found = parts.figures.contractors(4)
        for name, key in parts.figures.shown().items():
            ahead, contractor = found[key]
            rings, same = getattr(pipelines, name)().stages[:2]
            assert ahead.stages == (rings,)
            aside = {"reduce_above"} if contractor.reducer is None else set()  # says nothing without a reducer
            for field in vars(same).keys() - aside:
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
        (_, header, (line,)), *_ = parts.figures.figure_tables(
            [row, dict(n=1024, shape="mug", fixed=4, failure="ValueError: no")]
        )
        cells = dict(zip(header, line, strict=True))
        assert cells["against cao2010"] == "0.38 (0.38 to 0.38)"
        assert cells["LPR, own rule"] == "0.50 (0.50 to 0.50)"
        assert cells["own rule, no LPR"] == "0.75 (0.75 to 0.75)"
        assert (cells["clouds"], cells["paper"], cells["of these"]) == ("1", "about 1", "1")

    def test_whole_pipelines_in_knn(self, parts):
        rows = [contracted(parts, shape) for shape in ("tube", "mug")]
        rows[1]["whole"] = dict(rows[0]["whole"], default=16.0)
        title, header, lines = parts.figures.figure_tables(rows)[-1]
        assert (title, header[-2:]) == ("end to end, in kNN", ["mean", "most"])
        assert lines[0] == ["cao2010", "1024", "10.0 (10.0 to 10.0)", "10.0", "10.0"]
        assert lines[2] == ["default", "1024", "14.0 (13.0 to 15.0)", "14.0", "16.0"]

    def test_failures_are_lines(self, parts):
        failed = dict(measure="figures", n=512, shape="mug", fixed=4, failure="ValueError: no")
        assert ["512", "mug", "ValueError: no"] in parts.figures.figure_tables([failed])[-1][2]
        failed = dict(measure="stages", n=512, shape="mug", pipeline="default", failure="ValueError: no")
        assert parts.stages.stage_tables([failed])[0][2] == [["default", "512", *"-" * 8, "mug: ValueError: no"]]


class TestPictures:
    def test_tables_come_back_from_a_page(self, parts, tmp_path):
        tables = [("whole", ["", "points", "note"], [["default", "512", ""], ["", "-", "mug: no"]])]
        tables += [("default: CPU ms (in kNN)", ["", "512"], [["rings", "1.0 (0.50)"]])]
        page = tmp_path / "page.md"
        page.write_text("<!-- machine -->\n<!-- end -->\n<!-- stages -->\n<!-- end -->\n")
        parts.tables.fill(page, {"machine": "| no table |\n", "stages": tables})
        assert parts.pictures.tables_of(page, "stages") == tables

    def test_every_stage_is_in_one_share(self, stopwatch, parts):
        shown = [stage for stages, _ in parts.table_of_stages.SHARES.values() for stage in stages]
        assert sorted(shown) == sorted([*parts.table_of_stages.STAGES, stopwatch.REST])

    @pytest.mark.parametrize(("n", "words"), [(300, "300"), (4096, "4k"), (1536, "1.5k"), (2**20, "1M")])
    def test_thousands(self, parts, n, words):
        assert parts.pictures.thousands(n) == words

    def test_nothing_to_show_is_no_picture(self, parts, tmp_path):
        failed = dict(measure="stages", n=512, shape="mug", pipeline="default", failure="ValueError: no")
        parts.pictures.draw_stages(parts.stages.stage_tables([failed]), tmp_path)
        assert list(tmp_path.iterdir()) == []


class TestCommands:
    def test_stages(self, call, tmp_path):
        out = tmp_path / "out.json"
        words = ("stages", "--sizes", "256,512", "--published-to", 256, "--repeat", 1, "--jobs", 0)
        printed = call(*words, "--markdown", "-o", out)
        assert "left out: wen2024, cao2010 on 512 points" in printed
        assert "Measured on " in printed
        assert "| whole | " in printed
        told = json.loads(out.read_text())
        assert {"commit", "machine", "versions", "command"} < set(told)
        rows = told["rows"]
        assert [(row["n"], row["pipeline"]) for row in rows] == [
            *((256, name) for name in ("default", "wen2024", "cao2010")),
            (512, "default"),
        ]
        for row in rows:
            assert row["cpu"] == pytest.approx(sum(part["cpu"] for part in row["stages"].values()), rel=1e-6)
            assert min(row["cpu"], row["knn_cpu"], row["iterations"], row["vertices"]) > 0
        assert "| LPR |" not in printed.partition("cao2010: CPU")[2]

    def test_memory_is_that_of_a_fresh_process(self, parts, tmp_path):
        np.save(tmp_path / "cloud.npy", sauropod(20000).points)
        job = dict(n=20000), (tmp_path / "cloud.npy", pipelines.cao2010())
        (row,) = parts.runs.run(parts.stages.most_memory, [job], 1, fresh=True)
        assert 20 < row["peak"] < 200
        if row["stage_peaks"]:
            assert row["peak"] == max(row["stage_peaks"].values())
            assert row["stage_peaks"]["order"] < 20

    def test_a_process_that_dies_is_a_failure_of_its_job_alone(self, parts):
        rows = parts.runs.run(os._exit, [(dict(name="bad"), (1,))], 1, fresh=True)
        assert rows == [dict(name="bad", failure="its process died: exit code 1")]

    def test_figures(self, call, tmp_path, parts):
        out = tmp_path / "out.json"
        words = ("figures", "--builtin", "--shapes", "tube,torus", "--sizes", "256,300", "--jobs", 0)
        printed = call(*words, "-o", out, "--pictures", tmp_path / "new", "--markdown")
        rows = json.loads(out.read_text())["rows"]
        assert [(row["n"], row["shape"]) for row in rows] == [
            (300, "tube"),
            (300, "torus"),
            (256, "tube"),
            (256, "torus"),
        ]
        for row in rows:
            left = {name: parts.figures.take(row, key)["left"] for name, key in parts.figures.shown().items()}
            assert left["cao2010"] == row["n"] > left["wen2024"]
            assert all(run["solves"] == 4 for run in row["runs"] if run["key"][2] == "fixed" and not run["refused"])
            assert all(row["whole"][name] > 0 for name in parts.figures.WHOLE)
        assert printed.count("| 300 | 2 | ") == 2
        assert {path.name for path in (tmp_path / "new").iterdir()} == {"contraction_256.png", "contraction_300.png"}

    def test_scans_of_a_folder(self, call, tmp_path, monkeypatch):
        shape = sauropod(300)
        axis = dict(nodes=shape.nodes, edges=shape.edges, radii=shape.radii)
        np.savez(tmp_path / "shape.npz", **axis, clean_256=shape.points[:256])
        np.savetxt(tmp_path / "scan.xyz", shape.points)
        listed = [dict(name="scan", path="scan.xyz", n_points=300), dict(name="few", path="few.xyz", n_points=200)]
        (tmp_path / "data").mkdir()
        (tmp_path / "data" / "manifest.json").write_text(json.dumps([listed[0] | dict(path="../scan.xyz"), listed[1]]))
        monkeypatch.setenv("GLSK_DATA", str(tmp_path / "data"))
        out = tmp_path / "out.json"
        printed = call("figures", tmp_path, "--sizes", 256, "--jobs", 0, "-o", out)
        assert "left out: 1 clouds of less than 256 points" in printed
        assert "built-in" not in printed
        rows = json.loads(out.read_text())["rows"]
        assert [(row["shape"], row["n"], row["runs"][0]["contracted"]) for row in rows] == [
            ("shape", 256, 256),
            ("scan", 256, 256),
        ]

    def test_sizes_that_a_folder_lacks_are_of_built_in_shapes(self, parts, tmp_path, monkeypatch):
        shape = sauropod(256)
        axis = dict(nodes=shape.nodes, edges=shape.edges, radii=shape.radii)
        np.savez(tmp_path / "shape.npz", **axis, clean_256=shape.points)
        monkeypatch.setenv("GLSK_DATA", str(tmp_path / "none"))
        found = parts.figures.objects(tmp_path, False, "", [256, 512])
        assert [(n, cloud.shape) for n, cloud in found] == [
            (256, "shape"),
            *((512, name) for name in parts.clouds.BUILTIN),
        ]
        assert all(len(cloud.load()[0]) == n for n, cloud in found)

    def test_rate(self, call, tmp_path):
        before = os.environ.get("OMP_NUM_THREADS")
        out = tmp_path / "out.json"
        call("rate", "--sizes", 256, "--repeat", 1, "--jobs", 0, "-o", out)
        rows = json.loads(out.read_text())["rows"]
        assert [row["threads"] for row in rows] == sorted({1, cores()})
        for row in rows:
            assert 0 < row["import_wall"] + row["first_wall"] < row["process_wall"]
            assert row["wall"] > 0
        assert os.environ.get("OMP_NUM_THREADS") == before

    def test_all_fill_a_page(self, call, tmp_path, root):
        page = tmp_path / "speed.md"
        page.write_text((root / "docs" / "speed.md").read_text().partition("## Clouds as scanners")[0])
        (tmp_path / "images").mkdir()
        words = ("--sizes", "256,512", "--figure-sizes", "256", "--pipeline", "default", "--shapes", "tube")
        printed = call("all", page, "--builtin", *words, "--repeat", 1, "--jobs", 0, "--markdown")
        text = page.read_text()
        assert text.count("| default | 512 |") == 1
        assert text.count("| 256 | 1 | ") == 3
        assert text.count("\nMeasured on ") == 1
        assert text.count("<!-- end -->") == 4
        assert "| 16384 |" not in text  # what was there before
        assert [line for line in printed.splitlines() if line.startswith("|")] == [
            line for line in text.splitlines() if line.startswith("|")
        ]
        pictures = {path.stem: path.read_bytes() for path in (tmp_path / "images").iterdir()}
        assert set(pictures) == {"contraction_256", "speed_growth", "speed_shares"}
        call("redraw", page, tmp_path / "again")
        for path in (tmp_path / "again").iterdir():
            assert path.read_bytes() == pictures.pop(path.stem)
        assert set(pictures) == {"contraction_256"}

    def test_large(self, call, tmp_path, root):
        page, out = tmp_path / "speed.md", tmp_path / "out.json"
        page.write_text("before\n<!-- large -->\nold\n<!-- end -->\nafter\n")
        words = ("--sizes", "400,300", "--shapes", "tube,torus", "--jobs", 0, "--markdown")
        printed = call("large", page, *words, "-o", out)
        rows = json.loads(out.read_text())["rows"]
        assert [(row["shape"], row["n"], row["sampled"]) for row in rows] == [
            (shape, n, n) for shape in ("tube", "torus") for n in (300, 400)
        ]
        for row in rows:
            assert min(row["cpu"], row["wall"], row["vertices"]) > 0
            assert row["loops"] == (row["shape"] == "torus")
        for row in rows[1::2]:
            assert row["base"] == 300
            assert row["same_loops"]
            assert 0 < row["mean"] < row["most"] < 10
        lines = [line for line in printed.splitlines() if line.startswith("|")]
        assert len(lines) == 6
        assert "file" not in lines[0]
        assert [line for line in page.read_text().splitlines() if line.startswith("|")] == lines
        assert page.read_text().count("\nMeasured on ") == 1
        assert "old" not in page.read_text()

    def test_large_from_file_to_file(self, call, tmp_path):
        out = tmp_path / "out.json"
        printed = call("large", "--sizes", 300, "--shapes", "tube", "--file", "--jobs", 0, "-o", out, "--markdown")
        (row,) = json.loads(out.read_text())["rows"]
        assert min(row["file_cpu"], row["file_wall"]) > 0
        assert 100 < row["file_peak"] < 2000
        assert "file MB" in printed

    def test_huge(self, call, tmp_path):
        pytest.importorskip("laspy")
        page, out = tmp_path / "speed.md", tmp_path / "out.json"
        page.write_text("before\n<!-- huge -->\nold\n<!-- end -->\nafter\n")
        words = (
            "--points",
            9000,
            "--against",
            5000,
            "--endings",
            ".ply,.laz",
            "--labelled",
            ".laz",
            "--folder",
            tmp_path,
        )
        printed = call("huge", page, *words, "-o", out, "--markdown")
        small, *rows = json.loads(out.read_text())["rows"]
        assert (small["n"], small["loops"], small["components"]) == (5000, 1, 1)
        assert [row["file"] for row in rows] == [".ply", ".laz", ".laz: labels"]
        assert rows[2]["size"] > rows[0]["size"]  # of what is written
        for row in rows[:2]:
            assert (row["n"], row["loops"], row["components"]) == (9000, 1, 1)
            assert 0 < row["mean"] < row["most"] < 10
        for row in rows:
            assert min(row["file_cpu"], row["file_wall"], row["size"]) > 0
        lines = [line for line in printed.splitlines() if line.startswith("|")]
        assert len(lines) == 6
        assert [line for line in page.read_text().splitlines() if line.startswith("|")] == lines
        assert sorted(path.name for path in tmp_path.glob("huge_*")) == [
            f"huge_9000.{it}" for it in ("laz", "npz", "ply")
        ]
        assert not (tmp_path / "labelled.ply").exists()

    def test_distance_of_curves(self, parts):
        ends = np.array([[0.0, 0, 0], [10, 0, 0]])
        curve, beside = (Skeleton(ends + [0, y, 0], np.array([[0, 1]]), np.ones(2), (), (), ()) for y in (0, 1))
        assert parts.large.apart(curve, beside, 20) == pytest.approx((5, 5))
        longer = Skeleton(ends * 2, curve.edges, curve.radii, (), (), ())
        mean, most = parts.large.apart(longer, curve, 20)
        assert most == pytest.approx(50, abs=0.1)
        assert mean == pytest.approx((100 * 5 / 20 / 2 + 0) / 2, abs=0.1)  # half of it is 5 away on average, back none

    def test_failures_of_large_clouds_are_lines(self, parts):
        failed = dict(measure="large", shape="tube", n=300, failure="ValueError: no")
        ((_, header, (line,)),) = parts.large.large_tables([failed])
        assert len(header) == len(line)
        assert line == ["tube", "300", *"-" * 9, "ValueError: no"]

    @pytest.mark.parametrize(
        "wrong",
        [
            ("stages", "--sizes", "1k"),
            ("stages", "--shapes", "teapot"),
            ("stages", "--kind", "dirty"),
            ("stages", "--pipeline", "wen2023"),
            ("figures", "no_such_folder"),
            ("rate", "--shape", "teapot"),
            ("rate", "--pipeline", "wen2023"),
            ("large", "no_such_page.md"),
            ("large", "README.md"),
            ("large", "--shapes", "teapot"),
            ("all", "no_such_page.md", "--builtin"),
            ("all", "README.md", "--builtin"),
        ],
    )
    def test_wrong_usage_is_found_at_once(self, call, wrong, root, monkeypatch):
        monkeypatch.chdir(root)
        assert "Invalid value" in call(*wrong, code=2)
