"""Which files a batch takes, and what it calls their results."""

import os
from itertools import chain
from pathlib import Path

import pytest

from glsk_o3d import FileFormatError, InvalidParameterError
from glsk_o3d.batch import plan_batch
from glsk_o3d.batch.inputs import find_inputs
from glsk_o3d.io.paths import SCAN_ENDINGS


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def touch(here):
    def make(*names):
        for name in names:
            (here / name).parent.mkdir(parents=True, exist_ok=True)
            (here / name).touch()

    return make


def names(*inputs, out="out", **options):
    found = find_inputs(inputs, out, **options)[0]
    assert all(path.is_absolute() for path in found.values())
    return list(found)


def test_a_folder(touch):
    touch("in/b.ply", "in/a.PCD", "in/notes.md", "in/.hidden.ply", "in/sub/c.ply", "in/sub/.git/d.ply")
    assert names("in") == ["a", "b"]
    assert names("in", recursive=True) == ["a", "b", "sub/c"]


@pytest.mark.parametrize("ending", SCAN_ENDINGS)
def test_every_ending_that_is_read(touch, ending):
    touch(f"in/a{ending}")
    Path(f"in/a{ending}").write_text("1 2 3\n")
    assert names("in") == ["a"]


def test_a_pattern_is_named_from_its_fixed_part(touch):
    touch("in/p1/scan.ply", "in/p2/scan.ply", "in/p2/scan.txt", "in/p3/deep/scan.ply")
    assert names("in/*/scan.*") == ["p1/scan", "p2/scan"]
    assert names("in/p1/*") == ["scan"]
    assert names("in/**/*.ply") == ["p1/scan", "p2/scan", "p3/deep/scan"]


def test_a_list(touch, here):
    touch("in/a.ply", "in/sub/b.ply")
    (here / "list.txt").write_bytes(b"\xef\xbb\xbf# mine\r\nin/a.ply\r\n\r\n  in/sub/b.ply\nin/gone.ply")
    assert names("list.txt") == ["in/a", "in/gone", "in/sub/b"]
    (here / "list.txt").write_text("# nothing\n")
    with pytest.raises(FileNotFoundError, match=r"list\.txt: read as a list.* and it names none; it is no point cloud"):
        names("list.txt")


def test_a_text_that_is_a_cloud(here):
    (here / "in").mkdir()
    for name in ("scan.txt", "scan.csv", "in/other.txt"):
        (here / name).write_text("x,y,z\n" + "1,2,3\n" * 9)
    (here / "in" / "README.txt").write_text("Three scans of a tree, of 2026")
    (here / "in" / "lengths.csv").write_text("branch,length,radius\n1,2,3\n")
    assert names("scan.txt", "scan.csv", "in") == ["other", "scan.csv", "scan.txt"]
    assert find_inputs(["in"], "out")[1] == {
        str(here / "in" / name): "no cloud by its first lines" for name in ("README.txt", "lengths.csv")
    }


def test_what_a_folder_holds_beside_clouds_is_left_out_with_the_reason(touch, here):
    touch("in/a.ply", "in/notes.md", "in/Makefile", "in/.hidden", "in/out/b.md")
    assert find_inputs(["in"], "in/out", recursive=True)[1] == {
        str(here / "in" / "notes.md"): "no cloud by its ending, .md",
        str(here / "in" / "Makefile"): "no cloud by its ending, none",
    }


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root reads everything")
def test_folders_that_cannot_be_read_are_told(touch, here):
    touch("in/a.ply", "in/shut/b.ply")
    (here / "in" / "shut").chmod(0)
    try:
        found = find_inputs(["in"], "out", recursive=True)
    finally:
        (here / "in" / "shut").chmod(0o700)
    assert found[1] == {str(here / "in" / "shut"): "cannot be read: Permission denied"}


