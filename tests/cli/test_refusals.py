"""What the commands refuse: in one line that says what was wrong and where, before they write anything."""

import numpy as np
import open3d as o3d
import pytest

from glsk_o3d import Skeleton, read_skeleton, samples, save_skeleton

TABLE = """
    1 branches z.ply                                       | z.ply: no such file
    1 branches SCANS/ring.ply                              | ring.ply: is a cloud, not a skeleton: make one with
    1 branches empty.json                                  | empty.json: the skeleton is empty
    2 branches y.ply --root trunk                          | root = 'trunk': must be an axis, x to -z, 'thickest'
    2 branches y.ply --root 4                              | root = 4: there are vertices 0 to 3
    2 branches y.ply -o y.txt                              | y.txt: the table is CSV and its name ends in .csv
    2 tree y.ply --root a,b,c                              | root = 'a,b,c': must be an axis
    2 tree y.ply --up w                                    | up = 'w': must be
    2 tree y.ply --unit 0                                  | unit = '0': must be metres, above 0, or one of m, cm, mm
    2 tree o.ply                                           | 1 loops: cylinders need a tree; see pipelines.tree()
    2 tree two.json                                        | 2 components: cylinders need one tree
    2 tree y.ply -o c.xlsx                                 | c.xlsx: the file is a table of cylinders and its name ends
    2 edit o.ply                                           | nothing to write: give an output with -o
    2 edit o.ply -o o.ply                                  | o.ply: is an input
    2 edit o.ply -o new.ply --simplify 1 --vertices 3      | simplify needs either a tolerance or n
    2 edit o.ply -o new.ply --root x                       | only trees have a root; see cut_loops (--cut-loops)
    2 edit o.ply -o new.ply --prune-order 0                | the skeleton has 1 loops: branches have an order in a tree
    1 convert o.ply a.swc                                  | a.swc: this format holds trees only
    2 convert o.ply a.nope                                 | a.nope: the file is a skeleton and its name ends in
    2 convert y.ply a.ply --root x                         | for others use 'glsk edit'
    2 rig y.ply                                            | nothing to write: give one output with -o
    2 rig y.ply -o a.glb -o b.glb                          | rig writes one file: give one output with -o
    2 rig none.ply -o r.fbx                                | r.fbx: the rig is glTF and its name ends in .glb
    2 rig y.ply -o r.glb --up x                            | up = 'x': must be one of z, y
    1 rig y.ply none.ply -o r.glb                          | none.ply: no such file
    1 rig y.ply y.ply -o r.glb                             | y.ply: is a skeleton, not a scan
    1 rig y.ply junk.ply -o r.glb                          | junk.ply: not a valid .ply file: it does not start with
    1 rig y.ply nan.xyz -o r.glb                           | nan.xyz: the surface has points that are not finite: drop
    1 rig o.ply -o r.glb                                   | 1 loop(s): pass cut_loops=True (--cut-loops) to drop
    1 rig bare.obj -o r.glb                                | a rig needs radii or points: read the skeleton from
    2 grasps rod.npz --opening -1                          | max_opening = -1.0: must be above 0
    2 grasps rod.npz --opening 1 --plane 0,0,1             | --plane 0,0,1: write 4 numbers with commas
    2 grasps rod.npz --opening 1 --plane 0,0,0,1           | is no plane
    2 grasps rod.npz --opening 1 --cone down,30            | --cone down: write 3 numbers
    2 grasps rod.npz --opening 1 --cone z                  | --cone z: write a direction and degrees, such as -z,60
    2 grasps rod.npz --opening 1 --cone z,270              | the angle of cone = 270.0: must be
    2 grasps rod.npz --opening 1 --up w                    | --up w: write 3 numbers
    2 grasps rod.npz --opening 1 --finger a,b,c            | --finger a,b,c: write 3 numbers
    2 grasps rod.npz --opening 1 -o g.txt                  | the grasps are JSON, CSV or PLY and its name ends in .json
    2 grasps y.ply --opening 1                             | has no confidence, perhaps due to its file: give min_con
    2 grasps y.ply --opening 1 --min-confidence 0          | has no points of the object: give cloud=
    1 grasps rod.npz --opening 1 --scene none.ply          | none.ply: no such file
    1 evaluate y.ply no.ply                                | no.ply: no such file
    1 evaluate y.ply SCANS/ring.ply --truth none.npz       | none.npz: not a valid truth: the truth has no nodes
    1 evaluate dot.ply SCANS/ring.ply                      | dot.ply: the skeleton has no edge with a length
    1 evaluate y.ply few.xyz                               | few.xyz: no part of the skeleton has 6 points around it
    2 evaluate y.ply SCANS/ring.ply -o r.txt               | r.txt: the report is JSON and its name ends in .json
    2 evaluate y.ply SCANS/ring.ply --preview p.jpg        | p.jpg: the picture is a PNG and its name ends in .png
    1 crosscheck SCANS/ring.ply --mesh no.xyz              | unknown ending of a mesh
    1 crosscheck SCANS/ring.ply --mesh SCANS/ball.ply      | ball.ply: no triangles could be read
    1 crosscheck SCANS/ring.ply --mesh away.ply            | ring.ply: no point of the cloud lies on the mesh
    1 crosscheck SCANS/nan.ply                             | nan.ply: 2 of 1000 points
    2 crosscheck SCANS/ring.ply --mesh a.off --method poisson | --mesh gives a mesh
    2 crosscheck SCANS/ring.ply --method alpha             | mesh = 'alpha': must be 'auto', 'ball_pivoting', 'poisson'
    2 crosscheck SCANS/ring.ply --max-points 5             | max_points = 5: must be None or a whole number of at least
    2 crosscheck SCANS/ring.ply -o r.txt                   | r.txt: the report is JSON
    1 info SCANS/empty.ply                                 | empty.ply: the file is empty
    1 info none.ply                                        | none.ply: no such file
    1 info bad.json                                        | bad.json: not a valid .json skeleton
    1 info bad.swc                                         | bad.swc: not a valid .swc skeleton
    1 info bad.docx                                        | bad.docx: unknown ending
    1 view SCANS/empty.ply                                 | empty.ply: the file is empty
    2 view y.ply --report r.pdf                            | r.pdf: the report is a page and its name ends in .html
    1 skeletonize y.ply -o a.ply                           | y.ply: is a skeleton, not a scan
    2 filters Contracter                                   | is called 'Contracter': did you mean 'Contractor'?
    2 demo --pipeline best                                 | there are default
    1 demo -o y.ply                                        | y.ply: is a file, not a folder
"""


