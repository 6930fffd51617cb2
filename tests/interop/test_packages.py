"""What is not installed is named, and how to install it; Open3D's verbosity level, and Python's own means before it."""

import logging
import re
import subprocess
import sys
import warnings

import open3d as o3d
import pytest
import tomlkit

import glsk_o3d as glsk
from glsk_o3d import SkeletonWarning, samples
from glsk_o3d.errors import MissingPackageError
from glsk_o3d.interop import packages

BALL = samples.sphere(400).points


@pytest.mark.parametrize(
    ("package", "error", "says"),
    [
        ("open3d", ModuleNotFoundError("No module", name="open3d"), 'cannot be imported: pip install "open3d"$'),
        ("igl", ModuleNotFoundError("No module", name="igl"), r'pip install "glsk-o3d\[crosscheck\]"$'),
        ("open3d", ModuleNotFoundError("no dash", name="dash"), r"damaged \(no dash\).* --force-reinstall open3d$"),
        ("igl", ImportError("broken"), "damaged .* --force-reinstall libigl$"),  # the extra would install nothing anew
        ("open3d", ImportError("libusb-1.0.so.0: cannot open shared object file"), "libusb-1.0.so.0.* apt-get install"),
        ("open3d", OSError("libGL.so.1: cannot open shared object file"), r"needs libGL\.so\.1, which .* libgl1 "),
    ],
)
def test_a_missing_package_says_what_to_install(monkeypatch, package, error, says):
    def fail(name):
        raise error

    monkeypatch.setattr("importlib.import_module", fail)
    with pytest.raises(MissingPackageError, match=f"^{package} .*{says}") as caught:
        packages.require(package, {"igl": "libigl"}.get(package))
    assert caught.value.__cause__ is error


def test_extras_and_libraries_are_those_of_the_project(root):
    extras = tomlkit.parse((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    names = {"PIL": "pillow", "igl": "libigl"}
    for module, extra in packages.EXTRA_OF.items():
        asked = [
            key for key in extras if any(line.startswith(f"{names.get(module, module)}>=") for line in extras[key])
        ]
        assert asked == [extra]
    script = (root / "scripts" / "system-deps.sh").read_text()
    assert set(re.findall(r"=(lib[\w.-]+)", script)) <= set(packages._OPEN3D_LIBRARIES.split())


@pytest.fixture
def verbosity():
    before = o3d.utility.get_verbosity_level()
    yield lambda name: o3d.utility.set_verbosity_level(getattr(o3d.utility.VerbosityLevel, name))
    o3d.utility.set_verbosity_level(before)


@pytest.mark.parametrize("level", ["Warning", "Debug"])
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
    assert [name for name in took if name != "LPRReducer"] == [*skeleton.report.seconds]
    assert len(skeleton.report.seconds) == len(glsk.pipelines.default().stages)
    solves = [text for text in caplog.messages if text.startswith("solve ")]
    assert len(solves) == len(skeleton.report.iterations)
    log = logging.getLogger("glsk_o3d")
    assert (log.level, log.handlers) == (logging.NOTSET, [])
    caplog.clear()
    with caplog.at_level(logging.ERROR, logger="glsk_o3d"):  # the level of the logger comes first
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
