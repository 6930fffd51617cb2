"""An installation without the extras: what works all the same, and that everything else names its extra."""

import json
import re
import subprocess
import sys
from importlib.metadata import PackageNotFoundError

import pytest
import tomlkit

from glsk_o3d.errors import MissingPackageError
from glsk_o3d.interop import packages

EXTRAS = {  # module: (what pip calls it, the extra that brings it)
    "matplotlib": ("matplotlib", "pictures"),
    "PIL": ("pillow", "pictures"),
    "igl": ("libigl", "crosscheck"),
    "pymeshlab": ("pymeshlab", "meshlab"),
    "distributed": ("distributed", "cluster"),
    "laspy": ("laspy", "las"),
    "lazrs": ("lazrs", "las"),
    "pye57": ("pye57", "e57"),
}
BARE = f"""
import sys
for name in {[*EXTRAS, "tomlkit"]}:
    sys.modules[name] = None
"""
WORKS = """
import glsk_o3d as glsk
from glsk_o3d.samples import y_junction
points = y_junction(600).points
skeleton = glsk.skeletonize(points)
from glsk_o3d.io.skeletons import FORMATS, READABLE
for ending in FORMATS:
    skeleton.save(f"s{ending}", cut_loops=True)
    if ending in READABLE:
        glsk.read_skeleton(f"s{ending}")
glsk.save_recipe(glsk.pipelines.default(), "r.toml")
assert glsk.load_recipe("r.toml") == glsk.pipelines.default()
skeleton.to_networkx(), skeleton.to_line_set(), skeleton.to_tensor_line_set()
skeleton.annotate(points, color=(1, 0, 0))
table = skeleton.branch_table()
table.to_csv("branches.csv"), str(table), glsk.analysis.grasp_candidates(skeleton, 1.0)
"""
ASKS = """
import json
from pathlib import Path
from glsk_o3d.crosscheck import cross_check
for ending in ("las", "laz", "e57"):
    Path(f"scan.{ending}").write_bytes(b"any")
asking = {
    "preview": lambda: glsk.save_preview(skeleton, "s.png"),
    "report": lambda: glsk.save_report(skeleton, "s.html"),
    "plot": lambda: glsk.plot_skeleton(skeleton),
    "colours": lambda: skeleton.to_line_set(color="branch"),
    "grasps": lambda: glsk.analysis.grasp_candidates(skeleton, 1.0).to_line_set(),
    "crosscheck": lambda: cross_check(points),
    "meshlab": lambda: glsk.MeshSet(),
    "cluster": lambda: glsk.batch.run_batch("s.ply", "out", scheduler="tcp://127.0.0.1:1"),
    "las": lambda: glsk.read_cloud("scan.las"),
    "laz": lambda: glsk.read_cloud("scan.laz"),
    "e57": lambda: glsk.read_cloud("scan.e57"),
    "batch": lambda: glsk.batch.run_batch("s.ply", "out", preview=True),
}
said = {"notebook": skeleton._repr_html_()}
for name, ask in asking.items():
    try:
        ask()
    except glsk.MissingPackageError as error:
        said[name] = str(error)
print(json.dumps(said))
"""
NAMED = {
    **dict.fromkeys(("preview", "report", "plot", "colours", "grasps", "notebook", "batch"), "pictures"),
    **{"las": "las", "laz": "las", "e57": "e57"},
    **{name: name for name in ("crosscheck", "meshlab", "cluster")},
}


@pytest.fixture
def bare(tmp_path):
    """Run code, in a folder of its own, where none of the extras is installed."""

    def run(code, *arguments):
        words = [sys.executable, "-c", BARE + code, *arguments]
        return subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)

    return run


@pytest.fixture
def project(root):
    return tomlkit.parse((root / "pyproject.toml").read_text())["project"]


def test_without_extras(bare, tmp_path):
    done = bare(WORKS + ASKS)
    assert (done.returncode, done.stderr) == (0, "")
    said = json.loads(done.stdout.replace("&quot;", '\\"'))
    assert said.keys() == NAMED.keys()
    for name, message in said.items():
        assert f'pip install "glsk-o3d[{NAMED[name]}]"' in message, name
    left = {path.name for path in tmp_path.iterdir() if path.name.partition(".")[0] not in ("s", "scan")}
    assert left - {"out"} == {"r.toml", "branches.csv"}
    assert not list(tmp_path.glob("*.png")) + list(tmp_path.glob("*.html"))


COMMAND = "from glsk_o3d.cli.main import app; app(sys.argv[1:])"


def test_the_demo_leaves_out_its_picture(bare, tmp_path):
    done = bare(COMMAND, "demo", "-n", "1200")
    assert done.returncode == 0
    assert done.stderr.count("\n") == 1
    assert "no skeleton.png: " in done.stderr
    assert done.stderr.endswith('pip install "glsk-o3d[pictures]"\n')
    assert {path.name for path in (tmp_path / "demo").iterdir()} == {"cloud.ply", "skeleton.ply", "skeleton.json"}


