"""Shapes of the benchmark, each drawn once."""

import hashlib
from functools import cache

import numpy as np
import pytest
from glsk_bench.shapes import shape


@pytest.fixture(scope="session")
def drawn():
    """Like `shape`."""
    return cache(shape)


@pytest.fixture(scope="session")
def fingerprint():
    """A few letters that tell arrays apart: to four decimals, so that roundings of any processor do not count."""

    def take(*arrays):
        found = hashlib.sha256()
        for array in arrays:
            found.update(np.round(array * 1e4).astype("<i8").tobytes())
        return found.hexdigest()[:16]

    return take


@pytest.fixture(scope="session")
def everything():
    """The bytes of all files of a folder, by their names in it."""

    def read(folder):
        return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}

    return read
