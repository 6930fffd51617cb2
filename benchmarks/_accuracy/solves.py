"""Where the stop rule stops, and how well the reduced contraction tracks the full one."""

from __future__ import annotations

from collections import Counter
from statistics import fmean

from _common.clouds import Case
from _common.command_line import with_solves
from _common.results import pick, summary
from _common.tables import Tables, number
from scipy.spatial import cKDTree

from glsk_o3d import Pipeline
from glsk_o3d.cli.overrides import override
from glsk_o3d.pipelines import default

from .axis import local_radius
from .measuring import by_pipeline, by_variant


def stops(rows: list[dict]) -> Counter:
    """At how many shapes the rule stops after how many solves."""
    return Counter(row.get("solves") for row in pick(rows, pipeline="rule"))


def stop_tables(rows: list[dict]) -> Tables:
    """A table per variant."""
    tables = []
    for name, group in by_variant(rows).items():
        taken, lines = stops(group), []
        for label, here in by_pipeline(group).items():
            mean = summary(here)
            numbers = [number(mean[key]) for key in ("error", "inside", "completeness")]
            count = str(taken[int(label)]) if label != "rule" else ""
            lines.append([label, *numbers, f"{mean['right']}/{mean['n']}", count])
        tables.append((name, ["solves", "error", "inside", "complete", "topology", "rule stops"], lines))
    return tables


def tracking(case: Case) -> dict:
    """How far reduced contractions are from the one without reduction after as many solves, in local radii."""
    points, axis = case.load()
    contraction = Pipeline(*default().stages[:2])
    solves = len(contraction(points).report.iterations)
    contraction = with_solves(contraction, solves)
    full = override(contraction, ["Contractor.reducer=none"])(points).contracted
    found: dict[str, float] = dict(solves=solves)
    for name, kept in (("conserved", "true"), ("published", "false")):
        reduced = override(contraction, [f"LPRReducer.conserve_mass={kept}"])(points).contracted
        away = cKDTree(full).query(reduced)[0] / local_radius(axis, reduced)
        missed = cKDTree(reduced).query(full)[0] / local_radius(axis, full)
        found |= {f"{name}_points": len(reduced), f"{name}_mean": float(away.mean())}
        found |= {f"{name}_hausdorff": float(max(away.max(), missed.max()))}
    return found


def mass_tables(rows: list[dict]) -> Tables:
    """A table per variant, with the mean over its shapes."""
    names = ["solves"]
    names += [f"{kind}_{what}" for kind in ("conserved", "published") for what in ("points", "mean", "hausdorff")]
    digits = [0 if name == "solves" or name.endswith("points") else 3 for name in names]
    tables = []
    for variant, here in by_variant(rows).items():
        good = [row for row in here if "failure" not in row]
        if good:
            here.append({"shape": "mean"} | {key: fmean(row[key] for row in good) for key in names})
        lines = []
        for row in here:
            cells = [number(row.get(key), n) for key, n in zip(names, digits, strict=True)]
            lines.append([row["shape"], *cells, row.get("failure", "")])
        tables.append((variant, ["shape", *(key.replace("_", " ") for key in names), "note"], lines))
    return tables
