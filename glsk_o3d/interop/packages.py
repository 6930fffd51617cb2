"""Other packages: imported only where they are needed, and their plugins."""

import importlib
import re
from collections.abc import Iterable
from importlib import metadata
from typing import Any

from ..errors import MissingPackageError

EXTRA_OF = {
    **{"matplotlib": "pictures", "laspy": "las", "lazrs": "las", "pye57": "e57", "igl": "crosscheck"},
    **{"pymeshlab": "meshlab", "networkx": "graph"},
}
"""The extra of this package that brings a module."""
_NEEDED = {
    **{".html": "matplotlib", ".png": "matplotlib", ".graphml": "networkx"},
    **{".las": "laspy", ".laz": "lazrs", ".e57": "pye57"},
}
"""The module that reads or writes files with an ending."""
_OPEN3D_LIBRARIES = "libegl1 libgl1 libgomp1 libidn2-0 libudev1 libusb-1.0-0 libx11-6"
"""What Debian calls the shared libraries that Open3D loads."""

FILTER_GROUP, PIPELINE_GROUP = "glsk_o3d.filters", "glsk_o3d.pipelines"
"""The entry points of plugins."""


def require(package: str) -> Any:
    """Import a package; a MissingPackageError says how to get it, or the shared library that it lacks."""
    root = package.partition(".")[0]
    try:
        importlib.import_module(root)
        return importlib.import_module(package)
    except (ImportError, OSError) as error:
        library = re.search(r"(lib[\w.+-]+\.so[\w.]*): cannot open shared object file", str(error))
        if library:
            lack = f"needs {library[1]}, which this machine lacks; on Debian: apt-get install {_OPEN3D_LIBRARIES}"
        elif isinstance(error, ModuleNotFoundError) and error.name == root:
            wanted = f"glsk-o3d[{EXTRA_OF[root]}]" if root in EXTRA_OF else root
            lack = f'cannot be imported: pip install "{wanted}"'
        else:
            lack = f"cannot be imported: its installation is damaged ({error}): install it anew"
        raise MissingPackageError(f"{package} {lack}", name=package) from error


def require_for(ending: str) -> None:
    """MissingPackageError if files with an ending are read or written by a package that is not installed."""
    if ending.lower() in _NEEDED:
        require(_NEEDED[ending.lower()])


def import_open3d() -> Any:
    """The module ``open3d``; the MissingPackageError says what to install."""
    return require("open3d")


def entry_points(group: str, problems: list[str]) -> Iterable[metadata.EntryPoint]:
    """The entry points of a group; none, and a line in `problems`, if the metadata of any package is malformed."""
    try:
        return metadata.entry_points(group=group)
    except Exception as error:
        problems.append(f"all plugins left out: the entry points of an installed package are malformed: {error}")
        return ()
