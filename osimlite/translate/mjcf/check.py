"""Comparison of a MuJoCo file, of any origin, with a model: paths, muscles and bodies.

Muscles and bodies are matched by name, joints by the names of coordinates. In each of many random
poses, joints have the values of the coordinates; joints that follow others by an equality have the
values that it gives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from osimlite.base.records import dataclass
from osimlite.base.require import require
from osimlite.base.text import format_json
from osimlite.errors import ModelError, OsimliteError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle
from osimlite.simulation.paths import Paths
from osimlite.simulation.robot.names import joint_names
from osimlite.translate.fidelity import Error
from osimlite.translate.mjcf.isometric import compute_isometric_tension
from osimlite.translate.mjcf.muscles import Curves
from osimlite.translate.mjcf.poses import draw_poses, list_free_coordinates, measure_arm_errors
from osimlite.translate.mjcf.warnings import collect_warnings

MAX_FOLLOWER_CHAIN = 4
"""Longest chain of joints that follow one another; the equalities are applied this many times."""


@dataclass(frozen=True)
class MuscleCheck:
    """Errors of a muscle, or of another force along a path.

    Attributes:
        name: name of the muscle.
        length: error of the path length (m).
        arms: errors of the moment arms by coordinate (m for rotations, 1 for translations).
        force: error of the isometric force at full activation over the maximum isometric force;
            None without a muscle.
        fiber: optimal fiber length that the file implies, over that of the model.
        tendon: tendon slack length that the file implies, minus that of the model (m).
    """

    name: str
    length: Error
    arms: Mapping[str, Error]
    force: Error | None = None
    fiber: float | None = None
    tendon: float | None = None

    @property
    def worst_arm(self) -> Error:
        """Moment arm error with the largest root mean square."""
        return max(self.arms.values(), key=lambda error: error.rms, default=Error(0.0, 0.0, "m"))


@dataclass(frozen=True)
class Check:
    """Errors of a file.

    Attributes:
        muscles: errors of the muscles that both have.
        missing: names of forces along paths that the file lacks.
        coordinates: names of free coordinates that the file has no joint for.
        bodies: error of the positions of bodies (m), after moving all bodies of each pose onto the
            model's rigidly; None with fewer than three common bodies.
    """

    muscles: tuple[MuscleCheck, ...]
    missing: tuple[str, ...] = ()
    coordinates: tuple[str, ...] = ()
    bodies: Error | None = None

    def to_json(self) -> str:
        """Return all numbers as JSON text."""
        return format_json(_convert_to_data(asdict(self)))


def check_mjcf(model: Model, file: str | Path, *, poses: int = 50, seed: int = 7) -> Check:
    """Compare a MuJoCo file with the model from which it was made.

    Args:
        model: model of OpenSim.
        file: MJCF file, or any other file that MuJoCo loads.
        poses: number of random poses, uniform over the ranges of all coordinates.
        seed: seed of the poses.

    Returns:
        Errors of the muscles and of the positions of bodies, and what the file lacks.

    Raises:
        MissingDependency: mujoco is not installed.
        OsimliteError: MuJoCo cannot load the file.
        ModelError: the model has no muscles, or none in common with the file.
    """
    mujoco: Any = require("mujoco", extra="mujoco", purpose="the check of a file of MuJoCo's")
    with collect_warnings(mujoco):
        return _compare(mujoco, model, file, poses, seed)


def _compare(mujoco: Any, model: Model, file: str | Path, poses: int, seed: int) -> Check:
    """Compare a MuJoCo file with a model; for the arguments see :func:`check_mjcf`.

    Returns:
        Errors of the muscles and of the positions of bodies, and what the file lacks.

    Raises:
        OsimliteError: MuJoCo cannot load the file.
        ModelError: the model has no muscles or other paths, or none in common with the file.
    """
    try:
        mj_model = mujoco.MjModel.from_xml_path(str(file))
    except ValueError as error:
        raise OsimliteError(f"MuJoCo does not load it: {error}", file=str(file)) from error
    paths = Paths(model)
    if not paths.names:
        raise ModelError(f"'{model.name}' has no muscles or other paths to compare")
    mujoco_model = _MujocoModel(mujoco, mj_model, paths)
    # MuJoCo knows names, not paths.
    owners = {name.rpartition("/")[2]: name for name in paths.names}
    tendons = {
        name: index for name in owners if (index := mujoco_model.find_tendon(name)) is not None
    }
    if not tendons:
        raise ModelError(
            f"the file has no tendon or actuator with the name of a muscle of the model, such as '{next(iter(owners))}'",
            file=str(file),
        )
    sampled_poses, samples_by_path = draw_poses(paths, poses, seed)
    lengths, moment_arms, body_positions = zip(
        *(mujoco_model.measure_tendons(q) for q in sampled_poses.q), strict=True
    )
    result = []
    for name, tendon in tendons.items():
        path_samples = samples_by_path[owners[name]]
        length_errors = np.array(lengths)[:, tendon] - path_samples.lengths
        arm_errors = measure_arm_errors(
            paths.mechanism, np.array(moment_arms)[:, tendon], path_samples
        )
        by_coordinate = {mujoco_model.names[index]: error for index, error in arm_errors.items()}
        muscle = model.tree().by_path[owners[name]]
        strength_errors = (
            mujoco_model.measure_strength(name, muscle, path_samples.lengths)
            if isinstance(muscle, Muscle)
            else {}
        )
        result.append(
            MuscleCheck(name, Error.measure(length_errors, "m"), by_coordinate, **strength_errors)
        )
    return Check(
        tuple(result),
        tuple(name for name in owners if name not in tendons),
        tuple(
            mujoco_model.names[index]
            for index in mujoco_model.free
            if index not in mujoco_model.joints
        ),
        _compare_bodies(mujoco_model, sampled_poses.origins, body_positions),
    )


def _convert_to_data(value: Any) -> Any:
    """Return plain data in which errors have named fields; JSON would write them as lists."""
    match value:
        case Error():
            return value._asdict()
        case dict():
            return {name: _convert_to_data(member) for name, member in value.items()}
        case tuple() | list():
            return [_convert_to_data(member) for member in value]
    return value


class _MujocoModel:
    """Compiled model of MuJoCo that is posed by the coordinates of a model of OpenSim."""

    def __init__(self, mujoco: Any, mj_model: Any, paths: Paths) -> None:
        self.mujoco = mujoco
        self.model = mj_model
        self.data = mujoco.MjData(mj_model)
        self.names = joint_names(paths.mechanism)
        self.free = list_free_coordinates(paths.mechanism)
        object_types = mujoco.mjtObj
        joints = (
            (k, mujoco.mj_name2id(mj_model, object_types.mjOBJ_JOINT, name))
            for k, name in enumerate(self.names)
        )
        self.joints = {k: joint for k, joint in joints if joint >= 0}
        bodies = ((k, body.name) for k, body in enumerate(paths.mechanism.bodies))
        matched = (
            (k, mujoco.mj_name2id(mj_model, object_types.mjOBJ_BODY, name)) for k, name in bodies
        )
        self.bodies = {k: body for k, body in matched if body >= 0}
        self.followers = [
            (int(mj_model.eq_obj1id[k]), int(mj_model.eq_obj2id[k]), mj_model.eq_data[k, :5])
            for k in range(mj_model.neq)
            if mj_model.eq_type[k] == mujoco.mjtEq.mjEQ_JOINT and mj_model.eq_active0[k]
        ]

    def find_tendon(self, name: str) -> int | None:
        """Return the index of the tendon of an actuator, or of the tendon, with a name; or None."""
        object_types = self.mujoco.mjtObj
        actuator = self.mujoco.mj_name2id(self.model, object_types.mjOBJ_ACTUATOR, name)
        if (
            actuator >= 0
            and self.model.actuator_trntype[actuator] == self.mujoco.mjtTrn.mjTRN_TENDON
        ):
            return int(self.model.actuator_trnid[actuator, 0])
        tendon = self.mujoco.mj_name2id(self.model, object_types.mjOBJ_TENDON, name)
        return tendon if tendon >= 0 else None

    def measure_tendons(self, q: Array) -> tuple[Array, Array, Array]:
        """Pose the model, and measure its tendons and bodies.

        Args:
            q: values of the coordinates (n,).

        Returns:
            Lengths of all tendons (T,) (m), moment arms about the free coordinates (T, m), and
            positions of the matched bodies (b, 3) (m).
        """
        model, data = self.model, self.data
        # Joints that the model does not know stay in their reference pose.
        data.qpos[:] = model.qpos0
        rates = np.zeros((len(self.free), model.nv))
        for index, joint in self.joints.items():
            data.qpos[model.jnt_qposadr[joint]] = q[index]
            if index in self.free:
                rates[self.free.index(index), model.jnt_dofadr[joint]] = 1.0
        # Each round makes one more link of a chain of followers right.
        for _ in range(MAX_FOLLOWER_CHAIN):
            for joint, leader, polynomial in self.followers:
                address = model.jnt_qposadr[joint]
                dof = model.jnt_dofadr[joint]
                value = (
                    0.0
                    if leader < 0
                    else data.qpos[model.jnt_qposadr[leader]]
                    - model.qpos0[model.jnt_qposadr[leader]]
                )
                data.qpos[address] = model.qpos0[address] + polyval(value, polynomial)
                if leader >= 0:
                    rates[:, dof] = (
                        polyval(value, polyder(polynomial)) * rates[:, model.jnt_dofadr[leader]]
                    )
        arms = np.empty((model.ntendon, len(self.free)))
        # MuJoCo computes the rates of tendons from speeds, so that each coordinate gets a unit
        # speed.
        for column, rate in enumerate(rates):
            data.qvel[:] = rate
            self.mujoco.mj_fwdPosition(model, data)
            self.mujoco.mj_fwdVelocity(model, data)
            # OpenSim's moment arm is minus the change of length per change of the coordinate.
            arms[:, column] = -data.ten_velocity
        return data.ten_length.copy(), arms, data.xpos[list(self.bodies.values())].copy()

    def measure_strength(self, name: str, muscle: Muscle, lengths: Array) -> dict[str, Any]:
        """Compare the isometric force of a muscle at full activation.

        Args:
            name: name of the actuator.
            muscle: muscle of the model.
            lengths: lengths of its path (L,) (m).

        Returns:
            Fields `force`, `fiber` and `tendon` of a :class:`MuscleCheck`; empty without a muscle
            in the file.
        """
        actuator = self.mujoco.mj_name2id(self.model, self.mujoco.mjtObj.mjOBJ_ACTUATOR, name)
        if (
            actuator < 0
            or self.model.actuator_gaintype[actuator] != self.mujoco.mjtGain.mjGAIN_MUSCLE
        ):
            return {}
        gain, bias = (
            row[actuator].copy()
            for row in (self.model.actuator_gainprm, self.model.actuator_biasprm)
        )
        # A negative force means MuJoCo's default: scale over the acceleration at unit force.
        if gain[2] < 0.0:
            gain[2] = gain[3] / self.model.actuator_acc0[actuator]
        curves = Curves.read(self.model.actuator_lengthrange[actuator], gain, bias)
        sorted_lengths = np.sort(lengths)
        (tensions,) = compute_isometric_tension(muscle, sorted_lengths, (1.0,))
        force_errors = (curves.compute_tension(sorted_lengths, 1.0) - tensions)[
            np.isfinite(tensions)
        ] / muscle.max_isometric_force
        # MuJoCo's fibers lie along the tendon.
        projected_fiber = muscle.optimal_fiber_length * np.cos(muscle.pennation_angle_at_optimal)
        return {
            "force": Error.measure(force_errors, "Fmax") if len(force_errors) else None,
            "fiber": float(curves.fiber / projected_fiber),
            "tendon": float(curves.tendon - muscle.tendon_slack_length),
        }


def _compare_bodies(
    mujoco_model: _MujocoModel, origins: Array, positions: Sequence[Array]
) -> Error | None:
    """Return the error of body positions after the best rigid motion in each pose.

    The rotation is computed by Kabsch's algorithm.
    """
    # Fewer than three points do not determine a rigid motion.
    if len(mujoco_model.bodies) < 3:
        return None
    distances = []
    for pose, result in enumerate(positions):
        expected = origins[list(mujoco_model.bodies), pose]
        measured_offsets, expected_offsets = result - result.mean(0), expected - expected.mean(0)
        left_vectors, _, right_vectors = np.linalg.svd(measured_offsets.T @ expected_offsets)
        # The sign avoids a reflection.
        flip = np.diag((1.0, 1.0, np.sign(np.linalg.det(left_vectors @ right_vectors))))
        distances.append(
            np.linalg.norm(
                measured_offsets @ left_vectors @ flip @ right_vectors - expected_offsets, axis=1
            )
        )
    return Error.measure(np.concatenate(distances), "m")