def test_folders_that_go_away_are_told(touch, here, monkeypatch):
    touch("in/a.ply", "in/sub/b.ply")
    listed = os.scandir

    def scandir(path):
        if str(path).endswith("sub"):
            raise PermissionError(13, "Permission denied", str(path))
        return listed(path)

    monkeypatch.setattr(os, "scandir", scandir)
    assert list(find_inputs(["in"], "out", recursive=True)[1].values()) == ["cannot be read: Permission denied"]


def test_a_list_with_a_nul(here):
    (here / "list.txt").write_bytes(b"scan\0.ply\n")
    with pytest.raises(FileNotFoundError, match="it holds a NUL"):
        names("list.txt")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_a_list_that_may_never_end(here):
    os.mkfifo(here / "list.txt")
    with pytest.raises(FileFormatError, match=r"list\.txt: is a pipe or a device"):
        names("list.txt")


@pytest.mark.parametrize("first", [b"0.25 1", b"x,y,z", b"\xff\xfe", b"gone.ply"])
def test_a_text_that_is_no_list(here, first):
    (here / "list.txt").write_bytes(first + b"\nsome words" * 99)
    with pytest.raises(
        FileNotFoundError, match=r"as a list of files, a path per line .* none of 100 lines .* no point cloud, either"
    ) as e:
        names("list.txt")
    assert repr(os.fsdecode(first)) in str(e.value)


def test_a_list_of_what_lies_elsewhere(touch, here):
    touch("in/a.ply", "lists/b.ply")
    (here / "lists" / "list.txt").write_text("in/a.ply\nlists/b.ply\n")
    assert names("lists/list.txt") == ["b", (here / "in" / "a").relative_to(here.anchor).as_posix()]


def test_other_inputs_rename_none(touch, here):
    touch("x/in/a.ply", "x/in/sub/a.ply", "more/deep/b.ply", "p/1/c.ply", "l/d.ply")
    (here / "l" / "list.txt").write_text("l/d.ply\n")
    given = [["x/in"], ["more/deep/b.ply"], ["p/*/c.ply"], ["l/list.txt"]]
    alone = [names(*each, recursive=True) for each in given]
    assert alone == [["a", "sub/a"], ["b"], ["1/c"], ["d"]]
    assert names(*chain(*given), recursive=True) == sorted(chain(*alone))


def test_two_with_one_name(touch):
    touch("monday/a.ply", "tuesday/a.ply")
    with pytest.raises(
        InvalidParameterError, match=r"would both be called a\.ply: give the folder above them, a quoted"
    ):
        names("monday", "tuesday")
    for cure in ("*/a.ply", "*day/*"):
        assert names(cure) == ["monday/a", "tuesday/a"]
    assert names(".", recursive=True) == ["monday/a", "tuesday/a"]


def test_the_same_file_twice_is_one(touch, here):
    touch("in/a.ply", "in/b.ply")
    (here / "list.txt").write_text(f"{here}/in/a.ply\nin/../in/a.ply\n")
    assert names("in", "in/a.ply", "./in/*.ply", "list.txt") == ["a", "b"]
    assert names("list.txt", "in") == ["b", "in/a"]


def test_names_that_would_be_equal_keep_their_endings(touch):
    touch("in/a.ply", "in/a.pcd", "in/b.ply", "in/recipe.ply", "in/ledger.xyz")
    assert sorted(names("in")) == ["a.pcd", "a.ply", "b", "ledger.xyz", "recipe.ply"]
    touch("in/a.ply.xyz")
    with pytest.raises(InvalidParameterError, match=r"a\.ply and .*a\.ply\.xyz would both be called a\.ply"):
        names("in")


def test_results_are_no_inputs(touch):
    touch("in/a.pcd", "in/out/a.ply", "in/outer/b.ply")
    assert names("in", out="in/out", recursive=True) == ["a", "outer/b"]
    assert names("in/**/*.*", out="in/out") == ["a", "outer/b"]
    assert names("in/out", out=".") == ["a"]  # what was asked for
    for inputs in ("in", "in/*.pcd"):
        with pytest.raises(InvalidParameterError, match="give the results one of their own"):
            names(inputs, out="in")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("none", "none: no such file or folder"),
        ("none.ply", "no such file"),
        ("none/*.ply", "no cloud matches; known endings are .ply"),
        ("empty", "no cloud in this folder .sub-folders are taken with recursive.; known"),
        ("list.txt", "no such file"),
    ],
)
def test_what_is_not_there(here, given, message):
    (here / "empty").mkdir()
    with pytest.raises(FileNotFoundError, match=message):
        names(given)


