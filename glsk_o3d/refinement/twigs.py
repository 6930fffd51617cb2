"""Cut twigs that hardly leave the part they grow from."""

from dataclasses import replace

import numpy as np

from .loops import surface_distance
from .merging import merge_vertices

FAR = 0.9  # share of a twig's points that its reach covers


def cut_twigs(skeleton, reach):
    """Cut branches that end in a leaf and whose points reach no farther than the surface around their junction.

    What counts is the points, not the curve: the contraction shortens stubs as thick as they are long, and lets thin
    ones grow.

    Parameters
    ----------
    skeleton : Skeleton
    reach : float
        Least distance of a branch's points from its junction (all but a tenth), over the distance from the junction to
        the surface. Of every junction the least first, until there is none.

    Returns
    -------
    Skeleton
        Points of a cut twig belong to its junction.
    """
    while True:
        thickness, degree = surface_distance(skeleton), skeleton.degree
        owned = skeleton.witnesses
        owned = owned[np.argsort(skeleton.vertex_of_point[owned], kind="stable")]
        stop = np.cumsum(np.bincount(skeleton.vertex_of_point[owned], minlength=len(degree)))
        start = np.concatenate([[0], stop[:-1]])
        worst = {}
        for branch in skeleton.branches:
            a, b = branch[0], branch[-1]
            if sorted((degree[a] == 1, degree[b] == 1)) != [False, True]:
                continue
            junction, twig = (a, branch[1:]) if degree[b] == 1 else (b, branch[:-1])
            points = skeleton.points[np.concatenate([owned[start[v] : stop[v]] for v in twig])]
            distance = np.linalg.norm(points - skeleton.vertices[junction], axis=1)
            far = np.quantile(distance, FAR) if len(distance) else 0.0
            if far < worst.get(junction, (reach * thickness[junction],))[0]:
                worst[junction] = (far, twig)
        if not worst:
            return skeleton
        group, m = np.arange(len(skeleton.vertices)), len(skeleton.vertices)
        for junction, (_, twig) in worst.items():
            group[twig] = junction
        stay = np.flatnonzero(group == np.arange(m))
        places = skeleton.vertices[stay]
        skeleton = merge_vertices(skeleton, group)
        # a junction stays where it was
        skeleton = replace(skeleton, vertices=places)