@pytest.fixture
def files(tmp_path, y, ring_file):
    """Skeletons, clouds and meshes, of which most lack something."""
    none = np.empty((0, 3))
    save_skeleton(read_skeleton(tmp_path / y), tmp_path / "bare.obj")
    save_skeleton(Skeleton(np.eye(3), [[0, 1]], np.ones(3), (), (), ()), tmp_path / "two.json")
    save_skeleton(Skeleton((), (), (), (), (), ()), tmp_path / "empty.json")
    save_skeleton(Skeleton([[0, 0, 0]], [], [1], (), (), ()), tmp_path / "dot.ply")
    rod = samples.tube(500, length=1.0, radius=0.1)
    skeleton = Skeleton(rod.nodes, rod.edges, rod.radii, [0] * 500, rod.points, (), confidence=[1, 1])
    save_skeleton(skeleton, tmp_path / "rod.npz")
    np.savez(tmp_path / "none.npz", nodes=none, edges=np.empty((0, 2), int), radii=[])
    np.savetxt(tmp_path / "few.xyz", np.eye(3))
    cube = o3d.geometry.TriangleMesh.create_box().translate((50, 0, 0))
    o3d.io.write_triangle_mesh(str(tmp_path / "away.ply"), cube)
    texts = {"junk.ply": "hello", "nan.xyz": "0 0 0\n0 nan 1\n", "bad.json": "{}", "bad.swc": "1 2", "bad.docx": "x"}
    for name, text in texts.items():
        (tmp_path / name).write_text(text)


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize("line", TABLE.strip().splitlines())
def test_refusals(refused, scans, line):
    words, message = map(str.strip, line.split("|"))
    code, *words = words.replace("SCANS", str(scans)).split()
    assert message in refused(int(code), *words)
