"""Other tools on the public benchmark: their runs, the scores that are kept, and the tables that are made of them."""

import importlib
import math
import os
import re
import signal
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest
import typer
from glsk_bench import Repeat, Results, leaderboard, read_folder, read_results
from glsk_bench.scoring import OF_THINGS, Scores
from typer.testing import CliRunner

from glsk_o3d import read_skeleton
from glsk_o3d.analysis import compare
from glsk_o3d.skeleton import Skeleton

FAILED = dict(failure="not done after 5 s")
SHARES = ("perfect", "topology", "tips_f1", "junctions_f1")


@pytest.fixture(scope="module")
def tool(benchmark):
    with benchmark("leaderboard") as module:
        yield module


@pytest.fixture(scope="module")
def parts(tool):
    names = dict(tables="_leaderboard", runs="_runs", peers="_peers")
    return SimpleNamespace(**{name: sys.modules[module] for name, module in names.items()})


def row(shape="tubes_100", variant="clean", **values):
    facts = dict(shape=shape, variant=variant, family=shape.partition("_")[0], seconds=1.0)
    found = dict.fromkeys(Scores.__dataclass_fields__, 0) | dict.fromkeys(SHARES, 1.0) | dict(failure=None)
    return facts | found | dict(error=0.1, inside=1.0, completeness=1.0, ends=0.2, length=1.0) | values


def failed(reason, **names):
    return row(**names) | Scores.of_failure(reason).as_dict()


def entries(parts, **rows):
    return [
        parts.tables.Entry(Results("v1", name, True, here), dict(hours=1.5, commit="c")) for name, here in rows.items()
    ]


class TestTables:
    def test_losses_are_worse_means_with_their_intervals(self, parts):
        shapes = [f"tubes_{seed}" for seed in range(100, 112)]
        ours = [row(it, error=0.2, ends=None) for it in shapes]
        better = [row(it, error=0.1, topology=0.0, ends=0.1) for it in shapes]
        now_and_then = [row(it, error=0.1 if i % 3 else 0.35) for i, it in enumerate(shapes)]
        hardly = [row(it, error=0.1999) for it in shapes]
        found = parts.tables.worse(entries(parts, default=ours, cgal=better, pygel=now_and_then, thinning=hardly))
        lines = parts.tables.losses(found)[2]
        assert [line[0] for line in lines] == ["all", "clean", "tubes"]
        assert lines[0][1:] == ["12", "error", "CGAL of wrap", "0.100", "0.200", "-0.100 [-0.100, -0.100]"]
        _, low, high = found[1].difference
        assert found[1][:4] == ("all", "pygel", "error", 12)
        assert low < -0.017 < 0 < high
        assert parts.tables.unclear(found)[2] == [
            ["error", "PyGEL3D of coarser wrap", "all (-0.017), clean (-0.017), tubes (-0.017)"]
        ]

    def test_a_failure_is_a_loss_of_topology_and_no_error(self, parts):
        shapes = [f"tubes_{seed}" for seed in range(100, 104)]
        both = entries(parts, default=[failed("no", shape=it) for it in shapes], cgal=[row(it) for it in shapes])
        found = parts.tables.worse(both)
        assert {line[2] for line in parts.tables.losses(found)[2]} == {"perfect", "topology", "tips F1", "junctions F1"}

    def test_overview_is_sorted_and_has_seconds(self, parts):
        good, bad = [row(), row("trees_100")], [failed("gone"), row("trees_100", perfect=0.0, error=0.4)]
        rows = leaderboard(entry.results for entry in entries(parts, cgal=bad, default=good)).entries
        title, header, lines = parts.tables.overview(rows, {"cgal": dict(cpu=2.345)})
        assert title.startswith("2 clouds")
        assert [line[0] for line in lines] == ["`default`", "CGAL"]
        cells = dict(zip(header, lines[1], strict=True))
        assert cells["perfect"].startswith("0.00")
        assert cells["topology"].startswith("0.50")
        assert (cells["failures"], cells["CPU s"], cells["takes"]) == ("1", "2.35", "wrap")
        assert cells["error"].startswith("0.400")  # of the answer alone

    def test_what_only_things_have_is_shown_and_can_be_lost(self, parts):
        shapes = [f"mugs_{seed}" for seed in range(4)]
        ours = [row(it, hooks=0.5, reach=None, wiggle=-0.3) for it in shapes]
        theirs = [row(it, hooks=0.25, reach=1.0, wiggle=0.2) for it in shapes]
        both = entries(parts, default=ours, cgal=theirs)
        lines = [line[2:] for line in parts.tables.losses(parts.tables.worse(both))[2] if line[0] == "all"]
        told = [
            ["hooks", "0.25", "0.50", "-0.25 [-0.25, -0.25]"],
            ["wiggle", "0.200", "0.300", "-0.100 [-0.100, -0.100]"],
        ]
        assert [[words, *rest] for words, _, *rest in lines] == told
        rows = leaderboard(entry.results for entry in both).entries
        _, header, lines = parts.tables.overview(rows, {})
        cells = {line[0]: dict(zip(header, line, strict=True)) for line in lines}
        assert cells["`default`"]["wiggle"].startswith("-0.300")
        assert (cells["`default`"]["reach"], cells["CGAL"]["reach"][:4]) == ("-", "1.00")
        plain = [dict(each, **dict.fromkeys(OF_THINGS)) for each in ours]
        rows = leaderboard(entry.results for entry in entries(parts, default=plain)).entries
        assert not {"hooks", "reach", "wiggle", "mirror", "junction offset"} & {*parts.tables.overview(rows, {})[1]}

    def test_groups(self, parts):
        rows = [row(), row("trees_100", topology=0.0), row("trees_100", "holes", error=None)]
        (line,) = parts.tables.by_group(entries(parts, cgal=rows), "family", "topology", 2, "")[2]
        assert line == ["CGAL", "wrap", "1.00 [1.00, 1.00]", "0.50 [0.50, 0.50]"]
        _, header, (line,) = parts.tables.by_group(entries(parts, cgal=rows), "variant", "error", 3, "")
        assert header[2:] == ["clean (2)", "holes (1)"]
        assert line[2:] == ["0.100 [0.100, 0.100]", "-"]

    def test_failures_by_reason_and_name(self, parts):
        rows = [failed("no answer: a|b"), failed("no answer: a|b", variant="holes"), failed("late", shape="trees_100")]
        rows += [failed(f"no answer: {n} of 10 parts", shape=f"groups_{n}") for n in (7, 3.5, 11)]
        rows += [failed(f"exit code {n}", shape=f"frames_{n}") for n in (1, 139)]
        lines = parts.tables.failures(entries(parts, cgal=rows, default=[row()]))[2]
        assert lines == [
            ["CGAL", "wrap", "a/b", "2", "tubes_100_clean, tubes_100_holes"],
            ["CGAL", "wrap", "late", "1", "trees_100_clean"],
            ["CGAL", "wrap", "3.5 to 11 of 10 parts", "3", "groups_7_clean, groups_3.5_clean, groups_11_clean"],
            ["CGAL", "wrap", "exit code 1", "1", "frames_1_clean"],
            ["CGAL", "wrap", "exit code 139", "1", "frames_139_clean"],
        ]


