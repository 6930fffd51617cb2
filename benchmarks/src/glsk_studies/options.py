"""What some options are worth: the tables of docs/parameters.md, on the package's own samples.

Means over several draws of the points, of the default pipeline but for what is named, against the true axis.
"""

from __future__ import annotations

from itertools import chain
from typing import Annotated

import numpy as np
import typer

from glsk_o3d import Refiner, samples
from glsk_o3d.analysis import compare
from glsk_o3d.cli.overrides import override
from glsk_o3d.pipelines import default

from .runs import FirstPage, Jobs, Output, application, run
from .tables import Tables, fill, number, pick, present, save

NOISE = dict(noise=0.01)
CLOUDS = {
    "`torus`": (samples.torus, {}),
    "`helix`": (samples.helix, {}),
    "`helix`, 1 % noise": (samples.helix, NOISE),
    "`y_junction`": (samples.y_junction, {}),
    "`y_junction`, 1 % noise": (samples.y_junction, NOISE),
    "`y_junction`, 512 points": (samples.y_junction, dict(n=512)),
    "animal, two cameras": (samples.sauropod, {}),
    "animal, two cameras, 1 % noise": (samples.sauropod, NOISE),
    "animal, two cameras, 1024 points": (samples.sauropod, dict(n=1024)),
    "animal, whole, 1 % noise": (samples.sauropod, NOISE | dict(cameras=None)),
}
"""Samples by what the tables call them; 4096 points where nothing else is said."""

ANIMALS = [name for name in CLOUDS if name.startswith("animal") and "1024" not in name]
SPURS = {
    "0": "Refiner.limb=0",
    f"{Refiner().limb}, the default": "",
    "0.8": "Refiner.limb=0.8",
    "0.95": "Refiner.limb=0.95",
    "the default, with `RingBuilder.k=24`": "RingBuilder.k=24",
}
RADII = [name for name in CLOUDS if "y_j" in name or "animal" in name]
NEIGHBOURS = {"`default`": "", "`k=24`": "RingBuilder.k=24", "`k=32`": "RingBuilder.k=32"}
CURVES = ["`torus`", "`helix`", "`helix`, 1 % noise", "`y_junction`", "animal, two cameras"]
SPACING = {f"`spacing={value}`": f"Refiner.spacing={value}" for value in (0.25, 0.5, 1)}

app = application(None)


def measure(cloud: str, settings: str, seed: int) -> dict:
    """One skeleton against its axis."""
    make, changed = CLOUDS[cloud]
    sample = make(**dict(n=4096, seed=seed) | changed)
    skeleton = override(default(), settings.split())(sample.points)
    found = compare(skeleton, sample)
    facts = {name: getattr(found, name) for name in ("error", "radius_error", "ends", "leaves", "topology")}
    return dict(facts, vertices=len(skeleton.vertices))


def tables(rows: list[dict]) -> dict[str, Tables]:
    """The tables by their parts of the page."""

    def values(cloud, settings, what):
        return [row[what] for row in pick(rows, cloud=cloud, settings=settings)]

    def mean(*which, digits=2):
        return number(float(np.mean(values(*which))), digits)

    def ends(cloud, settings):
        return " ".join(f"{more:+d}" if more else "0" for more in values(cloud, settings, "leaves"))

    spurs = [[name, *(ends(cloud, it) for cloud in ANIMALS)] for name, it in SPURS.items()]
    radii = [
        [cloud, *(mean(cloud, it, what) for what in ("radius_error", "ends") for it in NEIGHBOURS.values())]
        for cloud in RADII
    ]
    header = ["cloud", *(f"{what}, {name}" for what in ("radii", "ends") for name in NEIGHBOURS)]
    spacing = []
    for cloud in CURVES:
        pairs = [(mean(cloud, it, "vertices", digits=0), mean(cloud, it, "error", digits=3)) for it in SPACING.values()]
        spacing.append([cloud, *map(", ".join, pairs)])
    return {
        "spurs": [("ends too many or too few, in each draw", ["`Refiner.limb`", *ANIMALS], spurs)],
        "radii": [("mean error of the radii over the true one, and distance of the true ends in radii", header, radii)],
        "spacing": [("vertices, and mean error of the curve in radii", ["cloud", *SPACING], spacing)],
    }


@app.command()
def options(
    page: FirstPage = None,
    draws: Annotated[int, typer.Option("--draws", min=1, help="Of the points of every sample.")] = 6,
    jobs: Jobs = 2,
    output: Output = None,
) -> None:
    """Measure, print the tables, and put them into a page."""
    pairs = [(ANIMALS, SPURS), (RADII, NEIGHBOURS), (CURVES, SPACING)]
    wanted = dict.fromkeys((cloud, it) for clouds, settings in pairs for cloud in clouds for it in settings.values())
    seeds = range(draws)
    rows = run(measure, [(dict(cloud=it[0], settings=it[1]), (*it, seed)) for it in wanted for seed in seeds], jobs)
    if failed := [row for row in rows if "failure" in row]:
        raise SystemExit(f"{failed[0]['cloud']} with {failed[0]['settings'] or 'no settings'}: {failed[0]['failure']}")
    save(output, rows)
    found = tables(rows)
    present([*chain(*found.values())])
    if page is not None:
        fill(page, found)
