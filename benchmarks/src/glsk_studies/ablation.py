"""What every idea of the method is worth: `default` with each switched off."""

from __future__ import annotations

import re
from pathlib import Path

from glsk_o3d.interop.atomic import write_atomically

from .axes import CLOUD, change, value_of
from .runs import PUBLISHED
from .tables import BLUE, INK, Tables, grouped, keep, number, pick, sheet, summary

IDEAS = {
    "neighbours by size": "RingBuilder.k=published",
    "frame that turns along": "Sampler.frame=box",
    "thinning": "Sampler.size=all Thinner.thin_to=all",
    "outliers set aside": "OutlierRemover.outlier_factor=0",
    "denoising": "Denoiser.denoise=0",
    "merges of many points alone": "LPRReducer.least=0",
    "mass of merged points": "LPRReducer.least=0 LPRReducer.conserve_mass=false",
    "mended rings": "LPRReducer.least=0 LPRReducer.mend_rings=false",
    "cheapest merges first": "LPRReducer.least=0 LPRReducer.order=index",
    "stop by score": "Contractor.stop=RingSizeRatio",
    "stop at 3 %": "ExplainedScore.threshold=0.02",
    "last solve kept": "Contractor.keep_last=false",
    "hold on lines": "Contractor.line_hold=1",
    "runaways held": "Contractor.retries=0",
    "sampling by thickness": "Connector.radius=2% Connector.thickness=0",
    "all ring links": "Connector.links=nearest",
    "shut holes reopened": "Connector.shut=1",
    "shortest edge first": "Refiner.collapse=degree",
    "false loops closed": "Refiner.handle=0",
    "air cut": "Refiner.air=0",
    "gaps bridged": "Refiner.bridge=0",
    "spurs cut": "Refiner.limb=0",
    "edges subdivided": "Refiner.spacing=0",
    "fit to the axis": "Refiner.recentre=0",
    "thin parts traced": "Tracer.surface=0",
}
"""What `default` adds to the publications, and the settings that switch it off. All of them together (but for the
stop rule, which is published) are `wen2024`."""
WORTH = dict(perfect=2, topology=2, error=3)  # the digits of what is compared cloud by cloud


def losses(rows: list[dict]) -> tuple[dict[str, dict], list[str]]:
    """Means of every pipeline over all variants, and the ideas in it by how much is lost without them."""
    mean = {name: summary(here) for name, here in grouped(rows, "pipeline").items()}
    ideas = (name for name in mean if name in IDEAS)
    return mean, sorted(ideas, key=lambda name: _lost(mean[name], mean["default"]), reverse=True)


def _lost(mean, whole):
    """The relative rise of the error and the relative fall of the number of shapes with right topology."""
    return mean["error"] / whole["error"] - mean["right"] / max(whole["right"], 1)


def _cell(mean):
    """Error / right topologies."""
    return f"{number(mean['error'])} / {mean['right']}"


def ablation_tables(rows: list[dict]) -> Tables:
    """`default`, the ideas by how much is lost without them, and the publications."""
    variants, (mean, ideas) = grouped(rows, "variant"), losses(rows)
    lines = []
    for name in ["default", *ideas, *(name for name in PUBLISHED if name in mean)]:
        parts = [summary(pick(group, pipeline=name)) for group in variants.values()]
        label, setting = (f"without {name}", f"`{IDEAS[name]}`") if name in IDEAS else (name, "")
        lines.append([label, *map(_cell, (*parts, mean[name])), setting])
    titles = [f"{variant} ({len(pick(group, pipeline='default'))})" for variant, group in variants.items()]
    header = ["", *titles, f"all ({mean['default']['n']})", "setting"]
    return [("one idea off at a time", header, lines)]


