"""A batch in this process: what is done, skipped and done again, and what the ledger says."""

import json
import os
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

import glsk_o3d
from glsk_o3d import BatchError, Connector, InvalidParameterError, RecipeError, pipelines, read_skeleton, skeletonize
from glsk_o3d.batch import plan_batch, run_batch
from glsk_o3d.batch.ledger import LEDGER_COLUMNS, file_hash, locked
from glsk_o3d.recipes import to_recipe
from glsk_o3d.samples import torus

# the work is done in this process, where a skeleton's warnings are errors
pytestmark = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")


@pytest.fixture
def batch(tmp_path):
    """Run a batch from ``in`` to ``out`` in a thread; gives what each input that was done had as reason."""

    def run(inputs=None, **options):
        plans = []
        with ThreadPoolExecutor(1) as pool:
            run.result = run_batch(
                inputs or tmp_path / "in", tmp_path / "out", executor=pool, on_plan=plans.append, **options
            )
        return {task.name: task.why for task in plans[0].todo}

    return run


@pytest.fixture
def scans(tmp_path, write):
    for i, name in enumerate("abc"):
        write(tmp_path / "in" / f"{name}.ply", seed=i)
    return tmp_path / "in"


def test_every_scan_is_done_once(batch, scans, rows, tmp_path):
    seen = []
    assert batch(on_result=seen.append) == dict.fromkeys("abc", "new")
    found = rows(tmp_path / "out")
    assert (batch.result.done, batch.result.skipped, batch.result.failed) == (3, 0, 0)
    assert batch.result.rate > 0
    assert batch.result.rows == found == {row["name"]: row for row in seen}
    for name, row in found.items():
        assert tuple(row) == LEDGER_COLUMNS
        assert (row["status"], row["outputs"], row["version"]) == ("done", [f"{name}.ply"], glsk_o3d.__version__)
        assert row["input_hash"] == file_hash(scans / f"{name}.ply")
        skeleton = skeletonize(glsk_o3d.read_cloud(scans / f"{name}.ply"))
        assert (row["points"], row["loops"], row["stop_reason"]) == (256, 1, skeleton.report.stop_reason)
        assert row["leaves"] == len(skeleton.leaves)
        same = read_skeleton(tmp_path / "out" / f"{name}.ply")
        assert (same.vertices == skeleton.vertices).all()
    assert json.loads((tmp_path / "out" / "recipe.json").read_text()) == to_recipe(pipelines.default())


def test_a_second_run_skips(batch, scans, rows, tmp_path):
    batch()
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("?.ply")}
    lines = rows(tmp_path / "out")
    assert batch() == {}
    assert (batch.result.done, batch.result.skipped) == (0, 3)
    assert rows(tmp_path / "out") == lines == batch.result.rows
    assert before == {path: path.stat().st_mtime_ns for path in before}
    assert batch(force=True) == dict.fromkeys("abc", "asked for")


def test_a_second_run_does_what_has_changed(batch, scans, rows, write, tmp_path):
    (scans / "bad.ply").write_text("no")
    out = tmp_path / "out"
    assert len(batch()) == 4
    assert rows(out)["bad"]["error"].startswith("not a valid .ply file")
    write(scans / "a.ply", seed=9)
    (out / "b.ply").unlink()
    write(scans / "d.ply", seed=4)
    os.utime(scans / "c.ply")  # a date is no change
    assert batch() == {"a": "input changed", "b": "outputs are gone", "bad": "failed before", "d": "new"}
    write(scans / "bad.ply")
    assert batch() == {"bad": "failed before"}
    assert {row["status"] for row in rows(out).values()} == {"done"}


def test_other_parameters_are_another_result(batch, scans, rows, tmp_path):
    batch()
    assert batch(pipeline="wen2024") == dict.fromkeys("abc", "other parameters")
    hashes = {row["parameters"] for row in rows(tmp_path / "out").values()}
    assert batch(pipeline=pipelines.wen2024()) == {}
    assert batch(pipeline="wen2024", cut_loops=True) == dict.fromkeys("abc", "other parameters")
    assert len(hashes | {row["parameters"] for row in rows(tmp_path / "out").values()}) == 2
    assert batch(pipeline="wen2024", cut_loops=True, formats=["ply", "npz"]) == dict.fromkeys("abc", "outputs are gone")
    assert batch(pipeline="wen2024", cut_loops=True, formats=["npz"]) == {}


