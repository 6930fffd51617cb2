"""SWC as others write it; and robot models in yourdfpy: where it puts links, and what they are made of."""

import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh
import yourdfpy

from glsk_o3d import FileFormatError, Skeleton, pipelines, read_skeleton, samples, save_skeleton
from glsk_o3d.editing import reroot, simplify
from glsk_o3d.io.formats.trees import write_urdf

WATER = 1000.0


# ------------------------------------------------------------------------------------------------------------------ SWC


def test_swc_as_others_write_it(tmp_path):
    path = tmp_path / "s.swc"
    path.write_bytes("# Bäume\n\n 30 3 1 1 1 0.5 7\n7 1 0 0 0 2 -1\n9 3 2 0 0 .5 30 extra\n".encode("latin-1"))
    back = read_skeleton(path)
    np.testing.assert_array_equal(back.edges, [[0, 1], [0, 2]])
    np.testing.assert_array_equal(back.radii, [0.5, 2, 0.5])


def test_swc_cuts_loops_and_keeps_edges_of_no_length(loop, make, tmp_path):
    save_skeleton(loop, tmp_path / "s.swc", cut_loops=True)
    tree = read_skeleton(tmp_path / "s.swc")
    assert (len(tree.edges), tree.n_loops, tree.n_components) == (len(loop.edges) - loop.n_loops, 0, 1)
    save_skeleton(make(np.zeros((3, 3)), [[0, 1], [1, 2]]), tmp_path / "s.swc")
    assert len(read_skeleton(tmp_path / "s.swc").edges) == 2


# ----------------------------------------------------------------------------------------------------------------- URDF


def load(skeleton):
    robot = yourdfpy.URDF.load(io.BytesIO(write_urdf(skeleton)), load_meshes=False)
    assert robot.validate()
    assert robot.base_link == "base"
    return robot


def numbers(of, link):
    """The vertex that a link or joint belongs to."""
    return int(of.name.removeprefix(f"{link}_"))


def shapes(robot, use="collisions"):
    """Both ends of every cylinder, and the centre of every ball, in the frame of the base, by vertex."""
    cylinders, balls = {}, {}
    for link in robot.robot.links[1:]:
        i = numbers(link, "link")
        frame = robot.get_transform(link.name, "base")
        for part in getattr(link, use):
            place = frame @ (np.eye(4) if part.origin is None else part.origin)
            if part.geometry.cylinder:
                half = part.geometry.cylinder.length / 2
                cylinders[i] = [(place @ [0, 0, side * half, 1])[:3] for side in (-1, 1)]
            else:
                balls[i] = place[:3, 3]
    return cylinders, balls


@pytest.fixture(scope="module")
def grown():
    """A plant with forks as a tree of a hundred vertices or so."""
    skeleton = pipelines.tree()(samples.tree(6000, forks=3, seed=1).points)
    return reroot(simplify(skeleton, tolerance=0.005), "z")


@pytest.mark.parametrize(("use", "offset"), [("collisions", 0.0), ("visuals", [4e5, 3e5, 300])])
def test_forward_kinematics_gives_the_vertices(grown, offset, use):
    far = replace(grown, vertices=grown.vertices + offset)
    robot = load(far)
    cylinders, balls = shapes(robot, use)
    assert sorted(balls) == list(range(len(far.vertices)))
    assert sorted(cylinders) == sorted(far.edges[:, 1])
    for parent, child in far.edges:
        np.testing.assert_allclose(cylinders[child], far.vertices[[parent, child]], rtol=0, atol=1e-9)
    np.testing.assert_allclose([balls[i] for i in sorted(balls)], far.vertices, rtol=0, atol=1e-9)
    steps = {numbers(joint, "joint"): joint.origin[:3, 3] for joint in robot.robot.joints}
    assert (steps.pop(0) == far.vertices[0]).all()  # the offset is in the joint of the root alone, to the last bit
    assert np.abs(list(steps.values())).max() < 2 * np.ptp(far.vertices, axis=0).max()


def test_directions_along_the_axes(make):
    steps = np.array([[0, 0, 1], [0, 0, -1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]) * 2.0
    star = make(np.array([[0, 0, 0], *steps]) + 1, [[0, i] for i in range(1, 7)])
    cylinders, _ = shapes(load(star))
    for i, step in enumerate(steps, 1):
        np.testing.assert_allclose(cylinders[i], [np.ones(3), 1 + step], atol=1e-15)


def test_sizes_are_those_of_the_skeleton_and_masses_those_of_water(grown):
    """The inertia of a cylinder from the mesh that trimesh makes of it: finite sides, hence a little less."""
    robot, mean = load(grown), grown.radii[grown.edges].mean(axis=1)
    sizes = dict(zip(grown.edges[:, 1].tolist(), zip(mean, grown.edge_lengths, strict=True), strict=True))
    for link in robot.robot.links[1:]:
        i = numbers(link, "link")
        parts = [part.geometry for part in link.collisions]
        assert [part.sphere.radius for part in parts if part.sphere] == [grown.radii[i]]
        cylinders = [(part.cylinder.radius, part.cylinder.length) for part in parts if part.cylinder]
        np.testing.assert_allclose(cylinders, [sizes[i]] if i else [], rtol=1e-15)
    for name in ("link_0", "link_1", f"link_{len(grown.vertices) - 1}"):
        link = robot.link_map[name]
        part, origin = link.collisions[0].geometry, link.collisions[0].origin
        if part.cylinder:
            mesh = trimesh.creation.cylinder(part.cylinder.radius, part.cylinder.length, sections=2000)
        else:
            mesh = trimesh.creation.icosphere(5, radius=part.sphere.radius)
        mesh.density = WATER
        assert link.inertial.mass == pytest.approx(mesh.mass, rel=1e-3)
        atol = 1e-6 * np.abs(mesh.moment_inertia).max()
        np.testing.assert_allclose(link.inertial.inertia, mesh.moment_inertia, rtol=1e-3, atol=atol)
        np.testing.assert_allclose(link.inertial.origin, np.eye(4) if origin is None else origin)


def test_every_component_stands_on_the_base(forest):
    rooted = reroot(forest, "x")
    joints = load(rooted).robot.joints
    roots = np.setdiff1d(np.arange(len(rooted.vertices)), rooted.edges[:, 1])
    assert [numbers(joint, "joint") for joint in joints if joint.parent == "base"] == roots.tolist()
    assert {joint.type for joint in joints} == {"fixed"}


def test_what_has_no_size_is_left_out(make, dot):
    path = make(np.array([[0, 0, 0], [0, 0, 0], [0, 0, 1], [0, 0, 2.0]]), [[0, 1], [1, 2], [2, 3]])
    robot = load(replace(path, radii=[0.1, 0.1, 0, 0]))
    balls = [[part.geometry.sphere is not None for part in link.collisions] for link in robot.robot.links]
    assert balls == [[], [True], [True], [False], []]
    assert [link.name for link in robot.robot.links if link.inertial is not None] == ["link_0", "link_2"]
    np.testing.assert_array_equal(robot.get_transform("link_3", "base")[:3, 3], [0, 0, 1])
    assert [link.name for link in load(Skeleton((), (), (), (), (), ())).robot.links] == ["base"]


def test_missing_values_are_refused(tree):
    with pytest.raises(FileFormatError, match="needs radii, and 2 of 6 vertices have none"):
        write_urdf(replace(tree, radii=[1, np.nan, 1, np.nan, 1, 1]))
