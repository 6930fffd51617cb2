"""Other tools on the public benchmark: their runs, the scores that are kept, and the tables that are made of them."""

import os
import re
import signal
import time

from glsk_bench import Results, read_folder, read_results
from glsk_bench import leaderboard as make_leaderboard
from glsk_bench.scoring import Scores
from glsk_studies import board, leaderboard, runs

STUDY = leaderboard

SHARES = ("perfect", "topology", "tips_f1", "junctions_f1")


def row(shape="tubes_100", variant="clean", **values):
    facts = dict(shape=shape, variant=variant, family=shape.partition("_")[0], seconds=1.0)
    scores = dict.fromkeys(Scores.__dataclass_fields__, 0) | dict.fromkeys(SHARES, 1.0) | dict(failure=None)
    return facts | scores | dict(error=0.1, inside=1.0, completeness=1.0, ends=0.2, length=1.0) | values


def entries(**rows):
    return [board.Entry(Results("v1", name, True, here), dict(hours=1.5, commit="c")) for name, here in rows.items()]


class TestTables:
    def test_losses_are_worse_means_with_their_intervals(self):
        shapes = [f"tubes_{seed}" for seed in range(100, 112)]
        ours = [row(it, error=0.2, ends=None) for it in shapes]
        better = [row(it, error=0.1, topology=0.0, ends=0.1) for it in shapes]
        now_and_then = [row(it, error=0.1 if i % 3 else 0.35) for i, it in enumerate(shapes)]
        hardly = [row(it, error=0.1999) for it in shapes]
        worse = board.worse(entries(default=ours, cgal=better, pygel=now_and_then, thinning=hardly))
        lines = board.losses(worse)[2]
        assert [line[0] for line in lines] == ["all", "clean", "tubes"]
        assert lines[0][1:] == ["12", "error", "CGAL of wrap", "0.100", "0.200", "-0.100 [-0.100, -0.100]"]
        _, low, high = worse[1].difference
        assert worse[1][:4] == ("all", "pygel", "error", 12)
        assert low < -0.017 < 0 < high
        assert board.unclear(worse)[2] == [
            ["error", "PyGEL3D of coarser wrap", "all (-0.017), clean (-0.017), tubes (-0.017)"]
        ]


class TestKept:
    def test_the_pages_have_what_is_kept(self, root):
        names = ("README.md", "docs/comparison.md", "docs/comparison_tables.md")
        pages = "".join((root / name).read_text(encoding="utf-8") for name in names)
        for version in leaderboard.PARTS:
            kept = board.kept(version)
            rows = make_leaderboard(entry.results for entry in kept).entries if kept else []
            for name, text in leaderboard.pieces(version, kept, rows).items():
                shown = re.search(rf"<!-- {name} -->\n(.*?)<!-- end -->", pages, re.S)[1].strip()
                if name != "recorded":  # late solves of wen2024 round otherwise elsewhere
                    assert shown == text.strip()


class TestCommands:
    def test_a_run_keeps_its_scores(self, call, small, tmp_path, monkeypatch):
        monkeypatch.setattr(leaderboard, "make", lambda place, version, jobs: read_folder(place))
        monkeypatch.setattr(board, "KEPT", tmp_path)
        assert "default.json.gz: 0 failures" in call("run", tmp_path, "--tool", "default", "--jobs", 2)
        rows = read_results(tmp_path / "v1" / "default.json.gz").rows
        assert len(rows) == 7
        assert all(each["topology"] for each in rows)
        kept = (tmp_path / "v1" / "default.json.gz").read_bytes()
        assert "default.json.gz: 0 failures" in call("run", tmp_path, "--there")
        assert (tmp_path / "v1" / "default.json.gz").read_bytes() == kept
        assert "no answers of cgal" in " ".join(call("run", tmp_path, "--there", "--tool", "cgal", code=2).split())

    def test_pages_are_filled_or_all_is_printed(self, call, tmp_path, monkeypatch):
        monkeypatch.setattr(leaderboard, "kept", lambda version: entries(default=[row()]) if version == "v1" else [])
        monkeypatch.setattr(leaderboard, "IMAGES", tmp_path)
        words = {name: f"of {name}" for name in leaderboard.PARTS["v1"]}
        monkeypatch.setattr(leaderboard, "pieces", lambda version, entries, rows: words if entries else {})
        one = tmp_path / "one.md"
        others = "<!-- another -->\nkept\n<!-- end -->\n<!-- things-short -->\nto come\n<!-- end -->\n"
        one.write_text(f"<!-- short -->\n<!-- end -->\n{others}")
        call("page", one)
        assert one.read_text() == f"<!-- short -->\n\nof short\n<!-- end -->\n{others}"
        assert sorted(path.name for path in tmp_path.glob("*.png")) == ["leaderboard.png"]
        assert call("page").split() == [word for name in leaderboard.PARTS["v1"] for word in ("of", name)]

    def test_repeat_keeps_how_far_answers_are_apart(self, call, rods, tmp_path, monkeypatch):
        monkeypatch.setattr(board, "KEPT", tmp_path)
        words = ("--tool", "default", "--version", "v1", "--draws", 2)
        assert "repeat_things.json.gz: default: moved 0." in call("repeat", tmp_path, *words)
        assert len([*tmp_path.glob("repeat_things/default/*.npz")]) == 12
        (repeats,) = board.repeats("v1", "things")
        assert [each["draws"] for each in repeats.rows] == [2] * 6
        _, header, (line,) = board.repeated([repeats])
        cells = dict(zip(header, line, strict=True))
        assert (cells[""], cells["loops"], cells["failures"]) == ("`default`", "1.00 [1.00, 1.00]", "0")


def crash_or_work(job):
    if job == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    if job == "hang":
        time.sleep(600)
    return dict(inverse=1 / job)


def test_jobs_that_crash_or_hang_are_failures_and_end_nothing():
    jobs = [({}, (job,)) for job in ("crash", 0, "hang", 4)]
    crashed, failing, hung, fine = runs.run(crash_or_work, jobs, 2, fresh=True, limit=8, preload=["numpy"])
    assert crashed == {"failure": "its process died: SIGSEGV"}
    assert failing == {"failure": "ZeroDivisionError: division by zero"}
    assert hung == {"failure": "not done after 8 s"}
    assert fine == {"inverse": 0.25}
