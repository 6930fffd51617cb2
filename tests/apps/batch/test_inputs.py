"""Which files a batch takes, and what it calls their results."""

from pathlib import Path

import pytest

from glsk_o3d import InvalidParameterError
from glsk_o3d.apps.batch import plan_batch
from glsk_o3d.apps.batch.inputs import find_inputs


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


DAYS = ["days/monday/a.ply", "days/tuesday/a.ply"]


def touch(*names):
    for name in names:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).touch()


def names(*inputs, out="out", **options):
    actual, _ = find_inputs(inputs, out, **options)
    assert all(path.is_absolute() for path in actual)
    return list(actual.values())


def left_out(*inputs, out="out"):
    return {Path(path).name: why for path, why in find_inputs(inputs, out, recursive=True)[1].items()}


def test_a_folder_and_what_is_left_out_with_the_reason():
    touch("in/b.ply", "in/a.PCD", "in/notes.md", "in/Makefile", "in/.hidden.ply", "in/sub/c.ply", "in/sub/.git/d.ply")
    assert names("in") == ["a", "b"]
    assert names("in", recursive=True) == ["a", "b", "sub/c"]
    endings = {"notes.md": "no cloud by its ending, .md", "Makefile": "no cloud by its ending, none"}
    assert left_out("in") == endings
    Path("in/README.txt").write_text("Three scans of a tree, of 2026")
    Path("in/lengths.csv").write_text("branch,length,radius\n1,2,3\n")
    Path("in/scan.csv").write_text("x,y,z\n" + "1,2,3\n" * 9)
    assert left_out("in") == endings | dict.fromkeys(["README.txt", "lengths.csv"], "no cloud by its first lines")
    assert names("in") == ["a", "b", "scan"]


def test_a_list(folder):
    touch("in/a.ply", "in/sub/b.ply", "lists/b.ply")
    Path("list.txt").write_bytes(b"\xef\xbb\xbf# mine\r\nin/a.ply\r\n\r\n  in/sub/b.ply\nin/gone.ply")
    assert names("list.txt") == ["in/a", "in/gone", "in/sub/b"]
    Path("lists/list.txt").write_text("in/a.ply\nlists/b.ply\n")
    assert names("lists/list.txt") == ["b", (folder / "in" / "a").relative_to(folder.anchor).as_posix()]
    Path("scan.txt").write_text("1 2 3\n" * 9)
    assert names("scan.txt") == ["scan"]
    Path("own.txt").write_text(".\n")  # it fails when its turn comes, and needs a name until then
    assert names("own.txt") == [folder.name]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"# nothing\n", r"list\.txt: no point cloud, .* a path per line: it has none"),
        (b"\xff\xfe" + b"\nsome words" * 99, r"list\.txt: no point cloud, .*: none of 100 names one that is there"),
    ],
)
def test_a_text_that_is_no_list(content, message):
    Path("list.txt").write_bytes(content)
    with pytest.raises(FileNotFoundError, match=message):
        names("list.txt")


def test_the_same_file_twice_is_one(folder):
    touch("l/d.ply")
    Path("l/list.txt").write_text(f"l/d.ply\n{folder}/l/../l/d.ply\n")
    assert names("l/list.txt", "l/d.ply", "l") == ["d"]


def test_names_that_would_be_equal():
    touch("in/a.ply", "in/a.pcd", "in/b.ply", "in/recipe.ply", "in/ledger.xyz", "in/ü b.ply", "in/scan.v1.ply")
    assert sorted(names("in")) == ["a.pcd", "a.ply", "b", "ledger.xyz", "recipe.ply", "scan.v1", "ü b"]
    touch("in/a.ply.xyz", "days/monday/a.ply", "days/tuesday/a.ply")
    for given, first, second, name in ((["in"], "a.ply", "a.ply.xyz", "a.ply"), (DAYS, *DAYS, "a.ply")):
        with pytest.raises(InvalidParameterError, match=rf"{first}.* and .*{second}.* both be called {name}: give the"):
            plan_batch(given, "out")
    assert names("days", recursive=True) == ["monday/a", "tuesday/a"]


def test_results_are_no_inputs():
    touch("in/a.pcd", "in/out/a.ply", "in/outer/b.ply")
    assert names("in", out="in/out", recursive=True) == ["a", "outer/b"]
    assert names("in/out", out=".") == ["a"]  # what was asked for
    with pytest.raises(InvalidParameterError, match="give the results one of their own"):
        names("in", out="in")


def test_what_is_not_there():
    Path("empty").mkdir()
    for given, message in (("none", "none: no such file or folder"), ("empty", "no cloud in it .sub-folders are")):
        with pytest.raises(FileNotFoundError, match=message):
            names(given)
    with pytest.raises(InvalidParameterError, match="there is no input"):
        names()
