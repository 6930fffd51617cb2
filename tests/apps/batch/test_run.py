"""A batch in this process: what is done, skipped and done again, and what the ledger says."""

import json
import os
import re
from pathlib import Path

import numpy as np
import pytest

import glsk_o3d
from glsk_o3d import Connector, InvalidParameterError, RecipeError, pipelines, read_skeleton, samples, skeletonize
from glsk_o3d.analysis import tree_measures
from glsk_o3d.apps.batch import plan_batch, run_batch
from glsk_o3d.apps.batch.ledger import file_hash
from glsk_o3d.recipes import to_recipe

# the work is done in this process, where a skeleton's warnings are errors
pytestmark = pytest.mark.filterwarnings("ignore::glsk_o3d.SkeletonWarning")


@pytest.fixture
def scans(tmp_path, write):
    for i, name in enumerate("abc"):
        write(tmp_path / "in" / f"{name}.ply", seed=i)
    return tmp_path / "in"


def test_every_scan_is_done_once_and_a_second_run_skips(run, scans, rows, tmp_path):
    seen = []
    assert run(on_result=seen.append) == dict.fromkeys("abc", "new")
    ledger, result = rows(), run.result
    assert (result.done, result.skipped, result.failed, result.rate > 0) == (3, 0, 0, True)
    assert result.rows == ledger == {row["name"]: row for row in seen}
    for name, row in ledger.items():
        assert (row["status"], row["outputs"], row["version"]) == ("done", [f"{name}.ply"], glsk_o3d.__version__)
        assert row["input_hash"] == file_hash(scans / f"{name}.ply")
        skeleton = skeletonize(glsk_o3d.read_cloud(scans / f"{name}.ply"))
        assert (row["points"], row["loops"], row["stop_reason"]) == (256, 1, skeleton.report.stop_reason)
        np.testing.assert_array_equal(read_skeleton(tmp_path / "out" / f"{name}.ply").vertices, skeleton.vertices)
    assert json.loads((tmp_path / "out" / "recipe.json").read_text()) == to_recipe(pipelines.default())
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("?.ply")}
    assert run() == {}
    assert (run.result.done, run.result.skipped) == (0, 3)
    assert rows() == ledger == run.result.rows
    assert before == {path: path.stat().st_mtime_ns for path in before}
    assert run(force=True) == dict.fromkeys("abc", "asked for")


def test_trees_have_their_measures_in_the_ledger(run, rows, tmp_path):
    (tmp_path / "in").mkdir()
    drawn = glsk_o3d.samples.tree(4000, forks=2, length=3, radius=0.2, seed=1)
    np.savetxt(tmp_path / "in" / "tree.xyz", drawn.points)
    run(pipeline="tree", formats=["json"])
    row, measures = rows()["tree"], tree_measures(read_skeleton(tmp_path / "out" / "tree.json"))
    assert (row["status"], row["traced"], row["unit"]) == ("done", 0, 1)
    assert row["stem_diameter"] == pytest.approx(measures.stem_diameter)
    assert row["length_without_traced"] == pytest.approx(measures.length_without_traced)
    run(force=True)
    assert "stem_diameter" not in rows()["tree"]


def test_a_second_run_does_what_has_changed(run, scans, rows, write, tmp_path):
    (scans / "bad.ply").write_text("no")
    run()
    assert (run.result.done, run.result.failed) == (3, 1)  # a failed scan stops no other
    assert rows()["bad"]["error"].startswith("not a valid .ply file")
    write(scans / "a.ply", seed=9)
    (tmp_path / "out" / "b.ply").unlink()
    (tmp_path / "out" / "b.ply").mkdir()
    write(scans / "d.ply", seed=4)
    os.utime(scans / "c.ply")  # a date is no change
    assert run() == {"a": "input changed", "b": "outputs are gone", "bad": "failed before", "d": "new"}
    assert "b.ply: is a folder or a device, not a file to write to" in rows()["b"]["error"]
    (tmp_path / "out" / "b.ply").rmdir()
    write(scans / "bad.ply")
    assert run() == {"b": "failed before", "bad": "failed before"}
    assert {row["status"] for row in rows().values()} == {"done"}


