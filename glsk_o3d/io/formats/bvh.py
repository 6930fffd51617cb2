"""BVH, the files of motion capture: an armature and its frames, here one, at rest.

As in Blender's files the root's offset is its place, and its position in the frame is the same. y points up, and units
are the cloud's.
"""

import numpy as np

from ...analysis.rigging import bone_before, bone_names
from ...skeleton import Skeleton
from .graphs import line, text

TURNS = ("Zrotation", "Xrotation", "Yrotation")
PLACE = ("Xposition", "Yposition", "Zposition")
FRAME_SECONDS = 1 / 30  # published: as in the files of Biovision, who made the format


def content(forest: Skeleton, up: str) -> bytes:
    """The content of a file: a joint for each bone of a forest that is numbered from its roots outwards, below one root
    that is at vertex 0."""
    vertices = forest.vertices @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]).T if up == "z" else forest.vertices
    names, parent = bone_names(forest), bone_before(forest)
    heads, tails = vertices[forest.edges].swapaxes(0, 1)
    offsets = (heads - np.where((parent >= 0)[:, None], heads[parent], vertices[0])).tolist()
    ends, place = (tails - heads).tolist(), vertices[0].tolist()
    children: list[list[int]] = [[] for _ in names]
    for bone in np.flatnonzero(parent >= 0).tolist():
        children[parent[bone]].append(bone)
    lines = ["HIERARCHY", "ROOT armature", "{", line("OFFSET", *place), line("CHANNELS 6", *PLACE, *TURNS)]
    stack = [(bone, False) for bone in np.flatnonzero(parent < 0)[::-1].tolist()]
    while stack:
        bone, done = stack.pop()
        if done:
            lines += ["}"]
            continue
        lines += [f"JOINT {names[bone]}", "{", line("OFFSET", *offsets[bone]), line("CHANNELS 3", *TURNS)]
        stack += [(bone, True), *((child, False) for child in children[bone][::-1])]
        if not children[bone]:
            lines += ["End Site", "{", line("OFFSET", *ends[bone]), "}"]
    motion = ["MOTION", "Frames: 1", f"Frame Time: {FRAME_SECONDS:.6f}", line(*place, *[0.0] * 3 * (len(names) + 1))]
    return text([*lines, "}", *motion])
