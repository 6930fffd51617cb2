"""Entry points of the distributions that are installed, of which any may be malformed."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import metadata


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
