"""What cameras and laser scanners see of a shape: no hidden and no grazing surface, along rays, with their noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from glsk_o3d.errors import InvalidParameterError
from glsk_o3d.geometry.vectors import dot, norm, unit

from .shapes import Shape
from .shapes.curves import UP, direction

# Fitted, as all of this page: to what depth cameras and laser scanners deliver. Lengths are shares of the diagonal.
CAMERA_DISTANCE = 2.2  # from the middle of the shape
TWO_APART, THREE_APART = 140, 120  # two cameras, and three, in degrees around the shape
LOWEST_CAMERA, HIGHEST_CAMERA = 15, 35  # in degrees above the horizon
SEEN_COSINE, RAY_COSINE = 0.1, 0.15  # of the angle between ray and normal, at least: for a view, and for a ray
VIEW_CELL = 1.6  # side of a cell whose nearest surface hides what is behind, in the spacing of the surface's points
SLANT_CELLS = 2.2  # a slanted surface recedes as much as over so many cells without hiding itself
RAY_REACH = 1.3  # how far from a ray a point stands for what it hits, in the spacing, on surface that faces it
MOST_GRIDS = 12  # tried, each finer than the one before, until enough rays hit
FINER, FINEST = 0.98, 0.7  # a grid is as much finer as rays were too few, and that much more; at most
TANGENT_REACH = 3  # how far along its ray a point goes to meet the tangent plane, at most, in the spacing
NO_SURFACE = 9.0  # range of a ray that hits nothing
EDGE_STEP = 0.04  # what is farther behind is background
DEPTH_NOISE, LIDAR_NOISE = 0.0015, 0.002  # standard deviation along the ray; of depth where surface faces the camera
FLYING_SHARE, FLYING_REACH = 0.005, 0.2  # points between foreground and background, and how far behind they are at most
LIDAR_CELL = (0.5, 2.0)  # sides of a cell of its grid, in those of a square as large: dense along, sparse across


class Rays(NamedTuple):
    """Rays from one place that hit the shape."""

    directions: np.ndarray  # (m, 3), of length 1
    ranges: np.ndarray  # (m,)
    cosines: np.ndarray  # of the angle between ray and normal
    behind: np.ndarray  # the range beside the ray where that is much longer, else NaN


def camera_places(rng: np.random.Generator, count: int) -> np.ndarray:
    """Draw places of two or three cameras around a shape and somewhat above it, (count, 3) float array."""
    apart = np.radians(TWO_APART if count == 2 else THREE_APART)
    around = rng.uniform(0, 2 * np.pi) + apart * np.arange(count)
    return places_at(around, np.radians(rng.uniform(LOWEST_CAMERA, HIGHEST_CAMERA, count)))


def places_at(around: np.ndarray, above: np.ndarray) -> np.ndarray:
    """Places of cameras at these angles around and above a shape, (count, 3) float array."""
    level = np.cos(above)
    return CAMERA_DISTANCE * np.column_stack([level * np.cos(around), level * np.sin(around), np.sin(above)])


def _projected(points, eye):
    """Image coordinates, tangents of angles; distances; and the camera's axes, of which the last is its view."""
    ahead = -direction(eye)
    right = direction(np.cross(ahead, UP))
    axes = np.array([right, np.cross(right, ahead), ahead])
    local = (points - eye) @ axes.T
    return local[:, :2] / local[:, 2:], norm(local), axes


def seen_cosines(shape: Shape, eye: np.ndarray, least: float = SEEN_COSINE) -> np.ndarray:
    """How squarely a camera looks at each point of a surface."""
    image, distance, _ = _projected(shape.points, eye)
    cosine = dot(eye - shape.points, shape.normals) / distance
    cell = _view_cell(shape)
    pixel = np.floor((image - image.min(axis=0)) / cell).astype(int)
    front = cosine > 0  # what is turned away hides nothing that its front does not hide
    depth = np.full(pixel.max(axis=0) + 1, np.inf)
    np.minimum.at(depth, tuple(pixel[front].T), distance[front])
    nearest = minimum_filter(depth, 3)[tuple(pixel.T)]
    steep = np.maximum(cosine, least)
    slack = SLANT_CELLS * cell * distance * np.sqrt(1 - steep * steep) / steep + shape.spacing
    return np.where((cosine > least) & (distance < nearest + slack), cosine, 0.0)


def _view_cell(shape):
    """Side of the cells of an image: no surface that faces the camera has an empty one."""
    return VIEW_CELL * shape.spacing / CAMERA_DISTANCE


