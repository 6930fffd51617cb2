"""Other packages: imported only where they are needed, their plugins, and what Open3D's verbosity level asks for."""

import importlib
import logging
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import metadata
from typing import Any

from ..errors import MissingPackageError

EXTRA_OF = {
    **dict.fromkeys(("matplotlib", "PIL"), "pictures"),
    **dict.fromkeys(("laspy", "lazrs"), "las"),
    **{"pye57": "e57", "igl": "crosscheck", "pymeshlab": "meshlab", "distributed": "cluster", "networkx": "graph"},
}
"""The extra of this package that brings a module."""
_NEEDED = {  # ending of a file -> modules that read or write it
    ".html": ("matplotlib",),
    ".png": ("matplotlib",),
    ".graphml": ("networkx",),
    ".las": ("laspy",),
    ".laz": ("laspy", "lazrs"),
    ".e57": ("pye57",),
}
_OPEN3D_LIBRARIES = "libegl1 libgl1 libgomp1 libidn2-0 libudev1 libusb-1.0-0 libx11-6"
"""What Debian calls the shared libraries that Open3D loads."""

FILTER_GROUP, PIPELINE_GROUP = "glsk_o3d.filters", "glsk_o3d.pipelines"
"""The entry points of plugins."""
QUIET, TALKATIVE = 0, 3  # int(o3d.utility.VerbosityLevel.Error) and .Debug


def require(package: str, install: str | None = None) -> Any:
    """Import a package; a MissingPackageError says how to get it, or the shared library that it lacks.

    `install` is what pip calls it, if it is not the module's name.
    """
    root = package.partition(".")[0]
    name = install or root
    try:
        importlib.import_module(root)
        return importlib.import_module(package)
    except (ImportError, OSError) as error:
        library = re.search(r"(lib[\w.+-]+\.so[\w.]*): cannot open shared object file", str(error))
        if library:
            lack = f"needs {library[1]}, which this machine lacks; on Debian: apt-get install {_OPEN3D_LIBRARIES}"
        elif isinstance(error, ModuleNotFoundError) and error.name == root:
            wanted = f"glsk-o3d[{EXTRA_OF[root]}]" if root in EXTRA_OF else name
            lack = f'cannot be imported: pip install "{wanted}"'
        else:
            lack = f"cannot be imported: its installation is damaged ({error}): pip install --force-reinstall {name}"
        raise MissingPackageError(f"{package} {lack}", name=package) from error


def require_for(ending: str) -> None:
    """MissingPackageError if files with an ending are read or written by a package that is not installed."""
    for package in _NEEDED.get(ending.lower(), ()):
        require(package)


def import_open3d() -> Any:
    """The module ``open3d``; the MissingPackageError says what to install."""
    return require("open3d")


def open3d_is(level: int) -> bool:
    """Whether Open3D has been imported and set to a verbosity level; it is not imported to find out."""
    utility = getattr(sys.modules.get("open3d"), "utility", None)
    return utility is not None and int(utility.get_verbosity_level()) == level


@contextmanager
def following_open3d() -> Iterator[None]:
    """Let the package's log say as much as Open3D does: debug messages at its level Debug, errors alone at Error.

    A level that the user has given the logger ``glsk_o3d`` comes first. Where nobody listens to the log, debug messages
    go to stderr, in Open3D's form.
    """
    log = logging.getLogger(__package__.partition(".")[0])
    talkative = open3d_is(TALKATIVE)
    if log.level != logging.NOTSET or not (talkative or open3d_is(QUIET)):
        yield
        return
    handler = logging.StreamHandler() if talkative and not log.hasHandlers() else logging.NullHandler()
    handler.setFormatter(logging.Formatter("[glsk-o3d %(levelname)s] %(message)s"))
    log.addHandler(handler)
    log.setLevel(logging.DEBUG if talkative else logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(logging.NOTSET)
        log.removeHandler(handler)


def entry_points(group: str, problems: list[str]) -> Iterator[tuple[str, metadata.EntryPoint]]:
    """Every entry point of a group with its distribution; of a distribution found twice those of the first.

    One by one, since a single malformed file spoils `importlib.metadata.entry_points` for all: what is wrong with it
    goes to `problems`. The name of a distribution is asked last, since that reads a file ten times as long.
    """
    seen = set()
    for distribution in metadata.distributions():
        text = distribution.read_text("entry_points.txt") or ""
        if group not in text:
            continue
        name = str(distribution.metadata["Name"])
        if name in seen:
            continue
        seen.add(name)
        heads = [line for line in map(str.strip, text.splitlines()) if line.strip("[] ") == group]
        try:
            if any(head != f"[{group}]" for head in heads):  # importlib.metadata passes over it
                raise ValueError(f"a line should be '[{group}]'")
            entries = list(distribution.entry_points.select(group=group))
        except Exception as error:
            problems.append(f"the plugins of {name} left out: its entry_points.txt is malformed: {error}")
        else:
            yield from ((f"{name} {distribution.version}", entry) for entry in entries)
