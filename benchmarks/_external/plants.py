"""4D plant registration (Chebrolu, Magistri, Läbe and Stachniss 2021): laser scans of plants, and graphs of them."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from glsk_o3d import read_cloud
from glsk_o3d.analysis.curves import check_graph
from glsk_o3d.errors import FileFormatError, InvalidParameterError, brief
from glsk_o3d.io.formats.graphs import words_by_line

from .entries import Axis, Entry, Source, plain, welded

ENDING = ".graph.txt"


def sources(folder: Path) -> list[Source]:
    """All ``NAME.graph.txt`` in the folder and those in it, but for hidden ones."""
    found = sorted(path for path in folder.rglob(f"*{ENDING}") if path.is_file())
    seen = [path for path in found if not any(part.startswith(".") for part in path.relative_to(folder).parts)]
    return [(plain(Path(path.parent.name, _stem(path))), partial(plant, path)) for path in seen]


def plant(path: Path) -> Entry:
    """A plant and its scan beside it, ``NAME.ply`` or ``NAME.xyz``."""
    scans = [scan for ending in (".ply", ".xyz") if (scan := path.with_name(_stem(path) + ending)).is_file()]
    if not scans:
        raise FileNotFoundError(f"{path.with_name(_stem(path))}.ply or .xyz: no such cloud")
    return Entry(plain(Path(path.parent.name)), {"scan": np.asarray(read_cloud(scans[0]).points)}, read_graph(path))


def read_graph(path: Path) -> Axis:
    """The graph in a file of lines ``v x y z``, with a label or without, and ``e i j`` that count from 0."""
    lines = words_by_line(path.read_bytes())
    try:
        nodes = np.array([[float(word) for word in words[1:4]] for words in lines if words[0] == "v"])
        edges = np.array([[int(word) for word in words[1:3]] for words in lines if words[0] == "e"])
        if nodes.ndim != 2 or nodes.shape[1] != 3 or edges.ndim != 2:
            raise ValueError("it has no lines 'v x y z' and 'e i j'")
        return welded(nodes, check_graph(nodes, edges, "graph"))
    except (ValueError, InvalidParameterError) as error:
        raise FileFormatError(f"{path}: not a valid graph: {brief(error)}") from None


def _stem(path: Path) -> str:
    return path.name.removesuffix(ENDING)
