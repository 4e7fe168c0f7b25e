"""The OpenSim model under construction, which every pass reads and extends."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field
from osimlite.mechanics.multibody.spatial import Array, rotation_of, rotation_xyz
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import PhysicalFrame, PhysicalOffsetFrame
from osimlite.schema.model import Model
from osimlite.schema.paths import AbstractGeometryPath
from osimlite.simulation.robot.names import UniqueNames
from osimlite.translate.fidelity import LEFT_OUT, Error, Fidelity
from osimlite.translate.mjcf_import.source import MjcfSource

Armature = Literal["rotors", "none"]
Limits = Literal["forces", "range"]
MuscleType = Literal["millard", "exact"]
Up = Literal["y", "z"]
ContactOption = Literal["forces", "geometry", "none"]
TendonPathOption = Literal["wraps", "geodesics"]


@dataclass(frozen=True)
class ImportOptions:
    """Options of a conversion; see :func:`osimlite.from_mjcf`."""

    written_for: int | None = None
    muscle: MuscleType = "millard"
    armature: Armature = "rotors"
    limits: Limits = "forces"
    contact: ContactOption = "forces"
    up: Up = "z"
    keyframe: str | None = None
    tendon_paths: TendonPathOption = "wraps"
    poses: int = 60
    seed: int = 0


class TendonPath(NamedTuple):
    """The path of a tendon."""

    path: AbstractGeometryPath
    shift: float = 0.0  # number that was added to the tendon's length, m


@dataclass(eq=False)
class ConversionDraft:
    """State of a conversion.

    Attributes:
        source: compiled MJCF file.
        options: options of the user.
        model: OpenSim model.
        fidelity: account of the conversion.
        world: frame that stands for MuJoCo's world: ground, or a frame turned in ground.
        frames: frame of each body of MuJoCo, world first.
        coordinates: names of the coordinates of each joint of MuJoCo: one for a hinge or a slide,
            three for a ball, six (rotations, then translations) for a free joint.
        rotors: coordinate that each rotor follows, by the name of the rotor's coordinate.
        made: coordinates of the model by name.
        files: files to write beside the model, by name.
        meshes: file of each mesh that is written.
        wrapping_geoms: geoms that a tendon wraps around.
        path_sites: sites that a tendon runs through.
        paths: path of each tendon, by the index of the tendon.
        version: version of MuJoCo whose rules the tendons follow.
        names: unique names by kind of component.
    """

    source: MjcfSource
    options: ImportOptions
    model: Model
    fidelity: Fidelity
    world: PhysicalFrame
    frames: list[PhysicalFrame] = field(default_factory=list)
    coordinates: list[tuple[str, ...]] = field(default_factory=list)
    rotors: dict[str, str] = field(default_factory=dict)
    made: dict[str, Coordinate] = field(default_factory=dict)
    files: dict[str, str | bytes] = field(default_factory=dict)
    meshes: dict[int, str] = field(default_factory=dict)
    wrapping_geoms: set[int] = field(default_factory=set)
    path_sites: set[int] = field(default_factory=set)
    paths: dict[int, TendonPath] = field(default_factory=dict)
    version: int = 4
    names: dict[str, UniqueNames] = field(default_factory=dict)

    @property
    def mj(self) -> Any:
        """MuJoCo's compiled model."""
        return self.source.model

    def has_one_control(self, actuator: int) -> bool:
        """Return whether an actuator has one control and one output; those of MuJoCo 4 may have several."""
        counts = (getattr(self.mj, f"actuator_{part}num", None) for part in ("ctrl", "out"))
        return all(numbers is None or int(numbers[actuator]) == 1 for numbers in counts)

    def get_control_index(self, actuator: int) -> int:
        """Return the index of the first control of an actuator, to which limits of controls belong."""
        addresses = getattr(self.mj, "actuator_ctrladr", None)
        return actuator if addresses is None else int(addresses[actuator])

    def get_output_index(self, actuator: int) -> int:
        """Return the index of the first output of an actuator, to which gears and lengths belong."""
        addresses = getattr(self.mj, "actuator_outadr", None)
        return actuator if addresses is None else int(addresses[actuator])

    def coordinate_path(self, joint: int) -> str:
        """Return the path of the coordinate of a hinge or slide."""
        return self.model.tree().path_of(self.made[self.coordinates[joint][0]]) or ""

    def unique(self, kind: str, name: str) -> str:
        """Return a legal name that no other component of this kind has."""
        return self.names.setdefault(kind, UniqueNames())(name)

    def note_result(self, kind: str, index: int, result: str) -> None:
        """Note what an object of MuJoCo became."""
        self.fidelity.translated[self.source.path_of(kind, index)] = result

    def record(
        self,
        kind: str,
        index: int,
        cannot_say: str,
        done: str,
        detail: str = "",
        errors: dict[str, Error] | None = None,
    ) -> None:
        """Record a loss or an approximation of an object of MuJoCo."""
        path = self.source.path_of(kind, index)
        self.fidelity.add(kind, path, cannot_say, done, detail, errors)

    def drop(self, kind: str, index: int, cannot_say: str, detail: str = "") -> None:
        """Record that an object of MuJoCo is left out."""
        self.record(kind, index, cannot_say, LEFT_OUT, detail)

    def frame_at(
        self, body: int, name: str, position: Array, rotation: Array
    ) -> tuple[PhysicalFrame, bool]:
        """Return the frame of a body, or a new frame fixed in it where the pose is not the identity.

        Args:
            body: index of the body.
            name: name of the new frame.
            position: position of the frame in the body (3,), m.
            rotation: rotation matrix from the frame to the body (3, 3).

        Returns:
            The frame, and whether it is new. A new frame is in the model's component set.
        """
        # A frame that would be the body itself is not needed.
        owner = self.frames[body]
        if not position.any() and np.array_equal(rotation, np.eye(3)):
            return owner, False
        frame = PhysicalOffsetFrame(
            name=self.unique("frame", name),
            socket_parent=owner,
            translation=vector(position),
            orientation=angles_of(rotation),
        )
        self.model.add(frame)
        return frame, True


def vector(values: Sequence[float] | Array) -> tuple[float, float, float]:
    """Convert three numbers to floats, without negative zeros.

    Returns:
        The three floats.
    """
    # Adding 0.0 turns -0.0 into 0.0.
    x, y, z = (float(value) + 0.0 for value in values)
    return x, y, z


def angles_of(rotation: Array) -> tuple[float, float, float]:
    """Return the body-fixed X-Y-Z angles of a rotation matrix (3, 3), exact near 90 degrees also.

    The third angle is computed first and the first one from what remains, so that rounding of one
    is made good by the other where the second angle is near 90 degrees.

    Returns:
        The three angles, rad.
    """
    # The arcsine of one entry would lose half of the digits near 90 degrees.
    y_angle = np.arctan2(rotation[0, 2], np.hypot(rotation[0, 0], rotation[0, 1]))
    z_angle = np.arctan2(-rotation[0, 1], rotation[0, 0])
    x_rotation = rotation @ rotation_xyz(np.array((0.0, y_angle, z_angle))).T
    x_angle = np.arctan2(x_rotation[2, 1], x_rotation[1, 1])
    return vector((x_angle, y_angle, z_angle))


def quaternion_matrix(quaternion: Array) -> Array:
    """Return the rotation matrix (3, 3) of one of MuJoCo's quaternions (w, x, y, z)."""
    return rotation_of(np.asarray(quaternion, dtype=float))


def default_name(path: Path) -> str:
    """Return the name of the files of a conversion."""
    return path.stem
