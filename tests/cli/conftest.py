"""Small scans, and two ways to run the command: as a process and in this one."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from glsk_o3d import Skeleton, save_skeleton
from glsk_o3d.cli.main import app
from glsk_o3d.samples import sample_object, sphere, torus, y_junction


def _write_scan(path: Path, points) -> Path:
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    header += "property double x\nproperty double y\nproperty double z\nend_header\n"
    path.write_bytes(header.encode() + np.asarray(points, "<f8").tobytes())
    return path


@pytest.fixture(scope="session")
def scans(tmp_path_factory) -> Path:
    """A folder with scans of 1000 or 1100 points each; nothing may be written into it."""
    folder = tmp_path_factory.mktemp("scans")
    points = sample_object(1000).points
    _write_scan(folder / "sample.ply", sample_object(1100).points)
    _write_scan(folder / "ring.ply", torus(1000).points)
    _write_scan(folder / "ball.ply", sphere(1000).points)
    points[[3, 8]] = [[np.nan, 0, 0], [0, np.inf, 0]]
    _write_scan(folder / "nan.ply", points)
    (folder / "empty.ply").touch()
    return folder


@pytest.fixture
def write_scan():
    """Write points as a binary PLY file, whatever they are."""
    return _write_scan


@pytest.fixture
def glsk(tmp_path):
    """Run the installed command as a process in an empty folder."""
    script = Path(sys.executable).with_name("glsk")

    def run(*words, **options):
        environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
        words = [script, *map(str, words)]
        return subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, env=environment, **options)

    return run


@pytest.fixture
def invoke(tmp_path, monkeypatch):
    """Run the command in this process, in an empty folder; only mistakes of ours raise."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        result = CliRunner().invoke(app, list(map(str, words)))
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return run


@pytest.fixture
def refused(invoke, tmp_path):
    """Run the command in this process; it must fail with one line and change no file. Gives the line."""

    def run(code, *words):
        before = {path: path.is_file() and path.read_bytes() for path in tmp_path.iterdir()}
        result = invoke(*words)
        assert result.exit_code == code, result.output
        assert result.stdout == ""
        assert result.stderr.startswith("glsk: error: ")
        assert result.stderr.count("\n") == 1
        assert {path: path.is_file() and path.read_bytes() for path in tmp_path.iterdir()} == before
        return result.stderr.removeprefix("glsk: error: ").rstrip()

    return run


@pytest.fixture
def y(tmp_path) -> str:
    """The name of a file in the folder of the test with the skeleton of a Y, without points."""
    sample = y_junction(100)
    save_skeleton(Skeleton(sample.nodes, sample.edges, sample.radii, (), (), ()), tmp_path / "y.ply")
    return "y.ply"


@pytest.fixture
def ring_file(tmp_path) -> str:
    """The name of a file in the folder of the test with a closed skeleton of twelve vertices."""
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    circle = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    edges = [*((i, i + 1) for i in range(11)), (0, 11)]
    save_skeleton(Skeleton(circle, edges, np.full(12, 0.1), (), (), ()), tmp_path / "o.ply")
    return "o.ply"
