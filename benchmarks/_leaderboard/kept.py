"""Scores that are kept beside the code, so that the tables can be made and checked without hours of runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from _common.results import read, read_packed, write_packed
from _peers import PEERS
from glsk_bench import Results, read_results

KEPT = Path(__file__).resolve().parents[1] / "v1"
SECONDS = KEPT / "seconds.json"
DECIMALS = 4  # of what is kept, far more than intervals are wide


@dataclass(frozen=True)
class Entry:
    """A tool's scores, and how its answers were made: commit, machine, versions, limit in seconds, hours of all."""

    results: Results
    made: dict[str, Any]

    @property
    def tool(self) -> str:
        return self.results.name


def keep(results: Results, made: Mapping[str, Any]) -> Path:
    """Write the scores of a tool, packed; gives the path."""
    rows = [{name: _short(value) for name, value in row.items()} for row in results.rows]
    hours = round(sum(row["seconds"] or 0 for row in rows) / 3600, 2)
    told = {"benchmark": results.benchmark, "name": results.name, "whole": results.whole, "clouds": rows}
    path = KEPT / f"{results.name}.json.gz"
    write_packed(path, {**told, "made": {**made, "hours": hours}})
    return path


def kept() -> list[Entry]:
    """All that is kept, in the order of the tools."""
    paths = {name: KEPT / f"{name}.json.gz" for name in PEERS}
    return [Entry(read_results(path), read_packed(path)["made"]) for path in paths.values() if path.is_file()]


def seconds() -> dict[str, dict[str, Any]]:
    """The median CPU seconds `cpu` of each tool, and `where` they were measured; of those that were."""
    return read(SECONDS) if SECONDS.is_file() else {}


def _short(value):
    return round(value, DECIMALS) if isinstance(value, float) else value
