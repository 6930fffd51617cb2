"""Rows of results: picked, summed up, and saved with where they come from."""

from __future__ import annotations

import gzip
import json
import os
import platform
import re
import subprocess
import sys
from pathlib import Path
from statistics import fmean
from typing import Any

from glsk_o3d.interop.atomic import write_atomically
from glsk_o3d.report import Report

ROOT = Path(__file__).resolve().parents[2]


def pick(rows: list[dict], **facts) -> list[dict]:
    """The rows with these facts."""
    return [row for row in rows if all(row[name] == value for name, value in facts.items())]


def summary(rows: list[dict]) -> dict:
    """Means over the shapes that gave a skeleton, and how many are right; a failure is not."""
    good = [row for row in rows if "failure" not in row]
    names = ("error", "inside", "completeness", "length", "ends", "radius_error", "tips_f1", "junctions_f1", "cpu")
    values = {name: [row[name] for row in good if row[name] is not None] for name in names}
    right = [row for row in good if row["topology"]]
    counts = dict(n=len(rows), right=len(right), leaves=sum(row["leaves"] == 0 for row in right))
    return counts | {name: fmean(found) if found else float("nan") for name, found in values.items()}


def save(path: Path | None, rows: list[dict]) -> None:
    """Write all rows, with where they come from, as JSON."""
    if path is None:
        return
    told = {"command": sys.argv[1:], **surroundings(), "rows": rows}
    path.write_text(json.dumps(told, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def read(path: Path) -> dict[str, Any]:
    """What `save` has written."""
    return json.loads(path.read_text(encoding="utf-8"))


def write_packed(path: Path, told: dict[str, Any]) -> None:
    """Write packed JSON: the same bytes for the same content."""
    packed = gzip.compress(json.dumps(told, ensure_ascii=False).encode(), mtime=0)
    write_atomically(path, lambda temporary: Path(temporary).write_bytes(packed))


def read_packed(path: Path) -> dict[str, Any]:
    """What `write_packed` has written."""
    return json.loads(gzip.decompress(path.read_bytes()))


def surroundings() -> dict[str, Any]:
    """The commit, the machine and the versions that results are of."""
    commit = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=ROOT, capture_output=True, text=True)
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return {
        "commit": commit.stdout.strip() or None,
        "machine": {
            "system": platform.platform(),
            "processor": _processor(),
            "cores": os.cpu_count(),
            "memory_gb": round(memory, 1),
            "load": round(os.getloadavg()[0], 1),
        },
        "versions": {"python": platform.python_version(), **Report().versions},
    }


def machine() -> str:
    """A line that says where and what was measured."""
    told = surroundings()
    it, versions = told["machine"], ", ".join(f"{name} {version}" for name, version in told["versions"].items())
    return (
        f"Measured on {it['processor']}, {it['cores']} cores, {it['memory_gb']} GB, load {it['load']}, {it['system']}; "
        f"{versions}; commit {told['commit']}; one thread."
    )


def _processor() -> str:
    try:
        return re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())[1]  # type: ignore[index]
    except (OSError, TypeError):
        return platform.processor()
