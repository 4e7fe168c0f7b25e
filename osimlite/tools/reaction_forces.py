"""Forces of constraints and wrenches at joints along a motion."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from typing import Any

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.constrained_dynamics import INDEPENDENCE, evaluate_constraints
from osimlite.mechanics.kernels.layout import LINK_WORK, MODEL
from osimlite.mechanics.kernels.points import link_work
from osimlite.mechanics.multibody.body_constraints import find_carrier
from osimlite.mechanics.multibody.constraints import ConstraintEquations, Coupler
from osimlite.mechanics.multibody.dynamics import mass_matrix
from osimlite.mechanics.multibody.kinematics import MechanismKinematics
from osimlite.mechanics.multibody.linear import solve_least_norm
from osimlite.mechanics.multibody.links import Link, LinkMap, LinkTree, Placement
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.parts import GROUND
from osimlite.mechanics.multibody.program import PackedMechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema import sets as schema
from osimlite.schema.joints import Joint
from osimlite.simulation.constrained import select_constraints
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.controls import Controls
from osimlite.simulation.link_motion import LinkMotion
from osimlite.simulation.system import System
from osimlite.tools.motion import Motion


@dataclass(frozen=True, eq=False)
class ConstraintForces:
    """Forces of the constraints of a mechanism at one state."""

    state: MechanismKinematics  # kinematics of the state
    # Constraints, each with its multipliers (m,), one for each equation.
    multipliers: list[tuple[ConstraintEquations, Array]]

    @classmethod
    def compute_along(cls, motion: Motion) -> Iterator[ConstraintForces]:
        """Yield the constraint forces at every time of a motion.

        The multipliers λ are those for which Gᵀ λ gives the accelerations of the motion. If several
        λ do so, for example with redundant constraints, the shortest is taken, as in Simbody.
        """
        mechanism, system = motion.mechanism, motion.system
        order = list(system.order)
        constraints, _ = select_constraints(mechanism, order)
        required_forces = system.compute_required_forces(
            motion.table, motion.accelerations[:, order]
        )
        for t, q, u, missing in zip(
            motion.times.tolist(), motion.values, motion.speeds, required_forces, strict=True
        ):
            state = mechanism.at(q, u, t)
            # Rows of the constraint Jacobian G.
            blocks = [matrix.acceleration_equations(state)[0] for matrix in constraints]
            rows = np.concatenate(blocks)[:, order].T
            # The mass matrix is singular if constraints drive massless bodies.
            with suppress(np.linalg.LinAlgError):
                factor = np.linalg.cholesky(mass_matrix(state)[np.ix_(order, order)])
                rows, missing = (
                    np.asarray(np.linalg.solve(factor, matrix), float) for matrix in (rows, missing)
                )
            result = solve_least_norm(rows, missing, INDEPENDENCE * np.sqrt(rows.shape[1]))
            multipliers = np.split(result, np.cumsum([len(block) for block in blocks])[:-1])
            yield cls(state, list(zip(constraints, multipliers, strict=True)))

    def compute_wrenches(self, constraint: ConstraintEquations, multipliers: Array) -> Array:
        """Compute the wrenches of a constraint on its bodies.

        Args:
            constraint: constraint between bodies.
            multipliers: Lagrange multipliers of the constraint (m,).

        Returns:
            Moment (N m) and force (N) on each body (k, 6), about the body's origin, in ground.
        """
        mechanism = self.state.mechanism
        state = self.state
        bodies = [body for body in constraint.bodies if body != GROUND]
        equations: Any = constraint
        program = _build_separate_bodies(mechanism, equations)
        data, y, f = program.state(
            np.zeros(6 * len(mechanism.bodies)), np.zeros(6 * len(mechanism.bodies))
        )
        columns = np.frombuffer(data)[program.model[MODEL.WORK_COLUMN] :]
        for body in bodies:
            columns[36 * body : 36 * body + 36] = np.eye(6).ravel()
            link_record = np.frombuffer(link_work(program.model, data, body))
            link_record[: LINK_WORK.POSITION] = state.rotations[body].ravel()
            link_record[LINK_WORK.POSITION : LINK_WORK.VELOCITY] = (
                *state.origins[body],
                *state.origins[body],
            )
        evaluate_constraints(program.model, program.reals, data, y, f)
        wrenches = (multipliers @ program.equations(data).rows).reshape(-1, 6)
        # The wrench on ground is opposite to the sum of the others.
        force = -wrenches[bodies, 3:].sum(axis=0)
        torque = -(
            wrenches[bodies, :3] + np.cross(state.origins[bodies], wrenches[bodies, 3:])
        ).sum(axis=0)
        ground_wrench = np.concatenate((torque, force))
        return np.array(
            [ground_wrench if body == GROUND else wrenches[body] for body in constraint.bodies]
        )


@lru_cache
def _build_separate_bodies(mechanism: Mechanism, constraint: Any) -> PackedMechanism:
    """Return a program for a constraint between free bodies, each a link without a joint.

    The six components of each body's velocity are speeds of their own, so that multipliers times
    the rows of the constraint are wrenches.
    """
    count = len(mechanism.bodies)
    links = [Link(GROUND, []) for _ in range(count)]
    placements = LinkMap(mechanism, {}, [Placement(number, np.eye(4)) for number in range(count)])
    return PackedMechanism(
        LinkTree(links, [*range(0, 6 * count + 1, 6)], tuple(range(6 * count)), placements),
        (constraint,),
    )


def compute_constraint_records(motion: Motion) -> tuple[list[str], Array]:
    """Compute the forces that OpenSim's constraints report for their bodies and mobilizers.

    Forces come before moments, along the axes of the body that carries all bodies of a constraint.
    The sign is that of Simbody's multipliers, opposite to the forces that act.

    Args:
        motion: motion along which the forces are computed.

    Returns:
        Labels of m columns, and rows (t, m).
    """
    if motion.unbalanced and motion.balanced.any():
        columns, balanced_rows = compute_constraint_records(motion.select_times(motion.balanced))
        result = np.full((len(motion.times), len(columns)), np.nan)
        result[motion.balanced] = balanced_rows
        return columns, result
    mechanism = motion.mechanism
    tree = motion.model.tree()
    names = {
        tree.path_of(component): component.name
        for component in motion.model.components(schema.Constraint)
    }
    labels: list[str] = []
    rows = []
    for moment, forces in enumerate(ConstraintForces.compute_along(motion)):
        row: list[Array] = []
        for constraint, multipliers in forces.multipliers:
            # Skip constraints that lock coordinates or close loops of joints.
            name = names.get(constraint.name)
            if name is None:
                continue
            if constraint.bodies:
                wrenches = forces.compute_wrenches(constraint, multipliers).reshape(-1, 2, 3)[
                    :, ::-1
                ]
                row.append(
                    (
                        wrenches
                        @ forces.state.rotations[find_carrier(mechanism, constraint.bodies)]
                    ).ravel()
                )
                columns = [
                    f"{_get_body_name(mechanism, body)}_{letter}{axis}"
                    for body in constraint.bodies
                    for letter in "FM"
                    for axis in "xyz"
                ]
            else:
                indices = _find_mobilities(mechanism, constraint)
                row.append(
                    (multipliers @ constraint.acceleration_equations(forces.state)[0])[indices]
                )
                columns = [f"mobility_F{number}" for number in range(len(indices))]
            if moment == 0:
                labels += [f"{name}_{column}" for column in columns]
        rows.append(-np.concatenate([[], *row]))
    return labels, np.array(rows)


def _get_body_name(mechanism: Mechanism, body: int) -> str:
    """Return the name of a body, or "ground"."""
    return "ground" if body == GROUND else mechanism.bodies[body].name


def _find_mobilities(mechanism: Mechanism, constraint: ConstraintEquations) -> list[int]:
    """Return the indices of all coordinates of the joints of a coupler, the dependent one last."""
    assert isinstance(constraint, Coupler)
    joint_coordinates = {
        index: body.mobilizer.coordinates
        for body in mechanism.bodies
        for index in body.mobilizer.coordinates
    }
    joints = dict.fromkeys(joint_coordinates[index] for index in constraint.coordinates)
    return [index for joint in joints for index in joint]


class JointWrenches:
    """Wrenches at the joints along a motion, from the Newton-Euler equations."""

    @classmethod
    def compute_along(cls, motion: Motion, controls: Controls | None = None) -> JointWrenches:
        """Return the wrenches of a motion; cached unless other controls drive the actuators.

        Args:
            motion: motion along which the forces are computed.
            controls: controls that replace those of the simulation; None keeps them.
        """
        if controls is not None:
            return cls(motion, controls)
        return motion.compute_once("joint wrenches", lambda: cls(motion, None))

    def __init__(self, motion: Motion, controls: Controls | None) -> None:
        self.mechanism = motion.mechanism
        self.carried = {
            body.mobilizer.joint: index for index, body in enumerate(self.mechanism.bodies)
        }
        system = System(self.mechanism, motion.simulation.forces, keep_fixed_bodies=True)
        if controls is not None:
            system.set_controls(controls)
        balanced = motion.select_times(motion.balanced) if motion.unbalanced else motion
        self.link_motion = LinkMotion.compute(
            system, balanced.table, balanced.accelerations[:, list(system.order)]
        )
        if self.mechanism.constrained:
            for links, forces in zip(
                self.link_motion.links, ConstraintForces.compute_along(balanced), strict=True
            ):
                self._add_constraint_forces(links, forces)
        if motion.unbalanced:
            self.link_motion = LinkMotion(system, self._add_unbalanced_times(motion))

    def _add_unbalanced_times(self, motion: Motion) -> Array:
        """Return the links at all times (t, l, n), with NaN wrenches at unbalanced times."""
        # Without forces the wrenches are unknown, but the kinematics of the links is not.
        unloaded = System(self.mechanism.without_constraints(), Forces(()), keep_fixed_bodies=True)
        moments = np.column_stack(
            [motion.times, unloaded.state.pack_rows(motion.values, motion.speeds)]
        )
        links = unloaded.compute_accelerated_links(
            moments, motion.accelerations[:, list(unloaded.order)]
        )
        links[motion.balanced] = self.link_motion.links
        return links

    def _add_constraint_forces(self, links: Array, forces: ConstraintForces) -> None:
        """Add constraint forces to the wrenches of bodies and of all bodies that carry them.

        Args:
            links: records of the links (l, n), changed in place.
            forces: constraint forces at the same time.
        """
        for constraint, multipliers in forces.multipliers:
            for body, wrench in zip(
                constraint.bodies, forces.compute_wrenches(constraint, multipliers), strict=True
            ):
                force = wrench[3:]
                origin = forces.state.origins[body]
                # All bodies between this one and ground carry the wrench as well.
                while body != GROUND:
                    arm = origin - links[body, LINK_WORK.ORIGIN : LINK_WORK.ORIGIN + 3]
                    about = np.concatenate([wrench[:3] + np.cross(arm, force), force])
                    links[body, LINK_WORK.WRENCH : LINK_WORK.WRENCH + 6] += about
                    body = self.mechanism.bodies[body].parent

    def get_reaction(self, joint: Joint, side: str) -> tuple[Array, Array, Array]:
        """Return the reaction of a joint on one of its bodies.

        Args:
            joint: joint of the model.
            side: ``"child"`` or ``"parent"``.

        Returns:
            Force (N), moment (N m), and the origin of the joint's frame at which they act (m), each
            (t, 3) in ground.
        """
        outer_index = self.carried[joint.path]
        body = self.mechanism.bodies[outer_index]
        link = self.link_motion.links[:, outer_index]
        mobilizer = body.mobilizer
        # The outer body of the joint in the tree receives the wrench, the inner body the
        # opposite.
        is_outer = (side == "child") != mobilizer.reversed
        wrench = (-1.0 if is_outer else 1.0) * link[:, LINK_WORK.WRENCH : LINK_WORK.WRENCH + 6]
        frame = mobilizer.child_frame if side == "child" else mobilizer.parent_frame
        _, point = self.link_motion.locate_frame(outer_index if is_outer else body.parent, frame)
        arm = point - link[:, LINK_WORK.ORIGIN : LINK_WORK.ORIGIN + 3]
        return wrench[:, 3:], wrench[:, :3] - np.cross(arm, wrench[:, 3:]), point
