"""An installation without the extras: what works all the same, and that everything else names its extra."""

import json
import re
import subprocess
import sys

import pytest

from glsk_o3d.interop.packages import EXTRA_OF

BARE = f"""
import sys
for name in {[*EXTRA_OF, "tomlkit"]}:
    sys.modules[name] = None
"""
WORKS = """
import glsk_o3d as glsk
from glsk_o3d.samples import y_junction
points = y_junction(600).points
skeleton = glsk.skeletonize(points)
from glsk_o3d.io.skeletons import FORMATS, READABLE
for ending in FORMATS.keys() - {".graphml"}:
    glsk.save_skeleton(skeleton, f"s{ending}", cut_loops=True)
    if ending in READABLE:
        glsk.read_skeleton(f"s{ending}")
glsk.save_recipe(glsk.pipelines.default(), "r.json")
assert glsk.load_recipe("r.json") == glsk.pipelines.default()
skeleton.to_line_set(), glsk.to_tubes(skeleton, (1, 0, 0))
glsk.annotate(skeleton, points, color=(1, 0, 0))
table = glsk.analysis.branch_table(skeleton)
table.to_csv("branches.csv"), str(table), glsk.analysis.grasp_candidates(skeleton, 1.0)
"""
ASKS = """
import json
from pathlib import Path
from glsk_o3d.apps.crosscheck import cross_check
for ending in ("las", "laz", "e57"):
    Path(f"scan.{ending}").write_bytes(b"any")
requests = {
    "preview": lambda: glsk.save_preview(skeleton, "s.png"),
    "report": lambda: glsk.save_report(skeleton, "s.html"),
    "graph": skeleton.to_networkx,
    "graphml": lambda: glsk.save_skeleton(skeleton, "s.graphml"),
    "plot": lambda: glsk.plot_skeleton(skeleton),
    "colours": lambda: glsk.to_line_set(skeleton, "branch"),
    "crosscheck": lambda: cross_check(points),
    "meshlab": lambda: glsk.MeshSet(),
    "las": lambda: glsk.read_cloud("scan.las"),
    "laz": lambda: glsk.read_cloud("scan.laz"),
    "e57": lambda: glsk.read_cloud("scan.e57"),
    "batch": lambda: glsk.batch.run_batch("s.ply", "out", preview=True),
}
messages = {}
for name, request in requests.items():
    try:
        request()
    except glsk.MissingPackageError as error:
        messages[name] = str(error)
print(json.dumps(messages))
"""
NAMED = {
    **dict.fromkeys(("preview", "report", "plot", "colours", "batch"), "pictures"),
    **{"las": "las", "laz": "las", "e57": "e57", "graphml": "graph"},
    **{name: name for name in ("graph", "crosscheck", "meshlab")},
}


@pytest.fixture
def bare(tmp_path):
    """Run code, in a folder of its own, where none of the extras is installed."""

    def run(code, *arguments):
        words = [sys.executable, "-c", BARE + code, *arguments]
        return subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)

    return run


def test_without_extras(bare, tmp_path):
    done = bare(WORKS + ASKS)
    assert (done.returncode, done.stderr) == (0, "")
    messages = json.loads(done.stdout)
    assert messages.keys() == NAMED.keys()
    for name, message in messages.items():
        assert f'pip install "glsk-o3d[{NAMED[name]}]"' in message, name
    written = {path.name for path in tmp_path.iterdir() if path.name.partition(".")[0] not in ("s", "scan", "out")}
    assert written == {"r.json", "branches.csv"}
    assert not list(tmp_path.glob("*.png")) + list(tmp_path.glob("*.html"))


COMMAND = "from glsk_o3d.cli.main import app; app(sys.argv[1:])"


def test_the_command_names_the_extra_before_the_work(bare, tmp_path):
    (tmp_path / "scan.xyz").write_text("0 0 0\n")  # not looked at: what cannot be written comes first
    done = bare(COMMAND, "skeletonize", "scan.xyz", "-o", "s.ply", "--preview", "s.png")
    assert done.returncode == 1
    assert re.fullmatch(r'glsk: error: .*pip install "glsk-o3d\[pictures\]"\n', done.stderr)
    assert [path.name for path in tmp_path.iterdir()] == ["scan.xyz"]


PYMESHLAB = 'pymeshlab cannot be imported: pip install "glsk-o3d[meshlab]"\n'


def test_a_filter_script_names_its_extra_before_the_work(bare):
    assert bare(COMMAND, "run", "--list").returncode == 0
    done = bare(COMMAND, "run", "scan_cleanup", "nowhere.ply", "-o", "c.ply")  # the scan is not looked at
    assert (done.returncode, done.stderr) == (1, f"glsk: error: {PYMESHLAB}")
