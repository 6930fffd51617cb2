"""An armature as BVH, read back by a parser of its own: where joints are at rest, and what hangs on what."""

import numpy as np
import pytest

from glsk_o3d import Skeleton, save_rig


def read(path):
    """Joints by name: place at rest, the joint before, channels; places of end sites; and the frames."""
    words = iter(path.read_text().split())
    joints, ends, above, name = {}, [], [], None
    for word in words:
        if word in ("ROOT", "JOINT"):
            name = next(words)
            assert name not in joints
        elif word == "End":
            name = next(words)
        elif word == "{":
            above.append(name)
        elif word == "}":
            above.pop()
        elif word == "OFFSET":
            before = joints[above[-2]][0] if len(above) > 1 else 0
            place = before + np.array([float(next(words)) for _ in range(3)])
            if above[-1] == "Site":
                ends.append(place)
            else:
                joints[above[-1]] = [place, above[-2] if len(above) > 1 else None, []]
        elif word == "CHANNELS":
            joints[above[-1]][2] = [next(words) for _ in range(int(next(words)))]
        elif word == "MOTION":
            break
    assert above == []
    assert [next(words), next(words), next(words), next(words)] == ["Frames:", "1", "Frame", "Time:"]
    assert float(next(words)) == pytest.approx(1 / 30, abs=1e-6)
    return joints, np.array(ends), np.array(list(words), float)


@pytest.mark.parametrize("up", ["z", "y"])
def test_joints_are_where_the_bones_begin(tree, tmp_path, up):
    moved = Skeleton(tree.vertices + [100, 20, 3], tree.edges, tree.radii, (), (), ())
    bones = save_rig(moved, tmp_path / "r.bvh", root=2, up=up)
    joints, ends, frame = read(tmp_path / "r.bvh")
    turn = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]] if up == "z" else np.eye(3))  # y is up in the file
    place = bones.vertices @ turn.T
    root, before, channels = joints.pop("armature")
    turns = ["Zrotation", "Xrotation", "Yrotation"]
    assert (before, channels) == (None, ["Xposition", "Yposition", "Zposition", *turns])
    np.testing.assert_allclose(root, moved.vertices[2] @ turn.T)
    np.testing.assert_array_equal(frame, [*root, *[0] * 3 * (len(joints) + 1)])
    assert all(channels == turns for *_, channels in joints.values())

    def sorted_rows(rows):
        return np.array(sorted(np.round(rows, 9).tolist()))

    found = [[*(joints[before][0] if before in joints else root), *here] for here, before, _ in joints.values()]
    parent = {int(b): int(a) for a, b in bones.edges}
    heads = bones.edges[:, 0].tolist()
    expected = [[*place[parent.get(head, head)], *place[head]] for head in heads]
    np.testing.assert_allclose(sorted_rows(found), sorted_rows(expected))
    tips = np.setdiff1d(bones.leaves, [0])
    np.testing.assert_allclose(sorted_rows(ends), sorted_rows(place[tips]))


def test_a_long_chain_and_several_roots(tmp_path):
    n = 3000
    line = np.column_stack([np.arange(2.0 * n), np.zeros((2 * n, 2))])
    edges = np.column_stack([np.arange(2 * n - 1), np.arange(1, 2 * n)])
    apart = Skeleton(line, np.delete(edges, n - 1, axis=0), np.full(2 * n, 0.1), (), (), ())
    bones = save_rig(apart, tmp_path / "r.bvh", up="y")
    joints, ends, _ = read(tmp_path / "r.bvh")
    assert len(joints) == len(bones.edges) + 1 == 2 * n - 1
    assert sum(before == "armature" for _, before, _ in joints.values()) == 2
    np.testing.assert_allclose(sorted(ends[:, 0]), [n - 1, 2 * n - 1])
