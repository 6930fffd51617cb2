"""The speed benchmark: its stopwatch, its arithmetic, its table of stages, and its commands on tiny clouds."""

import json
from itertools import count

import numpy as np
import pytest
from glsk_studies import large, rates, speed, stopwatch

from glsk_o3d import Skeleton, pipelines
from glsk_o3d.geometry.cores import cores
from glsk_o3d.samples import sauropod

STUDY = speed


@pytest.fixture
def call(call, monkeypatch):
    """Run a command, small clouds only as often as asked for; gives what it printed."""
    monkeypatch.setattr(stopwatch, "LEAST", 0.0)
    return call


class TestStopwatch:
    def test_the_default_pipeline_goes_through_every_stage(self, monkeypatch):
        points = sauropod(4000, noise=0.01).points
        pipelines.default()(points)  # so that nothing is imported below
        ticks = count()
        monkeypatch.setattr(stopwatch, "_cpu", lambda: next(ticks))
        with stopwatch.Stopwatch(stopwatch.STAGES) as watch:
            skeleton = pipelines.default()(points)
        calls = {name: share.calls for name, share in watch.shares.items() if name != stopwatch.REST}
        assert min(calls.values()) > 0, calls
        assert calls["Laplacian"] == len(skeleton.report.iterations) == calls["refinement of the solve"]
        assert all(share.cpu > 0 for share in watch.shares.values())
        assert watch.cpu == next(ticks) - 1  # nothing is lost, nothing counts twice
        shown = [stage for stages, _ in stopwatch.SHARES.values() for stage in stages]
        assert sorted(shown) == sorted([*stopwatch.STAGES, stopwatch.REST])


class TestArithmetic:
    def test_distance_of_curves(self):
        ends = np.array([[0.0, 0, 0], [10, 0, 0]])
        curve, beside = (Skeleton(ends + [0, y, 0], np.array([[0, 1]]), np.ones(2), (), (), ()) for y in (0, 1))
        assert large.apart(curve, beside, 20) == pytest.approx((5, 5))
        longer = Skeleton(ends * 2, curve.edges, curve.radii, (), (), ())
        mean, most = large.apart(longer, curve, 20)
        assert most == pytest.approx(50, abs=0.1)
        assert mean == pytest.approx((100 * 5 / 20 / 2 + 0) / 2, abs=0.1)  # half of it is 5 away on average, back none


class TestCommands:
    def test_all_fill_a_page(self, call, tmp_path, root):
        page, out = tmp_path / "speed.md", tmp_path / "out.json"
        page.write_text((root / "docs" / "speed.md").read_text().partition("## Streams")[0])
        (tmp_path / "images").mkdir()
        words = ("--sizes", "256,512", "--figure-sizes", "256", "--published-to", 256, "--shapes", "tube")
        printed = call("all", page, "--builtin", *words, "--repeat", 1, "--jobs", 0, "-o", out)
        assert "left out: wen2024 on 512 points, cao2010 on 512 points" in printed
        text = page.read_text()
        assert text.count("| default | 512 |") == text.count("| wen2024 | 256 |") - 2 == 1
        assert text.count("\nMeasured on ") == 1
        assert text.count("<!-- end -->") == 4
        assert "| default | 16384 |" not in text  # what was there before
        assert "| LPR |" not in text.partition("cao2010: CPU")[2].partition("<!-- end -->")[0]
        tables = [[line for line in each.splitlines() if line.startswith("|")] for each in (printed, text)]
        assert tables[0] == tables[1]
        pictures = {path.stem for path in (tmp_path / "images").iterdir()}
        assert pictures == {"contraction_256", "speed_growth", "speed_shares"}
        rows = json.loads(out.read_text())["rows"]
        rates = [row for row in rows if row["measure"] == "rate"]
        assert [row["threads"] for row in rates] == sorted({1, cores()})
        for row in rates:
            assert 0 < row["import_wall"] + row["first_wall"] < row["process_wall"]

    def test_stream(self, call, tmp_path, monkeypatch):
        monkeypatch.setattr(rates, "FRAMES", 3)
        page, out = tmp_path / "speed.md", tmp_path / "out.json"
        page.write_text("<!-- stream -->\nold\n<!-- end -->\n")
        call("stream", page, "--sizes", "400", "--scenes", "handles", "--repeat", 1, "-o", out)
        rows = json.loads(out.read_text())["rows"]
        assert [row["workers"] for row in rows] == sorted({1, cores()})
        assert all(row["same"] and 0 < row["least"] <= row["wall"] <= row["most"] for row in rows)
        assert "| handles | 400 | 1 |" in page.read_text()

    def test_large(self, call, tmp_path):
        page, out = tmp_path / "speed.md", tmp_path / "out.json"
        page.write_text("before\n<!-- large -->\nold\n<!-- end -->\nafter\n")
        words = ("--sizes", "400,300", "--shapes", "torus", "--file", "--jobs", 0)
        printed = call("large", page, *words, "-o", out)
        first, second = json.loads(out.read_text())["rows"]
        assert [(row["n"], row["sampled"], row["loops"]) for row in (first, second)] == [(300, 300, 1), (400, 400, 1)]
        assert (second["base"], second["same_loops"]) == (300, True)
        assert 0 < second["mean"] < second["most"] < 10
        assert min(second["file_cpu"], second["file_wall"]) > 0
        assert 50 < second["file_peak"] < 2000
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
