"""The pictures of the README and of the pages, drawn by the package from its own samples.

make figures

They are kept in docs/images, so that whoever reads the pages without building the site sees them too.
"""

import io
import sys
from pathlib import Path

import architecture
import numpy as np
from first_page import (
    BLUE,
    GREY,
    INK,
    RED,
    SIDE,
    animal,
    card_robots,
    card_shapes,
    card_trees,
    dots,
    graph,
    panels,
    same_scale,
    showcase,
    skeletonised,
    view,
)
from glsk_bench import score
from glsk_bench.clouds import cloud
from glsk_bench.shapes import shape
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from PIL import Image
from scipy.spatial import Delaunay

import glsk_o3d as glsk
from glsk_o3d import samples
from glsk_o3d.curve.merging import collapse_triangles
from glsk_o3d.geometry.cycles import inscribed_circle, minimum_cycle_basis
from glsk_o3d.geometry.neighbourhoods import plane_axes

# ------------------------------------------------------------------------------------------------- pages of the filters


def curve():
    fork = glsk.editing.smooth(glsk.skeletonize(samples.helix(4000).points), length=0.3)
    rng = np.random.default_rng(0)
    points = samples.helix(4000).points[rng.choice(4000, 60, replace=False)]
    points = fork.vertices.mean(axis=0) + 1.15 * (points - fork.vertices.mean(axis=0))
    figure, axes = panels(["nearest places", "frames", "sections"])
    places = fork.nearest(points)
    for axis in axes:
        graph(axis, fork)
    dots(axes[0], points, INK, 5)
    segments(axes[0], points, places.position, INK)
    rows = fork.branches[0][::8]
    for column, color in enumerate((RED, BLUE, INK)):
        ends = fork.vertices[rows] + 0.12 * fork.frames[rows, :, column]
        segments(axes[1], fork.vertices[rows], ends, color)
    for arc_length in np.linspace(0.05, 0.95, 12) * fork.length:
        outline = fork.section(0, float(arc_length)).outline
        segments(axes[2], outline, np.roll(outline, -1, axis=0), BLUE)
    same_scale(axes)
    return figure


def segments(axis, starts, ends, color):
    axis.add_collection(
        LineCollection(np.stack([view(starts)[:, :2], view(ends)[:, :2]], axis=1), colors=color, linewidths=0.8)
    )


def denoiser():
    rng = np.random.default_rng(1)
    points = samples.y_junction(3000, noise=0.02).points
    low, high = points.min(axis=0), points.max(axis=0)
    points = np.concatenate([points, rng.uniform(low - 0.05, high + 0.05, (40, 3))])
    state = (glsk.OutlierRemover() | glsk.Denoiser())(points)
    figure, axes = panels(["a cloud with 2 % noise and 40 outliers", "denoised; red: set aside"])
    dots(axes[0], points, INK, 2.5)
    dots(axes[1], state.coordinates, INK, 2.5)
    dots(axes[1], points[state.outlier], RED, 7)
    same_scale(axes)
    return figure


def contractor():
    points = animal()
    state = (glsk.pipelines.rings() | glsk.Contractor())(points)
    figure, axes = panels(["the scan", f"after {len(state.report.iterations)} solves"], 0.8)
    dots(axes[0], points)
    dots(axes[1], points)
    dots(axes[1], state.contracted, RED, 2)
    same_scale(axes)
    return figure


def lpr_reducer():
    points = animal()
    rings = glsk.pipelines.rings()(points)
    whole, less = glsk.Contractor()(rings), glsk.Contractor(reducer=glsk.LPRReducer())(rings)
    figure, axes = panels([f"without: {len(whole)} points", f"with: {len(less)} points, larger for more mass"], 0.8)
    dots(axes[0], whole.contracted, RED, 2)
    dots(axes[1], less.contracted, RED, 1.5 * less.mass)
    same_scale(axes)
    return figure


def connector():
    points = animal()
    state = (glsk.pipelines.rings() | glsk.Contractor())(points)
    raw = glsk.Connector()(state)
    figure, axes = panels(["contracted points", f"{len(raw.vertices)} vertices, {len(raw.edges)} edges"], 0.8)
    dots(axes[0], state.contracted, INK, 3)
    dots(axes[1], points, size=1)
    graph(axes[1], raw, ends=False)
    same_scale(axes)
    return figure


