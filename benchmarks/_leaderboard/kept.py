"""Scores that are kept beside the code, so that the tables can be made and checked without hours of runs."""

from __future__ import annotations

import gzip
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from _common.results import machine, surroundings
from _peers import PEERS, versions

from glsk_o3d.benchmark import Results, read_results
from glsk_o3d.interop.atomic import write_atomically

KEPT = Path(__file__).resolve().parents[1] / "v1"
SECONDS = KEPT / "seconds.json"
DECIMALS = 4  # of what is kept, far more than intervals are wide


@dataclass(frozen=True)
class Entry:
    """A tool's scores, and how they came about: `where` in words, `commit`, seconds of a run, `hours` of all."""

    results: Results
    made: dict[str, Any]

    @property
    def tool(self) -> str:
        return self.results.name


def keep(results: Results, limit: float) -> Path:
    """Write the scores of a tool, packed; gives the path."""
    rows = [{name: _short(value) for name, value in row.items()} for row in results.rows]
    hours = sum(row["seconds"] or 0 for row in rows) / 3600
    where = f"{machine()} {versions([PEERS[results.name]])}".strip()
    made = {"where": where, "commit": surroundings()["commit"], "limit": limit, "hours": round(hours, 2)}
    told = {"benchmark": results.benchmark, "name": results.name, "whole": results.whole, "clouds": rows, "made": made}
    path = KEPT / f"{results.name}.json.gz"
    packed = gzip.compress(json.dumps(told, ensure_ascii=False).encode(), mtime=0)  # the same bytes for the same scores
    write_atomically(path, lambda temporary: Path(temporary).write_bytes(packed))
    return path


def kept() -> list[Entry]:
    """All that is kept, in the order of the tools."""
    paths = {name: KEPT / f"{name}.json.gz" for name in PEERS}
    return [Entry(read_results(path), _made(path)) for path in paths.values() if path.is_file()]


def seconds() -> dict[str, Any]:
    """The median CPU seconds of each tool and where they were measured; nothing if they were not."""
    return json.loads(SECONDS.read_text(encoding="utf-8")) if SECONDS.is_file() else {"where": "", "tools": {}}


def _made(path):
    with gzip.open(path) as stream:
        return json.load(stream)["made"]


def _short(value):
    return round(value, DECIMALS) if isinstance(value, float) else value