@pytest.mark.parametrize(
    ("words", "extra"),
    [
        (["-o", "s.ply", "--preview", "s.png"], "pictures"),
        (["-o", "s.ply", "--report", "s.html"], "pictures"),
    ],
)
def test_the_command_asks_before_the_work(bare, tmp_path, words, extra):
    (tmp_path / "scan.xyz").write_text("0 0 0\n")  # not looked at: what cannot be written comes first
    done = bare(COMMAND, "skeletonize", "scan.xyz", *words)
    assert done.returncode == 1
    assert done.stderr.startswith("glsk: error: ")
    assert done.stderr.endswith(f'pip install "glsk-o3d[{extra}]"\n')
    assert done.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["scan.xyz"]


SCAN = """
from glsk_o3d.meshlab.layers import Layer
from glsk_o3d.samples import torus
Layer.of(torus(600).points).save("scan.ply")
"""
PYMESHLAB = 'pymeshlab cannot be imported: pip install "glsk-o3d[meshlab]"\n'


def meshlabs_own(script):
    """The filters of a script that are not ours, each with its lines."""
    found = {}
    for i, line in enumerate(script.read_text().splitlines(), 1):
        title = re.search(r'<filter name="([^"]+)"', line)
        if title and "(GLSkeleton)" not in title[1]:
            found.setdefault(title[1], []).append(str(i))
    return {title: ", ".join(lines) for title, lines in found.items()}


def test_every_filter_script_runs_or_says_at_once_what_it_needs(bare, tmp_path, root):
    done = bare(SCAN + COMMAND, "run", "--list")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.endswith(PYMESHLAB)
    refused = set()
    for script in sorted((root / "filters").glob("*.mlx")):
        done = bare(COMMAND, "run", script.stem, "scan.ply", "-o", f"{script.stem}.ply")
        needs = meshlabs_own(script)
        assert (tmp_path / f"{script.stem}.ply").exists() == (not needs) == (done.returncode == 0)
        if needs:
            refused.add(script.stem)
            assert done.stderr.startswith(f"glsk: error: {script}: ")
            assert done.stderr.endswith(f" are filters of MeshLab's own: {PYMESHLAB}")
            assert done.stderr.count("\n") == 1
            assert dict(re.findall(r"'([^']+)' \(lines? ([\d, ]+)\)", done.stderr)) == needs
            blind = bare(COMMAND, "run", script.stem, "nowhere.ply", "-o", "s.ply")
            assert blind.stderr == done.stderr  # the scan was not looked at
    assert refused == {"mesh_crosscheck", "scan_cleanup", "scan_cleanup_then_skeleton"}


def flat(key, optional):
    """All that an extra brings, as the metadata of a wheel have it: without extras that are made of others."""
    for line in optional[key]:
        if line.startswith("glsk-o3d["):
            for other in line[len("glsk-o3d[") : -1].split(","):
                yield from flat(other, optional)
        else:
            yield line


@pytest.mark.parametrize("module", EXTRAS)
def test_every_extra_is_named_as_in_our_metadata(module, project, monkeypatch):
    def lacking(name):
        raise ModuleNotFoundError(name, name=name)

    def damaged(name):
        raise ImportError("broken")

    def unknown(name):
        raise PackageNotFoundError

    name, extra = EXTRAS[module]
    optional = project["optional-dependencies"]
    assert [key for key in optional if any(line.startswith(f"{name}>=") for line in optional[key])] == [extra]
    lines = [f"{line}; extra == '{key}'" for key in sorted(optional) for line in flat(key, optional)]
    monkeypatch.setattr(packages, "requires", lambda _: [*project["dependencies"], *lines])
    monkeypatch.setattr(packages.importlib, "import_module", lacking)
    with pytest.raises(MissingPackageError) as caught:
        packages.require(module, name)
    assert str(caught.value).endswith(f'pip install "glsk-o3d[{extra}]"')
    monkeypatch.setattr(packages.importlib, "import_module", damaged)  # then the extra would install nothing anew
    with pytest.raises(MissingPackageError, match=rf'--force-reinstall "{name}>='):
        packages.require(module, name)
    monkeypatch.setattr(packages.importlib, "import_module", lacking)
    monkeypatch.setattr(packages, "requires", unknown)  # run from a folder, not installed
    with pytest.raises(MissingPackageError, match=rf'pip install "{name}"$'):
        packages.require(module, name)


def test_what_is_always_needed_is_asked_for_by_itself(project, monkeypatch):
    def lacking(name):
        raise ModuleNotFoundError(name, name=name)

    monkeypatch.setattr(packages, "requires", lambda _: list(project["dependencies"]))
    monkeypatch.setattr(packages.importlib, "import_module", lacking)
    with pytest.raises(MissingPackageError, match=r'pip install "open3d>=[0-9.]+"$'):
        packages.import_open3d()
