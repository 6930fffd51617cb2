"""A skeleton of the sample object."""

import pytest

import glsk_o3d as glsk
from glsk_o3d.samples import sample_object


@pytest.fixture(scope="session")
def run():
    return glsk.skeletonize(sample_object(1500).points)
