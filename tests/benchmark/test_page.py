"""The programs on the page, run as the page says."""

import re
import shutil
import sys

import numpy as np
import pytest
from glsk_bench import run, score_answers

from glsk_o3d import read_cloud, read_skeleton


@pytest.fixture
def page(root):
    text = (root / "docs" / "benchmark.md").read_text()
    return lambda language: re.search(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)[1]


def longest(points):
    """The ends of a cloud along its longest axis, in either order."""
    middle = points.mean(axis=0)
    axis = np.linalg.svd(points - middle, full_matrices=False)[2][0]
    along = (points - middle) @ axis
    ends = middle + np.outer([along.min(), along.max()], axis)
    return ends[ends[:, 0].argsort()]


def test_the_python_program(page, small, tmp_path):
    (tmp_path / "mine.py").write_text(page("py"))
    words = f"{sys.executable} {tmp_path / 'mine.py'} {{cloud}} {{skeleton}}"
    assert run(small, tmp_path / "mine", command=words, ending=".obj").failures == {}
    cloud = small.scored[-1]
    found = read_skeleton(tmp_path / "mine" / f"{cloud.name}.obj").vertices
    expected = longest(np.asarray(read_cloud(cloud.path).points))
    np.testing.assert_allclose(found[found[:, 0].argsort()], expected, atol=1e-6)
    assert all(row["perfect"] for row in score_answers(small, tmp_path / "mine").rows)


@pytest.mark.skipif(shutil.which("od") is None or sys.platform != "linux", reason="needs od of GNU")
def test_the_script_around_a_program_with_formats_of_its_own(page, small, tmp_path, monkeypatch):
    (tmp_path / "mine.sh").write_text(page("shell"))
    mytool = tmp_path / "bin" / "mytool"
    mytool.parent.mkdir()
    mytool.write_text('#!/bin/sh\necho 2 $(head -n 1 "$1") $(tail -n 1 "$1")\n')
    mytool.chmod(0o755)
    monkeypatch.setenv("PATH", str(mytool.parent), prepend=":")
    words = f"sh {tmp_path / 'mine.sh'} {{cloud}} {{skeleton}}"
    assert run(small, tmp_path / "mine", command=words, ending=".cgal").failures == {}
    cloud = small.scored[0]
    found = read_skeleton(tmp_path / "mine" / f"{cloud.name}.cgal").vertices
    np.testing.assert_allclose(found, np.asarray(read_cloud(cloud.path).points)[[0, -1]], atol=1e-6)
