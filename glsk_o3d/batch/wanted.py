"""What a batch is asked for, checked before it looks at any cloud."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..driver import as_pipeline
from ..errors import FileFormatError, InvalidParameterError
from ..interop.packages import require_for
from ..io.clouds.selection import parsed
from ..io.skeletons import skeleton_ending
from ..pipeline import Filter, Pipeline, parts
from ..recipes import to_recipe
from .grid import checked_sizes
from .splitting import Cut


@dataclass(frozen=True)
class Wanted:
    """What a batch is asked for.

    Attributes
    ----------
    recipe : dict
    endings : tuple of str
        Of the files to write for every cloud.
    cut_loops, recursive, force : bool
    where : str or None
    cut : Cut or None
        How scenes are taken apart, if they are.
    """

    recipe: dict[str, Any]
    endings: tuple[str, ...]
    cut_loops: bool
    recursive: bool
    force: bool
    where: str | None
    cut: Cut | None

    @classmethod
    def of(
        cls,
        *,
        pipeline: Pipeline | Filter | str | os.PathLike = "default",
        formats: Sequence[str] = ("ply",),
        preview: bool = False,
        cut_loops: bool = False,
        recursive: bool = False,
        where: str | None = None,
        by: str | None = None,
        tiles: float | None = None,
        overlap: float | None = None,
        force: bool = False,
    ) -> Wanted:
        """The options of `plan_batch`, checked."""
        chosen = as_pipeline(pipeline)
        recipe = to_recipe(chosen)
        try:
            endings = list(dict.fromkeys(skeleton_ending(Path(), ending) for ending in formats)) + [".png"] * preview
        except FileFormatError as error:
            raise InvalidParameterError(str(error)) from None
        if not endings:
            raise InvalidParameterError("there is nothing to write: give a format")
        for ending in endings:
            require_for(ending)
        if where is not None:
            parsed(where)
        cut = _cut(chosen, by, tiles, overlap, where)
        return cls(recipe, tuple(endings), cut_loops, recursive, force, where, cut)

    @property
    def parameters(self) -> str:
        """The hash by which results made with the same options are known."""
        more: dict[str, Any] = {"cut_loops": True} if self.cut_loops else {}
        more |= {"where": self.where} if self.where else {}
        more |= {"tiles": [self.cut.tiles, self.cut.overlap]} if self.cut and self.cut.tiles else {}
        told = {"recipe": self.recipe, **more} if more else self.recipe
        return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()


def _cut(
    pipeline: Pipeline, by: str | None, tiles: float | None, overlap: float | None, where: str | None
) -> Cut | None:
    if tiles is None:
        if overlap is not None:
            raise InvalidParameterError(f"overlap = {overlap!r}: is that of tiles: give their size, too")
        return None if by is None else Cut(by=by, where=where)
    if by is not None:
        raise InvalidParameterError("by and tiles: labels have no seams, tiles have: give one of them")
    stages = list(parts(pipeline))
    if any(getattr(stage, "root", None) is not None for stage in stages):
        raise InvalidParameterError(
            "tiles: the pipeline makes one tree of all that is in a tile: give one without root"
        )
    tiles, overlap = checked_sizes(tiles, overlap)
    drop_invalid = any(getattr(stage, "drop_invalid", False) for stage in stages)
    return Cut(tiles=tiles, overlap=overlap, where=where, drop_invalid=drop_invalid)
