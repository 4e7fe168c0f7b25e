"""URDF text of a neutral robot.

The text is written so that readers get the same mechanics from it:

- Links and joints correspond one to one, so a reader's joints are `Robot.joints` by name (readers
  number them in orders of their own) and its links `Robot.links`. The root link "world" is massless
  and fixed.
- Every link has its ``<inertial>``: the origin is at the mass centre and its axes are the
  principal axes, so the tensor is diagonal. A link that only connects two joints has mass 0
  and inertia 0; without the element, some readers assume 1 kg.
- A rotation without hard limits is a ``continuous`` joint. A ``prismatic`` joint must have limits:
  `UNLIMITED` where the model has none. OpenSim's coordinate ranges limit no motion, so they are no
  limits here unless the robot has them.
- A joint driven by a multiple of the coordinate of another joint has a ``<mimic>``; any
  other function cannot be expressed.
- MuJoCo refuses a body without mass that moves. A ``<mujoco>`` element, which other readers skip,
  makes it give such bodies `LEAST_MASS`, and search mesh files where the text names them.
- PyBullet reports the frames of links in single precision and their inertial frames (mass centre,
  principal axes) in double: a program that needs more than 1e-7 has to start from the latter and
  remove the ``<inertial>`` origin.
- There is no ``<collision>`` unless the robot has collision shapes: contact in OpenSim is a force
  between a few named surfaces, not a property of shapes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise

from osimlite.io.document.lexical import format_shortest
from osimlite.io.document.xml_text import quote_attribute
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.robot.couplings import Mimic, find_mimics
from osimlite.simulation.robot.names import UniqueNames
from osimlite.simulation.robot.robot import (
    Ball,
    Box,
    MeshFile,
    Robot,
    RobotJoint,
    RobotLink,
    Tube,
    Visual,
    principal_axes,
)

UNLIMITED = 1e9
"""Limit of position, velocity or effort (m, m/s, rad/s, N, N·m) where the model has none."""

LEAST_MASS = 1e-9
"""Mass (kg) and principal moments (kg·m²) of a massless link in MuJoCo; other programs read zero."""

LONGEST_LINE = 1000
"""Largest number of characters of a line; Bullet cuts a line of more than 8191 anywhere."""

Attributes = dict[str, str]
"""Attributes of an XML element by name."""


def urdf_text(robot: Robot, *, visuals: bool = True) -> str:
    """Return a robot as URDF.

    Args:
        robot: robot with legal names (see `osimlite.simulation.robot.names`).
        visuals: whether shapes for drawing are written.

    Returns:
        The text of the file.
    """
    out, unique = _XmlWriter(), UniqueNames()
    with_visuals = [visual for link in robot.links for visual in link.visuals] if visuals else []
    materials = {
        color: _material_name(color) for color in sorted({visual.color for visual in with_visuals})
    }
    out.line('<?xml version="1.0" encoding="utf-8"?>')
    with out.element("robot", {"name": robot.name}):
        # MuJoCo refuses massless bodies unless the file states a least mass.
        with out.element("mujoco"):
            least = number(LEAST_MASS)
            out.empty("compiler", {"boundmass": least, "boundinertia": least, "strippath": "false"})
        for color, name in materials.items():
            with out.element("material", {"name": name}):
                out.empty("color", {"rgba": numbers(color)})
        for link in robot.links:
            with out.element("link", {"name": link.name}):
                _write_inertial(out, link)
                for visual in link.visuals if visuals else ():
                    with out.element("visual"):
                        _write_shape(out, visual)
                        out.empty("material", {"name": materials[visual.color]})
                for collision in link.collisions:
                    with out.element(
                        "collision", {"name": unique(collision.source.rsplit("/", 1)[-1])}
                    ):
                        _write_shape(out, collision)
        mimics = find_mimics(robot)
        for joint in robot.joints:
            _write_joint(out, joint, mimics.get(joint.name))
    return out.text()


def number(value: float) -> str:
    """Return the shortest text that reads back as the same float."""
    # Adding 0 turns -0 into 0.
    return format_shortest(float(value) + 0.0)


def numbers(values: Sequence[float] | Array) -> str:
    """Return numbers as text, separated by blanks."""
    return " ".join(number(float(value)) for value in values)


def roll_pitch_yaw(rotation: Array) -> tuple[float, float, float]:
    """Return the angles of a rotation in URDF's convention.

    Yaw is computed first and removed before the others are computed. At a pitch of ±90 degrees,
    where roll and yaw have the same effect, this still gives a pair that fits.

    Args:
        rotation: rotation matrix (3, 3).

    Returns:
        Roll, pitch and yaw (rad) with Rz(yaw) Ry(pitch) Rx(roll) = rotation, exact to rounding.
    """
    r = rotation.tolist()
    yaw = math.atan2(r[1][0], r[0][0])
    s, c = math.sin(yaw), math.cos(yaw)
    # By the yaw the other angles follow without division by cos(pitch), which vanishes at a right
    # angle.
    pitch = math.atan2(-r[2][0], c * r[0][0] + s * r[1][0])
    roll = math.atan2(s * r[0][2] - c * r[1][2], c * r[1][1] - s * r[0][1])
    return roll, pitch, yaw


def _write_inertial(out: _XmlWriter, link: RobotLink) -> None:
    """Write mass and inertia of a link, about the principal axes at its mass centre."""
    moments, axes = principal_axes(link.inertia)
    ixx, iyy, izz = (number(moment) for moment in moments)
    with out.element("inertial"):
        out.empty("origin", {"xyz": numbers(link.center), "rpy": numbers(roll_pitch_yaw(axes))})
        out.empty("mass", {"value": number(link.mass)})
        out.empty(
            "inertia", {"ixx": ixx, "ixy": "0", "ixz": "0", "iyy": iyy, "iyz": "0", "izz": izz}
        )


def _write_shape(out: _XmlWriter, shape: Visual) -> None:
    """Write pose and geometry of a shape of a link."""
    _write_origin(out, shape.origin)
    with out.element("geometry"):
        match shape.shape:
            case Box(size):
                out.empty("box", {"size": numbers(size)})
            case Ball(radius):
                out.empty("sphere", {"radius": number(radius)})
            case Tube(radius, length):
                out.empty("cylinder", {"radius": number(radius), "length": number(length)})
            case MeshFile(file, scale):
                out.empty("mesh", {"filename": file, "scale": numbers(scale)})


def _write_joint(out: _XmlWriter, joint: RobotJoint, mimic: Mimic | None) -> None:
    """Write the `<joint>` element of a joint.

    Args:
        out: receives the element.
        joint: the joint; a limit, effort or velocity that it lacks is written as `UNLIMITED` where
            URDF or most of its readers require one.
        mimic: leader of the joint and the linear function; None if it follows no other joint.
    """
    # URDF requires limits of a revolute joint, and has no prismatic joint without them.
    kind = "continuous" if joint.kind == "revolute" and joint.limits is None else joint.kind
    with out.element("joint", {"name": joint.name, "type": kind}):
        out.empty("parent", {"link": joint.parent})
        out.empty("child", {"link": joint.child})
        _write_origin(out, joint.origin)
        if joint.kind == "fixed":
            return
        out.empty("axis", {"xyz": numbers(joint.axis)})
        # Most readers require the limits of effort (N or N.m) and velocity (m/s or rad/s).
        effort_and_velocity = {
            "effort": number(UNLIMITED if joint.effort is None else joint.effort),
            "velocity": number(UNLIMITED if joint.velocity is None else joint.velocity),
        }
        if kind == "continuous":
            out.empty("limit", effort_and_velocity)
        else:
            lower, upper = (-UNLIMITED, UNLIMITED) if joint.limits is None else joint.limits
            # Not all readers know infinity, which a range may have on one side.
            position_limits = {
                "lower": number(max(lower, -UNLIMITED)),
                "upper": number(min(upper, UNLIMITED)),
            }
            out.empty("limit", {**position_limits, **effort_and_velocity})
        if mimic is not None:
            offset = {"offset": number(mimic.line.offset)} if mimic.line.offset else {}
            out.empty(
                "mimic", {"joint": mimic.leader, "multiplier": number(mimic.line.slope), **offset}
            )


def _write_origin(out: _XmlWriter, matrix: Array) -> None:
    """Write a pose, given as a homogeneous matrix (4, 4), as position and angles."""
    out.empty(
        "origin", {"xyz": numbers(matrix[:3, 3]), "rpy": numbers(roll_pitch_yaw(matrix[:3, :3]))}
    )


def _material_name(color: tuple[float, float, float, float]) -> str:
    return "rgba_" + "_".join(number(part).replace(".", "p").replace("-", "m") for part in color)


class _XmlWriter:
    """Writer of indented XML, one element a line."""

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._depth = 0

    def line(self, text: str) -> None:
        self._lines.append("  " * self._depth + text)

    def empty(self, tag: str, attributes: Attributes) -> None:
        self._start(tag, attributes, "/>")

    @contextmanager
    def element(self, tag: str, attributes: Attributes | None = None) -> Iterator[None]:
        self._start(tag, attributes or {}, ">")
        self._depth += 1
        yield
        self._depth -= 1
        self.line(f"</{tag}>")

    def text(self) -> str:
        return "\n".join(self._lines) + "\n"

    def _start(self, tag: str, attributes: Attributes, end: str) -> None:
        for line in _wrap_tag(
            [
                f"<{tag}",
                *(f"{name}={quote_attribute(value)}" for name, value in attributes.items()),
            ],
            end,
        ):
            self.line(line)


def _wrap_tag(words: Sequence[str], end: str) -> Iterator[str]:
    """Yield a start tag on one line, or one word a line if that is too long.

    Args:
        words: the tag and its attributes.
        end: end of the tag.
    """
    tag_text = " ".join(words) + end
    if len(tag_text) <= LONGEST_LINE:
        yield tag_text
        return
    for word, following in pairwise([*words, ""]):
        yield word if following else word + end
