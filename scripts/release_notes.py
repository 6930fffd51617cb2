"""What CHANGELOG.md says of a version; fails unless the tag, the package and CITATION.cff agree on it.

usage: python scripts/release_notes.py v0.1.0
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def notes(tag: str) -> str:
    """The section of the changelog."""
    version = tag.removeprefix("v")
    for name, pattern in (
        ("glsk_o3d/__init__.py", r'^__version__ = "(.*)"$'),
        ("CITATION.cff", r"^version: (.*)$"),
    ):
        said = re.findall(pattern, (ROOT / name).read_text("utf-8"), re.MULTILINE)
        if said != [version]:
            sys.exit(f"{name}: says {said}, the tag is {tag}")
    changes = (ROOT / "CHANGELOG.md").read_text("utf-8")
    section = re.search(rf"^## \[{re.escape(version)}\] - (\S+)\n(.*?)(?=^## |\Z)", changes, re.MULTILINE | re.DOTALL)
    if not section or not re.fullmatch(r"\d{4}-\d\d-\d\d", section[1]):
        sys.exit(f"CHANGELOG.md: needs a heading '## [{version}] - YYYY-MM-DD'")
    return section[2].strip()


if __name__ == "__main__":
    print(notes(sys.argv[1]))