def test_results_that_are_no_longer_true_are_taken_away(batch, scans, rows, tmp_path):
    out = tmp_path / "out"
    batch(formats=["ply", "json"])
    (scans / "a.ply").write_text("no")
    batch()
    assert rows(out)["a"]["status"] == "failed"
    assert sorted(path.name for path in out.glob("a.*")) == []
    assert sorted(path.name for path in out.glob("b.*")) == ["b.json", "b.ply"]


def test_an_interrupted_change_leaves_no_stale_result(batch, scans, rows, write, tmp_path):
    def stop(row):
        raise LookupError

    out = tmp_path / "out"
    batch(formats=["ply", "json"])
    with pytest.raises(LookupError):
        batch(pipeline="wen2024", on_result=stop)
    left = {row["name"]: row["status"] for row in map(json.loads, (out / "ledger.jsonl").read_text().splitlines())}
    stale = [name for name, status in left.items() if status == "stale"]
    assert len(left) == 3
    assert stale
    (scans / f"{stale[0]}.ply").write_text("no")
    for pipeline in ("default", "wen2024"):  # what is there is of the first, and no one's any more
        why = {task.name: task.why for task in plan_batch(scans, out, pipeline=pipeline).tasks}
        assert {why[name] for name in stale} == {"interrupted before"}
    batch(pipeline="wen2024")
    assert len({row["parameters"] for row in rows(out).values()}) == 1
    assert list(out.glob(f"{stale[0]}.*")) == list(out.glob("?.json")) == []


def test_what_a_lost_row_left_is_replaced_and_never_removed(batch, scans, rows, write, tmp_path):
    batch()
    out = tmp_path / "out"
    old = (out / "a.ply").read_bytes()
    (out / "ledger.jsonl").write_text("")
    (scans / "a.ply").write_text("no")
    write(scans / "b.ply", seed=9)
    assert batch() == dict.fromkeys("abc", "new")
    found = rows(out, strict=False)  # what it says of b and c is true of the files
    assert [row["outputs"] for row in found.values()] == [[], ["b.ply"], ["c.ply"]]
    assert (out / "a.ply").read_bytes() == old  # nobody knows whose it is
    write(scans / "a.ply", seed=8)
    assert batch() == {"a": "failed before"}
    assert rows(out)["a"]["outputs"] == ["a.ply"]


@pytest.mark.parametrize("name", ["a.ply", "a.png", "recipe.json", "ledger.csv"])
def test_files_of_others_are_not_touched(batch, scans, write, tmp_path, name):
    (tmp_path / "out").mkdir()
    mine = tmp_path / "out" / name
    mine.write_text("mine")
    (scans / "b.ply").write_text("no")
    for options in ({}, {"force": True}):
        with pytest.raises(InvalidParameterError, match=rf"{name}: is not the result of a batch.*another folder"):
            batch(preview=True, **options)
    with pytest.raises(InvalidParameterError, match="is not the result of a batch"):
        plan_batch(scans, tmp_path / "out", preview=True)
    assert mine.read_text() == "mine"
    assert {path.name for path in (tmp_path / "out").iterdir()} <= {name, ".ledger.lock"}


def test_a_scan_that_is_not_there_costs_no_results(batch, scans, rows, tmp_path):
    out = tmp_path / "out"
    batch(formats=["ply", "json"])
    good = rows(out)
    given = scans / "list.txt"
    given.write_text("\n".join(str(scans / f"{name}.ply") for name in "abc"))
    (scans / "a.ply").rename(tmp_path / "away.ply")
    for why in ("input changed", "failed before"):
        assert batch([given], formats=["ply", "json"]) == {"a": why}
        found = rows(out)
        assert sorted(found["a"]["outputs"]) == ["a.json", "a.ply"]
        same = {"outputs": found["a"]["outputs"]}
        assert found["a"] == good["a"] | {"status": "failed", "error": "no such file"} | same
        assert batch.result.failed == 1
    (tmp_path / "away.ply").rename(scans / "a.ply")
    assert batch([given], formats=["ply", "json"]) == {"a": "failed before"}
    assert rows(out)["a"]["status"] == "done"


def test_what_cannot_be_removed_hides_nothing(batch, scans, rows, tmp_path):
    out = tmp_path / "out"
    batch([scans / "a.ply", scans / "b.ply"], formats=["ply", "json"])
    (scans / "a.ply").write_text("no")
    for name in ("a.json", "b.json"):  # in their places folders, which no unlink removes
        (out / name).unlink()
        (out / name / "x").mkdir(parents=True)
    batch([scans / "a.ply", scans / "b.ply"], force=True)
    found = rows(out)
    assert found["a"]["error"].startswith("not a valid .ply file")
    assert found["b"]["status"] == "done"
    for name, row in found.items():
        assert any(f"{name}.json" in message and "could not be removed" in message for message in row["messages"])