def test_only_accepted_skeletons_are_written(run, scans, rows, write, tmp_path):
    write(scans / "flat.ply", points=samples.sheet(400).points)
    run(accept="good")
    assert {name: row["status"] for name, row in rows().items()} == {**dict.fromkeys("abc", "done"), "flat": "failed"}
    flat = rows()["flat"]
    assert flat["verdict"] == "no curve skeleton"
    assert "not accepted: no curve skeleton: sheet-like" in flat["error"]
    assert not (tmp_path / "out" / "flat.ply").exists()
    assert run() == {**dict.fromkeys("abc", "other parameters"), "flat": "failed before"}
    with pytest.raises(InvalidParameterError, match="accept = 'fair'"):
        run(accept="fair")


def test_shards_are_disjoint_and_together_all(run, scans, rows):
    for index, names in enumerate(("ac", "b"), 1):
        assert run(out=str(index), shard=(index, 2), formats=["npz"]) == dict.fromkeys(names, "new")
        assert list(rows(str(index))) == list(names)


def test_other_parameters_are_another_result(run, scans, rows):
    scan = [scans / "a.ply"]
    run()
    assert run(scan, pipeline="wen2024") == {"a": "other parameters"}
    ledger = rows()  # rows of other inputs stay
    assert ledger["a"]["parameters"] != ledger["b"]["parameters"] == ledger["c"]["parameters"]
    assert run(scan, pipeline=pipelines.wen2024()) == {}
    options = dict(pipeline="wen2024", cut_loops=True)
    assert run(scan, **options) == {"a": "other parameters"}
    assert run(scan, **options, formats=["ply", "npz"]) == {"a": "outputs are gone"}
    assert run(scan, **options, formats=["npz"]) == {}


def test_an_error_in_on_result_leaves_no_stale_result(run, scans, rows, tmp_path):
    def stop(row):
        raise LookupError

    out = tmp_path / "out"
    run(formats=["ply", "json"])
    with pytest.raises(LookupError):
        run(pipeline="wen2024", on_result=stop)
    statuses = {row["name"]: row["status"] for row in map(json.loads, (out / "ledger.jsonl").read_text().splitlines())}
    started = [name for name, status in statuses.items() if status == "started"]
    assert len(statuses) == 3
    assert started
    for pipeline in ("default", "wen2024"):  # what was there was of the first, and is no one's any more
        why = {task.name: task.why for task in plan_batch(scans, out, pipeline=pipeline).tasks}
        assert {why[name] for name in started} == {"interrupted before"}
    (scans / f"{started[0]}.ply").write_text("no")
    run(pipeline="wen2024")
    assert len({row["parameters"] for row in rows().values()}) == 1
    assert list(out.glob(f"{started[0]}.*")) == list(out.glob("?.json")) == []  # what is no longer true is taken away


def test_a_scan_that_is_not_there_costs_no_results(run, scans, rows, tmp_path):
    run(formats=["ply", "json"])
    good = rows()["a"]
    given = scans / "list.txt"
    given.write_text("\n".join(str(scans / f"{name}.ply") for name in "abc"))
    (scans / "a.ply").rename(tmp_path / "away.ply")
    for why in ("input changed", "failed before"):
        assert run([given], formats=["ply", "json"]) == {"a": why}
        row = rows()["a"]
        assert sorted(row["outputs"]) == ["a.json", "a.ply"]
        assert row == good | {"status": "failed", "error": "no such file", "outputs": row["outputs"]}
    (tmp_path / "away.ply").rename(scans / "a.ply")
    assert run([given], formats=["ply", "json"]) == {"a": "failed before"}
    assert rows()["a"]["status"] == "done"


def test_names_that_change_and_scans_that_move(run, scans, rows, write, tmp_path):
    run()
    write(scans / "a.xyz", seed=7)  # now both need their endings
    assert run() == {"a.ply": "new", "a.xyz": "new"}
    assert list(rows()) == ["a", "a.ply", "a.xyz", "b", "c"]
    write(tmp_path / "more" / "d.ply", seed=7)
    assert run([scans, tmp_path / "more" / "d.ply"]) == {"d": "new"}  # another input renames none
    scans.rename(tmp_path / "moved")
    assert run([tmp_path / "moved"]) == {}  # the same bytes somewhere else
    assert rows()["b"]["input"] == str(tmp_path / "moved" / "b.ply")
    write(tmp_path / "tuesday" / "b.ply", seed=7)
    with pytest.raises(InvalidParameterError, match=r"both be called b: give the folder above"):
        run([tmp_path / "tuesday"])
    (tmp_path / "moved" / "b.ply").unlink()
    assert run([tmp_path / "tuesday"]) == {"b": "input changed"}


