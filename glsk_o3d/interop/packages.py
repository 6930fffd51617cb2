"""Packages and system libraries that are imported only where they are needed."""

from __future__ import annotations

import importlib
import re
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, requires
from typing import Any

from ..errors import MissingPackageError

_DEBIAN = {  # shared library -> Debian package, where the one does not follow from the other
    "libGL": "libgl1",
    "libEGL": "libegl1",
    "libGLX": "libglx0",
    "libOpenGL": "libopengl0",
    "libgomp": "libgomp1",
    "libusb-1.0": "libusb-1.0-0",
    "libX11": "libx11-6",
    "libXext": "libxext6",
    "libXrender": "libxrender1",
    "libSM": "libsm6",
    "libICE": "libice6",
    "libglib-2.0": "libglib2.0-0",
    "libc++": "libc++1",
    "libc++abi": "libc++abi1",
}


def require(package: str, install: str | None = None) -> Any:
    """Import an optional package, or say what to install: it by itself, in the version that this package asks for.

    Parameters
    ----------
    package : str
        Name of the module.
    install : str, optional
        What pip calls it, if it is not the module's name.

    Returns
    -------
    module

    Raises
    ------
    MissingPackageError
        The package is not there, or it needs a shared library which is not; the message names the Debian package.
    """
    asked = install or package
    try:
        return importlib.import_module(package)
    except (ImportError, OSError) as error:
        library = re.search(r"(lib[\w.+-]+?)\.so[\w.]*: cannot open shared object file", str(error))
        if library:
            debian = _DEBIAN.get(library[1])
            cure = f"apt-get install {debian}" if debian else f"install the system library {library[1]}"
        elif isinstance(error, ModuleNotFoundError) and error.name == package.partition(".")[0]:
            cure = f'pip install "{_versioned(asked)}"'
        else:
            cure = f'its installation is damaged ({error}): pip install --force-reinstall "{_versioned(asked)}"'
        need = f"needs {library[0].partition(':')[0]}, which this machine lacks" if library else "cannot be imported"
        raise MissingPackageError(f"{package} {need}: {cure}", name=package) from error


def _versioned(package: str) -> str:
    with suppress(PackageNotFoundError):  # run from a folder, not installed
        for line in requires("glsk-o3d") or ():
            if re.split(r"[^\w.-]", line)[0] == package:
                return line.partition(";")[0].strip()
    return package


def import_open3d() -> Any:
    """The module ``open3d``.

    Returns
    -------
    module

    Raises
    ------
    MissingPackageError
        Open3D or a shared library that it needs is not installed; the message says what to install.
    """
    return require("open3d")
