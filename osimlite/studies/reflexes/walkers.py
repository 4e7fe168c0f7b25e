"""Several candidates of a walking model, stepped together: what is felt of them, and where their legs are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any, NamedTuple

import numpy as np

from osimlite.base.text import join_words, suggest_name
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.layout import OUTCOME
from osimlite.mechanics.kernels.pointers import Ints
from osimlite.mechanics.kernels.reflexes import REFLEXES
from osimlite.mechanics.kernels.sensors import OF_MUSCLES, SENSES
from osimlite.mechanics.kernels.walks import COUNTS, STEPS
from osimlite.mechanics.multibody.mechanism import GROUND, Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.forces import CoordinateLimitForce
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle
from osimlite.simulation.copies import Copies
from osimlite.simulation.elements.contact import PairContact
from osimlite.simulation.options import IntegrationOptions

SIDES = "_l", "_r"
"""Ends of names, left before right, which is the order of the legs."""


class Leg(NamedTuple):
    """A leg.

    Attributes:
        side: ending of the names of what belongs to it.
        base, foot: numbers of the bodies that it hangs on and ends with.
        pairs: numbers of the contacts of its foot.
        length: m.
    """

    side: str
    base: int
    foot: int
    pairs: range
    length: float


LAGGING = "euler2", "merson"
"""Integrators of SCONE, whose control steps begin with the derivative that the one before has ended with."""


class Felt:
    """What is felt of a model, and what is driven: names, legs, and the plan of a row.

    Args:
        model: whose.
        engine: of it.
        count: of its copies, each of which has numbers of its own.
        step: for which controls are held, s.
        lags: whether control steps begin with the derivative that the one before has ended with.
        legs: without the side the names of the bodies of upper legs (`upper`), of feet (`lower`;
            empty for those two below), and of the forces of feet (`contact`).

    Attributes:
        names: of the actuators, muscles first.
        order: number of the control of each among those of the model.
        coordinates: their names, in the order of the state.
        senses, known: plan of the rows, and its numbers.
        least, most: bounds of the controls.
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
        self.count, self.step, self.engine = count, step, engine
        self.mechanism: Mechanism = engine.mechanism
        tree, known = model.tree(), engine.forces.controls.names
        # Of an actuator with several controls the path has a number behind.
        owners: list[Any] = [
            tree.by_path.get(path) or tree.by_path[path.rpartition("_")[0]] for path in known
        ]
        self.order = sorted(range(len(known)), key=lambda k: not isinstance(owners[k], Muscle))
        self.paths = [known[k] for k in self.order]
        self.names = [path.rpartition("/")[2] for path in self.paths]
        self.muscles: list[Any] = [owners[k] for k in self.order if isinstance(owners[k], Muscle)]
        self.optimal = np.array([item.optimal_fiber_length for item in self.muscles])
        self.strengths = np.array([item.max_isometric_force for item in self.muscles])
        self.least, self.most = np.transpose(
            [_read_control_bounds(owners[k]) for k in self.order]
        ).reshape(2, -1)
        self.mass = self.mechanism.total_mass
        self.weight = self.mass * float(np.linalg.norm(self.mechanism.gravity))
        infos = self.mechanism.coordinates
        self.coordinates = [infos[k].name for k in engine.order]
        self.legs = self._legs(**legs)
        self.senses, self.known = self._sensing(model, lags=lags)

    def _sensing(self, model: Model, *, lags: bool) -> tuple[Ints, Array]:
        """Plan of what is felt, and its numbers; see :mod:`osimlite.mechanics.kernels.sensors`."""
        engine, bodies = self.engine, self.mechanism.bodies
        limits: list[int] = []
        for item in model.components(CoordinateLimitForce):
            if item.appliesForce and str(item.coordinate) in self.coordinates:
                places = engine.find_offsets(model.tree().path_of(item), ("force",))
                limits += self.coordinates.index(str(item.coordinate)), *places
        m, n, b, legs = len(self.muscles), len(self.coordinates), len(bodies), len(self.legs)
        centres = []
        for placement, body in zip(engine.placements, bodies, strict=True):
            frame = placement.frame
            centres.append(frame[:3, :3] @ body.mass_properties.center + frame[:3, 3])
        masses = np.array([body.mass_properties.mass for body in bodies])
        own = (
            [self.weight, masses.sum(), self.step, float(lags)],
            self.optimal,
            self.strengths,
            self.least,
            self.most,
            np.ravel(centres),
            masses,
        )
        known = np.concatenate(own)
        sizes = m, m, m, m, m, n, n, n, legs, 3 * b, 3, 1
        head = m, n, legs, len(limits) // 2, b, len(self.names), len(known)
        plan = [*head, 0, *np.cumsum(sizes).tolist()]
        plan += [
            place for path in self.paths[:m] for place in engine.find_offsets(path, OF_MUSCLES)
        ] + limits
        plan += [placement.link for placement in engine.placements]
        plan += [
            number
            for leg in self.legs
            for number in (leg.base, leg.foot, leg.pairs.start, leg.pairs.stop)
        ]
        return np.array(plan, dtype=np.int64), known

    def _legs(self, upper: str, lower: str, contact: str) -> list[Leg]:
        names = [body.name for body in self.mechanism.bodies]
        parents = {
            body.name: names[body.parent] for body in self.mechanism.bodies if body.parent != GROUND
        }
        at_rest = self.mechanism.at(
            np.array([info.default_value for info in self.mechanism.coordinates])
        )
        origins = {name: at_rest.origins[k] for k, name in enumerate(names)}
        elements = [item for item in self.engine.forces.elements if isinstance(item, PairContact)]
        first = np.cumsum([0, *(len(item.pairs) for item in elements)])
        pairs = {
            item.path.rpartition("/")[2]: range(a, b)
            for item, a, b in zip(elements, first[:-1], first[1:], strict=True)
        }
        legs = []
        for side in SIDES:
            top = f"{upper}{side}"
            below = {name: parents.get(parents.get(name, ""), "") for name in names}
            foot = (
                f"{lower}{side}"
                if lower
                else next((name for name, far in below.items() if far == top), "")
            )
            if top not in names or foot not in names or f"{contact}{side}" not in pairs:
                continue
            length, here = 0.0, foot
            while here != top and here in parents:
                length += float(
                    np.linalg.norm(origins[here] - origins.get(parents[here], np.zeros(3)))
                )
                here = parents[here]
            base = parents.get(top, "")
            if base not in names:
                raise ModelError(f"'{top}' hangs on no body")
            legs.append(
                Leg(side, names.index(base), names.index(foot), pairs[f"{contact}{side}"], length)
            )
        self._legs_named = upper, contact
        return legs

    def expect_legs(self) -> None:
        """Refuse a model without two legs.

        Raises:
            ModelError: it says what they are called.
        """
        if len(self.legs) != len(SIDES):
            upper, contact = self._legs_named
            near = suggest_name(f"{upper}_l", [body.name for body in self.mechanism.bodies])
            wanted = f"bodies '{upper}_l' and '{upper}_r', feet, and contact forces '{contact}_l' and '{contact}_r'"
            raise ModelError(f"the model has no legs, which are {wanted}{near}")