def test_an_input_from_elsewhere_renames_none(batch, scans, rows, write, tmp_path):
    batch()
    write(tmp_path / "more" / "deep" / "d.ply", seed=7)
    assert batch([scans, tmp_path / "more" / "deep" / "d.ply"]) == {"d": "new"}
    assert list(rows(tmp_path / "out")) == list("abcd")


def test_another_name_leaves_no_orphans(batch, scans, rows, write, tmp_path):
    batch(formats=["ply", "json"])
    write(scans / "a.xyz", seed=7)  # now both need their endings
    assert batch() == {"a.ply": "new", "a.xyz": "new"}
    assert list(rows(tmp_path / "out")) == ["a.ply", "a.xyz", "b", "c"]
    assert batch([tmp_path], recursive=True).keys() == {"in/a.ply", "in/a.xyz", "in/b", "in/c"}
    assert len(rows(tmp_path / "out")) == 4


def test_results_of_other_scans_are_not_replaced(batch, scans, rows, write, tmp_path):
    batch()
    write(tmp_path / "tuesday" / "a.ply", seed=7)
    with pytest.raises(InvalidParameterError, match=r"results, a, .*give another folder"):
        batch([tmp_path / "tuesday"])
    (scans / "a.ply").unlink()
    assert batch([tmp_path / "tuesday"]) == {"a": "input changed"}
    assert rows(tmp_path / "out")["a"]["input"] == str(tmp_path / "tuesday" / "a.ply")


def test_scans_that_have_moved_are_done(batch, scans, rows, tmp_path):
    batch()
    scans.rename(tmp_path / "moved")
    assert batch([tmp_path / "moved"]) == {}
    assert {Path(row["input"]).parent for row in rows(tmp_path / "out").values()} == {tmp_path / "moved"}


def test_outliers_are_counted(batch, scans, rows, tmp_path):
    (scans / "a.ply").unlink()
    points = "\n".join(" ".join(map(str, point)) for point in [*torus(1024).points, [3, 0, 0], [0, 3, 0]])
    (scans / "a.xyz").write_text(points)
    batch([scans / "a.xyz"])
    row = rows(tmp_path / "out")["a"]
    assert (row["points"], row["sampled"], row["outliers"]) == (1026, 1026, 2)


def test_a_ledger_from_elsewhere_removes_nothing(batch, scans, tmp_path):
    batch()
    ledger = tmp_path / "out" / "ledger.jsonl"
    treasure = tmp_path / "treasure.ply"
    treasure.write_text("kept")
    ledger.write_text(ledger.read_text().replace('["a.ply"]', '["a.ply", "a./../../treasure.ply", "../treasure.ply"]'))
    (scans / "a.ply").write_text("no")
    assert batch() == {"a": "new"}  # such a line counts for nothing
    assert treasure.read_text() == "kept"


def test_bad_files_stop_nothing(batch, scans, rows, write, tmp_path):
    (scans / "empty.ply").touch()
    (scans / "text.xyz").write_text("no numbers\n" * 9)
    (scans / "nan.xyz").write_text("nan nan nan\n" * 300)
    (scans / "cut.ply").write_bytes((scans / "a.ply").read_bytes()[:-100])
    (scans / "other.pcd").write_bytes((scans / "a.ply").read_bytes())
    (tmp_path / "list.txt").write_text(f"{scans}/gone.ply\n{scans}\n{scans}/list.doc\n")
    batch([scans, tmp_path / "list.txt"])
    failed = {Path(row["input"]).name: row["error"] for row in rows(tmp_path / "out").values() if row["error"]}
    assert failed.pop("empty.ply") == "the file is empty"
    assert failed.pop("text.xyz").startswith("no points could be read")
    assert "points" in failed.pop("nan.xyz")
    assert failed.pop("cut.ply").endswith("promises 256 points and holds 251: it breaks off")
    assert failed.pop("other.pcd").startswith("not a valid .pcd file")
    assert failed.pop("gone.ply") == "no such file"
    assert failed.pop("in") == "is a folder, not a file"
    assert failed.pop("list.doc") == "no such file"
    assert failed == {}
    assert (batch.result.done, batch.result.failed) == (3, 8)