class TestKept:
    def test_scores_are_written_packed_and_read(self, parts, monkeypatch, tmp_path):
        monkeypatch.setattr(parts.tables, "KEPT", tmp_path)
        results = Results("v1", "default", True, [row(error=0.123456, seconds=7200.0)])
        first = parts.tables.keep_scores(results, dict(limit=60.0))
        assert first == tmp_path / "v1" / "default.json.gz"
        assert parts.tables.kept("v2") == []
        (entry,) = parts.tables.kept("v1")
        assert entry.results.rows[0]["error"] == 0.1235
        assert (entry.tool, entry.made) == ("default", dict(limit=60.0, hours=2.0))
        assert first.read_bytes() == parts.tables.keep_scores(results, dict(limit=60.0)).read_bytes()

    def test_those_of_the_package_are_whole(self, parts):
        found = parts.tables.kept("v1")
        assert {"default", "wen2024"} <= {entry.tool for entry in found}
        clouds = {(each["shape"], each["variant"]) for each in found[0].results.rows}
        for entry in found:
            assert entry.results.whole
            assert {(each["shape"], each["variant"]) for each in entry.results.rows} == clouds
        assert len(clouds) == 779

    def test_the_pages_have_what_is_kept(self, tool, parts, root):
        pages = "".join((root / name).read_text(encoding="utf-8") for name in ("README.md", "docs/comparison.md"))
        for version in tool.PARTS:
            found = parts.tables.kept(version)
            rows = leaderboard(entry.results for entry in found).entries if found else []
            for name, text in tool.pieces(version, found, rows).items():
                there = re.search(rf"<!-- {name} -->\n(.*?)<!-- end -->", pages, re.S)[1].strip()
                if name != "recorded":  # late solves of wen2024 round otherwise elsewhere
                    assert there == text.strip()

    def test_every_table_has_a_place(self, tool, root):
        pages = "".join((root / name).read_text(encoding="utf-8") for name in ("README.md", "docs/comparison.md"))
        places = [name for names in tool.PARTS.values() for name in names]
        assert [name for name in places if pages.count(f"<!-- {name} -->\n") != 1] == []

    def test_what_is_recorded_of_the_authors_code(self, parts):
        _, header, lines = parts.tables.recorded()
        assert header == ["", "y_unequal", "torus", "quadruped"]
        cells = {line[0]: line[1:] for line in lines}
        assert cells["published code"] == ["2 / 3 / 8", "1 / 2 / 2", "2 / 6 / 17"]
        assert cells["`default`"] == cells["right"]


