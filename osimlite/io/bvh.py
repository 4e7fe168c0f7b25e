"""Reading and writing of BVH files: a skeleton of joints, and their motion.

A joint has a fixed offset from its parent, and channels that change from frame to frame: rotations
(degrees), applied in the order of the channels, and for some joints positions. A position channel
replaces the offset along its axis, as in Blender and bvhio.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from osimlite.base.files import read_file
from osimlite.base.records import dataclass, field, replace
from osimlite.base.text import format_count
from osimlite.errors import DocumentError
from osimlite.io.tables.storage import format_number
from osimlite.mechanics.multibody.spatial import Array

ROTATIONS = ("Zrotation", "Xrotation", "Yrotation")
"""Rotation channels that are written, in the usual order of BVH files."""

POSITIONS = ("Xposition", "Yposition", "Zposition")
"""Position channels that are written."""

MAX_NUMBER = 1e9
"""Largest accepted size of a number; motions are degrees and at most some kilometres in millimetres."""

MAX_JOINTS = 10_000
"""Largest accepted number of joints; more are a sign of damage."""


@dataclass(frozen=True, eq=False)
class BvhJoint:
    """Joint of a skeleton.

    Attributes:
        name: name of the joint.
        parent: index of the parent; -1 for a root.
        offset: position in the axes of the parent (3,), in the unit of the file.
        channels: names of the channels in the order of their numbers.
        end: position of the first end site (3,); None if there is none.
    """

    name: str
    parent: int
    offset: Array
    channels: tuple[str, ...] = ()
    end: Array | None = None

    @property
    def has_position(self) -> bool:
        """True if the joint has position channels."""
        return any(channel in POSITIONS for channel in self.channels)


@dataclass(frozen=True, eq=False)
class BvhMotion:
    """Skeleton and motion of a BVH file.

    Attributes:
        joints: joints of the skeleton, each after its parent.
        frame_time: time between two frames, s.
        values: numbers of all channels (frames, channels), joint by joint.
        file: path of the file; None if it was not read.
    """

    joints: tuple[BvhJoint, ...]
    frame_time: float
    values: Array
    file: str | None = field(default=None, compare=False)

    @property
    def times(self) -> Array:
        """Times of the frames (n,), s, from 0."""
        return np.asarray(self.frame_time * np.arange(len(self.values)), dtype=float)

    def compute_poses(self) -> tuple[Array, Array]:
        """Compute the poses of all joints in the axes of the file.

        Returns:
            Rotation matrices (frames, joints, 3, 3), and positions (frames, joints, 3) in the unit
            of the file.
        """
        count = len(self.values)
        rotations = np.empty((count, len(self.joints), 3, 3))
        positions = np.empty((count, len(self.joints), 3))
        column = 0
        # Joints come depth-first, so that a parent is computed before its children.
        for index, joint in enumerate(self.joints):
            rotation = np.broadcast_to(np.eye(3), (count, 3, 3))
            position = np.tile(joint.offset, (count, 1))
            for channel in joint.channels:
                axis = "XYZ".index(channel[0])
                if channel.endswith("position"):
                    # A position replaces the offset, as in Blender.
                    position[:, axis] = self.values[:, column]
                else:
                    # Channels are applied from left to right, each in the axes that the previous
                    # ones have turned.
                    rotation = rotation @ _make_rotations(axis, np.radians(self.values[:, column]))
                column += 1
            if joint.parent >= 0:
                above = rotations[:, joint.parent]
                position = positions[:, joint.parent] + np.einsum("nij,nj->ni", above, position)
                rotation = above @ rotation
            rotations[:, index], positions[:, index] = rotation, position
        return rotations, positions


def _make_rotations(axis: int, angles: Array) -> Array:
    """Return rotations (n, 3, 3) about a coordinate axis by angles (n,), rad."""
    # The two other axes in cyclic order make a right-handed rotation.
    i, j = ((1, 2), (2, 0), (0, 1))[axis]
    result = np.zeros((len(angles), 3, 3))
    result[:, axis, axis] = 1.0
    result[:, i, i] = result[:, j, j] = np.cos(angles)
    result[:, j, i] = np.sin(angles)
    result[:, i, j] = -np.sin(angles)
    return result


def find_angles(rotations: Array) -> Array:
    """Return the angles (n, 3), degrees, of the channels `ROTATIONS` for rotations (n, 3, 3).

    The angles are those of Rz(a) Rx(b) Ry(c). They continue from frame to frame without jumps by
    360 degrees. Where b is a right angle, c is 0.
    """
    # Element (2, 1) of Rz Rx Ry is sin(b), and cos(b) is the length of its column without it. Near a
    # right angle cos(b) has all digits, but arcsin only half of them.
    cosine = np.hypot(rotations[:, 0, 1], rotations[:, 1, 1])
    b = np.arctan2(rotations[:, 2, 1], cosine)
    # At a right angle only a + c or a - c is determined.
    is_locked = cosine < 1e-9
    a = np.where(
        is_locked,
        np.arctan2(rotations[:, 1, 0], rotations[:, 0, 0]),
        np.arctan2(-rotations[:, 0, 1], rotations[:, 1, 1]),
    )
    # c is the angle of the rotation without a. Near a right angle, rounding errors of the elements
    # change a, and c compensates for them.
    sin, cos = np.sin(a), np.cos(a)
    c = np.where(
        is_locked,
        0.0,
        np.arctan2(
            cos * rotations[:, 0, 2] + sin * rotations[:, 1, 2],
            cos * rotations[:, 0, 0] + sin * rotations[:, 1, 0],
        ),
    )
    # `unwrap` removes jumps by full turns.
    angles = np.unwrap(np.stack([a, b, c], axis=1), axis=0)
    return np.asarray(np.degrees(angles), dtype=float)


def format_bvh(motion: BvhMotion) -> Iterator[str]:
    """Yield the text of a file in parts."""
    children: dict[int, list[int]] = {}
    for index, joint in enumerate(motion.joints):
        children.setdefault(joint.parent, []).append(index)
    yield "HIERARCHY\n"
    # Pairs of a joint and whether its block only has to be closed.
    waiting = [(index, False, 0) for index in reversed(children.get(-1, []))]
    while waiting:
        index, is_end, depth = waiting.pop()
        indent = "\t" * depth
        if is_end:
            yield f"{indent}}}\n"
            continue
        joint = motion.joints[index]
        yield f"{indent}{'JOINT' if depth else 'ROOT'} {joint.name}\n{indent}{{\n"
        yield f"{indent}\tOFFSET {_format_numbers(joint.offset)}\n"
        yield f"{indent}\tCHANNELS {len(joint.channels)} {' '.join(joint.channels)}\n"
        if joint.end is not None:
            # "End Site" gives the length of the last bone.
            yield f"{indent}\tEnd Site\n{indent}\t{{\n{indent}\t\tOFFSET {_format_numbers(joint.end)}\n{indent}\t}}\n"
        waiting.append((index, True, depth))
        waiting += [(child, False, depth + 1) for child in reversed(children.get(index, []))]
    yield f"MOTION\nFrames: {len(motion.values)}\nFrame Time: {format_number(motion.frame_time)}\n"
    for row in motion.values:
        yield f"{_format_numbers(row)}\n"


def _format_numbers(numbers: Sequence[float] | Array) -> str:
    """Return numbers with all digits, separated by blanks."""
    # The sum with 0 turns a negative zero into 0.
    return " ".join(format_number(float(number) + 0.0) for number in numbers)


class _BvhReader:
    """Words of a file with their line numbers."""

    def __init__(self, path: str | Path) -> None:
        self.file = str(path)
        # Some editors write a byte-order mark.
        text = read_file(path).decode("utf-8", "replace").lstrip("\ufeff")
        self.lines = text.splitlines()
        # Line breaks have no meaning in the format, so words are read.
        self.words = [
            (word, number) for number, line in enumerate(self.lines, 1) for word in line.split()
        ]
        self.position = 0

    def fail(self, message: str) -> DocumentError:
        """Return an error at the line of the current word."""
        index = min(self.position, len(self.words) - 1)
        line = self.words[index][1] if self.words else None
        return DocumentError(message, file=self.file, line=line)

    def peek(self) -> str:
        """Return the next word without taking it; "" at the end."""
        return self.words[self.position][0] if self.position < len(self.words) else ""

    def take(self, expected: str = "") -> str:
        """Return the next word and advance; raise an error if another one was expected."""
        word = self.peek()
        if not word or (expected and word.lower() != expected.lower()):
            expected_text = f"'{expected}'" if expected else "more"
            actual_text = f"'{word}'" if word else "the end of the file"
            raise self.fail(f"expected {expected_text}, found {actual_text}")
        self.position += 1
        return word

    def take_number(self) -> float:
        """Return the next word as a finite number of at most `MAX_NUMBER`."""
        word = self.peek()
        try:
            number = float(word)
        except ValueError:
            number = math.nan
        # NaN and infinity are words that float() accepts.
        if not math.isfinite(number):
            raise self.fail(f"expected a number, found '{word}'")
        if abs(number) > MAX_NUMBER:
            raise self.fail(f"expected a number of at most {MAX_NUMBER:g}, found '{word}'")
        self.position += 1
        return number

    def take_count(self) -> int:
        """Return the next word as a count."""
        word = self.peek()
        if not (word.isascii() and word.isdigit() and len(word) < 10):
            raise self.fail(f"expected a count, found '{word}'")
        self.position += 1
        return int(word)

    def take_vector(self) -> Array:
        """Return the next three words as numbers (3,)."""
        return np.array([self.take_number() for _ in range(3)])

    def take_name(self) -> str:
        """Return the words up to the next brace, which are a name that can have blanks."""
        words = []
        while self.peek() not in ("{", ""):
            words.append(self.take())
        return " ".join(words)


def read_bvh(path: str | Path) -> BvhMotion:
    """Read a BVH file.

    Args:
        path: path of the BVH file.

    Returns:
        Joints of the skeleton, and the values of their channels in each frame.

    Raises:
        MissingFileError: the file does not exist or cannot be read.
        DocumentError: it is not a BVH file, or is damaged; the message names the line.
    """
    reader = _BvhReader(path)
    reader.take("HIERARCHY")
    joints: list[BvhJoint] = []
    while reader.peek().upper() == "ROOT":
        reader.take()
        _read_joints(reader, joints)
    if not joints:
        # Some files have several roots.
        raise reader.fail("the file has no ROOT joint")
    reader.take("MOTION")
    reader.take("Frames:")
    count = reader.take_count()
    if count == 0:
        raise reader.fail("the motion has no frames")
    reader.take("Frame")
    reader.take("Time:")
    frame_time = reader.take_number()
    if frame_time <= 0.0:
        raise reader.fail(f"the frame time is {frame_time:g} s; it must be positive")
    width = sum(len(joint.channels) for joint in joints)
    word_count = len(reader.words) - reader.position
    # Compared before the numbers are read, so that a wrong count does not fill the memory.
    if word_count != count * width:
        raise reader.fail(
            f"{format_count(count, 'frame')} of {format_count(width, 'channel')} are "
            f"{count * width} numbers, but {word_count} words follow"
        )
    values = np.array([reader.take_number() for _ in range(word_count)]).reshape(count, width)
    return BvhMotion(tuple(joints), frame_time, values, str(path))


def _read_joints(reader: _BvhReader, joints: list[BvhJoint]) -> None:
    """Read a root and everything below it."""
    parents: list[int] = []
    while True:
        if len(joints) >= MAX_JOINTS:
            raise reader.fail(f"the file has more than {MAX_JOINTS} joints")
        name = reader.take_name()
        reader.take("{")
        reader.take("OFFSET")
        offset = reader.take_vector()
        channels = tuple(_take_channel(reader) for _ in range(_take_channel_count(reader)))
        parent = parents[-1] if parents else -1
        joints.append(BvhJoint(name or f"joint_{len(joints)}", parent, offset, channels))
        parents.append(len(joints) - 1)
        # Closing braces end joints; the next JOINT hangs on what is still open. Some programs write end
        # sites after the children of a joint, or several of them.
        while parents and (word := reader.peek().lower()) in ("}", "end"):
            if word == "}":
                reader.take()
                parents.pop()
            else:
                end = _take_end_site(reader)
                open_joint = joints[parents[-1]]
                if open_joint.end is None:
                    joints[parents[-1]] = replace(open_joint, end=end)
        if not parents:
            return
        reader.take("JOINT")


def _take_end_site(reader: _BvhReader) -> Array:
    """Read an end site.

    Returns:
        Position of the end site in the frame of its joint (3,), in the length unit of the file.
    """
    reader.take()
    reader.take_name()
    reader.take("{")
    reader.take("OFFSET")
    end = reader.take_vector()
    reader.take("}")
    return end


def _take_channel_count(reader: _BvhReader) -> int:
    """Return the number of channels of a joint and advance; 0 for a joint without the keyword."""
    if reader.peek().upper() != "CHANNELS":
        return 0
    reader.take()
    count = reader.take_count()
    if count > 6:
        raise reader.fail(f"a joint has {count} channels; there are six at most")
    return count


def _take_channel(reader: _BvhReader) -> str:
    """Return the next word as the name of a channel and advance."""
    word = reader.peek()
    channels = {name.lower(): name for name in (*POSITIONS, *ROTATIONS)}
    if word.lower() not in channels:
        # Channel names are in any letter case.
        raise reader.fail(f"unknown channel '{word}'; channels are {', '.join(channels.values())}")
    reader.take()
    return channels[word.lower()]
