"""Writes into the package what tells whether clouds are those of a version of the benchmark: once, when it is made.

    glsk benchmark make FOLDER
    python scripts/write_fingerprints.py FOLDER

What has been written once is never changed: then this says so and fails, unless nothing differs.
"""

import sys
from pathlib import Path

from glsk_bench import read_folder
from glsk_bench.versions import fingerprints, write_fingerprints


def main(folder: Path) -> Path:
    """Write the fingerprints of all clouds of a benchmark.

    Parameters
    ----------
    folder : Path
        With a whole version.

    Returns
    -------
    Path
        The file.
    """
    made = read_folder(folder)
    if not (made.whole and made.complete):
        raise SystemExit(
            f"{folder}: is not the whole of {made.version}: make it without --families, --seeds, --variants"
        )
    found = {
        shape: {variant: cloud["fingerprint"] for variant, cloud in told["clouds"].items()}
        for shape, told in made.shapes.items()
    }
    known = fingerprints(made.version)
    new = {f"{shape}_{variant}": words for shape, clouds in found.items() for variant, words in clouds.items()}
    if known and known != new:
        changed = sum(known.get(name) != words for name, words in new.items())
        raise SystemExit(f"{changed} clouds are not those of {made.version}, which never changes: make a new version")
    unscored = [cloud.name for cloud in made.clouds if not cloud.scored]
    return write_fingerprints(made.version, found, unscored)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    print(main(Path(sys.argv[1])))