def test_no_input_at_all():
    with pytest.raises(InvalidParameterError, match="there is no input"):
        names()


def test_odd_names(touch, here):
    odd = ["in/[a].ply", "in/ü b.ply", "in/a\nb.ply", "in/scan.v1.ply"]
    touch(*odd)
    assert sorted(names("in")) == sorted(os.path.splitext(name)[0][3:] for name in odd)
    assert names("in/[a].ply") == ["[a]"]


# ------------------------------------------------------------------------------------------------- files taken apart


@pytest.fixture
def table(here):
    def make(name, header, *rows):
        (here / name).parent.mkdir(exist_ok=True)
        (here / name).write_text("\n".join([header, *rows]) + "\n")

    return make


def apart(*inputs, **options):
    """The inputs that are made of files, by name, and what is left out, by the names of the files."""
    plan = plan_batch(inputs, "out", **options)
    assert not Path("out").exists()
    left_out = {Path(path).name: reason for path, reason in plan.left_out.items()}
    return {task.name: task.source for task in plan.tasks}, left_out


def test_the_points_of_a_file_taken_apart(here, table):
    table("forest.csv", "x,y,z,tree", *(f"{i},0,0,{i % 3}" for i in range(9)))
    table("bare.xyz", "1 2 3")
    table("broken.ply", "ply")
    found, left_out = apart("forest.csv", "bare.xyz", "broken.ply", by="tree")
    assert found == {
        "broken": str(here / "broken.ply"),  # what is wrong with it shows when it is read
        **{f"forest-{i}": f"{here / 'forest.csv'} where tree == {i}" for i in range(3)},
    }
    assert left_out == {"bare.xyz": "no attribute of its points is called 'tree': there are none"}
    with pytest.raises(
        InvalidParameterError, match=r"by = 'trees': no input can be taken .*forest\.csv: .* did you mean 'tree'"
    ):
        apart("forest.csv", by="trees")


def test_labels_that_differ_in_their_last_digit_are_two(table):
    table("a.csv", "x,y,z,tree", *(f"{i},0,0,{12345678901 + i % 2}" for i in range(6)))
    assert list(apart("a.csv", by="tree")[0]) == ["a-12345678901", "a-12345678902"]


def test_a_label_never_takes_the_name_of_another_file(table):
    table("in/a-1.ply", "ply")  # its points cannot be read, and it keeps its name
    table("in/a.csv", "x,y,z,tree", "1,2,3,1")
    with pytest.raises(InvalidParameterError, match="would both be called a-1"):
        apart("in", by="tree")


@pytest.mark.parametrize(
    ("header", "row", "options", "reason"),
    [
        ("x,y,z,tree", "1,2,3,1", dict(where="cl == 5"), "no attribute of the points is called 'cl'"),
        ("x,y,z,tree,cl", "1,2,3,1e300,5", {}, "tree: 1e+300 is no label: no name has that many digits"),
    ],
)
def test_a_file_that_cannot_be_taken_apart_stops_no_other(table, header, row, options, reason):
    table("a.csv", "x,y,z,tree,cl", "1,2,3,inf,5", "1,2,3,2,5")
    table("b.csv", header, row)
    found, left_out = apart("a.csv", "b.csv", by="tree", **options)
    assert list(found) == ["a-2"]
    assert reason in left_out["b.csv"]


def test_what_numbers_no_things_is_refused(table):
    table("a.csv", "x,y,z,time", *(f"1,2,3,{i}" for i in range(10_001)))
    with pytest.raises(InvalidParameterError, match=r"has 10001 parts or more: it numbers no things"):
        apart("a.csv", by="time")
