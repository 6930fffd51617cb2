"""Which files a batch takes, and what it calls their results."""

import os

import pytest

from glsk_o3d import InvalidParameterError
from glsk_o3d.batch.inputs import ENDINGS, find_inputs


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


@pytest.mark.parametrize("ending", ENDINGS)
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
    assert names("list.txt") == ["a", "gone", "sub/b"]
    (here / "list.txt").write_text("# nothing\n")
    with pytest.raises(FileNotFoundError, match=r"list\.txt: this list names no file"):
        names("list.txt")


def test_several_share_their_common_folder(touch):
    touch("x/in/a.ply", "x/more/deep/a.ply")
    assert names("x/in", "x/more/deep/a.ply") == ["in/a", "more/deep/a"]


def test_the_same_file_twice_is_one(touch, here):
    touch("in/a.ply", "in/b.ply")
    (here / "list.txt").write_text(f"{here}/in/a.ply\nin/../in/a.ply\n")
    assert names("in", "in/a.ply", "./in/*.ply", "list.txt") == ["a", "b"]


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
