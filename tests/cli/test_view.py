"""What `glsk view` takes, refuses and says."""

import sys

import pytest

from glsk_o3d import read_skeleton, skeletonize
from glsk_o3d.samples import sample_object


@pytest.fixture(scope="module")
def skeleton_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("skeleton") / "s.json"
    skeletonize(sample_object(700).points).save(path)
    return path


@pytest.fixture
def shown(monkeypatch):
    """What would be shown, instead of a window."""
    calls = []
    monkeypatch.setattr("glsk_o3d.viewing.window.show", lambda *words, **options: calls.append((*words, options)))
    return calls


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="about X11")
@pytest.mark.parametrize("display", [None, ":4242"])
def test_without_a_display_it_names_what_else_there_is(glsk, monkeypatch, skeleton_file, display):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    if display:
        monkeypatch.setenv("DISPLAY", display)
    run = glsk("view", skeleton_file)
    assert run.returncode == 1
    assert run.stderr.startswith("glsk: error: there is no display to open a window on: save_report and save_preview")
    assert run.stderr.count("\n") == 1


def test_a_skeleton(invoke, skeleton_file, shown):
    assert invoke("view", skeleton_file).exit_code == 0
    ((skeleton, cloud, options),) = shown
    assert cloud is None
    assert repr(skeleton) == repr(read_skeleton(skeleton_file))
    assert options == {"title": "s.json"}


def test_a_scan(invoke, scans, shown):
    assert invoke("view", scans / "sample.ply").exit_code == 0
    ((skeleton, cloud, _),) = shown
    assert len(skeleton.vertices) == 0
    assert len(cloud.points) == len(skeleton.points) == 1100


def test_files_instead_of_a_window(invoke, scans, skeleton_file, shown, tmp_path):
    for file in (skeleton_file, scans / "nan.ply"):
        result = invoke("view", file, "--report", "r.html", "--preview", "p.png")
        assert (result.exit_code, result.stdout) == (0, "wrote p.png\nwrote r.html\n")
        assert f"<title>{file.name}</title>" in (tmp_path / "r.html").read_text("utf-8")
        assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    assert shown == []


@pytest.mark.parametrize(
    ("code", "words", "message"),
    [
        (1, ["none.ply"], "no such file"),
        (1, ["empty.ply"], "the file is empty"),
        (2, ["sample.ply", "--report", "r.pdf"], "the report is a page and its name ends in .html"),
        (1, ["sample.ply", "--report", "no/r.html"], "no such folder"),
    ],
)
def test_refuses(refused, scans, shown, code, words, message):
    assert message in refused(code, "view", scans / words[0], *words[1:])
    assert shown == []
