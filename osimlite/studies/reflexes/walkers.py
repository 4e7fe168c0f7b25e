"""Names, legs and sensors of a walking model, and copies of it that are stepped together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import join_words, suggest_name
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.layout import OUTCOME
from osimlite.mechanics.kernels.pointers import Ints
from osimlite.mechanics.kernels.reflexes import REFLEXES
from osimlite.mechanics.kernels.sensors import OF_MUSCLES, SENSOR_PLAN
from osimlite.mechanics.kernels.walks import PROGRESS
from osimlite.mechanics.multibody.mechanism import GROUND, Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.forces import CoordinateLimitForce
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle
from osimlite.simulation.copies import Copies
from osimlite.simulation.elements.contact import PairContact
from osimlite.simulation.options import IntegrationOptions

SIDES = "_l", "_r"
"""Endings of names of the left and the right side; legs have this order."""


class Leg(NamedTuple):
    """Bodies and contacts of a leg.

    Attributes:
        side: ending of the names of its parts, from `SIDES`.
        base: index of the body that the leg is attached to, such as the pelvis.
        foot: index of the body at its end.
        pairs: indices of the contact pairs of its foot.
        length: sum of the distances between the body origins from the foot to the upper leg, in the
            default pose (m).
    """

    side: str
    base: int
    foot: int
    pairs: range
    length: float


LAGGING_INTEGRATORS = "euler2", "merson"
"""Integrators with which SCONE starts a control step from the derivative at the end of the previous
one.