class TestCommands:
    def test_run_keeps_the_scores_and_goes_on(self, tool, parts, call, small, tmp_path, monkeypatch):
        monkeypatch.setattr(tool, "make", lambda place, version, jobs: read_folder(place))
        monkeypatch.setattr(parts.tables, "KEPT", tmp_path)
        assert "default.json.gz: 0 failures" in call("run", tmp_path, "--tool", "default", "--jobs", 2)
        rows = read_results(tmp_path / "v1" / "default.json.gz").rows
        assert len(rows) == 7
        assert all(each["topology"] for each in rows)
        written = {path: path.stat().st_mtime_ns for path in (tmp_path / "default").glob("*.npz")}
        call("run", tmp_path, "--tool", "default", "--jobs", 2)
        assert written == {path: path.stat().st_mtime_ns for path in (tmp_path / "default").glob("*.npz")}
        kept = (tmp_path / "v1" / "default.json.gz").read_bytes()
        assert "default.json.gz: 0 failures" in call("run", tmp_path, "--there")
        assert (tmp_path / "v1" / "default.json.gz").read_bytes() == kept
        assert "no answers of cgal" in " ".join(call("run", tmp_path, "--there", "--tool", "cgal", code=2).split())
        call("picture", tmp_path, tmp_path / "p.png", "--cloud", "tubes_100_clean", "--tool", "default,cgal")
        assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")

    def test_answers_of_other_settings_are_not_gone_on_with(self, tool, parts, call, small, tmp_path, monkeypatch):
        monkeypatch.setattr(tool, "make", lambda place, version, jobs: read_folder(place))
        monkeypatch.setattr(parts.tables, "KEPT", tmp_path)
        monkeypatch.setattr(tool, "in_processes", lambda answer, work, *_, **__: [job[0] | FAILED for job in work])
        assert "7 failures" in call("run", tmp_path, "--tool", "default", "--limit", 5)
        (entry,) = parts.tables.kept("v1")
        assert {each["failure"] for each in entry.results.rows} == {"no answer: not done after 5 s"}
        assert (entry.made["limit"], entry.made["hours"]) == (5, round(7 * 5 / 3600, 2))
        assert "has answers of 5" in call("run", tmp_path, "--tool", "default", "--limit", 6, code=2)
        asked = []
        monkeypatch.setattr(tool, "in_processes", lambda answer, work, *_, **__: asked.extend(work) or [])
        call("run", tmp_path, "--tool", "default", "--limit", 5)
        assert asked == []
        call("run", tmp_path, "--tool", "default", "--limit", 5, "--retry")
        assert len(asked) == 7

    def test_seconds_are_kept_and_added_to(self, tool, parts, call, tmp_path, monkeypatch):
        monkeypatch.setattr(parts.tables, "KEPT", tmp_path)
        (tmp_path / "v1").mkdir()
        (tmp_path / "v1" / "seconds.json").write_text('{"cgal": {"cpu": 2.5, "where": "there"}}')
        rows = [dict(tool="default", cpu=0.125), dict(tool="cgal", failure="gone")]
        monkeypatch.setattr(tool, "in_processes", lambda work, jobs, *_, **__: rows)
        assert "cgal: gone" in call("seconds", "--tool", "default")
        found = parts.tables.seconds("v1")
        assert (found["cgal"], found["default"]["cpu"]) == (dict(cpu=2.5, where="there"), 0.125)
        assert "one thread" in found["default"]["where"]

    def test_pages_are_filled_or_all_is_printed(self, tool, parts, call, tmp_path, monkeypatch):
        monkeypatch.setattr(tool, "kept", lambda version: entries(parts, default=[row()]) if version == "v1" else [])
        monkeypatch.setattr(tool, "IMAGES", tmp_path)
        words = {name: f"of {name}" for name in tool.PARTS["v1"]}
        monkeypatch.setattr(tool, "pieces", lambda version, entries, rows: words if entries else {})
        one = tmp_path / "one.md"
        others = "<!-- another -->\nkept\n<!-- end -->\n<!-- things-short -->\nto come\n<!-- end -->\n"
        one.write_text(f"<!-- short -->\n<!-- end -->\n{others}")
        call("page", one)
        assert one.read_text() == f"<!-- short -->\n\nof short\n<!-- end -->\n{others}"
        assert sorted(path.name for path in tmp_path.glob("*.png")) == ["leaderboard.png"]
        assert call("page").split() == [word for name in tool.PARTS["v1"] for word in ("of", name)]

    def test_repeat_keeps_how_far_answers_are_apart(self, tool, parts, call, rods, tmp_path, monkeypatch):
        monkeypatch.setattr(parts.tables, "KEPT", tmp_path)
        words = ("--tool", "default", "--version", "v1", "--draws", 2)
        assert "repeat_things.json.gz: default: moved 0." in call("repeat", tmp_path, *words)
        assert len([*tmp_path.glob("repeat_things/default/*.npz")]) == 12
        (found,) = parts.tables.repeats("v1", "things")
        assert [each["draws"] for each in found.rows] == [2] * 6
        _, header, (line,) = parts.tables.repeated([found])
        cells = dict(zip(header, line, strict=True))
        assert (cells[""], cells["loops"], cells["failures"]) == ("`default`", "1.00 [1.00, 1.00]", "0")
        assert parts.tables.repeats("v1", "meshes") == []
        other = Repeat("own 0", "cgal", found.rows)
        with pytest.raises(typer.BadParameter, match="has other clouds"):
            parts.tables.keep_repeat("v1", "things", other, {})
        parts.tables.keep_repeat("v1", "things", Repeat(found.benchmark, "cgal", found.rows), {})
        assert [each.name for each in parts.tables.repeats("v1", "things")] == ["default", "cgal"]

    @pytest.mark.parametrize(
        "wrong",
        [
            ("run", "d", "--tool", "magic"),
            ("seconds", "--tool", "magic"),
            ("page", "no_such_page.md"),
            ("picture", "d", "no_such_folder/p.png"),
        ],
    )
    def test_wrong_usage_is_found_at_once(self, call, wrong):
        assert "Invalid value" in call(*wrong, code=2)


