"""What cameras and laser scanners see of a shape: no hidden and no grazing surface, along rays, with their noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter, maximum_filter, minimum_filter

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
WALL_BEHIND = (0.03, 0.25)  # of the wall, behind the farthest place of the shape, in depth
MIXED_SHARE = (0.02, 0.08)  # of the points of a camera before a wall
DEPTH_STEPS = 500  # of its range, from the nearest place to the wall
VEIL_PIXELS, VEIL_NOISE = 2, 0.5  # how far along an edge mixed pixels are alike, and how much each is another
VEIL_LEAST = 1e-12  # derived: keeps what divides by it finite where there is one pixel
LEAST_COVERED = 0.05  # of a mixed pixel, by the front and by the back
LIDAR_CELL = (0.5, 2.0)  # sides of a cell of its grid, in those of a square as large: dense along, sparse across


class Rays(NamedTuple):
    """Rays from one place that hit the shape."""

    directions: np.ndarray  # (m, 3), of length 1
    ranges: np.ndarray  # (m,)
    cosines: np.ndarray  # of the angle between ray and normal
    behind: np.ndarray  # the range beside the ray where that is much longer, else NaN
    pixels: np.ndarray  # (m, 2), the cell of the grid

    def rows(self, picked: np.ndarray) -> Rays:
        """Some of the rays."""
        return Rays(*(column[picked] for column in self))

    @property
    def image(self) -> np.ndarray:
        """The ranges of the cells of the grid, infinite where nothing is hit, as all around."""
        image = np.full(self.pixels.max(axis=0) + 2, np.inf)
        image[tuple(self.pixels.T)] = self.ranges
        return image


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
    found = Rays(rays, ranges, cosines, ranges, pixel[hit])
    return found._replace(behind=_background(found))


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


def _background(rays):
    """The longest range in the cells around, where that is a step behind; else NaN."""
    image = rays.image
    behind = maximum_filter(np.where(np.isinf(image), NO_SURFACE, image), 3)[tuple(rays.pixels.T)]
    return np.where(behind > rays.ranges + EDGE_STEP, behind, np.nan)


def depth_image(shape: Shape, eye: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    """Draw n points of a depth camera, (n, 3) float array: noise grows at grazing angles, points fly at edges."""
    rays = cast(shape, eye, n, (1, 1), rng)
    rays = rays.rows(rng.permutation(len(rays.ranges))[:n])
    far = rays.ranges + rng.normal(0, DEPTH_NOISE, n) / rays.cosines
    edge = np.flatnonzero(np.isfinite(rays.behind))
    fly = rng.choice(edge, min(len(edge), round(FLYING_SHARE * n)), replace=False)
    share = rng.uniform(0.1, 0.9, len(fly))
    room = np.minimum(rays.behind[fly], rays.ranges[fly] + FLYING_REACH) - rays.ranges[fly]
    far[fly] = rays.ranges[fly] + share * room
    return eye + rays.directions * far[:, None]


def mixed_image(
    shape: Shape, eye: np.ndarray, n: int, rng: np.random.Generator, share: float, wall: float
) -> np.ndarray:
    """Draw n points of a depth camera before a wall so far behind the shape, a share of them mixed, (n, 3) float array.

    A mixed pixel looks at an edge of depth, inside the outline of the shape or just beside it. Its range is the mean of
    those of both sides by the light that each returns: by its part of the pixel over the square of its range.
    Neighbours are mixed alike, so that they form veils. Noise grows with the square of the range and at grazing angles,
    and depth has steps.
    """
    rays = cast(shape, eye, n, (1, 1), rng)
    _, distance, axes = _projected(shape.points, eye)
    depth = (shape.points - eye) @ axes[2]
    wall += depth.max()
    edges = _edges(rays, axes, wall)
    order, mixture = (_veils(edges.pixels, rays.image.shape, rng) for _ in range(2))
    picked = np.flatnonzero(order < round(share * n))
    mixed = edges.rows(picked)
    covered = LEAST_COVERED + (1 - 2 * LEAST_COVERED) * (mixture[picked] + 0.5) / len(order)
    front, back = covered / mixed.ranges**2, (1 - covered) / mixed.behind**2
    mixed = mixed._replace(ranges=(front * mixed.ranges + back * mixed.behind) / (front + back))
    plain = np.ones(len(rays.ranges), bool)
    inside = np.flatnonzero(np.isfinite(rays.behind))  # the first of the edges
    plain[inside[picked[picked < len(inside)]]] = False
    taken = rng.permutation(np.flatnonzero(plain))[: n - len(picked)]
    rays = Rays(*map(np.concatenate, zip(rays.rows(taken), mixed, strict=True)))
    ranges = rays.ranges + rng.normal(0, DEPTH_NOISE, n) * (rays.ranges / CAMERA_DISTANCE) ** 2 / rays.cosines
    ahead = rays.directions @ axes[2]
    step = (wall - distance.min()) / DEPTH_STEPS
    return eye + rays.directions * (np.round(ranges * ahead / step) * step / ahead)[:, None]


def _edges(rays, axes, wall):
    """Rays at edges of depth: those that hit, and then those just beside the outline.

    Their ranges are those of the front. Behind it is the shape, or else a wall at this depth.
    """
    image, inside = rays.image, rays.rows(np.flatnonzero(np.isfinite(rays.behind)))
    nearest = minimum_filter(image, 3)
    beside = np.argwhere(np.isinf(image) & np.isfinite(nearest))
    local = rays.directions @ axes.T
    tangents = local[:, :2] / local[:, 2:]
    pitch = np.ptp(tangents, axis=0) / np.maximum(np.ptp(rays.pixels, axis=0), 1)
    tangents = tangents[0] + (beside - rays.pixels[0]) * pitch
    directions = np.vstack([inside.directions, unit(np.column_stack([tangents, np.ones(len(beside))]) @ axes)])
    front = np.concatenate([inside.ranges, nearest[tuple(beside.T)]])
    back = np.concatenate([inside.behind, np.full(len(beside), NO_SURFACE)])
    back = np.minimum(back, wall / (directions @ axes[2]))
    return Rays(directions, front, np.ones(len(front)), back, np.vstack([inside.pixels, beside]))


def _veils(pixels, shape, rng):
    """Random ranks of pixels, such that those of neighbours are alike."""
    smooth = gaussian_filter(rng.normal(size=shape), VEIL_PIXELS)[tuple(pixels.T)]
    smooth = smooth / max(smooth.std(), VEIL_LEAST) + VEIL_NOISE * rng.normal(size=len(pixels))
    return np.argsort(np.argsort(smooth, kind="stable"), kind="stable")


def lidar_scan(shape: Shape, eye: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    """Draw n points of a laser scanner, (n, 3) float array: scan lines, and noise of its range."""
    rays = cast(shape, eye, n, LIDAR_CELL, rng)
    taken = rng.permutation(len(rays.ranges))[:n]
    ranges = rays.ranges[taken] + rng.normal(0, LIDAR_NOISE, n)
    return eye + rays.directions[taken] * ranges[:, None]
