"""The benchmark that shows that no result has changed, on the samples alone."""

import json

import pytest
from typer.testing import CliRunner

from glsk_o3d.samples import SAMPLES


@pytest.fixture(scope="module")
def call(benchmark, tmp_path_factory):
    """Run a command on tiny samples and no other cloud; gives its exit code and what it printed."""
    nothing = tmp_path_factory.mktemp("shared")
    with benchmark("digest") as tool:

        def run(*arguments):
            words = (*arguments, "--shared", nothing, "--size", 64, "--jobs", 1)
            result = CliRunner().invoke(tool.app, [*map(str, words)])
            assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
            return result.exit_code, result.stdout

        yield run


def test_what_differs_is_said(call, tmp_path):
    path = tmp_path / "before.json"
    assert call("make", path)[0] == 0
    told = json.loads(path.read_text())
    samples = told["samples"]
    assert [*samples] == [f"{name} 64" for name in sorted(SAMPLES)]
    digests = [digest for each in samples.values() for digest in each.values()]
    assert len({*digests}) == len(digests) == 3 * len(SAMPLES)
    code, printed = call("compare", path)
    assert code == 0
    assert printed.split()[-5:] == ["samples", "9", "9", "9", "9"]

    digest = samples["torus 64"]["wen2024"]
    samples["torus 64"]["wen2024"] = "InvalidCloudError"
    told["data"] = {"gone": dict.fromkeys(samples["tube 64"], "0" * 16)}
    path.write_text(json.dumps(told))
    code, printed = call("compare", path)
    assert code == 1
    lines = [line.strip() for line in printed.splitlines()]
    assert [line.split() for line in lines if line.startswith(("data", "samples"))] == [
        ["data", "1", "0", "0", "0"],
        ["samples", "9", "9", "8", "9"],
    ]
    differs = [line for line in lines if line.startswith("differs: ")]
    assert len(differs) == 4
    assert f"differs: torus 64, wen2024: InvalidCloudError before, {digest} now" in differs
    assert differs[0] == f"differs: gone, default: {'0' * 16} before, nothing now"