def refiner():
    points = animal()
    raw = (glsk.pipelines.rings() | glsk.Contractor() | glsk.Connector())(points)
    fine = glsk.Refiner()(raw)
    figure, axes = panels(
        [f"before: {raw.n_loops} loops, counting triangles", f"after: {fine.n_loops} loop, {len(fine.leaves)} ends"],
        0.8,
    )
    for each, skeleton in zip(axes, (raw, fine), strict=True):
        dots(each, points, size=1)
        graph(each, skeleton, ends=skeleton is fine)
    same_scale(axes)
    return figure


def stopping():
    points = animal()
    figure = Figure((2 * SIDE, 0.8 * SIDE), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    contraction = glsk.pipelines.rings() | glsk.Contractor(max_iterations=8, stop=lambda _: None)
    records = contraction(points).report.iterations
    for axes, name, threshold, label in zip(
        figure.subplots(1, 2), ("explained_change", "drop"), (0.03, 0.01), ("De", "a(t−1) − a(t)"), strict=True
    ):
        ratio = [1, *(record.ring_ratio for record in records)]
        values = -np.diff(ratio) if name == "drop" else [getattr(record, name) for record in records]
        axes.plot(np.arange(1, len(values) + 1), values, "o-", color=INK)
        axes.axhline(threshold, color=RED, linestyle="--")
        axes.set(xlabel="solve", ylabel=label, yscale="log")
    return figure


# ------------------------------------------------------------------------------------------------- pages of the method


def hull():
    """A neighbourhood in its plane, the Delaunay star of its centre, and the hull of the inverted neighbours."""
    state = glsk.RingBuilder()(samples.torus(2000, noise=0.004).points)
    rings = state.rings
    cloud = state.cloud[state.survivors]
    even = [lengths.min() / lengths.max() for lengths in np.split(rings.edge_lengths(cloud), rings.indptr[1:-1])]
    i = int(np.argmax(np.where(rings.closed & (rings.sizes == 6), even, 0)))
    nearest = np.argsort(((cloud - cloud[i]) ** 2).sum(axis=1))[1:16]
    offset = (cloud[nearest] - cloud[i]) @ plane_axes(state.normals[state.survivors][[i]])[0]
    flat = np.concatenate([[[0.0, 0.0]], offset])
    inverted = offset / (offset**2).sum(axis=1, keepdims=True)
    where = {int(point): row for row, point in enumerate(nearest)}
    ring = [where[int(point)] for point in rings[i] if int(point) in where]
    figure, axes = panels(
        ["the neighbours in their plane, triangulated", "inverted, q = x / |x|²: corners of the hull"]
    )
    for a, b, c in Delaunay(flat).simplices:
        inside = 0 in (a, b, c)
        colors = dict(facecolor="#fde3d3" if inside else "white", edgecolor=GREY)
        axes[0].add_patch(Polygon(flat[[a, b, c]], linewidth=0.8, **colors))
    axes[0].add_patch(Polygon(offset[ring], fill=False, edgecolor=RED, linewidth=1.8))
    axes[1].add_patch(Polygon(inverted[ring], facecolor="#fde3d3", edgecolor=RED, linewidth=1.8))
    for each, places in zip(axes, (offset, inverted), strict=True):
        each.scatter(*places.T, s=20, c=INK, zorder=3)
        each.scatter(*places[ring].T, s=30, c=RED, zorder=4)
        each.scatter(0, 0, s=50, c=BLUE, zorder=5)
        for number, row in enumerate(ring, 1):
            outward = 10 * places[row] / np.linalg.norm(places[row])
            style = dict(textcoords="offset points", ha="center", va="center", fontsize=9, color=RED)
            each.annotate(str(number), places[row], xytext=outward, **style)
        each.margins(0.12)
        each.autoscale_view()
    return figure


def contraction():
    points = animal()
    states = []
    (glsk.pipelines.rings() | glsk.Contractor())(points, on_state=states.append)
    remaining = map(len, states)
    titles = [f"the scan: {len(points)} points", *(f"solve {t}: {n} points" for t, n in enumerate(remaining, 1))]
    figure, axes = panels(titles, 0.8, columns=3)
    for each, places in zip(axes, [points, *(state.contracted for state in states)], strict=False):
        dots(each, places, INK, 1.5)
    same_scale(axes[: len(titles)])
    return figure


def reduction():
    points = samples.y_junction(4096).points
    kept = glsk.remove_redundant_points(points, passes=3)[1]
    drawn = np.random.default_rng(0).choice(len(points), len(kept), replace=False)
    figure, axes = panels([f"all {len(points)} points", f"the {len(kept)} that LPR leaves", f"{len(kept)} at random"])
    for each, chosen in zip(axes, (slice(None), kept, drawn), strict=True):
        dots(each, points[chosen], INK, 3)
    same_scale(axes)
    return figure


def mass():
    points = samples.torus(4096).points
    rings = glsk.RingBuilder()(points)
    variants = (None, glsk.LPRReducer(), glsk.LPRReducer(conserve_mass=False))
    states = [
        glsk.Contractor(reducer=reducer, stop=lambda records: None, max_iterations=4)(rings) for reducer in variants
    ]
    words = ("no reduction", "mass kept", "mass lost, as published")
    figure, axes = panels([f"{word}: {len(state)} points" for word, state in zip(words, states, strict=True)])
    circle = np.linspace(0, 2 * np.pi, 200)
    axis = 0.4 * np.stack([np.cos(circle), np.sin(circle), 0 * circle], axis=1)
    for each, state in zip(axes, states, strict=True):
        dots(each, points, size=1, elevation=60)
        each.plot(*view(axis, elevation=60)[:, :2].T, color=BLUE, linewidth=1)
        dots(each, state.contracted, RED, 4, elevation=60)
    same_scale(axes)
    return figure


def centring():
    """A cross-section of a bent tube seen from one side only, before and after the fit to the axis."""
    torus = samples.torus(6000)
    points = torus.points[torus.points[:, 2] > 0]
    built = glsk.pipelines.rings() | glsk.Contractor() | glsk.Connector()
    raw = built(points)
    figure, axes = panels(["before the fit", "after it: where the normals meet"], 0.75)
    for each, passes in zip(axes, (0, 3), strict=True):
        skeleton = skeletonised(raw, glsk.Refiner(recentre=passes))
        angle = np.arctan2(points[:, 1], points[:, 0])
        cut = np.flatnonzero(np.abs(angle - 0.6) < 0.06)
        across, up = np.hypot(*points[cut, :2].T), points[cut, 2]
        normal = skeleton.normals[cut]
        outward = normal[:, :2] @ [np.cos(0.6), np.sin(0.6)]
        lines = np.stack([across, up], axis=1)
        reach = np.stack([outward, normal[:, 2]], axis=1)
        reach *= np.where(reach[:, 1:] > 0, -1, 1) * 0.13
        each.add_collection(LineCollection(np.stack([lines, lines + reach], axis=1), colors=GREY, linewidths=0.6))
        each.scatter(across, up, s=8, c=INK)
        each.add_patch(Circle((0.4, 0), 0.1, fill=False, edgecolor=BLUE, linestyle=":"))
        near = np.argmin(np.abs(np.arctan2(skeleton.vertices[:, 1], skeleton.vertices[:, 0]) - 0.6))
        vertex = skeleton.vertices[near]
        each.scatter(np.hypot(*vertex[:2]), vertex[2], s=60, c=RED, zorder=4)
        each.autoscale_view()
    same_scale(axes)
    return figure


def loop_test():
    points = animal(6000)
    raw = (glsk.pipelines.rings() | glsk.Contractor() | glsk.Connector())(points)
    skeleton = glsk.Refiner()(raw)
    figure, axes = panels(
        ["before: every loop of four edges and more", "after: the circle fits through the handle"], 0.8
    )
    before = collapse_triangles(raw)
    for each, shown in zip(axes, (before, skeleton), strict=True):
        dots(each, points, size=1)
        graph(each, shown, INK, 1.2, ends=False)
        for cycle in minimum_cycle_basis(len(shown.vertices), shown.edges, shown.edge_lengths):
            loop = shown.vertices[cycle]
            middle, radius = inscribed_circle(loop)
            two = np.linalg.svd(loop - loop.mean(axis=0), full_matrices=False)[2][:2]
            angle = np.linspace(0, 2 * np.pi, 60)[:, None]
            circle = middle + radius * (np.cos(angle) * two[0] + np.sin(angle) * two[1])
            each.add_collection(
                LineCollection([view(np.concatenate([loop, loop[:1]]))[:, :2]], colors=RED, linewidths=2)
            )
            each.plot(*view(circle)[:, :2].T, color=BLUE, linewidth=1.5)
    same_scale(axes)
    return figure


# ------------------------------------------------------------------------------------------------------------- failures


def failures():
    rng = np.random.default_rng(0)
    parallel = [samples.tube(2000, length=1, radius=0.1, seed=s).points + [0, y, 0] for s, y in ((0, 0), (1, 0.2))]
    box = rng.uniform(-0.5, 0.5, (4000, 3)) * [1, 0.6, 0.5]
    face = rng.integers(0, 3, 4000)
    box[np.arange(4000), face] = np.sign(box[np.arange(4000), face]) * np.array([0.5, 0.3, 0.25])[face]
    noisy = samples.y_junction(3000, noise=0.05).points
    return {
        "a ball": samples.sphere(3000).points,
        "a sheet": samples.sheet(3000).points,
        "a box": box,
        "two tubes that touch": np.concatenate(parallel),
        "two linked rings of 150 points": samples.two_rings(150).points,
        "5 % noise": noisy,
    }


def limits():
    cases = failures()
    figure, axes = panels(list(cases), 0.9, columns=3)
    for each, (name, points) in zip(axes, cases.items(), strict=True):
        skeleton = skeletonised(points)
        dots(each, points, size=1.5 if len(points) > 500 else 6)
        graph(each, skeleton)
        warning = (skeleton.report.warnings or ("no warning",))[0].partition(":")[0]
        parts = f"components: {skeleton.n_components}, loops: {skeleton.n_loops}" if len(skeleton.edges) else "no edges"
        each.set_title(f"{name}\n{warning}; {parts}", fontsize=9, color=INK)
    return figure


THINGS = {  # of version 2 of the benchmark: one that comes out well, and one that does not
    "flat": (("blades", 100, "clean"), ("blades", 109, "scan2")),
    "hollow": (("mugs", 101, "clean"), ("mugs", 106, "clean")),
    "bulky": (("animals", 100, "clean"), ("animals", 111, "scan2")),
    "two depth cameras": (("implements", 101, "depth2"), ("implements", 107, "depth2")),
}


def things():
    """Things with exact axes: one that comes out well above one that does not, and the axis beside each skeleton."""
    figure, axes = panels([""] * 2 * len(THINGS), 0.8, columns=len(THINGS))
    for column, (name, pair) in enumerate(THINGS.items()):
        for row, (family, seed, variant) in enumerate(pair):
            thing, each = shape(family, seed), axes[row * len(THINGS) + column]
            points = cloud(thing, variant)
            skeleton = skeletonised(points)
            dots(each, points, size=1.2)
            edges = view(thing.nodes)[:, :2][thing.edges[thing.judged]]
            each.add_collection(LineCollection(edges, colors=BLUE, linewidths=3.2, alpha=0.6, capstyle="round"))
            graph(each, skeleton)
            scores = score(thing, skeleton.vertices, skeleton.edges)
            each.set_title(
                f"{name}: error {scores.error:.2f}, {'right' if scores.perfect else 'wrong'}", fontsize=9, color=INK
            )
    return figure


FIGURES = (
    *(showcase, card_robots, card_trees, card_shapes),
    *(denoiser, contractor, lpr_reducer, connector, refiner, stopping),
    *(hull, contraction, reduction, mass, centring, loop_test, limits, things, curve),
)


def write(folder: Path) -> None:
    """Draw all figures, and the diagram; in few colours, so that they are small."""
    architecture.write(folder)
    for draw in FIGURES:
        drawn = io.BytesIO()
        draw().savefig(drawn, dpi=150, bbox_inches=None if draw in FIGURES[:4] else "tight")
        picture = Image.open(drawn).convert("RGB").quantize(256, dither=Image.Dither.NONE)
        picture.save(folder / f"{draw.__name__}.png", optimize=True)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