def test_bad_files_stop_nothing_and_say_why(run, scans, rows, tmp_path, monkeypatch):
    (scans / "empty.ply").touch()
    (scans / "nan.xyz").write_text("nan nan nan\n" * 300)
    (scans / "odd.xyz").write_text((scans / "a.ply").read_text().partition("end_header\n")[2] + "no point\n")
    (tmp_path / "list.txt").write_text(f"{scans}/gone.ply\n{scans}\n")
    run([scans, tmp_path / "list.txt"])
    failed = {Path(row["input"]).name: row["error"] for row in rows().values() if row["error"]}
    assert (failed["empty.ply"], failed["gone.ply"]) == ("the file is empty", "no such file")
    assert failed["in"] == "is a folder, not a file"
    assert "points" in failed["nan.xyz"]
    assert (run.result.done, run.result.failed) == (4, len(failed)) == (4, 4)
    odd = rows()["odd"]  # warnings are counted and kept
    assert odd["warnings"] == len(odd["messages"]) >= 1
    assert any("1 of 257 lines hold no point" in message for message in odd["messages"])
    run([scans / "a.ply"], formats=["ply", "swc"])
    row = rows()["a"]
    assert "holds trees only" in row["error"]
    assert (row["status"], row["outputs"], row["loops"]) == ("failed", ["a.ply"], 1)
    run([scans / "a.ply"], formats=["swc"], cut_loops=True, preview=True)
    assert rows()["a"]["outputs"] == ["a.swc", "a.png"]
    monkeypatch.setattr("glsk_o3d.apps.batch.tasks.points_for", lambda *_: 1 / 0)  # a mistake in the code
    run([scans / "b.ply"], force=True)
    assert rows()["b"]["error"] == "ZeroDivisionError: division by zero"


@pytest.mark.usefixtures("no_run")
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"pipeline": "wen2042"}, "no pipeline is called"),
        ({"pipeline": Connector()}, "does not lead from a cloud"),
        ({"formats": ["stl"]}, "unknown ending"),
        ({"formats": []}, "nothing to write"),
        ({"workers": 0}, "workers = 0"),
        ({"shard": (3, 2)}, "shard = 3"),
    ],
)
def test_wrong_arguments(scans, tmp_path, options, message):
    with pytest.raises(ValueError, match=message):
        run_batch(scans, tmp_path / "out", **options)
    assert not (tmp_path / "out").exists()
    with pytest.raises(InvalidParameterError, match=r"a\.ply: is an input"):
        plan_batch([scans / "a.ply", scans / "b.ply"], scans)
    contractor = glsk_o3d.Contractor(reducer=lambda state: state)  # no file can hold it
    with pytest.raises(RecipeError):
        plan_batch(scans, "out", pipeline=glsk_o3d.RingBuilder() | contractor | Connector() | glsk_o3d.Refiner())


@pytest.mark.parametrize("name", ["a.ply", "a.png", "recipe.json"])
def test_files_of_others_are_not_touched(run, scans, tmp_path, name):
    mine = tmp_path / "out" / name
    mine.parent.mkdir()
    mine.write_text("mine")
    for options in (dict(preview=True, force=True), dict(preview=True, tiles=0.5)):
        with pytest.raises(InvalidParameterError, match=rf"{name}: is not the result of a batch.*another folder"):
            run(**options)
    assert mine.read_text() == "mine"
    assert {path.name for path in mine.parent.iterdir()} <= {name, ".ledger.lock"}


@pytest.mark.parametrize("link", ["sub", "sub/s.ply", "ledger.jsonl", "recipe.json", ".ledger.lock"])
def test_no_link_leads_out_of_the_output_folder(write, tmp_path, link):
    write(tmp_path / "in" / "sub" / "s.ply", seed=0)
    victim, out = tmp_path / "victim", tmp_path / "out"
    victim.mkdir()
    (out / link).parent.mkdir(parents=True)
    (victim / "kept").write_text("kept")
    (out / "ledger.jsonl").touch()
    (out / link).unlink(missing_ok=True)
    (out / link).symlink_to(victim if link == "sub" else victim / "kept")
    with pytest.raises(InvalidParameterError, match=rf"{re.escape(link)}.*: leads out of the output folder, to "):
        run_batch(tmp_path / "in", out, recursive=True, workers=1)
    assert [path.name for path in victim.iterdir()] == ["kept"]
    assert (victim / "kept").read_text() == "kept"