@pytest.mark.parametrize("change", [{"path": "/no/where/a.ply"}, {"out_dir": "/no/where"}])
def test_workers_that_see_other_files(scans, rows, tmp_path, change):
    class Elsewhere(ThreadPoolExecutor):
        def submit(self, work, task):
            return super().submit(work, replace(task, **change))

    with Elsewhere(1) as pool:
        run_batch(scans / "a.ply", tmp_path / "out", executor=pool)
    error = rows(tmp_path / "out")["a"]["error"]
    assert "no such f" in error
    assert re.search(
        r"\(on .+, process \d+; there is one here: workers need the same files by the same paths\)$", error
    )


def test_a_writer_that_fails(batch, scans, rows, tmp_path):
    batch(formats=["ply", "swc"])
    found = rows(tmp_path / "out")["a"]
    assert found["status"] == "failed"
    assert "holds trees only" in found["error"]
    assert (found["outputs"], found["loops"]) == (["a.ply"], 1)
    batch(formats=["swc"], cut_loops=True, preview=True)
    found = rows(tmp_path / "out")["a"]
    assert found["outputs"] == ["a.swc", "a.png"]


def test_mistakes_are_told_with_their_place(batch, scans, rows, tmp_path, monkeypatch):
    def broken(self, data, watch):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(glsk_o3d.Refiner, "_run", broken)
    batch([scans / "a.ply"])
    assert re.fullmatch(r"ZeroDivisionError: a bug \(test_run\.py, line \d+\)", rows(tmp_path / "out")["a"]["error"])


def test_warnings_are_counted_and_kept(batch, write, rows, tmp_path):
    path = write(tmp_path / "in" / "a.xyz")
    path.write_text(path.read_text() + "no point\n")
    batch()
    found = rows(tmp_path / "out")["a"]
    assert found["warnings"] == len(found["messages"]) >= 1
    assert any("1 of 257 lines hold no point" in message for message in found["messages"])


def test_rows_of_other_inputs_stay(batch, scans, rows, tmp_path):
    batch()
    batch([scans / "a.ply"], pipeline="wen2024")
    found = rows(tmp_path / "out")
    assert list(found) == ["a", "b", "c"]
    assert found["a"]["parameters"] != found["b"]["parameters"] == found["c"]["parameters"]


def test_a_name_that_is_no_unicode(batch, scans, write, rows, tmp_path):
    write(scans / os.fsdecode(b"\xff.ply"))
    batch()
    assert os.fsdecode(b"\xff") in rows(tmp_path / "out")
    assert batch() == {}


@pytest.mark.usefixtures("no_run")
class TestRefusals:
    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"pipeline": "wen2042"}, "no pipeline is called"),
            ({"pipeline": Connector()}, "does not lead from a cloud"),
            ({"formats": ["stl"]}, "unknown ending"),
            ({"formats": []}, "nothing to write"),
            ({"workers": 0}, "workers = 0"),
            ({"workers": 2, "scheduler": "tcp://x:1"}, "neither workers nor"),
        ],
    )
    def test_wrong_arguments(self, scans, tmp_path, options, message):
        with pytest.raises(ValueError, match=message):
            run_batch(scans, tmp_path / "out", **options)
        assert not (tmp_path / "out").exists()

    def test_a_pipeline_that_no_file_can_hold(self, scans, tmp_path):
        pipeline = pipelines.default()
        contractor = glsk_o3d.Contractor(reducer=lambda state: state)
        pipeline = glsk_o3d.Pipeline(pipeline.stages[0], contractor, *pipeline.stages[2:])
        with pytest.raises(RecipeError):
            run_batch(scans, tmp_path / "out", pipeline=pipeline)

    def test_results_over_inputs(self, scans, tmp_path):
        with pytest.raises(InvalidParameterError, match=r"a\.ply: is an input"):
            plan_batch([scans / "a.ply", scans / "b.ply"], scans)

    def test_two_batches_in_one_folder(self, scans, tmp_path):
        (tmp_path / "out").mkdir()
        with locked(tmp_path / "out"), pytest.raises(BatchError, match="another batch"):
            run_batch(scans, tmp_path / "out")

    def test_a_plan_writes_nothing(self, scans, tmp_path):
        plan = plan_batch(scans, tmp_path / "out", formats=["ply", ".JSON", "json"], preview=True)
        assert plan.tasks[0].outputs == ("a.ply", "a.json", "a.png")
        assert (plan.skipped, len(plan.parameters)) == (0, 64)
        assert not (tmp_path / "out").exists()
