"""Values of OpenSim's coordinates in a pose of MuJoCo."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.spatial import Array
from osimlite.translate.mjcf_import.draft import angles_of, quaternion_matrix
from osimlite.translate.mjcf_import.joints import BALL, FREE


class JointRecord(NamedTuple):
    """Joint of MuJoCo."""

    kind: int  # mjtJoint
    address: int  # offset of the first number of the joint in qpos
    default_rotation: Array  # orientation (3, 3) of the body in the file, for a free joint
    names: tuple[str, ...]  # names of the coordinates of the joint


@dataclass(frozen=True, eq=False)
class CoordinateMap:
    """Map from MuJoCo's positions to values of coordinates.

    Attributes:
        joints: MuJoCo's joints in their order.
        rotors: name of the coordinate that each rotor follows, by the name of the rotor's
            coordinate.
    """

    joints: tuple[JointRecord, ...]
    rotors: dict[str, str]

    @classmethod
    def build(
        cls, model: Any, coordinates: Sequence[tuple[str, ...]], rotors: dict[str, str]
    ) -> CoordinateMap:
        """Return the map of a compiled model.

        Args:
            model: MuJoCo's compiled model.
            coordinates: names of the coordinates of each joint.
            rotors: coordinates that rotors follow.
        """
        return cls(
            tuple(
                JointRecord(
                    int(model.jnt_type[joint]),
                    int(model.jnt_qposadr[joint]),
                    quaternion_matrix(model.body_quat[model.jnt_bodyid[joint]]),
                    names,
                )
                for joint, names in enumerate(coordinates)
            ),
            rotors,
        )

    def values(self, qpos: Array) -> dict[str, float]:
        """Return the value of each coordinate (rad, m) in a pose of MuJoCo.

        Args:
            qpos: MuJoCo's positions (nq,).

        Returns:
            Values by the names of the coordinates.
        """
        values: dict[str, float] = {}
        for joint_type, address, reference, names in self.joints:
            numbers: Sequence[float]
            if joint_type == FREE:
                rotation = quaternion_matrix(qpos[address + 3 : address + 7])
                numbers = (*angles_of(rotation @ reference.T), *qpos[address : address + 3])
            elif joint_type == BALL:
                numbers = angles_of(quaternion_matrix(qpos[address : address + 4]))
            else:
                numbers = (qpos[address],)
            values.update(zip(names, map(float, numbers), strict=True))
        values.update({rotor: values[name] for rotor, name in self.rotors.items()})
        return values

    def names(self) -> list[str]:
        """Return the names of the coordinates in MuJoCo's order, without rotors."""
        return [name for joint in self.joints for name in joint.names]


def tabulate_values(map_: CoordinateMap, poses: Array) -> Array:
    """Return the values (P, n) of the coordinates of a map in poses (P, nq), rotors left out."""
    names = map_.names()
    rows = [map_.values(pose) for pose in poses]
    return np.array([[row[name] for name in names] for row in rows])
