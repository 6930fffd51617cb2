"""Folders of answers: every format, every way to fail, and nothing dropped."""

import gzip
import json

import pytest
from glsk_bench import read_folder, read_results, score_answers, scoring
from glsk_bench.folders import INDEX_NAME

from glsk_o3d import Skeleton, save_skeleton
from glsk_o3d.errors import FileFormatError
from glsk_o3d.io.skeletons import READABLE

CLOUD = "tubes_100_clean"


def rows_of(results):
    return {f"{row['shape']}_{row['variant']}": row for row in results.rows}


@pytest.fixture
def answer(small, tmp_path):
    """Score one answer to the first tube: a skeleton, bytes, or a function of the path; gives its row."""
    place = tmp_path / "answers"
    place.mkdir()

    def found(content, ending=".ply", name=CLOUD):
        (place / "tubes_101_clean.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
        path = place / f"{name}{ending}"
        if isinstance(content, bytes):
            path.write_bytes(content)
        else:
            content(path)
        results = score_answers(small, place)
        assert len(results.rows) == 7
        return rows_of(results)[CLOUD]

    return found


@pytest.mark.parametrize("ending", READABLE)
def test_every_format_that_is_read(answer, small, ending):
    axis = small.truth("tubes_100")
    skeleton = Skeleton(axis.nodes, axis.edges, axis.radii, (), (), ())
    found = answer(lambda path: save_skeleton(skeleton, path), ending)
    assert (found["perfect"], found["failure"], found["seconds"]) == (True, None, None)
    assert found["error"] < 1e-6


NO_EDGES = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
NO_EDGES += b"end_header\n0 0 0\n"


@pytest.mark.parametrize(
    ("content", "ending", "said"),
    [
        (b"", ".ply", "unreadable"),
        (b"rubbish", ".obj", "unreadable"),
        (NO_EDGES, ".ply", "is a cloud"),
        (b"v 0 0 0\nv 1 0 0\nl 1 3\n", ".obj", "unreadable"),
        (b"v 0 0 0\nv 1e300 0 0\nl 1 2\n", ".obj", "must be finite, and at most"),
    ],
)
def test_what_is_no_skeleton_is_a_failure(answer, tmp_path, content, ending, said):
    found = answer(content, ending)
    assert said in found["failure"]
    assert str(tmp_path) not in found["failure"]
    told = {name: value for name, value in found.items() if value is not None}
    del told["failure"], told["shape"], told["family"], told["variant"]
    assert told == dict(perfect=False, topology=False, tips_f1=0, junctions_f1=0)


def test_what_is_missing_is_a_failure(perfect, small):
    (perfect / f"{CLOUD}.obj").unlink()
    results = score_answers(small, perfect)
    assert [name for name, row in rows_of(results).items() if row["failure"] == "no answer"] == [CLOUD]
    assert (results.failures, len(results.rows), results.name, results.whole) == (1, 7, "perfect", False)
    assert rows_of(results)["trees_100_scan2"]["perfect"]


def test_two_answers_are_refused(perfect, small):
    (perfect / f"{CLOUD}.swc").write_text("1 0 0 0 0 1 -1\n")
    with pytest.raises(FileFormatError, match=f"{CLOUD}.swc answers the same cloud: keep one"):
        score_answers(small, perfect)


def test_a_folder_without_any_answer_is_refused(small, tmp_path):
    with pytest.raises(FileNotFoundError, match="no such folder"):
        score_answers(small, tmp_path / "none")
    (tmp_path / "none").mkdir()
    with pytest.raises(FileFormatError, match=r"such as trees_100_clean\.ply"):
        score_answers(small, tmp_path / "none")
    told = {"clouds": {"hammer_0": dict(seconds=1.5)}}  # answers to the clouds of another benchmark
    (tmp_path / "none" / "times.json").write_text(json.dumps(told))
    with pytest.raises(FileFormatError, match="has no answer to any cloud of"):
        score_answers(small, tmp_path / "none")


def test_times_are_taken_over(perfect, small):
    (perfect / f"{CLOUD}.obj").unlink()
    clouds = {CLOUD: dict(seconds=600.1, failure="not done after 600 s"), "trees_100_clean": dict(seconds=1.5)}
    (perfect / "times.json").write_text(json.dumps({"clouds": clouds}))
    rows = rows_of(score_answers(small, perfect, name="mine"))
    assert (rows[CLOUD]["failure"], rows[CLOUD]["seconds"]) == ("no answer: not done after 600 s", 600.1)
    assert (rows["trees_100_clean"]["failure"], rows["trees_100_clean"]["seconds"]) == (None, 1.5)


def test_results_are_read_as_they_were_written(perfect, small, tmp_path):
    (perfect / f"{CLOUD}.obj").unlink()
    results = score_answers(str(small.path), perfect, name="Größe | 1")
    results.save(tmp_path / "scores.json")
    text = (tmp_path / "scores.json").read_text()
    told = json.loads(text)
    for row in told["clouds"]:  # as they were before things had measures of their own
        for name in scoring.OF_THINGS:
            assert row.pop(name) is None
    (tmp_path / "old.json").write_text(json.dumps(told))
    (tmp_path / "scores.json.gz").write_bytes(gzip.compress(text.encode()))
    for name in ("scores.json", "old.json", "scores.json.gz"):
        assert read_results(tmp_path / name) == results


ROW = b'{"version": "v1", "complete": true, "shapes": {"a": {}}, "clouds": {"a": 1}}'
PACKED = gzip.compress(b" " * 100_000)
SCORES = b'{"benchmark": "v1", "name": "a", "whole": true, "clouds": [{}]}'


@pytest.mark.parametrize("data", [b"", b"[]", ROW, SCORES, b"[" * 100_000])
@pytest.mark.parametrize("name", ["times.json", "scores.json", INDEX_NAME])
def test_damaged_files(perfect, small, name, data):
    place = small.path if name == INDEX_NAME else perfect
    read = {"scores.json": read_results, INDEX_NAME: lambda path: read_folder(path.parent)}
    (place / name).write_bytes(data)
    with pytest.raises(FileFormatError, match=name):
        read.get(name, lambda path: score_answers(small, perfect))(place / name)


@pytest.mark.parametrize("data", [PACKED, PACKED[:-9]])
def test_packed_results_that_are_damaged_or_fill_the_memory(tmp_path, monkeypatch, data):
    monkeypatch.setattr(scoring, "MOST_RESULTS", 1000)
    (tmp_path / "scores.json.gz").write_bytes(data)
    with pytest.raises(FileFormatError, match=r"not the scores|it is too large"):
        read_results(tmp_path / "scores.json.gz")