class TestTools:
    def test_the_adapter_goes_from_a_file_to_a_file_whatever_points_up(self, benchmark, tmp_path):
        """Level sets begin at the lowest point: turned with the cloud, they are the same."""
        points = np.random.default_rng(0).normal(scale=[0.05, 0.05, 1.0], size=(500, 3))
        found = {}
        with benchmark("adapter") as adapter:
            for up, turn in (("y", [1, 2, 0]), ("z", [0, 1, 2])):
                np.savetxt(tmp_path / f"{up}.xyz", points[:, turn])
                words = ["levels", tmp_path / f"{up}.xyz", tmp_path / f"{up}.obj", "--up", up]
                assert CliRunner().invoke(adapter.app, [*map(str, words)]).exit_code == 0
                found[up] = read_skeleton(tmp_path / f"{up}.obj").vertices[:, np.argsort(turn)]
            for wrong in (["magic", "c.xyz", "s.obj"], ["levels", "c.xyz", "s.obj", "--up", "w"]):
                assert CliRunner().invoke(adapter.app, wrong).exit_code == 2
        np.testing.assert_allclose(found["y"], found["z"], atol=1e-12)

    @pytest.mark.filterwarnings("ignore")  # theirs
    def test_those_that_are_installed(self, parts):
        there = {name: peer for name, peer in parts.peers.PEERS.items() if None not in peer.versions().values()}
        others = [name for name, peer in there.items() if peer.packages]
        if not others:
            pytest.skip("none of the other tools is installed: make peers")
        points, axis = importlib.import_module("_clouds").builtin("tube", "clean_4096")
        for name in others:
            vertices, edges = there[name](points)
            found = compare(Skeleton(vertices, edges, [math.nan] * len(vertices), (), (), ()), axis)
            assert found.topology, name
            assert found.error < 0.5, name


def crash_or_work(job):
    if job == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    if job == "hang":
        time.sleep(600)
    return dict(inverse=1 / job)


def test_jobs_that_crash_or_hang_are_failures_and_end_nothing(parts):
    jobs = [({}, (job,)) for job in ("crash", 0, "hang", 4)]
    crashed, failing, hung, fine = parts.runs.run(crash_or_work, jobs, 2, fresh=True, limit=8, preload=["numpy"])
    assert crashed == {"failure": "its process died: SIGSEGV"}
    assert failing == {"failure": "ZeroDivisionError: division by zero"}
    assert hung == {"failure": "not done after 8 s"}
    assert fine == {"inverse": 0.25}
