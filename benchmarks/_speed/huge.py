"""Clouds larger than memory, from disk to disk: what they cost, and whether their skeleton is that of a small one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from glsk_o3d.interop.packages import require
from glsk_o3d.samples import sauropod

HUGE_BLOCK = 1_000_000  # points written at a time
SURFACE_POINTS = 2_000_000  # of which each is drawn again and again, with noise of its own: far nearer than the noise
HUGE_NOISE = 0.003  # its standard deviation, as a share of the diagonal
LAS_STEP = 1e-5  # between coordinates in LAS, in units of the shape, which is one and a half long


def noisy_blocks(n: int, seed: int = 0) -> Iterator[np.ndarray]:
    """The sauropod, whole and noisy, as (m, 3) float arrays in random order."""
    draw = np.random.default_rng(seed)
    surface = draw.permutation(sauropod(min(n, SURFACE_POINTS), cameras=None, seed=seed).points)
    sigma = HUGE_NOISE * np.linalg.norm(np.ptp(surface, axis=0))
    for begin in range(0, n, HUGE_BLOCK):
        rows = np.arange(begin, min(n, begin + HUGE_BLOCK)) % len(surface)
        yield surface[rows] + draw.normal(scale=sigma, size=(len(rows), 3))


def write_huge(path: Path, n: int, seed: int = 0) -> None:
    """Such a cloud as binary PLY of float32, or as LAS or LAZ."""
    blocks = noisy_blocks(n, seed)
    if path.suffix == ".ply":
        with path.open("wb") as stream:
            properties = "".join(f"property float {axis}\n" for axis in "xyz")
            stream.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {n}\n{properties}end_header\n".encode())
            for block in blocks:
                stream.write(block.astype("<f4").tobytes())
        return
    laspy = require("laspy")
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [LAS_STEP] * 3
    with laspy.open(path, mode="w", header=header) as file:
        for block in blocks:
            record = laspy.ScaleAwarePointRecord.zeros(len(block), header=header)
            record.x, record.y, record.z = block.T
            file.write_points(record)