def cast(shape: Shape, eye: np.ndarray, n: int, sides: tuple[float, float], rng: np.random.Generator) -> Rays:
    """Cast the rays of a grid at what a camera sees."""
    seen = np.flatnonzero(seen_cosines(shape, eye, RAY_COSINE) > 0)
    points, normals = shape.points[seen], shape.normals[seen]
    image, distance, axes = _projected(points, eye)
    facing = np.abs(dot(normals, unit(points - eye)))
    reach = RAY_REACH * shape.spacing / np.sqrt(facing) / CAMERA_DISTANCE
    cell = _view_cell(shape)
    size = len(np.unique(np.floor(image / cell).astype(int), axis=0)) * cell**2
    pitch = np.sqrt(size / n) * np.asarray(sides)
    for _ in range(MOST_GRIDS):
        phase = rng.random(2)
        pixel, off = _grid(image, pitch, phase)
        hit = _nearest_by_cell(pixel, off)
        hit = hit[off[hit] < reach[hit]]
        if len(hit) >= n:
            break
        pitch = pitch * max(FINEST, FINER * np.sqrt(len(hit) / n))
    else:
        raise InvalidParameterError(
            f"{shape.name}: {len(shape.points)} points of its surface are too few for {n} rays of one scanner: "
            "ask for fewer points"
        )
    middle = image[hit] + (0.5 - np.mod(image[hit] / pitch + phase, 1)) * pitch
    rays = unit(np.column_stack([middle, np.ones(len(hit))]) @ axes)
    ranges = _met(rays, points[hit] - eye, normals[hit], distance[hit], TANGENT_REACH * shape.spacing)
    cosines = np.maximum(-dot(rays, normals[hit]), RAY_COSINE)
    return Rays(rays, ranges, cosines, _background(pixel, hit, ranges))


def _grid(image, pitch, phase):
    """The cell of each place in an image, from (1, 1) on, and its distance from the middle of the cell."""
    scaled = image / pitch + phase
    pixel = np.floor(scaled).astype(int)
    return pixel - (pixel.min(axis=0) - 1), np.linalg.norm((np.mod(scaled, 1) - 0.5) * pitch, axis=1)


def _nearest_by_cell(pixel, off):
    """The row nearest to the middle of each cell, cell by cell."""
    key = pixel[:, 0] * (pixel[:, 1].max() + 2) + pixel[:, 1]
    order = np.lexsort([off, key])
    return order[np.concatenate([[True], np.diff(key[order]) > 0])]


def _met(rays, offset, normals, distance, reach):
    """How far rays go to the tangent planes of points, but hardly nearer or farther than the points themselves."""
    slope = -dot(rays, normals)
    ranges = dot(offset, normals) / np.where(slope > 0.05, -slope, -0.05)
    return np.clip(ranges, distance - reach, distance + reach)


def _background(pixel, hit, ranges):
    """The longest range in the cells around, where that is a step behind; else NaN."""
    image = np.full(pixel.max(axis=0) + 2, np.inf)
    image[tuple(pixel[hit].T)] = ranges
    behind = maximum_filter(np.where(np.isinf(image), NO_SURFACE, image), 3)[tuple(pixel[hit].T)]
    return np.where(behind > ranges + EDGE_STEP, behind, np.nan)


def depth_image(shape: Shape, eye: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    """Draw n points of a depth camera, (n, 3) float array: noise grows at grazing angles, points fly at edges."""
    rays = cast(shape, eye, n, (1, 1), rng)
    taken = rng.permutation(len(rays.ranges))[:n]
    rays = Rays(*(column[taken] for column in rays))
    far = rays.ranges + rng.normal(0, DEPTH_NOISE, n) / rays.cosines
    edge = np.flatnonzero(np.isfinite(rays.behind))
    fly = rng.choice(edge, min(len(edge), round(FLYING_SHARE * n)), replace=False)
    share = rng.uniform(0.1, 0.9, len(fly))
    room = np.minimum(rays.behind[fly], rays.ranges[fly] + FLYING_REACH) - rays.ranges[fly]
    far[fly] = rays.ranges[fly] + share * room
    return eye + rays.directions * far[:, None]


def lidar_scan(shape: Shape, eye: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    """Draw n points of a laser scanner, (n, 3) float array: scan lines, and noise of its range."""
    rays = cast(shape, eye, n, LIDAR_CELL, rng)
    taken = rng.permutation(len(rays.ranges))[:n]
    ranges = rays.ranges[taken] + rng.normal(0, LIDAR_NOISE, n)
    return eye + rays.directions[taken] * ranges[:, None]
