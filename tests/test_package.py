"""What holds for the package as a whole."""

import re
import subprocess
import sys
from importlib.metadata import version

import glsk_o3d


def test_import_leaves_the_heavy_packages_alone(root):
    code = "import sys, glsk_o3d; print(*sorted({name.partition('.')[0] for name in sys.modules}))"
    run = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    loaded = set(run.stdout.split())
    assert "glsk_o3d" in loaded
    assert not loaded & {"open3d", "matplotlib", "networkx", "igl", "pymeshlab", "plotly", "typer", "rich"}


def test_there_is_one_version(root):
    cited = re.search(r"^version: (.+)$", (root / "CITATION.cff").read_text(), re.MULTILINE)[1]
    assert glsk_o3d.__version__ == cited == version("glsk-o3d")


def test_is_typed(root):
    for package in ("glsk_o3d", "benchmarks/src/glsk_bench"):
        assert (root / package / "py.typed").is_file()


def test_all_names_are_there():
    missing = [name for name in glsk_o3d.__all__ if not hasattr(glsk_o3d, name)]
    assert not missing
