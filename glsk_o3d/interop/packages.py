"""Packages and system libraries that are imported only where they are needed."""

from __future__ import annotations

import importlib
import re
from collections import Counter
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, requires
from typing import Any

from ..errors import MissingPackageError

_OF_DEBIAN = "GL EGL GLX OpenGL gomp usb-1.0 X11 Xext Xrender SM ICE glib-2.0 c++ c++abi"
"""Shared libraries that Debian has in packages of their names."""
_NEEDED = {  # ending of a file -> modules that read or write it
    ".html": ("matplotlib",),
    ".png": ("matplotlib",),
    ".las": ("laspy",),
    ".laz": ("laspy", "lazrs"),
    ".e57": ("pye57",),
}


def require(package: str, install: str | None = None) -> Any:
    """Import a package, or say what to install: the extra of this package that brings it, or it in the version we need.

    `install` is what pip calls it, if it is not the module's name. A MissingPackageError says that the package is not
    there, or that it needs a shared library which is not; then it names the Debian package.
    """
    asked = install or package
    try:
        return importlib.import_module(package)
    except (ImportError, OSError) as error:
        library = re.search(r"(lib[\w.+-]+?)\.so\.?(\d*)[\w.]*: cannot open shared object file", str(error))
        if library:
            cure = _library_from(library[1], library[2])
        elif isinstance(error, ModuleNotFoundError) and error.name == package.partition(".")[0]:
            cure = f'pip install "{_asked_for(asked)[1]}"'
        else:
            cure = f'its installation is damaged ({error}): pip install --force-reinstall "{_asked_for(asked)[0]}"'
        need = f"needs {library[0].partition(':')[0]}, which this machine lacks" if library else "cannot be imported"
        raise MissingPackageError(f"{package} {need}: {cure}", name=package) from error


def _library_from(name: str, version: str) -> str:
    """How to get a shared library; Debian's package has its name, in small letters, and its version."""
    if name.removeprefix("lib") in _OF_DEBIAN.split():
        package = name.lower().replace("glib-", "glib")
        return f"apt-get install {package}{'-' * package[-1].isdigit()}{version}"
    return f"install the system library {name}"


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
