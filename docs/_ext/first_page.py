"""How the pictures are drawn, and those of the first page: five damaged objects, and the three cards."""

import warnings

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

import glsk_o3d as glsk
from glsk_o3d import pipelines, samples
from glsk_o3d.analysis import Gripper, grasp_candidates, segment
from glsk_o3d.io.colors import shades

INK, RED, GREY, BLUE = "#333333", "#d0121f", "#b4b4b4", "#1f5fa8"
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
    offset = 0.1
    for name, wide, points, angles in objects:
        skeleton = skeletonised(points)
        axes = figure.add_axes([offset / total, foot / height, wide / total, 1 - foot / height])
        portrait(axes, skeleton, points, np.array([wide, height - foot]), **angles)
        figure.text((offset + wide / 2) / total, 0.12 / height, name, ha="center", fontsize=12.5, color=INK)
        offset += wide + 0.2
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
    branches = shades(skeleton, "branch", skeleton.branch_of_edge, skeleton.edges)
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
