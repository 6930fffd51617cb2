"""An armature as BVH, read back by a parser of its own: where joints are at rest, and what hangs on what."""

import numpy as np
import pytest

from glsk_o3d import Skeleton, save_rig
from glsk_o3d.analysis.rigging import bone_before, bone_names


def read(path):
    """Joints by name: place at rest, the joint before, channels; places of end sites; and the frame."""
    words = iter(path.read_text().split())
    joints, ends, above, name = {}, [], [], None
    for word in words:
        if word in ("ROOT", "JOINT", "End"):
            name = next(words)
        elif word == "{":
            above.append(name)
        elif word == "}":
            above.pop()
        elif word == "OFFSET":
            before = above[-2] if len(above) > 1 else None
            place = np.array([float(next(words)) for _ in range(3)]) + (joints[before][0] if before else 0)
            if above[-1] == "Site":
                ends.append(place)
            else:
                assert above[-1] not in joints
                joints[above[-1]] = [place, before]
        elif word == "CHANNELS":
            joints[above[-1]].append([next(words) for _ in range(int(next(words)))])
        elif word == "MOTION":
            break
    assert above == []
    assert [next(words) for _ in range(4)] == ["Frames:", "1", "Frame", "Time:"]
    assert float(next(words)) == pytest.approx(1 / 30, abs=1e-6)
    return joints, np.array(ends), np.array(list(words), float)


@pytest.mark.parametrize("up", ["z", "y"])
def test_joints_are_where_the_bones_begin(tree, tmp_path, up):
    n = 3000  # bones in a row are more than Python calls functions in one another
    chain = np.column_stack([np.arange(n), np.full((n, 2), 9.0)])
    links = len(tree.vertices) + np.column_stack([np.arange(n - 1), np.arange(1, n)])
    both = np.concatenate([tree.vertices, chain]) + [100, 20, 3], np.concatenate([tree.edges, links])
    bones = save_rig(Skeleton(*both, np.full(len(both[0]), 0.1), (), (), ()), tmp_path / "r.bvh", root=2, up=up)
    joints, ends, frame = read(tmp_path / "r.bvh")
    place = bones.vertices @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]] if up == "z" else np.eye(3)).T  # y is up
    root, _, channels = joints.pop("armature")
    turns = ["Zrotation", "Xrotation", "Yrotation"]
    assert channels == ["Xposition", "Yposition", "Zposition", *turns]
    np.testing.assert_allclose(root, place[0])
    np.testing.assert_array_equal(frame, [*root, *[0] * 3 * (len(joints) + 1)])
    names = [*bone_names(bones), "armature"]
    assert {name: before for name, (_, before, _) in joints.items()} == dict(
        zip(names[:-1], (names[bone] for bone in bone_before(bones)), strict=True)
    )
    assert all(channels == turns for *_, channels in joints.values())
    np.testing.assert_allclose([joints[name][0] for name in names[:-1]], place[bones.edges[:, 0]])
    tips = place[np.setdiff1d(bones.edges[:, 1], bones.edges[:, 0])]
    np.testing.assert_allclose(*(rows[np.lexsort(np.round(rows, 6).T)] for rows in (ends, tips)))
