"""What is not installed is named, and how to install it."""

import pytest

from glsk_o3d.errors import MissingPackageError
from glsk_o3d.interop import packages


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (ModuleNotFoundError("No module named 'open3d'", name="open3d"), 'pip install "open3d>=0.18"$'),
        (ModuleNotFoundError("No module named 'dash'", name="dash"), "damaged.*dash.*--force-reinstall .open3d>=0.18"),
        (ImportError("libusb-1.0.so.0: cannot open shared object file: No such file"), "apt-get install libusb-1.0-0"),
        (OSError("libGL.so.1: cannot open shared object file: No such file"), "libGL.so.1.*apt-get install libgl1"),
        (ImportError("libX11.so.6: cannot open shared object file"), "apt-get install libx11-6"),
        (ImportError("libglib-2.0.so.0: cannot open shared object file"), "apt-get install libglib2.0-0"),
        (ImportError("libgomp.so.1: cannot open shared object file"), "apt-get install libgomp1"),
        (ImportError("libodd-2.so.7: cannot open shared object file"), "install the system library libodd-2"),
    ],
)
def test_missing_open3d_says_what_to_install(monkeypatch, error, says):
    def fail(name):
        raise error

    monkeypatch.setattr("importlib.import_module", fail)
    with pytest.raises(MissingPackageError, match=says) as caught:
        packages.import_open3d()
    assert "open3d" in str(caught.value)
    assert caught.value.__cause__ is error
