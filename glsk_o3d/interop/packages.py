"""Packages and system libraries that are imported only where they are needed."""

from __future__ import annotations

import importlib
import re
from collections import Counter
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
_NEEDED = {  # ending of a file -> modules that read or write it
    ".html": ("matplotlib",),
    ".png": ("matplotlib",),
    ".las": ("laspy",),
    ".laz": ("laspy", "lazrs"),
    ".e57": ("pye57",),
}


def require(package: str, install: str | None = None) -> Any:
    """Import a package, or say what to install: the extra of this package that brings it, or it in the version we need.

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
            cure = f'pip install "{_asked_for(asked)[1]}"'
        else:
            cure = f'its installation is damaged ({error}): pip install --force-reinstall "{_asked_for(asked)[0]}"'
        need = f"needs {library[0].partition(':')[0]}, which this machine lacks" if library else "cannot be imported"
        raise MissingPackageError(f"{package} {need}: {cure}", name=package) from error


def require_for(ending: str) -> None:
    """MissingPackageError if files with an ending are read or written by a package that is not installed."""
    for package in _NEEDED.get(ending.lower(), ()):
        require(package)


def _asked_for(package: str) -> tuple[str, str]:
    """A package as our metadata asks for it, and what brings it: the extra that has it, or it by itself."""
    with suppress(PackageNotFoundError):  # run from a folder, not installed
        lines = [line.partition(";") for line in requires("glsk-o3d") or ()]
        asked = [(line[0].strip(), re.search(r"extra == ['\"]([\w-]+)", line[2])) for line in lines]
        of_extra = Counter(extra[1] for _, extra in asked if extra)
        mine = [(versioned, extra) for versioned, extra in asked if re.split(r"[^\w.-]", versioned)[0] == package]
        if mine:  # larger extras have it among much else
            versioned, extra = min(mine, key=lambda found: of_extra[found[1][1]] if found[1] else 0)
            return versioned, f"glsk-o3d[{extra[1]}]" if extra else versioned
    return package, package


def import_open3d() -> Any:
    """The module ``open3d``; the MissingPackageError says what to install."""
    return require("open3d")
