"""What the constraints of a model push bodies and coordinates with."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from typing import Any

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.constrained_dynamics import SLIGHT, bind
from osimlite.mechanics.kernels.layout import LINK_WORK, MODEL
from osimlite.mechanics.kernels.points import link_work
from osimlite.mechanics.multibody.body_constraints import carrier
from osimlite.mechanics.multibody.constraints import Constraint, Coupler
from osimlite.mechanics.multibody.dynamics import mass_matrix
from osimlite.mechanics.multibody.kinematics import Kinematics
from osimlite.mechanics.multibody.linear import shortest
from osimlite.mechanics.multibody.links import Link, Placement, Places, Tree
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.parts import GROUND
from osimlite.mechanics.multibody.program import Program
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema import constraints as schema
from osimlite.simulation.constrained import constraints_on
from osimlite.tools.motion import Motion


@dataclass(frozen=True, eq=False)
class ConstraintForces:
    """The forces of the constraints of a mechanism at one state."""

    state: Kinematics  # at which they are, with the accelerations that they lead to
    # of the constraints, one number (m,) for each of the equations of each
    multipliers: list[tuple[Constraint, Array]]

    @classmethod
    def along(cls, motion: Motion) -> Iterator[ConstraintForces]:
        """Those at every time of a motion.

        With Gᵀ λ the bodies accelerate as they do. Of multipliers λ that do the same, as where
        constraints repeat each other, they are the shortest, as in Simbody.
        """
        mechanism, system = motion.mechanism, motion.system
        order = list(system.order)
        kept, _ = constraints_on(mechanism, order)
        needed = system.missing(motion.table, motion.accelerations[:, order])
        for t, q, u, missing in zip(
            motion.times.tolist(), motion.values, motion.speeds, needed, strict=True
        ):
            state = mechanism.at(q, u, t)
            blocks = [item.acceleration_equations(state)[0] for item in kept]
            rows = np.concatenate(blocks)[:, order].T
            # What has no mass, constraints may drive.
            with suppress(np.linalg.LinAlgError):
                factor = np.linalg.cholesky(mass_matrix(state)[np.ix_(order, order)])
                rows, missing = (
                    np.asarray(np.linalg.solve(factor, item), float) for item in (rows, missing)
                )
            result = shortest(rows, missing, SLIGHT * np.sqrt(rows.shape[1]))
            parts = np.split(result, np.cumsum([len(block) for block in blocks])[:-1])
            yield cls(state, list(zip(kept, parts, strict=True)))

    def on_bodies(self, constraint: Constraint, multipliers: Array) -> Array:
        """Moment (N m) and force (N) on each body of a constraint (k, 6), about the body's origin, in ground."""
        mechanism, state = self.state.mechanism, self.state
        bodies = [body for body in constraint.bodies if body != GROUND]
        held: Any = constraint
        program = _apart(mechanism, held)
        data, y, f = program.state(
            np.zeros(6 * len(mechanism.bodies)), np.zeros(6 * len(mechanism.bodies))
        )
        columns = np.frombuffer(data)[program.model[MODEL.WORK_COLUMN] :]
        for body in bodies:
            columns[36 * body : 36 * body + 36] = np.eye(6).ravel()
            here = np.frombuffer(link_work(program.model, data, body))
            here[: LINK_WORK.POSITION] = state.rotations[body].ravel()
            here[LINK_WORK.POSITION : LINK_WORK.VELOCITY] = (
                *state.origins[body],
                *state.origins[body],
            )
        bind(program.model, program.reals, data, y, f)
        wrenches = (multipliers @ program.equations(data).rows).reshape(-1, 6)
        # What pushes ground pushes back at the other bodies.
        force = -wrenches[bodies, 3:].sum(axis=0)
        torque = -(
            wrenches[bodies, :3] + np.cross(state.origins[bodies], wrenches[bodies, 3:])
        ).sum(axis=0)
        grounded = np.concatenate((torque, force))
        return np.array(
            [grounded if body == GROUND else wrenches[body] for body in constraint.bodies]
        )


@lru_cache
def _apart(mechanism: Mechanism, constraint: Any) -> Program:
    """A constraint between bodies whose velocities are speeds of their own, each body a link without a joint."""
    count = len(mechanism.bodies)
    links = [Link(GROUND, []) for _ in range(count)]
    places = Places(mechanism, {}, [Placement(number, np.eye(4)) for number in range(count)])
    return Program(
        Tree(links, [*range(0, 6 * count + 1, 6)], tuple(range(6 * count)), places), (constraint,)
    )


def recorded(motion: Motion) -> tuple[list[str], Array]:
    """Labels and numbers (t, m) that OpenSim's constraints record of the forces on their bodies and mobilizers.

    Forces come before moments, along the axes of the body that carries all those of a constraint.
    All have the opposite sign of what pushes, as the multipliers of Simbody have.
    """
    if motion.unbalanced and motion.balanced.any():
        columns, part = recorded(motion.select(motion.balanced))
        result = np.full((len(motion.times), len(columns)), np.nan)
        result[motion.balanced] = part
        return columns, result
    mechanism, tree = motion.mechanism, motion.model.tree()
    names = {tree.path_of(item): item.name for item in motion.model.components(schema.Constraint)}
    labels: list[str] = []
    rows = []
    for moment, forces in enumerate(ConstraintForces.along(motion)):
        row: list[Array] = []
        for constraint, multipliers in forces.multipliers:
            # Not those that hold coordinates, or close loops of joints.
            name = names.get(constraint.name)
            if name is None:
                continue
            if constraint.bodies:
                wrenches = forces.on_bodies(constraint, multipliers).reshape(-1, 2, 3)[:, ::-1]
                row.append(
                    (
                        wrenches @ forces.state.rotations[carrier(mechanism, constraint.bodies)]
                    ).ravel()
                )
                columns = [
                    f"{_name(mechanism, body)}_{what}{axis}"
                    for body in constraint.bodies
                    for what in "FM"
                    for axis in "xyz"
                ]
            else:
                places = _mobilities(mechanism, constraint)
                row.append(
                    (multipliers @ constraint.acceleration_equations(forces.state)[0])[places]
                )
                columns = [f"mobility_F{number}" for number in range(len(places))]
            if moment == 0:
                labels += [f"{name}_{column}" for column in columns]
        rows.append(-np.concatenate([[], *row]))
    return labels, np.array(rows)


def _name(mechanism: Mechanism, body: int) -> str:
    return "ground" if body == GROUND else mechanism.bodies[body].name


def _mobilities(mechanism: Mechanism, constraint: Constraint) -> list[int]:
    """Places of all coordinates of the joints that a coupler speaks of, its dependent coordinate last."""
    assert isinstance(constraint, Coupler)
    owners = {
        place: body.mobilizer.coordinates
        for body in mechanism.bodies
        for place in body.mobilizer.coordinates
    }
    joints = dict.fromkeys(owners[place] for place in constraint.coordinates)
    return [place for joint in joints for place in joint]
