"""Comparison of a converted model with MuJoCo, in osimlite and in OpenSim."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

# OpenSim's wheel contains a CasADi, which cannot be loaded after another one. Import OpenSim here,
# so that it is loaded while tests are collected, before any of them runs.
with contextlib.suppress(ImportError):
    import opensim  # noqa: F401

import osimlite
from osimlite.mechanics.multibody.spatial import Array
from osimlite.translate.mjcf_import.convert import Osim


def random_qpos(model: Any, count: int, seed: int = 0) -> Iterator[Array]:
    """Yield random poses of MuJoCo.

    Args:
        model: MuJoCo's model.
        count: number of poses.
        seed: seed of the random numbers.
    """
    random = np.random.default_rng(seed)
    for _ in range(count):
        qpos = model.qpos0 + random.uniform(-1.0, 1.0, model.nq)
        mujoco.mj_normalizeQuat(model, qpos)
        yield qpos


def pose_errors(path: Path, made: Osim, count: int) -> float:
    """Return the largest difference of positions (m) and of entries of rotation matrices of bodies."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data, mechanism = mujoco.MjData(model), osimlite.mechanism(made.model)
    worst = 0.0
    for qpos in random_qpos(model, count):
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        poses = mechanism.body_transforms(made.coordinates.values(qpos))
        for body, name in body_names(model, made):
            worst = max(worst, float(np.abs(poses[name][:3, 3] - data.xpos[body]).max()))
            turned = data.xmat[body].reshape(3, 3)
            worst = max(worst, float(np.abs(poses[name][:3, :3] - turned).max()))
    return worst


def body_names(model: Any, made: Osim) -> list[tuple[int, str]]:
    """Return the index of each body of MuJoCo except the world, and the name of the OpenSim body."""
    result = []
    for body in range(1, model.nbody):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body) or f"body_{body}"
        result.append((body, made.fidelity.translated[f"/body/{name}"].removeprefix("body ")))
    return result


def mass_matrix(model: Any, data: Any) -> Array:
    """Return MuJoCo's mass matrix (nv, nv) in the pose of the data."""
    matrix = np.zeros((model.nv, model.nv))
    for row, unit in zip(matrix, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, data, row, unit)
    return matrix


def speed_jacobian(model: Any, made: Osim, qpos: Array) -> Array:
    """Return MuJoCo's velocities (nv, n) for unit rates of the coordinates, without rotors.

    Ball and free joints are differentiated by central differences of the orientation.
    """
    names = made.coordinates.names()
    values = made.coordinates.values(qpos)
    jacobian = np.zeros((model.nv, len(names)))
    for joint, (kind, _, _, own) in enumerate(made.coordinates.joints):
        dof = model.jnt_dofadr[joint]
        columns = [names.index(name) for name in own]
        if kind in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
            jacobian[dof, columns[0]] = 1.0
            continue
        turns = slice(dof, dof + 3)
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            jacobian[dof : dof + 3, columns[3:]] = np.eye(3)
            turns = slice(dof + 3, dof + 6)
        angles = [values[name] for name in own[:3]]
        rest = made.coordinates.joints[joint].default_rotation if len(own) == 6 else np.eye(3)
        jacobian[turns, columns[:3]] = rest.T @ body_rates(angles)
    return jacobian


def body_rates(angles: list[float]) -> Array:
    """Return the matrix (3, 3) from the rates of body-fixed X-Y-Z angles to the angular velocity in the body."""
    _, y, z = angles
    return np.array(
        (
            (np.cos(y) * np.cos(z), np.sin(z), 0.0),
            (-np.cos(y) * np.sin(z), np.cos(z), 0.0),
            (np.sin(y), 0.0, 1.0),
        )
    )


def projection(made: Osim, order: list[str]) -> Array:
    """Return the rates (n, m) of all coordinates for unit rates of the coordinates without rotors."""
    names = made.coordinates.names()
    matrix = np.zeros((len(order), len(names)))
    for row, name in enumerate(order):
        matrix[row, names.index(made.coordinates.rotors.get(name, name))] = 1.0
    return matrix


def mass_errors(path: Path, made: Osim, count: int) -> float:
    """Return the largest relative difference of the mass matrices, including rotors."""
    model = mujoco.MjModel.from_xml_path(str(path))
    if not made.coordinates.rotors:
        model.dof_armature[:] = 0.0
    for joint in range(model.njnt):
        # OpenSim's model has the armature of hinges and slides only.
        if int(model.jnt_type[joint]) < int(mujoco.mjtJoint.mjJNT_SLIDE):
            first = model.jnt_dofadr[joint]
            model.dof_armature[first : first + 6 - 3 * int(model.jnt_type[joint])] = 0.0
    data, mechanism = mujoco.MjData(model), osimlite.mechanism(made.model)
    # Free bodies have a constant inertia, which the compiler computed with the armature.
    mujoco.mj_setConst(model, data)
    across = projection(made, list(mechanism.coordinate_names))
    worst = 0.0
    for qpos in random_qpos(model, count):
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        jacobian = speed_jacobian(model, made, qpos)
        theirs = jacobian.T @ mass_matrix(model, data) @ jacobian
        ours = across.T @ mechanism.mass_matrix(made.coordinates.values(qpos)) @ across
        worst = max(worst, float(np.abs(ours - theirs).max() / np.abs(theirs).max()))
    return worst


