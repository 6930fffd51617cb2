"""One object in time: a skeleton that keeps its graph from frame to frame, and branches that keep their identities."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from .analysis.correspondence import same_branches, same_one_by_one
from .api import PipelineChoice, chosen_pipeline
from .data.skeleton import Skeleton
from .editing import transform
from .errors import InvalidCloudError
from .geometry.vectors import TINY, finite_rows, norm
from .interop.clouds import cloud_points
from .interop.registration import Reference, finite_sample
from .parameters import check_number

END_RADII = 2.0  # fitted: over the radius, from a tracked end to that of a frame at most


@dataclass(frozen=True, eq=False)
class Tracked:
    """What a Tracker knows of its object in one frame.

    Attributes
    ----------
    skeleton : Skeleton
        The tracked graph where the object is in this frame, with the points of this frame. While earlier frames explain
        the points, vertex i is the same place of the object in every frame.
    identity : (B,) int array
        The identity of every branch of `skeleton.branches`. Branches that lie on one earlier branch, as when a new one
        divides it, share its identity.
    new, lost : tuple of int
        Identities that begin and that end in this frame; in the first frame all are new.
    length, growth : dict of float by int
        Length of every identity, and that minus the length with which it began, in the cloud's units.
    motion : (4, 4) float array
        The rigid motion since the last frame.
    unexplained : float
        Share of points that the object of the earlier frames, so moved, does not explain, and of its points that are
        missing; the larger one.
    is_computed : bool
        Whether the frame was skeletonised, which takes longer, and not only registered.
    """

    skeleton: Skeleton
    identity: np.ndarray
    new: tuple[int, ...]
    lost: tuple[int, ...]
    length: dict[int, float]
    growth: dict[int, float]
    motion: np.ndarray
    unexplained: float
    is_computed: bool

    def __repr__(self) -> str:
        return f"Tracked({len(self.length)} branches, new: {self.new}, lost: {self.lost}, {self.skeleton!r})"


class Topology(NamedTuple):
    """What frames vote about: the numbers of a graph, and whether its branches are not those of the held one."""

    components: int
    loops: int
    leaves: int
    has_other_branches: bool = False

    @classmethod
    def of(cls, skeleton: Skeleton) -> Topology:
        """That of a skeleton."""
        return cls(skeleton.n_components, skeleton.n_loops, len(skeleton.leaves))


class Tracker:
    """Follow one object through the frames of a depth camera, or a plant through days.

    1. The points of the frame are registered to those of a reference frame, by robust point-to-plane ICP.
    2. Where they explain each other, the tracked graph moves along, and nothing is skeletonised, except in the first
       frames and in every `check`-th one.
    3. Otherwise the frame is skeletonised. The graph changes if enough of the last frames agree on another one.
       A skeleton with the same graph is averaged with the tracked one, or replaces it, if the points differ.
    4. Branches have the identity of the earlier branch on which they lie.

    Parameters
    ----------
    pipeline : as of `skeletonize`
        What skeletonises a frame.
    patience : int
        Frames that must show another graph, of one more, before it is taken over. In the first frames, as many, the
        most frequent graph holds. 1 for scans that are days apart: each is believed.
    check : int
        Every how many frames one is skeletonised that is explained. 1 skeletonises all.
    average : int
        Frames of the running mean of vertices; 1 takes each as it is.
    unexplained : float
        Share of points, between 0 and 1, beyond which a frame is skeletonised.

    Raises
    ------
    InvalidParameterError

    Examples
    --------
    >>> from glsk_o3d.samples import y_junction
    >>> tracker = Tracker()
    >>> for frame in range(3):
    ...     tracked = tracker(y_junction(1000, seed=frame).points + [0.01 * frame, 0, 0])
    >>> tracked.identity.tolist(), tracked.new, tracked.lost
    ([0, 1, 2], (), ())
    """

    _held: Skeleton  # in the pose of the reference
    _identity: np.ndarray  # of its branches
    _reference: Reference
    _pose: np.ndarray  # the motion since the reference

    def __init__(
        self,
        pipeline: PipelineChoice = "default",
        *,
        patience: int = 5,
        check: int = 10,
        average: int = 10,
        unexplained: float = 0.01,
    ) -> None:
        check_number("patience", patience, "int", low=1)
        check_number("check", check, "int", low=1)
        check_number("average", average, "int", low=1)
        check_number("unexplained", unexplained, low=0, high=1)
        self._pipeline = chosen_pipeline(pipeline, {})
        self._patience, self._check, self._average, self._unexplained = patience, check, average, unexplained
        self._votes = deque[Topology](maxlen=patience + 1)
        self._first_length: dict[int, float] = {}
        self._n_identities = self._n_computed = self._n_explained = self._n_averaged = 0

    def __call__(self, cloud: Any) -> Tracked:
        """Take in the next frame.

        Parameters
        ----------
        cloud : as of `skeletonize`
            Of a mesh the vertices.

        Returns
        -------
        Tracked

        Raises
        ------
        InvalidCloudError
            The points cannot be skeletonised.
        MissingPackageError
        """
        points = cloud_points(cloud)
        if self._n_computed == 0:
            return self._begin(points)
        before = set(self._identity.tolist())
        seen = finite_sample(points)
        if len(seen) == 0:
            raise InvalidCloudError("the frame has no finite point: nothing in it can be followed")
        pose = self._reference.pose(seen, self._pose)
        unexplained = self._reference.unexplained(seen, pose)
        motion, self._pose = pose @ np.linalg.inv(self._pose), pose
        is_explained = unexplained <= self._unexplained
        self._n_explained = self._n_explained + 1 if is_explained else 0
        is_computed = not is_explained or self._n_computed < self._patience or self._n_explained >= self._check
        if is_computed:
            self._compare(points, is_explained)
        return self._tracked(points, before, motion, unexplained, is_computed)

    def _begin(self, points: np.ndarray) -> Tracked:
        skeleton = self._pipeline(points)
        self._identity = np.arange(len(skeleton.branches))
        self._n_identities, self._n_computed, self._n_averaged = len(self._identity), 1, 1
        self._votes.append(Topology.of(skeleton))
        self._hold(skeleton, points)
        return self._tracked(points, set(), np.eye(4), 1.0, True)

    def _hold(self, skeleton: Skeleton, points: np.ndarray) -> None:
        """Hold a skeleton in the pose of a frame, to which others are registered from now on."""
        self._held, self._reference, self._pose = skeleton, Reference(finite_sample(points)), np.eye(4)

    def _compare(self, points: np.ndarray, is_explained: bool) -> None:
        """Skeletonise a frame, and change the held graph if enough frames ask for it."""
        skeleton, held = self._pipeline(points), transform(self._held, self._pose)
        self._n_computed, self._n_explained = self._n_computed + 1, 0
        own, vote = Topology.of(held), Topology.of(skeleton)
        if vote == own and not same_one_by_one(skeleton, held):
            vote = vote._replace(has_other_branches=True)
        self._votes.append(vote)
        if vote == own and is_explained and self._average > 1:
            self._n_averaged = min(self._n_averaged + 1, self._average)
            self._hold(_averaged(held, skeleton, 1 / self._n_averaged), points)
        elif vote == own or self._is_elected(vote, own):
            self._votes = deque((each._replace(has_other_branches=False) for each in self._votes), self._votes.maxlen)
            self._identity = self._identities(skeleton, held)
            self._n_averaged = 1
            self._hold(skeleton, points)

    def _is_elected(self, vote: Topology, own: Topology) -> bool:
        """Whether enough frames show another topology than the held one."""
        count = Counter(self._votes)
        return count[vote] > count[own] if self._n_computed <= self._patience else count[vote] >= self._patience

    def _identities(self, skeleton: Skeleton, held: Skeleton) -> np.ndarray:
        """Identity of every branch, (B,) int array: that of the held branch on which it lies, or a new one."""
        identity = np.append(self._identity, -1)[same_branches(skeleton, held)]
        fresh = np.flatnonzero(identity < 0)
        identity[fresh] = self._n_identities + np.arange(len(fresh))
        self._n_identities += len(fresh)
        return identity

    def _tracked(
        self, points: np.ndarray, before: set[int], motion: np.ndarray, unexplained: float, is_computed: bool
    ) -> Tracked:
        skeleton = _with_points(transform(self._held, self._pose), points)
        lengths = np.bincount(self._identity[skeleton.branch_of_edge], skeleton.edge_lengths, self._n_identities)
        now = sorted(set(self._identity.tolist()))
        length = {each: float(lengths[each]) for each in now}
        growth = {each: length[each] - self._first_length.setdefault(each, length[each]) for each in now}
        new, lost = (tuple(sorted(each)) for each in (set(now) - before, before - set(now)))
        return Tracked(skeleton, self._identity.copy(), new, lost, length, growth, motion, unexplained, is_computed)


def _averaged(held: Skeleton, skeleton: Skeleton, least: float) -> Skeleton:
    """A held skeleton, drawn towards another one with the same graph, ends to ends.

    The weight of the other one is the distance over the radius, from `least` to 1: noise is averaged, and a part that
    bends is followed at once.
    """
    target, ends = skeleton.nearest(held.vertices).position, skeleton.vertices[skeleton.leaves]
    if len(ends):
        distance, nearest = cKDTree(ends).query(held.vertices[held.leaves])
        close = distance <= END_RADII * held.radii[held.leaves]
        target[held.leaves[close]] = ends[nearest[close]]
    step = target - held.vertices
    weight = np.clip(norm(step) / np.maximum(held.radii, TINY), least, 1)
    return held.changed(vertices=held.vertices + weight[:, None] * step)


def _with_points(skeleton: Skeleton, points: np.ndarray) -> Skeleton:
    """A skeleton with the points of another frame, each of which belongs to a vertex next to it on the curve."""
    vertex = np.full(len(points), -1)
    finite = np.flatnonzero(finite_rows(points))
    vertex[finite] = cKDTree(skeleton.vertices).query(points[finite])[1]
    return skeleton.changed(points=points, vertex_of_point=vertex, normals=None, representative_of_point=None)
