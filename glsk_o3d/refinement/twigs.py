"""Cut twigs that are shorter than the part they grow from is thick."""

from dataclasses import replace

import numpy as np

from .loops import surface_distance
from .merging import merge_vertices


def cut_twigs(skeleton, length):
    """Cut branches that end in a leaf and are shorter than the local thickness where they begin, shortest first.

    Parameters
    ----------
    skeleton : Skeleton
    length : float
        Shortest branch that stays, over the distance from its junction to the surface.

    Returns
    -------
    Skeleton
        Points of a cut twig belong to its junction.
    """
    while True:
        thickness = surface_distance(skeleton)
        degree = skeleton.degree
        worst, ratio = None, length
        for branch in skeleton.branches:
            a, b = branch[0], branch[-1]
            if sorted((degree[a] == 1, degree[b] == 1)) != [False, True]:
                continue
            junction, twig = (a, branch[1:]) if degree[b] == 1 else (b, branch[:-1])
            path = np.linalg.norm(np.diff(skeleton.vertices[branch], axis=0), axis=1).sum()
            if path < ratio * thickness[junction]:
                worst, ratio = (junction, twig), path / thickness[junction]
        if worst is None:
            return skeleton
        junction, twig = worst
        place = skeleton.vertices[junction]
        group = np.arange(len(skeleton.vertices))
        group[twig] = junction
        skeleton = merge_vertices(skeleton, group)
        # the junction stays where it was
        vertices = skeleton.vertices.copy()
        vertices[junction - (twig < junction).sum()] = place
        skeleton = replace(skeleton, vertices=vertices)