class LiveModel:
    """Converted model in OpenSim, posed by coordinate values."""

    def __init__(self, made: Osim, folder: Path) -> None:
        import opensim

        opensim.Logger.setLevelString("error")
        files = made.write(folder)
        opensim.ModelVisualizer.addDirToGeometrySearchPaths(str(folder / "Geometry"))
        self.opensim, self.model = opensim, opensim.Model(str(files[0]))
        self.state = self.model.initSystem()
        self.coordinates = {
            coordinate.getName(): coordinate for coordinate in self.model.getCoordinateSet()
        }

    def place(self, values: dict[str, float]) -> None:
        """Set the coordinates, without assembly."""
        for name, value in values.items():
            coordinate = self.coordinates[name]
            coordinate.setLocked(self.state, False)
            coordinate.setClamped(self.state, False)
            coordinate.setValue(self.state, value, False)
        self.model.realizePosition(self.state)

    def body(self, name: str) -> tuple[Array, Array]:
        """Find the pose of a body in ground.

        Returns:
            Position (3,) and rotation matrix (3, 3).
        """
        pose = self.model.getBodySet().get(name).getTransformInGround(self.state)
        position = pose.p()
        rotation = pose.R()
        return (
            np.array([position.get(k) for k in range(3)]),
            np.array([[rotation.get(i, j) for j in range(3)] for i in range(3)]),
        )

    def mass_matrix(self) -> Array:
        """Return the mass matrix in the order of OpenSim's mobilities."""
        matrix = self.opensim.Matrix()
        self.model.getMatterSubsystem().calcM(self.state, matrix)
        count = matrix.nrow()
        return np.array([[matrix.get(i, j) for j in range(count)] for i in range(count)])

    def mobilities(self) -> list[str]:
        """Return the coordinate names in the order of OpenSim's mobilities."""
        result = {}
        for coordinate in self.coordinates.values():
            coordinate.setSpeedValue(self.state, 0.0)
        for name, coordinate in self.coordinates.items():
            coordinate.setSpeedValue(self.state, 1.0)
            speeds = self.state.getU()
            result[next(k for k in range(speeds.size()) if speeds.get(k))] = name
            coordinate.setSpeedValue(self.state, 0.0)
        return [result[k] for k in sorted(result)]


def actuator_torques(path: Path, qpos: Array, qvel: Array, control: float, name: str) -> Array:
    """Return MuJoCo's generalized forces (nv,) of one actuator.

    Args:
        path: MJCF file.
        qpos: positions.
        qvel: velocities.
        control: control and activation of the actuator.
        name: name of the actuator.
    """
    model = mujoco.MjModel.from_xml_path(str(path))
    for actuator in range(model.nu):
        if model.actuator(actuator).name != name:
            # Without gain and bias, an actuator has no force.
            model.actuator_gainprm[actuator] = model.actuator_biasprm[actuator] = 0.0
            model.actuator_gaintype[actuator] = mujoco.mjtGain.mjGAIN_FIXED
            model.actuator_biastype[actuator] = mujoco.mjtBias.mjBIAS_NONE
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:], data.act[:] = qpos, qvel, control, control
    mujoco.mj_forward(model, data)
    return data.qfrc_actuator.copy()


class LiveForces:
    """Generalized forces of single forces in OpenSim, in a model of hinges and slides without constraints."""

    def __init__(self, live: LiveModel, made: Osim) -> None:
        self.live, self.made = live, made
        order = live.mobilities()
        self.names = made.coordinates.names()
        self.order = [order.index(name) for name in self.names]

    def accelerations(self, qpos: Array, qvel: Array, control: float, names: list[str]) -> Array:
        """Return the accelerations (n,) when only forces of these names act."""
        live = self.live
        live.place(self.made.coordinates.values(qpos))
        for name, speed in zip(self.names, qvel, strict=True):
            live.coordinates[name].setSpeedValue(live.state, speed)
        for force in live.model.getForceSet():
            force.setAppliesForce(live.state, force.getName() in names)
        for muscle in live.model.getMuscles():
            if muscle.getConcreteClassName() == "Millard2012EquilibriumMuscle":
                muscle.setActivation(live.state, control)
        live.model.realizeVelocity(live.state)
        controls = live.opensim.Vector(live.model.getNumControls(), control)
        live.model.setControls(live.state, controls)
        live.model.realizeAcceleration(live.state)
        return np.array(
            [live.coordinates[name].getAccelerationValue(live.state) for name in self.names]
        )

    def torques(self, qpos: Array, qvel: Array, control: float, names: list[str]) -> Array:
        """Return the generalized forces (n,) of forces with these names."""
        with_them = self.accelerations(qpos, qvel, control, names)
        without = self.accelerations(qpos, qvel, control, [])
        masses = self.live.mass_matrix()[np.ix_(self.order, self.order)]
        return masses @ (with_them - without)
