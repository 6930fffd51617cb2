"""The window: where there is no display an error, where there is one a picture."""

import os
import shutil
import socket
import subprocess
import sys

import numpy as np
import pytest

from glsk_o3d import DisplayError
from glsk_o3d.viewing.window import has_display, layers, show

needs_x11 = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="about X11")

LOOK = """
import sys
import numpy as np
import glsk_o3d as glsk
from glsk_o3d.viewing import window

def colours():
    opened.poll_events()
    opened.update_renderer()
    image = np.asarray(opened.capture_screen_float_buffer(True))
    return len(np.unique(np.rint(255 * image).reshape(-1, 3), axis=0))

switches = {}
window_class = __import__("open3d").visualization.VisualizerWithKeyCallback
window_class.register_key_callback = lambda self, key, switch: switches.setdefault(chr(key), switch)
opened = window.open_window(glsk.read_skeleton(sys.argv[1]), None, "a window")
seen = [colours()]
for key in "TTSC":
    switches[key](opened)
    seen.append(colours())
opened.destroy_window()
print(*seen)
"""


@pytest.fixture
def no_display(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


@needs_x11
@pytest.mark.usefixtures("no_display")
@pytest.mark.parametrize("display", [None, "", ":4242"])
def test_without_a_display(tree, monkeypatch, display):
    if display is not None:
        monkeypatch.setenv("DISPLAY", display)
    assert not has_display()
    with pytest.raises(DisplayError, match=r"no display .*save_report"):
        show(tree)


@needs_x11
@pytest.mark.usefixtures("no_display")
def test_a_wayland_socket_counts_only_while_somebody_listens(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # the names of sockets must be short
    monkeypatch.setenv("XDG_RUNTIME_DIR", ".")
    monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-0")
    assert not has_display()
    with socket.socket(socket.AF_UNIX) as compositor:
        compositor.bind("wayland-0")
        assert not has_display()
        compositor.listen()
        assert has_display()
    assert not has_display()  # though the file is still there


@needs_x11
def test_a_window_that_cannot_be_opened(run, monkeypatch):
    o3d = pytest.importorskip("open3d")
    monkeypatch.setattr("glsk_o3d.viewing.window.has_display", lambda: True)
    monkeypatch.setattr(o3d.visualization.VisualizerWithKeyCallback, "create_window", lambda *_: False)
    with pytest.raises(DisplayError, match="Open3D cannot open"):
        show(run[0])


def test_what_it_shows(run, forest, bare):
    skeleton = run[0]
    shapes = layers(skeleton)
    (cloud,), (lines, thin), (tubes,) = (shapes[name] for name in ("cloud", "skeleton", "radius tubes"))
    np.testing.assert_array_equal(np.asarray(cloud.points), skeleton.points)
    assert np.asarray(lines.lines).tolist() == skeleton.edges.tolist()
    assert thin.get_surface_area() < 0.5 * tubes.get_surface_area()
    assert len(layers(forest)["cloud"][0].points) == np.isfinite(forest.points).all(axis=1).sum() < len(forest.points)
    assert layers(bare)["cloud"] == []
    scan = cloud.paint_uniform_color((1, 0, 0))
    assert np.asarray(layers(skeleton, scan)["cloud"][0].colors)[0].tolist() == [1, 0, 0]


@pytest.fixture
def screen(no_display):
    """A display that nobody sees."""
    if shutil.which("Xvfb") is None:
        pytest.skip("needs Xvfb: apt-get install xvfb")
    reads, writes = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writes), "-screen", "0", "1024x768x24"], pass_fds=[writes], stderr=subprocess.DEVNULL
    )
    os.close(writes)
    with os.fdopen(reads) as told:
        number = told.readline().strip()
    yield f":{number}"
    server.terminate()
    server.wait()


@needs_x11
def test_on_a_screen(run, screen, tmp_path):
    run[0].save(tmp_path / "s.json")
    (tmp_path / "look.py").write_text(LOOK)
    command = [sys.executable, "look.py", "s.json"]
    environment = {**os.environ, "DISPLAY": screen, "PYTHONPATH": os.pathsep.join(sys.path)}
    told = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert told.returncode == 0, told.stderr
    first, tubes, again, cloud, nothing = map(int, told.stdout.splitlines()[-1].split())
    assert tubes != first == again > cloud > nothing == 1
