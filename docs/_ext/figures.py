"""The pictures of the README and of the pages, drawn by the package from its own samples.

make figures

They are kept in docs/images, so that whoever reads the pages without building the site sees them too.
"""

import io
import sys
import warnings
from pathlib import Path

import architecture
import numpy as np
from glsk_bench import score
from glsk_bench.clouds import cloud
from glsk_bench.shapes import shape
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from PIL import Image
from scipy.spatial import Delaunay, cKDTree

import glsk_o3d as glsk
from glsk_o3d import pipelines, samples
from glsk_o3d.analysis import Gripper, grasp_candidates, segment
from glsk_o3d.analysis.segmentation import branch_of_edge
from glsk_o3d.curve.merging import collapse_triangles
from glsk_o3d.geometry.cycles import inscribed_circle, minimum_cycle_basis
from glsk_o3d.geometry.neighbourhoods import plane_axes
from glsk_o3d.io.colors import shades

INK, RED, GREY, BLUE, ORANGE = "#333333", "#d0121f", "#b4b4b4", "#1f5fa8", "#e07b00"
SIDE = 3.2  # inches of a panel
CARD = (4.0, 3.0)  # inches of a picture on the first page

# ------------------------------------------------------------------------------------------------------------ drawing


def panels(titles, aspect=1.0, columns=None):
    """A figure with a row of empty axes, or several rows of so many columns."""
    columns = columns or len(titles)
    rows = -(-len(titles) // columns)
    figure = Figure((SIDE * columns, (SIDE * aspect + 0.35) * rows), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for each in axes:
        each.set_axis_off()
    for each, title in zip(axes, titles, strict=False):  # the last row need not be full
        each.set_title(title, fontsize=10, color=INK)
        each.set_aspect("equal")
    return figure, axes


def view(points, azimuth=-65.0, elevation=20.0):
    """Points as somebody sees them: right, up, and towards the eye."""
    a, e = np.radians([azimuth, elevation])
    right = [-np.sin(a), np.cos(a), 0]
    up = [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]
    return np.asarray(points) @ np.stack([right, up, np.cross(right, up)]).T


def dots(axes, points, color=GREY, size=2.0, **angles):
    seen = view(points, **angles)
    order = np.argsort(seen[:, 2])
    if isinstance(size, np.ndarray):
        size = size[order]
    axes.scatter(*seen[order, :2].T, s=size, c=color, linewidths=0)


def graph(axes, skeleton, color=RED, width=1.8, ends=True, **angles):
    seen = view(skeleton.vertices, **angles)[:, :2]
    axes.add_collection(LineCollection(seen[skeleton.edges], colors=color, linewidths=width, capstyle="round"))
    if ends:
        axes.scatter(*seen[skeleton.degree > 2].T, s=18, c=INK, zorder=3)
        axes.scatter(*seen[skeleton.degree == 1].T, s=12, facecolors="white", edgecolors=color, zorder=3)
    axes.autoscale_view()


def same_scale(axes):
    """The same limits for all panels."""
    limits = np.array([[*each.get_xlim(), *each.get_ylim()] for each in axes])
    for each in axes:
        each.set(xlim=(limits[:, 0].min(), limits[:, 1].max()), ylim=(limits[:, 2].min(), limits[:, 3].max()))


def skeletonised(points, pipeline=None):
    """A skeleton without its warnings, which the captions tell."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glsk.SkeletonWarning)
        return (pipeline or pipelines.default())(points)


def animal(n=5000):
    return samples.sample_object(n).points


# ------------------------------------------------------------------------------------------------------- the first one


def showcase():
    """Five objects, each damaged in another way, with their skeletons: the first picture of README and site."""
    height, foot = 2.75, 0.42  # inches, all of them
    objects = damaged()
    total = sum(wide for _, wide, _, _ in objects) + 0.2 * len(objects)
    figure = Figure((total, height), facecolor="white")
    FigureCanvasAgg(figure)
    left = 0.1
    for name, wide, points, angles in objects:
        skeleton = skeletonised(points)
        axes = figure.add_axes([left / total, foot / height, wide / total, 1 - foot / height])
        portrait(axes, skeleton, points, np.array([wide, height - foot]), **angles)
        figure.text((left + wide / 2) / total, 0.12 / height, name, ha="center", fontsize=12.5, color=INK)
        left += wide + 0.2
    return figure


def portrait(axes, skeleton, points, box, colors=None, width=2.5, beside=(), **angles):
    """A cloud and its skeleton in a box of so many inches, with room for what is beside; points are grey, or not."""
    cloud, vertices = view(points, **angles), view(skeleton.vertices, **angles)
    low, high = np.percentile(cloud[:, :2], [0.8, 99.2], axis=0)  # a few points may stand out
    also = np.concatenate([vertices[:, :2], *(view(ends, **angles)[:, :2] for ends in beside)])
    low, high = np.minimum(low, also.min(axis=0)), np.maximum(high, also.max(axis=0))
    room = (0.94 * box / (high - low)).min()
    limits = (low + high) / 2 + np.array([[-0.5], [0.5]]) * box / room
    axes.set(xlim=limits[:, 0], ylim=limits[:, 1])
    axes.set_axis_off()
    order = np.argsort(cloud[:, 2])
    greys = np.linspace(0.88, 0.55, len(order))  # the far ones lighter
    shown = dict(c=greys, cmap="gray", vmin=0, vmax=1) if colors is None else dict(c=colors[order])
    axes.scatter(*cloud[order, :2].T, s=1.8, linewidths=0, clip_on=False, **shown)
    branches = shades(skeleton, "branch", branch_of_edge(skeleton), skeleton.edges)
    for edge in np.argsort(vertices[skeleton.edges, 2].mean(axis=1)):  # what is in front crosses what is behind
        across, up = vertices[skeleton.edges[edge], :2].T
        axes.plot(across, up, color="white", linewidth=width + 1.7, solid_capstyle="butt")
        axes.plot(
            across, up, color=INK if colors is not None else branches[edge], linewidth=width, solid_capstyle="round"
        )


def card():
    """A figure of the size of the three on the first page, and its axes."""
    figure = Figure(CARD, facecolor="white")
    FigureCanvasAgg(figure)
    return figure, figure.add_axes([0, 0, 1, 1])


def card_robots():
    """The best grasp of each of four limbs, from above."""
    scan = samples.sample_object(6000).points
    skeleton = skeletonised(scan)
    grasps = grasp_candidates(skeleton, Gripper(0.25), around=16)
    grasps = grasps[grasps.approach[:, 2] <= -0.5]
    first = np.sort(np.unique(grasps.branch, return_index=True)[1])[:4]
    best = grasps[first]
    tip = best.position + best.depth[:, None] * best.approach
    base = tip - best.gripper.finger[2] * best.approach
    wrist = base - best.gripper.palm[2] * best.approach
    side = best.opening[:, None] / 2 * best.closing
    ends = np.stack([tip + side, base + side, base - side, tip - side, base, wrist], axis=1)
    figure, axes = card()
    angles = dict(azimuth=-62, elevation=16)
    portrait(axes, skeleton, scan, np.array(CARD), beside=[ends.reshape(-1, 3)], **angles)
    forks = (
        view(ends.reshape(-1, 3), **angles).reshape(-1, 6, 3)[:, [[0, 1], [1, 2], [2, 3], [4, 5]], :2].reshape(-1, 2, 2)
    )
    axes.add_collection(LineCollection(forks, colors=INK, linewidths=3, capstyle="round", zorder=5))
    return figure


def card_trees():
    cloud = samples.tree(16000, forks=4, length=1.0, radius=0.09, seed=4).points
    skeleton = skeletonised(cloud, pipelines.tree(root="z"))
    colors = shades(skeleton, "order", segment(skeleton, cloud), skeleton.vertex_of_point)
    figure, axes = card()
    portrait(axes, skeleton, cloud, np.array(CARD), colors, 1.2, azimuth=-60, elevation=8)
    return figure


def card_shapes():
    scan = samples.sample_object(12000).points
    skeleton = skeletonised(scan)
    colors = shades(skeleton, "branch", segment(skeleton, scan), skeleton.vertex_of_point)
    figure, axes = card()
    portrait(axes, skeleton, scan, np.array(CARD), colors, 1.2, [scan], azimuth=-62, elevation=16)
    return figure


def damaged(seed=0):
    """Label, inches across, points and the angles that they are seen from, of every object."""
    rng = np.random.default_rng(seed)
    grown = tree(seed)
    height = (grown[:, 2] - grown[:, 2].min()) / np.ptp(grown[:, 2])
    scan, spring = samples.sample_object(4096, seed=seed), samples.helix(6000, noise=0.015, seed=seed)
    rings = samples.two_rings(5000, seed=seed).points
    low, high = rings.min(axis=0), rings.max(axis=0)
    strays = rng.uniform(low - 0.1 * (high - low), high + 0.1 * (high - low), (len(rings) // 50, 3))
    torus = samples.torus(8000, seed=seed).points
    holes = cKDTree(torus[rng.choice(len(torus), 8)])
    return (
        ("scanned from two sides", 2.6, scan.points, dict(azimuth=-62, elevation=16)),
        ("1.5 % noise", 1.8, spring.points, dict(azimuth=-65, elevation=22)),
        ("few points on top", 1.95, grown[rng.random(len(grown)) < 6**-height], dict(azimuth=-62, elevation=22)),
        ("2 % outliers", 2.05, np.concatenate([rings, strays]), dict(azimuth=-50, elevation=32)),
        ("holes", 2.0, torus[holes.query(torus)[0] > 0.1], dict(azimuth=-65, elevation=62)),
    )


def tree(seed, forks=3):
    """A trunk that forks by 35 degrees to either side, again and again, each time 0.75 as long and 0.7 as thick."""
    parts, axes, fork = [], [], np.radians(35)

    def grow(start, heading, across, length, radius, forks):
        n = int(30_000 * length * radius)
        points = samples.tube(n, length=length, radius=radius, seed=100 * seed + len(parts)).points
        side = np.cross(heading, across)
        parts.append(start + (points + [length / 2, 0, 0]) @ np.stack([heading, across, side]))
        end = start + length * heading
        axes.append((np.stack([start, end]), np.full(2, radius)))
        for turn in (fork, -fork) if forks else ():
            onward = np.cos(turn) * heading + np.sin(turn) * across
            grow(end, onward, side, 0.75 * length, 0.7 * radius, forks - 1)

    grow(np.zeros(3), np.array([0.0, 0, 1]), np.array([1.0, 0, 0]), 1.0, 0.14, forks)
    points = np.concatenate(parts)
    for nodes, radii in axes:  # what is inside another branch goes
        points = points[samples.signed_distance(points, nodes, np.array([[0, 1]]), radii) > -1e-9]
    return points


# ------------------------------------------------------------------------------------------------- pages of the filters


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
    left = [len(points), *map(len, states)]
    shown = range(len(left))
    titles = [f"solve {t}: {left[t]} points" if t else f"the scan: {left[0]} points" for t in shown]
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
        said = (skeleton.report.warnings or ("no warning",))[0].partition(":")[0]
        parts = f"components: {skeleton.n_components}, loops: {skeleton.n_loops}" if len(skeleton.edges) else "no edges"
        each.set_title(f"{name}\n{said}; {parts}", fontsize=9, color=INK)
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
            found = score(thing, skeleton.vertices, skeleton.edges)
            each.set_title(
                f"{name}: error {found.error:.2f}, {'right' if found.perfect else 'wrong'}", fontsize=9, color=INK
            )
    return figure


FIGURES = (
    *(showcase, card_robots, card_trees, card_shapes),
    *(denoiser, contractor, lpr_reducer, connector, refiner, stopping),
    *(hull, contraction, reduction, mass, centring, loop_test, limits, things),
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
