"""What the commands refuse: in one line that says what was wrong and where, before they write anything."""

import numpy as np
import pytest

from glsk_o3d import Skeleton, read_skeleton, samples, save_skeleton

SCRIPT = '<FilterScript>\n<filter name="{}"/></FilterScript>'
TABLE = """
    1 branches z.ply                                       | z.ply: no such file
    1 branches SCANS/ring.ply                              | ring.ply: is a cloud, not a skeleton: make one with
    1 branches empty.json                                  | empty.json: the skeleton is empty
    2 branches y.ply --root trunk                          | root = 'trunk': must be an axis, x to -z, 'thickest'
    2 branches y.ply -o y.txt                              | y.txt: the table is CSV and its name ends in .csv
    2 tree y.ply --unit 0                                  | unit = 0.0: must be above 0
    2 tree o.ply                                           | see pipelines.tree() (--pipeline tree)
    2 tree two.json                                        | editing.largest_component() (glsk edit --largest)
    2 edit o.ply                                           | nothing to write: give an output with -o
    1 convert o.ply a.swc                                  | a.swc: this format holds trees only
    2 convert y.ply                                        | nothing to write: give a FILE, or -o FILE
    2 rig none.ply -o r.fbx                                | r.fbx: the rig is glTF and its name ends in .glb
    1 rig y.ply y.ply -o r.glb                             | y.ply: is a skeleton, not a scan
    1 rig y.ply junk.ply -o r.glb                          | junk.ply: not a valid .ply file: it does not start with
    1 rig y.ply nan.xyz -o r.glb                           | nan.xyz: the surface has points that are not finite: drop
    1 rig o.ply -o r.glb                                   | 1 loop(s): pass cut_loops=True (--cut-loops) to drop
    1 rig bare.obj -o r.glb                                | a rig needs radii or points: read the skeleton from
    2 grasps rod.npz --opening -1                          | max_opening = -1.0: must be above 0
    2 grasps rod.npz --opening 1 --plane 0,0,0,1           | must be four finite numbers a, b, c, d of ax + by + cz
    2 grasps rod.npz --opening 1 -o g.ply                  | the grasps are JSON or CSV and its name ends in .json
    2 grasps y.ply --opening 1                             | has no confidence: give min_confidence=0 (--min-
    1 grasps rod.npz --opening 1 --cloud none.ply          | none.ply: no such file
    1 evaluate y.ply SCANS/ring.ply --truth none.npz       | none.npz: not a valid truth: the truth has no nodes
    1 evaluate dot.ply SCANS/ring.ply                      | dot.ply: the skeleton has no edge with a length
    1 crosscheck SCANS/nan.ply                             | nan.ply: 2 of 1000 points
    1 info bad.json                                        | bad.json: not a valid .json skeleton
    1 info bad.docx                                        | bad.docx: unknown ending
    2 filters Contracter                                   | is called 'Contracter': did you mean 'Contractor'?
    1 demo -o y.ply                                        | y.ply: is a file, not a folder
"""

BEFORE_ANY_RUN = """
    1 skeletonize y.ply -o a.ply                           | y.ply: is a skeleton, not a scan
    2 skeletonize SCANS/ring.ply                           | nothing to write
    2 skeletonize SCANS/ring.ply -o s.stl                  | s.stl: the file is a skeleton and its name ends in .ply or
    2 skeletonize SCANS/ring.ply --preview s.jpg           | s.jpg: the picture is a PNG and its name ends in .png
    2 skeletonize SCANS/ring.ply -o s.ply -o ./s.ply       | s.ply: is named twice
    2 skeletonize SCANS/ring.ply -o SCANS/ring.ply         | is an input
    1 skeletonize SCANS/ring.ply -o no/where/s.ply         | no/where: no such folder
    1 skeletonize SCANS/ring.ply -o /proc/s.ply            | /proc/s.ply: no file can be made in this folder
    1 skeletonize SCANS/ring.ply -o folder.ply             | folder.ply: is a folder or a device, not a file to write to
    2 skeletonize SCANS/ring.ply -o s.ply --pipeline wen2042 | no pipeline is called 'wen2042': did you mean 'wen2024'?
    2 skeletonize SCANS/ring.ply -o s.ply --set radios=1   | did you mean 'radius'
    2 skeletonize SCANS/ring.ply -o s.ply --set Connector.radius=-1 | Connector.radius = -1.0: must be above 0
    1 skeletonize SCANS/empty.ply -o s.ply                 | empty.ply: the file is empty
    1 skeletonize folder.ply -o s.ply                      | folder
    1 skeletonize SCANS/nan.ply -o s.ply                   | index 3: drop them with drop_invalid (--drop-invalid)
    1 skeletonize none.xyz -o s.ply                        | none.xyz: none of its 20 points has finite coordinates
    2 run                                                  | a SCRIPT and a SCAN are needed
    2 run glskeleton SCANS/ring.ply                        | nothing to write
    2 run glskeletn SCANS/ring.ply -o s.ply                | no filter script is called 'glskeletn': did you mean
    1 run none.mlx SCANS/ring.ply -o s.ply                 | none.mlx: no such file
    1 run bad.mlx SCANS/ring.ply -o s.ply                  | bad.mlx, line 2: no filter is called 'Generate Skeletn'
    2 run glskeleton SCANS/ring.ply -o s.stl               | s.stl: the last layer is a skeleton and its name
    2 run points.mlx SCANS/ring.ply -o s.json              | points or a mesh and its name ends in .ply
    1 batch none -o out                                    | none: no such file or folder
    2 batch SCANS/ring.ply -o out --format stl             | unknown ending; known are .ply
    2 batch SCANS/ring.ply -o out --shard 3/2              | shard = 3
    2 batch SCANS/ring.ply -o out --shard 3                | write it as I/N
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
    texts = {"junk.ply": "hello", "nan.xyz": "0 0 0\n0 nan 1\n", "bad.json": "{}", "bad.swc": "1 2", "bad.docx": "x"}
    texts |= {"none.xyz": "nan nan nan\n" * 20, "bad.mlx": SCRIPT.format("Generate Skeletn")}
    texts |= {"points.mlx": SCRIPT.format("Generate Segmented Cloud (GLSkeleton)")}
    (tmp_path / "folder.ply").mkdir()
    for name, text in texts.items():
        (tmp_path / name).write_text(text)


@pytest.fixture
def refuses(refused, files, scans):
    """Run the command of a line; it must fail as the line says."""

    def check(line):
        words, message = map(str.strip, line.split("|"))
        code, *words = words.replace("SCANS", str(scans)).split()
        assert message in refused(int(code), *words)

    return check


@pytest.mark.parametrize("line", TABLE.strip().splitlines())
def test_refusals(refuses, line):
    refuses(line)


@pytest.mark.usefixtures("no_run")
@pytest.mark.parametrize("line", BEFORE_ANY_RUN.strip().splitlines())
def test_refusals_cost_no_run(refuses, line):
    refuses(line)
