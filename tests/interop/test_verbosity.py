"""Open3D's verbosity level, and Python's own means, which come first."""

import logging
import subprocess
import sys
import warnings

import open3d as o3d
import pytest

import glsk_o3d as glsk
from glsk_o3d import SkeletonWarning, samples

BALL = samples.sphere(400).points


@pytest.fixture
def verbosity():
    before = o3d.utility.get_verbosity_level()
    yield lambda name: o3d.utility.set_verbosity_level(getattr(o3d.utility.VerbosityLevel, name))
    o3d.utility.set_verbosity_level(before)


@pytest.mark.parametrize("level", ["Warning", "Info", "Debug"])
def test_warnings_are_issued(verbosity, level):
    verbosity(level)
    with pytest.warns(SkeletonWarning, match="sphere-like"):
        glsk.skeletonize(BALL)


def test_at_error_they_are_in_the_report_alone(verbosity):
    verbosity("Error")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        skeleton = glsk.skeletonize(BALL)
    assert "sphere-like" in skeleton.report.warnings[0]


def test_debug_messages_in_the_log(verbosity, caplog):
    tube = samples.tube(400).points
    glsk.skeletonize(tube)
    assert caplog.messages == []
    verbosity("Debug")
    skeleton = glsk.skeletonize(tube)
    took = [text.split()[0] for text in caplog.messages if " took " in text]
    assert [name for name in took if name != "LPRReducer"] == ["RingBuilder", "Contractor", "Connector", "Refiner"]
    solves = [text for text in caplog.messages if text.startswith("solve ")]
    assert len(solves) == len(skeleton.report.iterations)
    log = logging.getLogger("glsk_o3d")
    assert (log.level, log.handlers) == (logging.NOTSET, [])


def test_the_level_of_the_logger_comes_first(verbosity, caplog):
    verbosity("Debug")
    with caplog.at_level(logging.ERROR, logger="glsk_o3d"):
        glsk.RingBuilder()(BALL)
    assert caplog.messages == []


def test_on_the_console_where_nobody_listens(root):
    code = (
        "import glsk_o3d as g, sys\nfrom glsk_o3d import samples\npoints = samples.tube(300).points\n"
        "g.skeletonize(points)\nassert 'open3d' not in sys.modules\n"
        "import open3d as o3d\nlevel = o3d.utility.VerbosityLevel\ng.RingBuilder()(points)\n"
        "o3d.utility.set_verbosity_level(level.Debug)\ng.RingBuilder()(points)\n"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    assert run.stderr.startswith("[glsk-o3d DEBUG] RingBuilder took ")
    assert run.stderr.count("\n") == 1
