"""SWC and URDF: places, radii and edges of trees numbered from the root; no cloud.

Tools for neurons and plants open SWC. URDF is a robot model, for planning scenes and simulators: a link is a cylinder
along an edge, and a ball at the vertex that it leads to. Lengths are taken as metres, as URDF has them.
"""

from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from ...data.skeleton import Skeleton
from ...errors import FileFormatError
from ...geometry.vectors import norm
from .graphs import graph_skeleton, line, parents, text, words_by_line

URDF_DENSITY = 1000.0  # published: of water, in kg/m³; fresh wood and most plants are near it


def write_swc(forest: Skeleton) -> bytes:
    """The content of an SWC file of a skeleton that is numbered from its roots outwards."""
    parent = parents(forest)
    number = np.where(parent >= 0, parent + 1, -1).tolist()
    table = np.column_stack([forest.vertices, forest.radii]).tolist()
    rows = [line(i, 0, *row, before) for i, (row, before) in enumerate(zip(table, number, strict=True), 1)]
    return text(["# curve skeleton written by glsk-o3d: id type x y z radius parent", *rows])


def read_swc(data: bytes) -> Skeleton:
    """The skeleton in the content of an SWC file."""
    rows = words_by_line(data)
    if any(len(row) < 7 for row in rows) or not rows:
        raise ValueError("it has no rows of 7 numbers (id type x y z radius parent)")
    table = np.array([row[:7] for row in rows], float)
    names, parent = table[:, 0], table[:, 6]
    order = np.argsort(names)
    child = np.flatnonzero(parent >= 0)
    place = np.searchsorted(names[order], parent[child]).clip(max=len(names) - 1)
    if (names[order][place] != parent[child]).any() or len(np.unique(names)) < len(names):
        raise ValueError("a parent is missing, or two rows have the same id")
    return graph_skeleton(table[:, 2:5], np.column_stack([child, order[place]]), table[:, 5])


def write_urdf(skeleton: Skeleton) -> bytes:
    """The content of a URDF file of a forest that is numbered outwards; FileFormatError where it has no radii.

    Vertex i has ``link_i``, on the fixed joint ``joint_i``; the links of roots stand on the link ``base``, at the
    origin of the cloud. A link's frame is at the vertex that it comes from, not turned, and relative to the one before:
    a large offset of the whole cloud is in the joints of the roots alone. Cylinders are as thick as their ends on
    average; what has no size is left out. Masses are those of solid cylinders of `URDF_DENSITY`, of a root of its ball.
    """
    vertices, radii = skeleton.vertices, skeleton.radii
    unknown = np.count_nonzero(~np.isfinite(radii))
    if unknown:
        raise FileFormatError(
            f"URDF needs radii, and {unknown} of {len(radii)} vertices have none: read the skeleton from a format that "
            "holds them, such as .json or .ply, or skeletonise the cloud again"
        )
    before = parents(skeleton)
    root = before < 0
    parent = np.where(root, np.arange(len(vertices)), before)
    frame = vertices[parent]
    steps = frame - np.where(root[:, None], 0.0, frame[parent])
    span = vertices - frame
    length, thickness = norm(span), (radii + radii[parent]) / 2
    # masses of cylinders, of balls at roots, which have none, and their moments of inertia across and along the axis
    mass = URDF_DENSITY * np.pi * thickness**2 * np.where(root, thickness * 4 / 3, length)
    along = mass * thickness**2 * np.where(root, 2 / 5, 1 / 2)
    across = np.where(root, along, along / 2 + mass * length**2 / 12)
    # a cylinder lies along z: tilt it about y, then turn it about z
    turn = np.column_stack(
        [0 * length, np.arctan2(np.hypot(*span.T[:2]), span[:, 2]), np.arctan2(span[:, 1], span[:, 0])]
    )

    robot = Element("robot", name="skeleton")
    SubElement(robot, "link", name="base")
    for i in range(len(vertices)):
        link = SubElement(robot, "link", name=f"link_{i}")
        if mass[i] > 0:
            inertial = SubElement(link, "inertial")
            SubElement(inertial, "origin", xyz=line(*span[i] / 2), rpy=line(*turn[i]))
            SubElement(inertial, "mass", value=line(mass[i]))
            moments = dict(ixx=across[i], ixy=0.0, ixz=0.0, iyy=across[i], iyz=0.0, izz=along[i])
            SubElement(inertial, "inertia", {name: line(value) for name, value in moments.items()})
        for use in ("visual", "collision"):
            if length[i] > 0 and thickness[i] > 0:
                _shape(link, use, "cylinder", span[i] / 2, turn[i], radius=thickness[i], length=length[i])
            if radii[i] > 0:
                _shape(link, use, "sphere", span[i], np.zeros(3), radius=radii[i])
        joint = SubElement(robot, "joint", name=f"joint_{i}", type="fixed")
        SubElement(joint, "origin", xyz=line(*steps[i]))
        SubElement(joint, "parent", link="base" if root[i] else f"link_{parent[i]}")
        SubElement(joint, "child", link=f"link_{i}")
    indent(robot)
    written: bytes = tostring(robot, encoding="utf-8", xml_declaration=True)
    return written + b"\n"


def _shape(link: Element, use: str, kind: str, place: np.ndarray, turn: np.ndarray, **size: float) -> None:
    element = SubElement(link, use)
    SubElement(element, "origin", xyz=line(*place), rpy=line(*turn))
    SubElement(SubElement(element, "geometry"), kind, {name: line(value) for name, value in size.items()})
