"""The benchmark that shows that no result has changed, on the samples alone."""

import json
import subprocess
import sys

import pytest

from glsk_o3d.samples import SAMPLES


@pytest.fixture
def call(root):
    """Run the script, as with other versions of the package; gives what it printed."""

    def run(*words, code=0):
        line = [sys.executable, root / "benchmarks" / "digest.py", *words]
        done = subprocess.run([*map(str, line)], capture_output=True, text=True)
        assert done.returncode == code, done.stderr
        return done.stdout

    return run


def test_a_comparison_names_what_differs(call, tmp_path):
    path, words = tmp_path / "before.json", ("--shared", tmp_path, "--size", 64, "--jobs", 1)
    call("make", path, *words)
    recorded = json.loads(path.read_text())
    samples = recorded["samples"]
    assert [*samples] == [f"{name} 64" for name in sorted(SAMPLES)]
    assert "samples 9 9 9 9 9" in " ".join(call("compare", path, *words).split())
    samples["torus 64"]["wen2024"]["decisions"] = "other"
    samples["tube 64"]["tree"] = {"error": "InvalidCloudError"}
    path.write_text(json.dumps({"samples": samples}))
    printed = call("compare", path, *words, code=1)
    assert "samples 9 9 8 8 9" in " ".join(printed.split())
    assert "differs: torus 64, wen2024, decisions" in printed
    assert "differs: tube 64, tree, error" in printed
