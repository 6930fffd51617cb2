"""Small scans, a plugin that does harm to those that ask for it, and what always holds for an output folder."""

import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from glsk_o3d import read_skeleton
from glsk_o3d.samples import torus

SABOTEUR = '''
"""Does what the x of the first point says."""
import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glsk_o3d import Cloud, Filter
from glsk_o3d.parameters import documented
from glsk_o3d.interop.clouds import cloud_points


@documented
@dataclass(frozen=True, kw_only=True)
class Saboteur(Filter):
    """Harm."""

    consumes = produces = Cloud

    def _run(self, cloud, watch):
        points = cloud_points(cloud)
        order = int(points[0, 0]) // 1000 * 1000
        if order == 1000:
            os.kill(os.getpid(), signal.SIGKILL)
        if order == 2000 and Path(os.environ["ONCE"]).exists():
            Path(os.environ["ONCE"]).unlink()
            os._exit(3)
        if order == 3000:
            raise ZeroDivisionError("a bug")
        if order == 4000:
            gate = Path(os.environ["GATE"])
            (gate / str(os.getpid())).touch()
            while not (gate / "open").exists():
                time.sleep(0.01)
        return points
'''


@pytest.fixture
def saboteur(install, monkeypatch, tmp_path) -> Path:
    """A recipe with a filter that kills, here and in the processes that tests start; gives the recipe."""
    folder = install("glsk-saboteur", "1", SABOTEUR, "[glsk_o3d.filters]\nSaboteur = glsk_saboteur:Saboteur\n")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("ONCE", str(tmp_path / "once"))
    monkeypatch.setenv("GATE", str(tmp_path / "gate"))
    stages = [{"filter": name} for name in ("Saboteur", "RingBuilder", "Contractor", "Connector", "Refiner")]
    recipe = tmp_path / "saboteur.json"
    recipe.write_text(json.dumps({"glsk_o3d": {"version": 1}, "pipeline": stages}))
    return recipe


@pytest.fixture
def gate(tmp_path, until):
    """Where workers wait in the middle of a scan of the order 4000, until it opens."""

    class Gate:
        folder = tmp_path / "gate"

        def waiting(self, *processes) -> set[int]:
            """The workers that have come to it, once there are any."""
            return until(lambda: {int(path.name) for path in self.folder.glob("[0-9]*")}, *processes)

        def open(self):
            (self.folder / "open").touch()

        def forget(self):
            for path in self.folder.iterdir():
                path.unlink()

    Gate.folder.mkdir()
    return Gate()


@pytest.fixture
def write_points():
    """Write points as a binary PLY file; gives its path."""

    def save(path: Path, points) -> Path:
        header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
        header += "property double x\nproperty double y\nproperty double z\nend_header\n"
        path.write_bytes(header.encode() + np.asarray(points, "<f8").tobytes())
        return path

    return save


@pytest.fixture
def write(write_points):
    """Write a scan of 256 points; gives its path. The first `order` thousand say what the saboteur does."""

    def save(path: Path, seed=0, order=0) -> Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        points = torus(256, seed=seed).points + [order + 500 * bool(order), 0, 0]
        if path.suffix == ".ply":
            write_points(path, points)
        else:
            np.savetxt(path, points)
        return path

    return save


@pytest.fixture
def rows():
    """The lines of the ledger of a folder, which must be sound, by name.

    Strictly, there are no other results than those that it tells of.
    """

    def read(out: Path, strict=True) -> dict[str, dict]:
        lines = [json.loads(line) for line in (out / "ledger.jsonl").read_bytes().splitlines()]
        for key in ("name", "input"):
            assert max(Counter(line[key] for line in lines).values(), default=1) == 1, f"a {key} is there twice"
        found = {line["name"]: line for line in lines}
        for line in lines:
            assert (line["status"], line["error"] == "") in (("done", True), ("failed", False))
            for output in line["outputs"]:
                if not output.endswith((".png", ".swc")):  # the latter has no loops
                    skeleton = read_skeleton(out / output)
                    assert (len(skeleton.vertices), skeleton.n_loops) == (line["vertices"], line["loops"])
        written = {output for line in lines for output in line["outputs"]}
        own = {"ledger.jsonl", "ledger.csv", "recipe.json", ".ledger.lock"}
        there = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()} - own
        there -= {name for name in there if name.startswith(".parts/") and (name.endswith(".json") or not strict)}
        assert written == there if strict else written <= there
        return found

    return read


@pytest.fixture
def start(tmp_path):
    """Start ``glsk batch`` in an empty folder, as a terminal does: Ctrl-C goes to all its processes."""
    begun = []

    def run(*words) -> subprocess.Popen:
        command = [sys.executable, "-m", "glsk_o3d", "batch", *map(str, words)]
        pipe = subprocess.PIPE
        process = subprocess.Popen(command, cwd=tmp_path, stdout=pipe, stderr=pipe, text=True, start_new_session=True)
        begun.append(process)
        return process

    yield run
    for process in begun:
        process.kill()
        process.communicate()