def _read_control_bounds(actuator: Any) -> tuple[float, float]:
    """Least and largest control; OpenSim's own tools know of none for actuators with several."""
    if isinstance(actuator, Muscle):
        return getattr(actuator, "minimum_activation", actuator.min_control), 1.0
    return getattr(actuator, "min_control", -inf), getattr(actuator, "max_control", inf)


class Walkers(Felt):
    """Candidates of a model.

    Args:
        model: that walks.
        count: of the candidates.
        step: for which controls are held, s.
        options: accuracy, integrator and other options of the integration.
        legs: as of :class:`Felt`.

    Attributes:
        rows: what is felt of each (w, r).
        excitations: that are held (w, c).
        progress: what is counted of each walk (w, c), see :mod:`osimlite.mechanics.kernels.walks`.
        noted: by the criteria (w, k).

    Raises:
        ModelError: it has actuators that are no muscles.
    """

    noted: Array

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
            model, self.copies.engine, count, step, legs, lags=options.integrator in LAGGING
        )
        others = self.names[len(self.muscles) :]
        if others:
            raise ModelError(
                f"{join_words(others)} are no muscles, and efforts of muscles alone are known"
            )
        state, size = self.copies.simulation.state, len(self.coordinates)
        infos = self.mechanism.coordinates
        self.places = {
            **{f"{infos[k].path}/value": n for n, k in enumerate(state.order)},
            **{f"{infos[k].path}/speed": size + n for n, k in enumerate(state.order)},
            **{path: 2 * size + n for n, path in enumerate(state.paths)},
        }
        self._activations = np.array([self.places[f"{path}/activation"] for path in self.paths])
        self.rows, self.excitations = (
            np.zeros((count, self.senses[SENSES.SIZE])),
            np.zeros((count, len(self.names))),
        )
        self.progress: Ints = np.zeros((count, COUNTS), dtype=np.int64)
        self._driven: Ints = self.copies.places[self.order]

    # ------------------------------------------------------------------------------------------------- walking
    def go_by(self, plan: Ints, numbers: Array, criteria: Ints, bounds: Array, room: int) -> None:
        """Have walks go by reflexes (see :mod:`osimlite.mechanics.kernels.reflexes`), and criteria judge them.

        Args:
            plan: of the reflexes, to whose `ROOM` that of the criteria is added.
            numbers: of each candidate (w, r).
            criteria: see :mod:`osimlite.mechanics.kernels.criteria`.
            bounds: their numbers.
            room: that they need.
        """
        plan[REFLEXES.ROOM] += room
        whole = np.zeros((self.count, plan[REFLEXES.ROOM]))
        self.noted = whole[:, plan[REFLEXES.ROOM] - room :]
        self._asked = self.senses, self.known, self._driven, plan, numbers, criteria, bounds, whole

    def go(self, order: int, which: Sequence[int] | None = None) -> Array:
        """Have walkers (all by default) go on by an order of :mod:`osimlite.mechanics.kernels.walks`.

        Returns:
            Of each control step of the first walker the state at its start, excitations, loads.

        Raises:
            SimulationError: forces cannot be computed where they begin.
        """
        states = self.copies.states
        record = np.empty((max(order, 0), states.shape[1] + len(self.names) + len(self.legs)))
        chosen, before = range(self.count) if which is None else which, int(self.progress[0, STEPS])
        parts = *self._asked, self.rows, self.excitations, record, self.progress, order
        if self.copies.walk_some(chosen, *parts) != OUTCOME.OK:
            # The engine tells what it is.
            for k in chosen:
                self.engine.compute_applied_forces(0.0, states[k].tolist())
        return record[: int(self.progress[0, STEPS]) - before] if order > 0 else record

    def loads(self) -> Array:
        """Forces of the ground on the legs over the weight, as they were felt last (w, l)."""
        return self.rows[:, self.senses[SENSES.LOADS] : self.senses[SENSES.PLACES]]

    def equilibrate_muscles(self, activations: Array) -> None:
        """Have muscles be in equilibrium with activations (w, m)."""
        for k in range(self.count):
            state = self.copies.states[k].copy()
            state[self._activations] = activations[k]
            self.copies.states[k] = self.engine.equilibrate_muscles(0.0, state.tolist())

    def close(self) -> None:
        """Free the engine."""
        self.copies.close()
