"""Cores and threads at hand."""

import os
import subprocess
import sys

import pytest

from glsk_o3d.numerics.cores import cores, threads


def test_cores_are_those_that_may_be_used():
    assert cores() == len(os.sched_getaffinity(0))
    one = "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})"
    code = f"{one}; from glsk_o3d.numerics.cores import cores; print(cores())"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "1\n"


@pytest.mark.parametrize(
    ("said", "expected"),
    [("1", 1), ("7", 7), (" 3 ", 3), ("4,2", 4), ("", None), ("0", None), ("-2", None), ("all", None)],
)
def test_threads_are_as_many_as_openmp_may_use(said, expected, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", said)
    assert threads() == (expected or cores())