That derivative belongs to the previous excitations.
"""


class SensedModel:
    """Actuators, coordinates and legs of a model, with the plan of its sensor rows.

    Args:
        model: model with sensors.
        engine: engine of the model.
        count: number of its copies; each has its own parameters.
        step: duration of a control step (s).
        legs: names without their side: bodies of upper legs (`upper`), of feet (`lower`; empty for
            those two bodies below the upper leg), and contact forces of feet (`contact`).
        lags: whether a control step starts from the derivative at the end of the previous one.

    Attributes:
        names: names of the actuators, muscles first.
        paths: paths of the actuators in the same order.
        order: index of each actuator's control among the controls of the model.
        muscles: muscles of the model, in the order of `names`.
        optimal: optimal fiber lengths of the muscles (m).
        strengths: maximum isometric forces of the muscles (N).
        control_min: smallest control of each actuator.
        control_max: largest control of each actuator.
        mass: mass of the model (kg).
        weight: weight of the model (N).
        coordinates: names of the coordinates, in the order of the state.
        legs: left and right leg; empty where the names fit no bodies and contacts.
        sensor_plan: integers of the sensor rows, see :mod:`osimlite.mechanics.kernels.sensors`.
        sensor_numbers: numbers of the sensor rows.
    """

    def __init__(
        self,
        model: Model,
        engine: Any,
        count: int,
        step: float,
        legs: Mapping[str, str],
        *,
        lags: bool = False,
    ) -> None:
        self.count = count
        self.step = step
        self.engine = engine
        self.mechanism: Mechanism = engine.mechanism
        tree = model.tree()
        control_paths = engine.forces.controls.names
        # A control of an actuator with several has the path of the actuator, "_" and a number.
        actuators: list[Any] = [
            tree.by_path.get(path) or tree.by_path[path.rpartition("_")[0]]
            for path in control_paths
        ]
        self.order = sorted(
            range(len(control_paths)), key=lambda k: not isinstance(actuators[k], Muscle)
        )
        self.paths = [control_paths[k] for k in self.order]
        self.names = [path.rpartition("/")[2] for path in self.paths]
        self.muscles: list[Any] = [
            actuators[k] for k in self.order if isinstance(actuators[k], Muscle)
        ]
        self.optimal = np.array([muscle.optimal_fiber_length for muscle in self.muscles])
        self.strengths = np.array([muscle.max_isometric_force for muscle in self.muscles])
        self.control_min, self.control_max = np.transpose(
            [_read_control_bounds(actuators[k]) for k in self.order]
        ).reshape(2, -1)
        self.mass = self.mechanism.total_mass
        self.weight = self.mass * float(np.linalg.norm(self.mechanism.gravity))
        infos = self.mechanism.coordinates
        self.coordinates = [infos[k].name for k in engine.order]
        self.legs = self._find_legs(**legs)
        self.sensor_plan, self.sensor_numbers = self._make_sensor_plan(model, lags=lags)

    def _make_sensor_plan(self, model: Model, *, lags: bool) -> tuple[Ints, Array]:
        """Return plan and numbers of the sensor rows, see :mod:`osimlite.mechanics.kernels.sensors`."""
        engine, bodies = self.engine, self.mechanism.bodies
        limits: list[int] = []
        for limit_force in model.components(CoordinateLimitForce):
            # Locked coordinates are not in the state and have no sensor.
            if limit_force.appliesForce and str(limit_force.coordinate) in self.coordinates:
                force_offsets = engine.find_offsets(model.tree().path_of(limit_force), ("force",))
                limits += self.coordinates.index(str(limit_force.coordinate)), *force_offsets
        muscle_count = len(self.muscles)
        coordinate_count = len(self.coordinates)
        body_count = len(bodies)
        legs = len(self.legs)
        # The kernels work on links, into which several bodies may be merged.
        centres = []
        for placement, body in zip(engine.placements, bodies, strict=True):
            frame = placement.frame
            centres.append(frame[:3, :3] @ body.mass_properties.center + frame[:3, 3])
        masses = np.array([body.mass_properties.mass for body in bodies])
        number_groups = (
            [self.weight, masses.sum(), self.step, float(lags)],
            self.optimal,
            self.strengths,
            self.control_min,
            self.control_max,
            np.ravel(centres),
            masses,
        )
        numbers = np.concatenate(number_groups)
        sizes = (
            muscle_count,
            muscle_count,
            muscle_count,
            muscle_count,
            muscle_count,
            coordinate_count,
            coordinate_count,
            coordinate_count,
            legs,
            3 * body_count,
            3,
            1,
        )
        header = (
            muscle_count,
            coordinate_count,
            legs,
            len(limits) // 2,
            body_count,
            len(self.names),
            len(numbers),
        )
        plan = [*header, 0, *np.cumsum(sizes).tolist()]
        plan += [
            offset
            for path in self.paths[:muscle_count]
            for offset in engine.find_offsets(path, OF_MUSCLES)
        ] + limits
        plan += [placement.link for placement in engine.placements]
        plan += [
            number
            for leg in self.legs
            for number in (leg.base, leg.foot, leg.pairs.start, leg.pairs.stop)
        ]
        return np.array(plan, dtype=np.int64), numbers

    def _find_legs(self, upper: str, lower: str, contact: str) -> list[Leg]:
        """Return the legs whose bodies and contact forces have the given names and a side.

        Raises:
            ModelError: the upper body of a leg is attached to ground and not to another body.
        """
        names = [body.name for body in self.mechanism.bodies]
        parents = {
            body.name: names[body.parent] for body in self.mechanism.bodies if body.parent != GROUND
        }
        # Leg lengths are measured in the default pose.
        at_rest = self.mechanism.at(
            np.array([info.default_value for info in self.mechanism.coordinates])
        )
        origins = {name: at_rest.origins[k] for k, name in enumerate(names)}
        elements = [
            contact_element
            for contact_element in self.engine.forces.elements
            if isinstance(contact_element, PairContact)
        ]
        first_pairs = np.cumsum([0, *(len(contact_element.pairs) for contact_element in elements)])
        pairs = {
            contact_element.path.rpartition("/")[2]: range(a, b)
            for contact_element, a, b in zip(
                elements, first_pairs[:-1], first_pairs[1:], strict=True
            )
        }
        legs = []
        for side in SIDES:
            upper_body = f"{upper}{side}"
            # SCONE's legs are femur, tibia and foot: the foot is two bodies below the upper leg.
            second_parents = {name: parents.get(parents.get(name, ""), "") for name in names}
            foot = (
                f"{lower}{side}"
                if lower
                else next(
                    (
                        name
                        for name, grandparent in second_parents.items()
                        if grandparent == upper_body
                    ),
                    "",
                )
            )
            # A model without legs is allowed; measures and reflexes that need them refuse it.
            if upper_body not in names or foot not in names or f"{contact}{side}" not in pairs:
                continue
            length, present_body = 0.0, foot
            while present_body != upper_body and present_body in parents:
                length += float(
                    np.linalg.norm(
                        origins[present_body] - origins.get(parents[present_body], np.zeros(3))
                    )
                )
                present_body = parents[present_body]
            base = parents.get(upper_body, "")
            if base not in names:
                raise ModelError(
                    f"the body '{upper_body}' must be attached to another body, such as the pelvis, to be part of a leg"
                )
            legs.append(
                Leg(side, names.index(base), names.index(foot), pairs[f"{contact}{side}"], length)
            )
        self._leg_names = upper, contact
        return legs

    def expect_legs(self) -> None:
        """Refuse a model without two legs.

        Raises:
            ModelError: a leg is missing; the message says which names are expected.
        """
        if len(self.legs) != len(SIDES):
            upper, contact = self._leg_names
            suggestion = suggest_name(f"{upper}_l", [body.name for body in self.mechanism.bodies])
            expected_names = f"bodies '{upper}_l' and '{upper}_r', feet, and contact forces '{contact}_l' and '{contact}_r'"
            raise ModelError(f"the model has no legs; it needs {expected_names}{suggestion}")


def _read_control_bounds(actuator: Any) -> tuple[float, float]:
    """Return smallest and largest control of an actuator.

    An actuator with several controls has no bounds in OpenSim's tools.
    """
    if isinstance(actuator, Muscle):
        return getattr(actuator, "minimum_activation", actuator.min_control), 1.0
    return getattr(actuator, "min_control", -inf), getattr(actuator, "max_control", inf)


class Walkers(SensedModel):
    """Copies of a walking model, one per candidate.

    Args:
        model: model that walks.
        count: number of candidates w.
        step: duration of a control step (s).
        options: accuracy, integrator and other options of the integration.
        legs: names of the legs, see :class:`SensedModel`.

    Attributes:
        offsets: offset in the state of each state variable, by path.
        rows: sensor row of each candidate (w, r).
        excitations: excitations that are held over a control step (w, c).
        progress: counts of each walk (w, p), see `PROGRESS` in
            :mod:`osimlite.mechanics.kernels.walks`.
        criteria_work: workspaces of the criteria (w, k).

    Raises:
        ModelError: the model has actuators other than muscles.
    """

    criteria_work: Array

    def __init__(
        self,
        model: Model,
        count: int,
        step: float,
        options: IntegrationOptions,
        legs: Mapping[str, str],
    ) -> None:
        self.copies = Copies(model, count, step, options)
        super().__init__(
            model,
            self.copies.engine,
            count,
            step,
            legs,
            lags=options.integrator in LAGGING_INTEGRATORS,
        )
        other_actuators = self.names[len(self.muscles) :]
        if other_actuators:
            raise ModelError(
                f"{join_words(other_actuators)}: these actuators are not muscles, but this measure supports "
                "the effort of muscles only"
            )
        state = self.copies.simulation.state
        size = len(self.coordinates)
        infos = self.mechanism.coordinates
        self.offsets = {
            **{f"{infos[k].path}/value": n for n, k in enumerate(state.order)},
            **{f"{infos[k].path}/speed": size + n for n, k in enumerate(state.order)},
            **{path: 2 * size + n for n, path in enumerate(state.paths)},
        }
        self._activations = np.array([self.offsets[f"{path}/activation"] for path in self.paths])
        self.rows = np.zeros((count, self.sensor_plan[SENSOR_PLAN.SIZE]))
        self.excitations = np.zeros((count, len(self.names)))
        self.progress: Ints = np.zeros((count, PROGRESS.SIZE), dtype=np.int64)
        self._driven: Ints = self.copies.control_offsets[self.order]

    # ------------------------------------------------------------------------------------------------- walking
    def set_reflexes_and_criteria(
        self, plan: Ints, numbers: Array, criteria: Ints, bounds: Array, criteria_size: int
    ) -> None:
        """Set the reflexes that drive the walkers and the criteria that score them.

        Args:
            plan: integers of the reflexes, see :mod:`osimlite.mechanics.kernels.reflexes`; its
                `MEMORY_SIZE` is increased by the workspace of the criteria.
            numbers: numbers of the reflexes of each candidate (w, r).
            criteria: integers of the criteria, see :mod:`osimlite.mechanics.kernels.criteria`.
            bounds: numbers of the criteria.
            criteria_size: length of the workspace of the criteria.
        """
        # The memory of a candidate is that of its reflexes, followed by that of the criteria.
        plan[REFLEXES.MEMORY_SIZE] += criteria_size
        memory = np.zeros((self.count, plan[REFLEXES.MEMORY_SIZE]))
        self.criteria_work = memory[:, plan[REFLEXES.MEMORY_SIZE] - criteria_size :]
        self._walk_arguments = (
            self.sensor_plan,
            self.sensor_numbers,
            self._driven,
            plan,
            numbers,
            criteria,
            bounds,
            memory,
        )

    def advance(self, order: int, indices: Sequence[int] | None = None) -> Array:
        """Carry out an order for some walkers.

        Args:
            order: number of control steps, or `FEEL`, `BEGIN` or `START` of
                :mod:`osimlite.mechanics.kernels.walks`.
            indices: indices of the walkers; all by default.

        Returns:
            State at the start, excitations and leg loads of the first walker, one row for each
            control step.

        Raises:
            SimulationError: forces cannot be computed in a state from which a walker starts.
        """
        states = self.copies.states
        record = np.empty((max(order, 0), states.shape[1] + len(self.names) + len(self.legs)))
        selected = range(self.count) if indices is None else indices
        steps_before = int(self.progress[0, PROGRESS.STEPS])
        arguments = *self._walk_arguments, self.rows, self.excitations, record, self.progress, order
        if self.copies.walk_some(selected, *arguments) != OUTCOME.OK:
            # The kernels return a code only; evaluating again in Python raises the error with its cause.
            for k in selected:
                self.engine.compute_applied_forces(0.0, states[k].tolist())
        return (
            record[: int(self.progress[0, PROGRESS.STEPS]) - steps_before] if order > 0 else record
        )

    def get_leg_loads(self) -> Array:
        """Return the latest ground reaction forces on the legs over the weight (w, l)."""
        return self.rows[
            :, self.sensor_plan[SENSOR_PLAN.LOADS] : self.sensor_plan[SENSOR_PLAN.POSITIONS]
        ]

    def equilibrate_muscles(self, activations: Array) -> None:
        """Set activations (w, m) and bring the fibers of all muscles into equilibrium with them."""
        for k in range(self.count):
            # The engine needs the state as a list, and returns the complete state.
            state = self.copies.states[k].copy()
            state[self._activations] = activations[k]
            self.copies.states[k] = self.engine.equilibrate_muscles(0.0, state.tolist())

    def close(self) -> None:
        """Release the compiled engine."""
        self.copies.close()