def write_effects(page: Path, rows: list[dict]) -> None:
    """Put what is lost without each idea behind the settings that a page names in cells of its tables.

    That is over all clouds, and in the variant in which it counts most; up to the end of cell or line.
    """
    text, groups = page.read_text(encoding="utf-8"), {"": rows, **grouped(rows, "variant")}
    for name in IDEAS.keys() & {row["pipeline"] for row in rows}:
        pairs = {
            it: [summary(pick(here, pipeline=which)) for which in ("default", name)] for it, here in groups.items()
        }
        whole = pairs.pop("")
        most = max(pairs, key=lambda variant: _lost(pairs[variant][1], pairs[variant][0]))
        words = "{} → {}; {}: {} → {}".format(*map(_cell, whole), most, *map(_cell, pairs[most]))
        text = re.sub(rf"(`{re.escape(IDEAS[name])}`: ).*?(?= \||<br>)", lambda it, words=words: it[1] + words, text)
    write_atomically(page, lambda temporary: Path(temporary).write_text(text, encoding="utf-8"))


def worth_tables(rows: list[dict]) -> Tables:
    """How `default` changes without each idea, cloud by cloud, with intervals; by the topologies that are lost."""
    groups, lines = grouped(rows, "pipeline"), []
    whole = {tuple(row[name] for name in CLOUD[1:]): row for row in groups["default"]}
    ideas = sorted(IDEAS.keys() & groups.keys(), key=lambda name: (_mean(groups[name], "topology"), name))
    for name in [*ideas, *(name for name in PUBLISHED if name in groups)]:
        pairs = [(whole[tuple(row[it] for it in CLOUD[1:])], row) for row in groups[name]]
        changes = [change(pairs, it, digits)[1] for it, digits in WORTH.items()]
        label, setting = (f"without {name}", f"`{IDEAS[name]}`") if name in IDEAS else (f"`{name}`", "")
        lines.append([label, *changes, *_most(pairs), setting])
    first = ["`default`", *(number(_mean(whole.values(), it), digits) for it, digits in WORTH.items()), "", "", ""]
    header = ["", *WORTH, "most in", "topology there", "setting"]
    return [(f"what {len(whole)} clouds lose without each idea", header, [first, *lines])]


def of_worth(rows: list[dict]) -> list[dict]:
    """Of each row no more than `worth_tables` needs."""
    names = (*CLOUD, *WORTH, "failure")
    few = [{name: row[name] for name in names if name in row} for row in rows]
    return [row | {"error": round(row["error"], 4)} if "error" in row else row for row in few]


def _most(pairs):
    """The variant in which most topologies are lost, and the shares there; dashes if none is."""
    groups: dict[str, list] = {}
    for pair in pairs:
        groups.setdefault(pair[0]["variant"], []).append(pair)
    shares = {name: [_mean(side, "topology") for side in zip(*group, strict=True)] for name, group in groups.items()}
    name = min(shares, key=lambda it: shares[it][1] - shares[it][0])
    if shares[name][1] >= shares[name][0]:
        return "-", "-"
    return name, " → ".join(number(share, 2) for share in shares[name])


def _mean(rows, name):
    known = [value for row in rows if (value := value_of(row, name)) is not None]
    return sum(known) / len(known)


def draw_ablation(rows: list[dict], folder: Path) -> None:
    """What is lost without each idea: how much more error, how many shapes."""
    mean, ideas = losses(rows)
    whole = mean["default"]
    rise = [100 * (mean[name]["error"] / whole["error"] - 1) for name in ideas]
    lost = [whole["right"] - mean[name]["right"] for name in ideas]
    figure, both = sheet(0.9 + 0.23 * len(ideas), columns=2, sharey=True, width_ratios=(3, 2))
    titles = ("error rises by %", f"right topologies\nlost, of {whole['right']}")
    for axes, title, values in zip(both, titles, (rise, lost), strict=True):
        bars = axes.barh(range(len(ideas)), values, color=BLUE)
        words = [f"{value:.0f}".replace("-0", "0").replace("-", "\N{MINUS SIGN}") for value in values]
        axes.bar_label(bars, words, padding=3, fontsize=8)
        axes.axvline(0, color=INK, linewidth=0.8)
        axes.set_title(title, fontsize=10)
        axes.set_xticks([])
        axes.margins(x=0.18, y=0.01)
        axes.spines[["left", "bottom"]].set_visible(False)
        axes.tick_params(axis="y", length=0)
    both[0].set_yticks(range(len(ideas)), ideas, fontsize=9)
    both[0].invert_yaxis()
    keep(figure, folder, "accuracy_ideas")
