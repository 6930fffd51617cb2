"""Which files a batch takes, and what it calls their results."""

import os
from itertools import chain

import pytest

from glsk_o3d import InvalidParameterError
from glsk_o3d.batch.inputs import INPUT_ENDINGS, find_inputs


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
    found = find_inputs(inputs, out, **options)
    assert all(path.is_absolute() for path in found.values())
    return list(found)


def test_a_folder(touch):
    touch("in/b.ply", "in/a.PCD", "in/notes.md", "in/.hidden.ply", "in/sub/c.ply", "in/sub/.git/d.ply")
    assert names("in") == ["a", "b"]
    assert names("in", recursive=True) == ["a", "b", "sub/c"]


@pytest.mark.parametrize("ending", INPUT_ENDINGS)
def test_every_ending_that_is_read(touch, ending):
    touch(f"in/a{ending}")
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
    with pytest.raises(FileNotFoundError, match=r"list\.txt: read as a list of files.* and it names none; if it is a"):
        names("list.txt")


@pytest.mark.parametrize("first", [b"0.25 1 -3", b"x,y,z", b"\0\xff\xfe", b"gone.ply"])
def test_a_text_that_is_no_list(here, first):
    (here / "list.txt").write_bytes(first + b"\n1 2 3" * 99)
    with pytest.raises(
        FileNotFoundError, match=r"as a list of files, a path per line .* none of 100 lines .* to \.xyz$"
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
