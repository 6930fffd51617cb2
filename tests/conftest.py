"""Fixtures for all tests."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository."""
    return ROOT


@pytest.fixture(scope="session")
def shared_dir() -> Path:
    """Clouds and recorded results that are not in the repository: $GLSK_SHARED, or the folder ../shared."""
    place = Path(os.environ.get("GLSK_SHARED", ROOT.parent / "shared"))
    if not place.is_dir():
        pytest.skip(f"needs the data folder {place}, which is not in the repository (set GLSK_SHARED)")
    return place
