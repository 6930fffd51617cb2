"""What is not installed is named, and how to install it."""

import re

import pytest
import tomlkit

from glsk_o3d.errors import MissingPackageError
from glsk_o3d.interop import packages


@pytest.mark.parametrize(
    ("package", "error", "message"),
    [
        ("open3d", ModuleNotFoundError("No module", name="open3d"), 'cannot be imported: pip install "open3d"$'),
        ("igl", ModuleNotFoundError("No module", name="igl"), r'pip install "glsk-o3d\[crosscheck\]"$'),
        ("open3d", ModuleNotFoundError("no dash", name="dash"), r"damaged \(no dash\): install it anew$"),
        ("open3d", ImportError("libusb-1.0.so.0: cannot open shared object file"), "libusb-1.0.so.0.* apt-get install"),
        ("open3d", OSError("libGL.so.1: cannot open shared object file"), r"needs libGL\.so\.1, which .* libgl1 "),
    ],
)
def test_the_error_for_a_missing_package_names_what_to_install(monkeypatch, package, error, message):
    def fail(name):
        raise error

    monkeypatch.setattr("importlib.import_module", fail)
    with pytest.raises(MissingPackageError, match=f"^{package} .*{message}") as caught:
        packages.require(package)
    assert caught.value.__cause__ is error


def test_extras_and_libraries_are_those_of_the_project(root):
    extras = tomlkit.parse((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    names = {"igl": "libigl"}
    for module, extra in packages.EXTRA_OF.items():
        requirement = f"{names.get(module, module)}>="
        assert [key for key in extras if any(line.startswith(requirement) for line in extras[key])] == [extra]
    script = (root / "scripts" / "system-deps.sh").read_text()
    assert set(re.findall(r"=(lib[\w.-]+)", script)) <= set(packages._OPEN3D_LIBRARIES.split())
