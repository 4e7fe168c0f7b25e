"""Check BVH files: a round trip, files of other programs, and messages about damage."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from osimlite.errors import DocumentError, OsimliteError
from osimlite.io.bvh import ROTATIONS, BvhJoint, BvhMotion, find_angles, format_bvh, read_bvh

# File in the style of other programs: names with blanks, and several orders of rotations.
TEXT = """HIERARCHY
ROOT Hips of a man
{
  OFFSET 0.0 1.0 0.0
  CHANNELS 6 Xposition Yposition Zposition Yrotation Zrotation Xrotation
  JOINT Leg
  {
    OFFSET 0 -40 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -40 0
    }
  }
  JOINT Spine
  {
    OFFSET 0 10 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Head
    {
      OFFSET 0 20 0
      CHANNELS 0
      End Site
      {
        OFFSET 0 10 0
      }
    }
  }
}
MOTION
Frames:\t2
Frame Time: 0.008333
1 2 3 90 0 0 0 0 0 0 0 0
1 2 3 0 90 0 0 90 0 0 0 90
"""


def write(folder: Path, text: str) -> Path:
    (folder / "it.bvh").write_text(text)
    return folder / "it.bvh"


def test_joints_and_poses(tmp_path: Path) -> None:
    motion = read_bvh(write(tmp_path, TEXT))
    assert [joint.name for joint in motion.joints] == ["Hips of a man", "Leg", "Spine", "Head"]
    assert [joint.parent for joint in motion.joints] == [-1, 0, 0, 2]
    assert motion.times.tolist() == [0.0, 0.008333]
    rotations, positions = motion.compute_poses()
    # A position channel replaces the offset of the joint.
    assert positions[0, 0].tolist() == [1.0, 2.0, 3.0]
    np.testing.assert_allclose(positions[0, 1], [1.0, -38.0, 3.0], atol=1e-12)
    # A rotation by 90 degrees about Z maps -40 along Y to 40 along X.
    np.testing.assert_allclose(positions[1, 1], [41.0, 2.0, 3.0], atol=1e-12)
    np.testing.assert_allclose(rotations[0, 0] @ [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], atol=1e-12)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    motion = read_bvh(write(tmp_path, TEXT))
    again = read_bvh(write(tmp_path, "".join(format_bvh(motion))))
    assert [(j.name, j.parent, j.channels, j.offset.tolist()) for j in again.joints] == [
        (j.name, j.parent, j.channels, j.offset.tolist()) for j in motion.joints
    ]
    np.testing.assert_array_equal(again.values, motion.values)
    assert again.joints[1].end is not None and again.joints[1].end.tolist() == [0.0, -40.0, 0.0]


def test_end_sites_stand_anywhere_in_a_joint(tmp_path: Path) -> None:
    end = "End Site { OFFSET 0 0 7 }\n"
    # End sites stand before and after the children of a joint, twice in one joint, and after those
    # of the root.
    text = TEXT.replace("  JOINT Spine", end + end.replace("7", "8") + "  JOINT Spine")
    text = text.replace("  }\n}\nMOTION", "  " + end + "  }\n" + end + "}\nMOTION")
    motion, plain = read_bvh(write(tmp_path, text)), read_bvh(write(tmp_path, TEXT))
    assert [(j.name, j.parent) for j in motion.joints] == [(j.name, j.parent) for j in plain.joints]
    ends = [None if j.end is None else j.end.tolist() for j in motion.joints]
    assert ends == [[0, 0, 7], [0, -40, 0], [0, 0, 7], [0, 10, 0]]
    np.testing.assert_array_equal(motion.compute_poses()[1], plain.compute_poses()[1])
    again = read_bvh(write(tmp_path, "".join(format_bvh(motion))))
    assert [None if j.end is None else j.end.tolist() for j in again.joints] == ends


def test_angles_are_those_of_rotations_and_do_not_jump() -> None:
    rng = np.random.default_rng(0)
    angles = np.cumsum(rng.uniform(-20.0, 20.0, (400, 3)), axis=0)
    angles[:, 1] = 89.0 * np.sin(np.arange(400) / 30.0)
    joint = BvhJoint("a", -1, np.zeros(3), ("Zrotation", "Xrotation", "Yrotation"))
    rotations = BvhMotion((joint,), 0.01, angles).compute_poses()[0][:, 0]
    result = find_angles(rotations)
    again = BvhMotion((joint,), 0.01, result).compute_poses()[0][:, 0]
    np.testing.assert_allclose(again, rotations, atol=1e-12)
    assert np.abs(np.diff(result, axis=0)).max() < 60.0
    np.testing.assert_allclose(result - result[0], angles - angles[0], atol=1e-6)


def test_a_right_angle_has_an_answer() -> None:
    joint = BvhJoint("a", -1, np.zeros(3), ("Zrotation", "Xrotation", "Yrotation"))
    for middle in (90.0, -90.0, 90.0 - 5e-7, -90.0 + 1e-7, 90.0 - 1e-11):
        rotations = BvhMotion((joint,), 0.01, np.array([[20.0, middle, 30.0]])).compute_poses()[0][
            :, 0
        ]
        result = find_angles(rotations)
        if abs(middle) == 90.0:
            assert result[0, 2] == 0.0
        again = BvhMotion((joint,), 0.01, result).compute_poses()[0][:, 0]
        np.testing.assert_allclose(again, rotations, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("HIERARCHY", "BVH", 1, "expected 'HIERARCHY', found 'BVH'"),
        ("ROOT", "JOINT", 2, "no ROOT joint"),
        (
            "OFFSET 0 -40 0\n    CHANNELS",
            "OFFSET 0 x 0\n    CHANNELS",
            8,
            "expected a number, found 'x'",
        ),
        ("OFFSET 0 -40 0\n    CHANNELS", "OFFSET 0 nan 0\n    CHANNELS", 8, "expected a number"),
        ("OFFSET 0 -40 0\n    CHANNELS", "OFFSET 0 1e300 0\n    CHANNELS", 8, "at most 1e+09"),
        ("Xposition", "Wposition", 5, "unknown channel 'Wposition'"),
        ("CHANNELS 3", "CHANNELS 9", 9, "9 channels; there are six at most"),
        ("CHANNELS 3", "CHANNELS -1", 9, "expected a count"),
        (
            "Frames:\t2",
            "Frames: 3",
            None,
            "3 frames of 12 channels are 36 numbers, but 24 words follow",
        ),
        ("0.008333", "0", None, "frame time is 0 s"),
        ("Frames:\t2", "Frames: 0", None, "the motion has no frames"),
        ("MOTION", "", None, "expected 'MOTION'"),
        ("90\n", "90 z", None, "but 25 words follow"),
        (
            TEXT[TEXT.index("    End Site") :],
            "",
            None,
            "expected 'JOINT', found the end of the file",
        ),
        (TEXT, "", None, "found the end of the file"),
    ],
)
def test_damage_is_described(
    tmp_path: Path, old: str, new: str, line: int | None, message: str
) -> None:
    with pytest.raises(DocumentError) as error:
        read_bvh(write(tmp_path, TEXT.replace(old, new, 1)))
    assert message in error.value.message and (line is None or error.value.line == line)


def test_endless_joints_are_refused(tmp_path: Path) -> None:
    text = "HIERARCHY\nROOT a\n" + "{ OFFSET 0 0 0 JOINT b\n" * 10_001
    with pytest.raises(OsimliteError, match="more than 10000 joints"):
        read_bvh(write(tmp_path, text))


def test_zeros_have_no_sign(tmp_path: Path) -> None:
    joint = BvhJoint("a", -1, np.array([-0.0, 0.0, -0.0]), ROTATIONS)
    text = "".join(format_bvh(BvhMotion((joint,), 0.01, np.array([[-0.0, 1.0, -0.0]]))))
    assert "-0" not in text
