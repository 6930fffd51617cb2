"""Small scans, a plugin that does harm to those that ask for it, and what always holds for an output folder."""

import json
import os
import signal
import subprocess
import sys
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from glsk_o3d import read_skeleton
from glsk_o3d.apps.batch import run_batch
from glsk_o3d.samples import torus

SABOTEUR = '''
"""Does what the x of the first point says."""
import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

from glsk_o3d import Cloud, Filter
from glsk_o3d.parameters import documented
from glsk_o3d.interop.clouds import cloud_points

FOLDER = Path(os.environ["SABOTEUR"])


@documented
@dataclass(frozen=True, kw_only=True)
class Saboteur(Filter):
    """Harm."""

    consumes = produces = Cloud

    def run(self, cloud, context):
        points = cloud_points(cloud)
        order = int(points[0, 0]) // 1000 * 1000
        if order == 1000:
            os.kill(os.getpid(), signal.SIGKILL)
        if order == 2000 and (FOLDER / "once").exists():
            (FOLDER / "once").unlink()
            os._exit(3)
        if order == 4000:
            (FOLDER / str(os.getpid())).touch()
            while not (FOLDER / "open").exists():
                time.sleep(0.01)
        return points
'''


@pytest.fixture
def saboteur(install, monkeypatch, tmp_path) -> Path:
    """A recipe with a filter that kills, here and in the processes that tests start; gives the recipe."""
    folder = install("glsk-saboteur", "1", SABOTEUR, "[glsk_o3d.filters]\nSaboteur = glsk_saboteur:Saboteur\n")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("SABOTEUR", str(tmp_path / "saboteur"))
    (tmp_path / "saboteur").mkdir()
    stages = [{"filter": name} for name in ("Saboteur", "RingBuilder", "Contractor", "Connector", "Refiner")]
    recipe = tmp_path / "saboteur.json"
    recipe.write_text(json.dumps({"glsk_o3d": {"version": 1}, "pipeline": stages}))
    return recipe


@pytest.fixture
def waiting(tmp_path, until):
    """Wait for workers in the middle of a scan of the order 4000; gives their numbers.

    They go on when there is a file ``saboteur/open``.
    """
    return lambda *processes: until(
        lambda: {int(path.name) for path in (tmp_path / "saboteur").glob("[0-9]*")}, *processes
    )


@pytest.fixture
def write():
    """Write a scan of 256 points, or some other ones; gives its path. The first x tells the saboteur what to do."""

    def save(path: Path, seed=0, order=0, points=None) -> Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        points = torus(256, seed=seed).points + [order + 500 * bool(order), 0, 0] if points is None else points
        head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
        head += "property double x\nproperty double y\nproperty double z\nend_header"
        np.savetxt(path, points, fmt="%.17g", header=head if path.suffix == ".ply" else "", comments="")
        return path

    return save


@pytest.fixture
def run(tmp_path, at_once):
    """Run a batch from ``in``, or other inputs, to ``out``; gives what was to be done, with the reasons."""

    def call(inputs=None, out="out", **options):
        plans = []
        inputs = tmp_path / "in" if inputs is None else inputs
        call.result = run_batch(inputs, tmp_path / out, **{"on_plan": plans.append, **options})
        return {task.name: task.why for plan in plans for task in plan.todo}

    return call


@pytest.fixture
def rows(tmp_path):
    """The lines of the ledger in ``out``, which must be sound, by name.

    Strictly, there are no other results than those that it tells of.
    """

    def read(out="out", strict=True) -> dict[str, dict]:
        out = tmp_path / out
        lines = [json.loads(line) for line in (out / "ledger.jsonl").read_bytes().splitlines()]
        if strict:
            assert max(Counter(line["name"] for line in lines).values(), default=1) == 1, "a name is there twice"
        lines = [line for line in lines if strict or line["status"] != "started"]
        for line in lines:
            assert (line["status"], line["error"] == "") in (("done", True), ("failed", False))
            for output in line["outputs"]:
                if not output.endswith((".png", ".swc")):  # the latter has no loops
                    skeleton = read_skeleton(out / output)
                    assert (len(skeleton.vertices), skeleton.n_loops) == (line["vertices"], line["loops"])
        written = {output for line in lines for output in line["outputs"]}
        own = {"ledger.jsonl", "recipe.json", ".ledger.lock"}
        there = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()} - own
        there -= {name for name in there if name.startswith(".parts/")}
        assert written == there if strict else written <= there
        return {line["name"]: line for line in lines}

    return read


@pytest.fixture
def start(tmp_path):
    """Start ``glsk batch`` as a terminal does: Ctrl-C goes to all its processes."""
    begun = []

    def begin(*words) -> subprocess.Popen:
        command = [sys.executable, "-m", "glsk_o3d", "batch", *map(str, words)]
        pipe = subprocess.PIPE
        heard = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # in the background of a script it is ignored
        process = subprocess.Popen(
            command, cwd=tmp_path, stdout=pipe, stderr=pipe, text=True, start_new_session=True, preexec_fn=heard
        )
        begun.append(process)
        return process

    yield begin
    for process in begun:
        process.kill()
        process.communicate()
