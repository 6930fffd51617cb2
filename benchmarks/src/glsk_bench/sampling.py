"""Several clouds of each object: of somebody's meshes, or of things of the benchmark."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from glsk_o3d.errors import FileFormatError, GlskError, InvalidParameterError
from glsk_o3d.io.paths import MESH_ENDINGS
from glsk_o3d.io.scans import read_mesh
from glsk_o3d.parameters import check_number
from glsk_o3d.recipes.catalogue import named_pipeline

from . import versions
from .folders import BenchmarkFolder, begun, write_axis, write_points
from .own import PLAIN, check_names, stored_points
from .repeating import DOUBLE, of_axis

MANIFEST_NAME = "manifest.json"
FIRST_DRAW = 100  # fitted: the seed of the first cloud of a mesh; any would do
_KNOWN_OF_MESHES = ("components", "loops", "ends", "radius")


class _Object(NamedTuple):
    """Something of which clouds are drawn: its name, how, and `_KNOWN_OF_MESHES`, and perhaps its axis."""

    name: str
    family: str
    draw: Callable[[int, int], np.ndarray]  # so many points, of the draw of this number
    known: dict[str, Any]
    axis: Any = None


def sample(
    folder: str | os.PathLike,
    meshes: str | os.PathLike | None = None,
    *,
    version: str = "v2",
    draws: int = 5,
    n: int = 4096,
    noise: float = 0.0,
    double: bool = False,
    on_object: Callable[[str, int, int], object] | None = None,
) -> BenchmarkFolder:
    """Draw several clouds of each object, so that `run` and `repeat` say how much of a skeleton is chance.

    Points are uniform by area. The same arguments draw the same clouds again.

    Parameters
    ----------
    folder : path-like
        Made if it is not there. What it has of the same draws stays, and is not drawn again.
    meshes : path-like, optional
        A folder of triangle meshes in any format that Open3D reads; by default the first thing of each family of the
        version. A file ``manifest.json`` in it may say what is right: ``{"meshes": [{"name": "cup", "loops": 1, "ends":
        [2, 3], "components": 1, "radius": 0.1}]}``; all but the name may be left out, or null.
    version : str
        Of the benchmark, if no meshes are given.
    draws, n : int
        Clouds of each object, 2 or more, and points of each.
    noise : float
        Standard deviation of Gaussian noise on every coordinate, as a share of the bounding box's diagonal.
    double : bool
        Whether there is also the first cloud of each object in float64, OBJECT_float64, so that `repeat` says whether
        rounding to float32 changes its skeleton.
    on_object : callable, optional
        Called with the name of each object that is done, how many are, and of how many.

    Returns
    -------
    BenchmarkFolder
        Its clouds are called OBJECT_DRAW. The `radius` of an object, by which distances are divided, is that of its
        true axis, the median; of a mesh that of the manifest, else the median of all vertices of the skeletons that
        the pipeline `default` makes of its clouds, whichever program is tried.

    Raises
    ------
    FileNotFoundError
        There is no such folder of meshes, or none in it.
    FileFormatError
        A mesh or the manifest cannot be read.
    InvalidParameterError
        A number is out of its range; a name is not plain, or that of two meshes; there is no such version; the folder
        has other clouds of an object; or there is no skeleton of any of a mesh's clouds, to take the radius from.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     made = sample(folder, version="v1", draws=2, n=500)
    ...     [cloud.name for cloud in made.clouds][:2]
    ['figures_100_0', 'figures_100_1']
    """
    check_number("draws", draws, "int", low=2)
    check_number("n", n, "int", low=1)
    check_number("noise", noise, low=0)
    objects = _things(version) if meshes is None else _meshes(Path(meshes))
    made = begun(Path(folder), versions.OWN)
    facts = {"draws": draws, "points": n, "noise": noise, **({"double": True} if double else {})}
    for done, (name, make) in enumerate(objects.items(), 1):
        told = made.shapes.get(name)
        if told is not None and told.get("sampled") != facts:
            raise InvalidParameterError(f"{made.path}: has other clouds of {name}: give another folder")
        if told is None or not all((made.path / each["file"]).is_file() for each in told["clouds"].values()):
            made = _add(made, make(), facts)
        if on_object is not None:
            on_object(name, done, len(objects))
    return made


def _add(made: BenchmarkFolder, it: _Object, facts: Mapping[str, Any]) -> BenchmarkFolder:
    """Write the clouds of an object; gives the folder with it."""
    points = {}
    for draw in range(facts["draws"]):
        cloud = it.draw(facts["points"], draw)
        size = facts["noise"] * np.linalg.norm(np.ptp(cloud, axis=0)) if it.axis is None else facts["noise"]
        noise = np.random.default_rng(draw).normal(0, size, cloud.shape)
        points[str(draw)] = stored_points(f"{it.name}_{draw}", cloud + noise)
        if draw == 0 and facts.get("double"):
            points[DOUBLE] = cloud + noise
    check_names(made, it.name, points)
    told = {
        **{"family": it.family, "truth": f"truth/{it.name}.npz", "fingerprint": f"{it.family} {it.name}"},
        **{"sampled": dict(facts), **it.known, "clouds": {}},
    }
    if told["radius"] is None:
        told["radius"] = _usual_radius(it.name, [each for draw, each in points.items() if draw != DOUBLE])
    if it.axis is not None:
        write_axis(made.path / told["truth"], it.axis)
    for draw, cloud in points.items():
        file = f"clouds/{it.name}_{draw}.ply"
        write_points(made.path / file, cloud)
        cell = {"file": file, "scored": True, "coverage": None, "fingerprint": versions.fingerprint(cloud)}
        told["clouds"][draw] = {**cell, "sameness": None, "points": len(cloud)}
    made = replace(made, shapes={**made.shapes, it.name: told}, complete=True)
    made.save()
    return made


def _usual_radius(name: str, clouds: Any) -> float:
    """The median radius of all vertices of the skeletons that `default` makes of some clouds."""
    default, found = named_pipeline("default"), []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what a skeleton warns of does not concern the radius
        for points in clouds:
            try:
                found.append(default(points.astype(float)).radii)
            except GlskError:
                continue
    radii = np.concatenate([*found, np.empty(0)])
    radii = radii[np.isfinite(radii) & (radii > 0)]
    if len(radii) == 0:
        raise InvalidParameterError(f"{name}: no radius could be measured: give it in the {MANIFEST_NAME}")
    return float(np.median(radii))


def _things(version: str) -> dict[str, Callable[[], _Object]]:
    """How to make the first shape of each family of a version, by their names."""
    asked = versions.version(version)

    def make(family: str) -> _Object:
        from .clouds import cloud
        from .shapes import shape

        drawn = shape(family, asked.seeds[0], steady=asked.steady)
        radius, known = of_axis(drawn)
        return _Object(
            drawn.name, family, lambda n, draw: cloud(drawn, "clean", n, draw), known | {"radius": radius}, drawn
        )

    return {f"{family}_{asked.seeds[0]}": partial(make, family) for family in sorted(asked.families)}


def _meshes(folder: Path) -> dict[str, Callable[[], _Object]]:
    """How to read each mesh of a folder, by their names."""
    endings = (".ply", *MESH_ENDINGS)
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in endings) if folder.is_dir() else []
    if not paths:
        raise FileNotFoundError(f"{folder}: has no meshes: files that end in {', '.join(endings)}")
    told = _manifest(folder / MANIFEST_NAME)
    names = [path.stem for path in paths]
    for name in names:
        if not PLAIN.fullmatch(name) or names.count(name) > 1:
            raise InvalidParameterError(
                f"{folder}: {name!r} is no plain name, or that of two meshes: call one otherwise"
            )
    unknown = {"components": 1, "loops": None, "ends": None, "radius": None}

    def make(path: Path) -> _Object:
        return _Object(path.stem, "meshes", _drawing(path), unknown | told.get(path.stem, {}))

    return {path.stem: partial(make, path) for path in paths}


def _drawing(path: Path) -> Callable[[int, int], np.ndarray]:
    import open3d as o3d

    mesh = read_mesh(path)
    if not mesh.get_surface_area() > 0:
        raise FileFormatError(f"{path}: its triangles have no area")

    def draw(n: int, number: int) -> np.ndarray:
        o3d.utility.random.seed(FIRST_DRAW + number)
        return np.asarray(mesh.sample_points_uniformly(n).points)

    return draw


def _manifest(path: Path) -> dict[str, dict[str, Any]]:
    """What is known of meshes by their names; nothing where there is no such file."""
    if not path.is_file():
        return {}
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["meshes"]
        return {str(row["name"]): dict(_checked(row)) for row in rows}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise FileFormatError(f"{path}: is damaged ({type(error).__name__}: {error})") from None


def _checked(row: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """The facts of a mesh that are given; ValueError for what is none."""
    for name in _KNOWN_OF_MESHES:
        value = row.get(name)
        if value is None:
            continue
        if name == "ends" and not (isinstance(value, list) and len(value) == 2):
            raise ValueError(f"ends of {row['name']} are no list of two numbers")
        kind = dict(type="float", low=0, open_low=True) if name == "radius" else dict(type="int", low=0)
        for each in value if name == "ends" else [value]:
            check_number(name, each, **kind)  # type: ignore[arg-type]
        yield name, value
