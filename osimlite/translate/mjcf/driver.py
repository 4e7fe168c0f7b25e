"""Driver: a model in MuJoCo with OpenSim's own laws.

MuJoCo has neither splines nor the forces of OpenSim, but it has callbacks. A `Driver` writes the
exact functions of the coordinates into MuJoCo's equalities before every step, computes the
generalized forces of all muscles, contacts, limits, springs and bushings at every evaluation,
including wrapped paths and elastic tendons, and lets MuJoCo integrate their states with its own::

    driver = osimlite.mjcf.Driver(osimlite.read("gait.osim")) driver.data.actuator("soleus_r").ctrl
    = 0.3 driver.step(1000) driver.data.body("pelvis").xpos
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.require import require
from osimlite.base.text import suggest_or_list
from osimlite.errors import SettingError
from osimlite.mechanics.kernels.layout import ITEM, MODEL
from osimlite.mechanics.multibody.functions import ConstantValue, Polynomial, SmoothFunction
from osimlite.mechanics.multibody.mechanism import Values
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.elements import force_elements
from osimlite.simulation.robot.couplings import find_coordinate_drivers
from osimlite.simulation.robot.robot import principal_axes
from osimlite.simulation.system import System
from osimlite.translate.mjcf.draft import Version
from osimlite.translate.mjcf.driven import STATES_ACTUATOR
from osimlite.translate.mjcf.export import to_mjcf

Integrator = Literal["Euler", "RK4", "implicit", "implicitfast"]


class _FollowerJoint(NamedTuple):
    """Joint that follows other joints or time.

    Attributes:
        equality: index of the equality.
        address: address of the joint in qpos.
        dof: address of the joint in qvel.
        addresses: addresses of the leaders in qpos; empty for a function of time.
        leaders: addresses of the leaders in qvel.
        function: exact function.
        fitted: whether the equality of the file only approximates the function.
    """

    equality: int
    address: int
    dof: int
    addresses: list[int]
    leaders: list[int]
    function: SmoothFunction
    fitted: bool

    def evaluate(self, data: Any) -> tuple[float, Array, float, float]:
        """Evaluate the function in a state.

        Args:
            data: MuJoCo's data.

        Returns:
            Value, gradient by the leaders, rate, and the part of the acceleration from the
            curvature.
        """
        x, rates = (
            (data.qpos[self.addresses], data.qvel[self.leaders])
            if self.leaders
            else (data.time, 1.0)
        )
        value, *derivatives = self.function.evaluate(np.atleast_1d(x))
        (gradient, hessian), rates = map(np.array, derivatives), np.atleast_1d(rates)
        return value, gradient, float(gradient @ rates), float(rates @ hessian @ rates)


class Driver:
    """Model that MuJoCo moves by OpenSim's laws.

    MuJoCo's callbacks are global in a process. They are the driver's while it steps, and are
    restored afterwards.

    Args:
        model: model of OpenSim.
        timestep: time step of MuJoCo (s).
        integrator: integrator of MuJoCo.
        equilibrate: whether muscles start in equilibrium of fibers and tendon.
        file: file that `osimlite translate --driver` wrote, with your additions: a scene, sensors,
            cameras.
        folder: folder of the model file and of the files that it names.
        geometry: further folders for mesh files.

    Attributes:
        mjcf: translation, with the account of what the driver does not compute.
        model: MuJoCo's `MjModel`. `ctrl` of its actuators are controls of the model, which are
            added to those of the model's controllers.
        data: MuJoCo's `MjData`.
        system: forces of the model.

    Raises:
        MissingDependency: mujoco is not installed.
        SettingError: the time step is not positive, or the integrator is unknown.
        ModelError: the model is not a valid mechanism.
        UnsupportedError: a joint or constraint is not supported.
    """

    def __init__(
        self,
        model: Model,
        *,
        timestep: float = 1e-3,
        integrator: Integrator = "RK4",
        equilibrate: bool = False,
        file: str | Path | None = None,
        folder: str | Path | None = None,
        geometry: Sequence[str | Path] = (),
    ) -> None:
        self._mujoco: Any = require("mujoco", extra="mujoco", purpose="the driver of MuJoCo")
        if not 0.0 < timestep < np.inf:
            raise SettingError(f"'timestep' must be a positive number of s, not {timestep:g}")
        if integrator not in get_args(Integrator):
            suggestion = suggest_or_list(integrator, get_args(Integrator))
            raise SettingError(f"MuJoCo has no integrator '{integrator}'{suggestion}")
        version: Version = 3 if self._mujoco.__version__.startswith("3.") else 4
        self.mjcf = to_mjcf(model, mujoco=version, driver=True, folder=folder, geometry=geometry)
        if file is None:
            self.model = self._mujoco.MjModel.from_xml_string(self.mjcf.text, self.mjcf.files)
        else:
            self.model = self._mujoco.MjModel.from_xml_path(str(file))
        self.model.opt.timestep = timestep
        # The driver reads the constraint Jacobian as a full matrix.
        self.model.opt.jacobian = self._mujoco.mjtJacobian.mjJAC_DENSE
        self.model.opt.integrator = getattr(
            self._mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}"
        )
        self.data = self._mujoco.MjData(self.model)
        self._mechanism = mechanism = self.mjcf.robot.mechanism
        # Only ball and free joints have speeds that are not the rates of coordinates.
        self._speeds_differ_from_rates = not all(
            body.mobilizer.speeds_are_rates for body in mechanism.bodies
        )
        self._restore_inertias()
        forces = force_elements(model, mechanism, skip_unsupported=True, folder=folder)
        self.system = System(mechanism, forces)
        self._equilibrate = equilibrate
        self._add_controls()
        self._leading_coordinates = np.array(sorted(self.mjcf.leads), dtype=int)
        leaders = [self.mjcf.leads[index] for index in self._leading_coordinates]
        joints = [self.model.joint(leader.joint) for leader in leaders]
        self._qpos = np.array([joint.qposadr[0] for joint in joints], dtype=int)
        self._dofs = np.array([joint.dofadr[0] for joint in joints], dtype=int)
        self._slopes, self._starts = np.array([leader.line for leader in leaders]).reshape(-1, 2).T
        leading_indices = set(self.mjcf.leads)
        # Coordinates without a joint of their own follow a leading coordinate.
        self._following = {
            k: coupling_driver
            for k, coupling_driver in find_coordinate_drivers(self.mjcf.robot).items()
            if k not in leading_indices
        }
        self._followed = [self._make_follower(name) for name in self.mjcf.followers]
        self._free_dofs = np.setdiff1d(
            np.arange(self.model.nv), [follower.dof for follower in self._followed]
        )
        self._rates: list[float] = []
        self._failure: BaseException | None = None
        self.reset()

    # ------------------------------------------------------------------------------------------------- states
    def reset(self) -> None:
        """Reset to the default pose and to the initial states of the forces."""
        # Without a keyframe in the file, MuJoCo resets to its reference pose.
        self._mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        q, u, _ = self.state()
        y = self.system.state.pack(q.tolist(), u.tolist())
        if self._equilibrate:
            y = self.system.equilibrate_muscles(0.0, y)
        if self._states >= 0:
            self.data.act[:] = self.system.state.auxiliary(y)
        self.set_state(q, u)

    def forward(self) -> None:
        """Compute all results of the present state without a step, as `mj_forward` does.

        Raises:
            SimulationError: a force has no value in this state.
        """
        self._update_equalities()
        with self._call_back():
            self._mujoco.mj_forward(self.model, self.data)

    def state(self) -> tuple[Array, Array, Array]:
        """Return the state of the model.

        Returns:
            Values (n,) and generalized speeds (n,) of the coordinates, and the auxiliary states of
            the forces (z,).
        """
        return (*self._read_coordinates(self.data)[:2], np.array(self.data.act))

    def set_state(self, q: Values, u: Values) -> None:
        """Set all joints to given coordinates and generalized speeds.

        Args:
            q: values of the coordinates (n,) (rad or m).
            u: generalized speeds (n,).
        """
        mechanism, robot = self._mechanism, self.mjcf.robot
        rates = mechanism.coordinate_rates(q, u)
        for name, value in self.mjcf.joint_values(q).items():
            self.data.joint(name).qpos[0] = value
        for joint, rate in zip(robot.moving, robot.joint_jacobian(q) @ rates, strict=True):
            self.data.joint(joint.name).qvel[0] = rate
        # Joints of coordinates are linear functions of them.
        self.data.qvel[self._dofs] = rates[self._leading_coordinates] * self._slopes
        self.forward()

    def step(self, count: int = 1) -> None:
        """Simulate some time steps.

        Args:
            count: number of steps.

        Raises:
            SettingError: the number is negative.
            SimulationError: a force has no value in a state that is reached.
        """
        if count < 0:
            raise SettingError(f"the number of steps must be at least 0, not {count}")
        with self._call_back():
            for _ in range(count):
                self._mujoco.mj_step(self.model, self.data)
                self._update_equalities()

    # ---------------------------------------------------------------------------------------------- callbacks
    @contextmanager
    def _call_back(self) -> Iterator[None]:
        """Let MuJoCo call the driver for forces and activations within a `with` block."""
        mujoco = self._mujoco
        previous = mujoco.get_mjcb_control(), mujoco.get_mjcb_act_dyn()

        def apply_driver_forces(model: Any, data: Any) -> None:
            # Callbacks of other code continue to act.
            if previous[0] is not None:
                previous[0](model, data)
            self._apply_forces(data)

        mujoco.set_mjcb_control(apply_driver_forces)
        mujoco.set_mjcb_act_dyn(self._compute_activation_rates)
        try:
            yield
        finally:
            mujoco.set_mjcb_control(previous[0])
            mujoco.set_mjcb_act_dyn(previous[1])
        if self._failure is not None:
            failure, self._failure = self._failure, None
            raise failure

    def _apply_forces(self, data: Any) -> None:
        """Add the generalized forces of the model to MuJoCo's passive forces.

        MuJoCo calls this function as its callback of controls.
        """
        # After a failure MuJoCo finishes its step without forces.
        if self._failure is not None or not self.model.nv:
            return
        try:
            q, u, slopes = self._read_coordinates(data)
            state = self.system.state
            if len(self._controls):
                self.system.numbers[self._controls] = data.ctrl[: len(self._controls)]
            row = self.system.compute_applied_forces(
                data.time, state.pack(q.tolist(), u.tolist(), data.act.tolist())
            )
        except Exception as failure:
            # An exception cannot pass through MuJoCo's C code; it is raised after the step.
            self._failure = failure
            return
        count = len(state.order)
        self._rates = row[2 * count :]
        forces = np.zeros(len(q))
        forces[list(state.order)] = row[count : 2 * count]
        # Generalized forces of speeds are transformed to those of coordinate rates: Q = N^-T f.
        if self._speeds_differ_from_rates:
            forces[:] = np.linalg.solve(self._mechanism.rate_matrix(q).T, forces)
        for coordinate, (leader, slope) in slopes.items():
            # The force of a follower acts on its leader by the chain rule.
            forces[leader] += slope * forces[coordinate]
        # Passive forces: MuJoCo adds them to all others without further processing.
        data.qfrc_passive[self._dofs] += forces[self._leading_coordinates] / self._slopes
        self._apply_equality_forces(data)

    def _apply_equality_forces(self, data: Any) -> None:
        """Add the constraint forces of all equalities, computed exactly.

        MuJoCo's own equalities leave 1e-4 of the difference of accelerations, and ignore the
        curvature of the functions. With these forces nothing is left for them but to correct errors
        of position and speed.

        With follower accelerations a = B a_f + c in terms of those of the free joints a_f, and
        further rows J a = a_ref, it solves [B' M B, (J B)'; J B, 0] [a_f; l] = [B' (f - M c); a_ref
        - J c].
        """
        if not data.ne:
            return
        # Accelerations are `free_to_all` @ those of the free joints + `prescribed`.
        free_to_all = np.eye(self.model.nv)
        prescribed = np.zeros(self.model.nv)
        for follower in self._followed:
            _, gradient, _, prescribed[follower.dof] = follower.evaluate(data)
            free_to_all[follower.dof, follower.dof] = 0.0
            if follower.leaders:
                free_to_all[follower.dof, follower.leaders] = gradient
        free_to_all = free_to_all[:, self._free_dofs]
        # MuJoCo puts the rows of equalities first, in their order.
        equality_rows = np.searchsorted(
            data.efc_id[: data.ne], [follower_joint.equality for follower_joint in self._followed]
        )
        other_rows = np.setdiff1d(np.arange(data.ne), equality_rows)
        jacobian = data.efc_J.reshape(-1, self.model.nv)[other_rows]
        applied = data.qfrc_passive - data.qfrc_bias + data.qfrc_applied
        # Also without free joints the product has as many columns as there are joints.
        columns = [self._multiply_mass(data, column) for column in free_to_all.T.copy()]
        inertia = np.array(columns).reshape(-1, self.model.nv) @ free_to_all
        right_side = np.append(
            free_to_all.T @ (applied - self._multiply_mass(data, prescribed)),
            data.efc_aref[other_rows] - jacobian @ prescribed,
        )
        free_jacobian = jacobian @ free_to_all
        matrix = np.block(
            [
                [inertia, free_jacobian.T],
                [free_jacobian, np.zeros((len(other_rows), len(other_rows)))],
            ]
        )
        result = (
            np.linalg.lstsq(matrix, right_side)[0]
            if len(other_rows)
            else np.linalg.solve(matrix, right_side)
        )
        accelerations = free_to_all @ result[: len(self._free_dofs)] + prescribed
        # Forces that produce exactly these accelerations.
        data.qfrc_passive += self._multiply_mass(data, accelerations) - applied
        # `_update_equalities` writes for the start of a step; within the step fitted equalities have no
        # errors to correct.
        for row_index, follower_joint in zip(equality_rows, self._followed, strict=True):
            correction = 0.0 if follower_joint.fitted else data.efc_aref[row_index]
            data.efc_aref[row_index] = (
                correction
                + (prescribed if len(follower_joint.leaders) == 1 else accelerations)[
                    follower_joint.dof
                ]
            )

    def _multiply_mass(self, data: Any, accelerations: Array) -> Array:
        """Return the product of the mass matrix and accelerations (nv,)."""
        forces = np.empty(self.model.nv)
        self._mujoco.mj_mulM(self.model, data, forces, accelerations)
        return forces

    def _compute_activation_rates(self, _: Any, data: Any, actuator: int) -> float:
        """Return the rates of the auxiliary states.

        `_apply_forces` has computed them at the same evaluation.
        """
        # MuJoCo expects the rate of a single state as the return value.
        if len(self._rates) == 1:
            return self._rates[0]
        if actuator == self._states:
            data.act_dot[:] = self._rates
        return 0.0

    def _read_coordinates(self, data: Any) -> tuple[Array, Array, dict[int, tuple[int, float]]]:
        """Read the coordinates of the model from MuJoCo's joints.

        Args:
            data: MuJoCo's data.

        Returns:
            Values (n,), generalized speeds (n,), and for each coordinate without a joint the
            coordinate that leads it and the derivative by it.
        """
        q = self._mechanism.values({})
        rates = np.zeros(len(self._mechanism.coordinates))
        q[self._leading_coordinates] = (data.qpos[self._qpos] - self._starts) / self._slopes
        rates[self._leading_coordinates] = data.qvel[self._dofs] / self._slopes
        slopes = {}
        for coordinate, (leader, function) in self._following.items():
            q[coordinate], gradient, _ = function.evaluate(q[[0 if leader is None else leader]])
            if leader is not None:
                slopes[coordinate] = leader, float(gradient[0])
                rates[coordinate] = gradient[0] * rates[leader]
        return (
            q,
            self._mechanism.speeds_from_rates(q, rates)
            if self._speeds_differ_from_rates
            else rates,
            slopes,
        )

    # ----------------------------------------------------------------------------------------------- equalities
    def _update_equalities(self) -> None:
        """Move followers to their exact values, and update the equalities.

        These get the value, the slope and the curvature of the exact functions.
        """
        for follower in self._followed:
            if follower.fitted:
                value, gradient, rate, _ = follower.evaluate(self.data)
                self.data.qpos[follower.address], self.data.qvel[follower.dof] = value, rate
                polynomial = np.zeros(5)
                polynomial[0] = value
                if len(follower.leaders) == 1:
                    x = self.data.qpos[follower.addresses[0]]
                    slope = gradient[0]
                    curvature = 0.5 * follower.function.evaluate((x,))[2][0][0]
                    polynomial[:3] = (
                        value + x * (curvature * x - slope),
                        slope - 2.0 * curvature * x,
                        curvature,
                    )
                self.model.eq_data[follower.equality, :5] = polynomial

    # ------------------------------------------------------------------------------------------------ preparation
    def _restore_inertias(self) -> None:
        """Set the inertias that MuJoCo rejects in a file but accepts in a compiled model."""
        for record in self.mjcf.fidelity:
            if record.kind == "inertia":
                link, _ = self.mjcf.robot.link_of[record.component]
                self.model.body(link.name).inertia[:] = principal_axes(link.inertia)[0]
        self._mujoco.mj_setConst(self.model, self.data)

    def _make_follower(self, name: str) -> _FollowerJoint:
        """Return the addresses and the function of a joint that follows others."""
        follower = self.mjcf.followers[name]
        joint = self.model.joint(name)
        names = follower.arguments or (() if follower.leader is None else (follower.leader,))
        leaders = [self.model.joint(leader_name) for leader_name in names]
        return _FollowerJoint(
            self.model.equality(name).id,
            joint.qposadr[0],
            joint.dofadr[0],
            [leader.qposadr[0] for leader in leaders],
            [leader.dofadr[0] for leader in leaders],
            follower.function or Polynomial(follower.polynomial[::-1]),
            follower.function is not None,
        )

    def _add_controls(self) -> None:
        """Add MuJoCo's controls to those of the model, and find where the forces have their values."""
        controls = self.system.forces.controls
        # Two sets of controls with different values reveal where the values are stored.
        zero_controls, unit_controls = (
            controls.add_functions(dict.fromkeys(controls.names, ConstantValue(value)))
            for value in (0.0, 1.0)
        )
        self.system.set_controls(zero_controls)
        controls_offset = self.system.structure[MODEL.CONTROLS]
        first_value = (
            self.system.structure[controls_offset + ITEM.NUMBERS] if controls_offset else 0
        )
        self._controls = first_value + np.flatnonzero(
            np.array(zero_controls.make_record()[1]) != np.array(unit_controls.make_record()[1])
        )
        names = [self.model.actuator(k).name for k in range(self.model.nu)]
        self._states = names.index(STATES_ACTUATOR) if STATES_ACTUATOR in names else -1
