"""Several candidates of a walking model, stepped together: what is felt of them, and where their legs are."""

from __future__ import annotations

from math import inf
from typing import Any, NamedTuple

import numpy as np

from osimlite.errors import ModelError
from osimlite.multibody.mechanism import GROUND
from osimlite.multibody.spatial import Array
from osimlite.records import dataclass
from osimlite.schema.forces import CoordinateLimitForce
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle
from osimlite.simulation.copies import Copies
from osimlite.simulation.elements.contact import PairContact
from osimlite.simulation.kernels.layout import CONTACT_WORK, LINK_WORK, MODEL, STAGE
from osimlite.text import did_you_mean, listed

SIDES = "_l", "_r"
"""Ends of names, left before right, which is the order of the legs."""
OF_MUSCLES = ("fiber_length", "fiber_velocity", "tension", "active_fiber_force")


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
    pairs: tuple[int, ...]
    length: float


@dataclass(frozen=True, eq=False)
class Felt:
    """All candidates at one moment.

    Attributes:
        states: (w, y).
        lengths: of fibers, over the optimal ones (w, m).
        velocities: of fibers, optimal lengths/s (w, m).
        forces: of tendons along the path, over the strengths (w, m).
        active: forces of fibers, N (w, m).
        loads: forces of the ground on each leg, over the weight (w, l).
        moments: of the force that limits each coordinate, N or N m; 0 where none does (w, n).
        bodies: mass centres of all bodies in ground, m (w, b, 3).
        centre: mass centre, m (w, 3).
    """

    states: Array
    lengths: Array
    velocities: Array
    forces: Array
    active: Array
    loads: Array
    moments: Array
    bodies: Array
    centre: Array


class Walkers:
    """Candidates of a model.

    Args:
        model: that walks.
        count: of the candidates.
        step: for which controls are held, s.
        accuracy: of the integrator.
        integrator: which.
        upper: name of the bodies of upper legs, without the side.
        lower: of feet; empty for those two below.
        contact: of the forces of feet.
        longest: of the integrator's own steps, s.

    Raises:
        ModelError: it has actuators that are no muscles.
    """

    def __init__(
        self,
        model: Model,
        count: int,
        step: float,
        accuracy: float,
        integrator: str,
        upper: str = "femur",
        lower: str = "",
        contact: str = "foot",
        longest: float = inf,
    ) -> None:
        self.count, self.step = count, step
        self.copies = Copies(model, count, step, accuracy, integrator, longest)
        self.engine: Any = self.copies.engine
        self.mechanism = self.copies.simulation.mechanism
        tree = self.copies.simulation.model.tree()
        self.muscles: list[Any] = [tree.at(path) for path in self.copies.controls]
        others = [item.name for item in self.muscles if not isinstance(item, Muscle)]
        if others:
            raise ModelError(f"{listed(others)} are no muscles, and reflexes excite muscles alone")
        self.names = [item.name for item in self.muscles]
        self.optimal = np.array([item.optimal_fiber_length for item in self.muscles])
        self.strengths = np.array([item.max_isometric_force for item in self.muscles])
        self.least = np.array([getattr(item, "minimum_activation", item.min_control) for item in self.muscles])
        self.mass = self.mechanism.total_mass
        self.weight = self.mass * float(np.linalg.norm(self.mechanism.gravity))
        state = self.copies.simulation.state
        infos = self.mechanism.coordinates
        self.coordinates = [infos[k].name for k in state.order]
        size = len(self.coordinates)
        self.places = {
            **{f"{infos[k].path}/value": n for n, k in enumerate(state.order)},
            **{f"{infos[k].path}/speed": size + n for n, k in enumerate(state.order)},
            **{path: 2 * size + n for n, path in enumerate(state.paths)},
        }
        self.activations = np.array([self.places[f"{path}/activation"] for path in self.copies.controls])
        self._looked_at = self._places_to_look()
        self.legs = self._legs(upper, lower, contact)

    def _places_to_look(self) -> list[int]:
        structure = self.engine.structure
        places = [place for path in self.copies.controls for place in self.engine.places_of(path, OF_MUSCLES)]
        first = int(structure[MODEL.WORK_CONTACT])
        for pair in range(len(self.engine.contacts)):
            places += [first + CONTACT_WORK.SIZE * pair + CONTACT_WORK.FORCE + k for k in range(3)]
        self._limited = []
        for item in self.copies.simulation.model.components(CoordinateLimitForce):
            path = self.copies.simulation.model.tree().path_of(item)
            if item.appliesForce and str(item.coordinate) in self.coordinates:
                self._limited.append(self.coordinates.index(str(item.coordinate)))
                places += self.engine.places_of(path, ("force",))
        self._links = sorted({item.link for item in self.engine.placements if item.link != GROUND})
        for link in self._links:
            at = int(structure[MODEL.WORK_LINK]) + LINK_WORK.SIZE * link
            places += [*range(at + LINK_WORK.ROTATION, at + LINK_WORK.ROTATION + 9)]
            places += [*range(at + LINK_WORK.POSITION, at + LINK_WORK.POSITION + 3)]
        centres = []
        for placement, body in zip(self.engine.placements, self.mechanism.bodies, strict=True):
            frame = placement.frame
            centres.append(frame[:3, :3] @ body.mass_properties.center + frame[:3, 3])
        self._centres = np.array(centres)
        self._masses = np.array([body.mass_properties.mass for body in self.mechanism.bodies])
        return places

    def _legs(self, upper: str, lower: str, contact: str) -> list[Leg]:
        names = [body.name for body in self.mechanism.bodies]
        parents = {body.name: names[body.parent] for body in self.mechanism.bodies if body.parent != GROUND}
        at_rest = self.mechanism.at(np.array([info.default_value for info in self.mechanism.coordinates]))
        origins = {name: at_rest.origins[k] for k, name in enumerate(names)}
        elements = [item for item in self.copies.simulation.forces.elements if isinstance(item, PairContact)]
        first = np.cumsum([0, *(len(item.pairs) for item in elements)])
        pairs = {
            item.path.rpartition("/")[2]: (*range(a, b),)
            for item, a, b in zip(elements, first[:-1], first[1:], strict=True)
        }
        legs = []
        for side in SIDES:
            top = f"{upper}{side}"
            below = {name: parents.get(parents.get(name, ""), "") for name in names}
            foot = f"{lower}{side}" if lower else next((name for name, far in below.items() if far == top), "")
            if top not in names or foot not in names or f"{contact}{side}" not in pairs:
                continue
            length, here = 0.0, foot
            while here != top and here in parents:
                length += float(np.linalg.norm(origins[here] - origins.get(parents[here], np.zeros(3))))
                here = parents[here]
            base = parents.get(top, "")
            if base not in names:
                raise ModelError(f"'{top}' hangs on no body")
            legs.append(Leg(side, names.index(base), names.index(foot), pairs[f"{contact}{side}"], length))
        self._legs_named = upper, contact
        return legs

    def expect_legs(self) -> None:
        """Refuse a model without two legs.

        Raises:
            ModelError: it says what they are called.
        """
        if len(self.legs) != len(SIDES):
            upper, contact = self._legs_named
            near = did_you_mean(f"{upper}_l", [body.name for body in self.mechanism.bodies])
            wanted = f"bodies '{upper}_l' and '{upper}_r', feet, and contact forces '{contact}_l' and '{contact}_r'"
            raise ModelError(f"the model has no legs, which are {wanted}{near}")

    # ------------------------------------------------------------------------------------------------- states
    def looked(self, states: Array) -> Felt:
        """What is felt in some states (k, y)."""
        moments = np.column_stack([np.zeros(len(states)), states])
        found = self.engine.looked(moments, self._looked_at, STAGE.FORCE)
        count, kinds = len(self.names), len(OF_MUSCLES)
        muscles = found[:, : count * kinds].reshape(len(states), count, kinds)
        at = count * kinds
        pushes = found[:, at : at + 3 * len(self.engine.contacts)].reshape(len(states), -1, 3)
        at += 3 * len(self.engine.contacts)
        moments = np.zeros((len(states), len(self.coordinates)))
        moments[:, self._limited] = found[:, at : at + len(self._limited)]
        at += len(self._limited)
        links = found[:, at:].reshape(len(states), len(self._links), 12)
        bodies = np.empty((len(states), len(self._centres), 3))
        for k, (placement, centre) in enumerate(zip(self.engine.placements, self._centres, strict=True)):
            if placement.link == GROUND:
                bodies[:, k] = centre
                continue
            link = links[:, self._links.index(placement.link)]
            bodies[:, k] = link[:, 9:] + link[:, :9].reshape(-1, 3, 3) @ centre
        loads = np.zeros((len(states), len(self.legs)))
        for k, leg in enumerate(self.legs):
            loads[:, k] = np.linalg.norm(pushes[:, list(leg.pairs)].sum(axis=1), axis=1) / self.weight
        centre = np.einsum("b,kbi->ki", self._masses, bodies) / self._masses.sum()
        return Felt(
            states,
            muscles[..., 0] / self.optimal,
            muscles[..., 1] / self.optimal,
            muscles[..., 2] / self.strengths,
            muscles[..., 3],
            loads,
            moments,
            bodies,
            centre,
        )

    def felt(self) -> Felt:
        """All candidates as they are."""
        return self.looked(self.copies.states)

    def equilibrated(self, activations: Array) -> None:
        """Have muscles be in equilibrium with activations (w, m)."""
        for k in range(self.count):
            state = self.copies.states[k].copy()
            state[self.activations] = activations[k]
            self.copies.states[k] = self.engine.equilibrated(0.0, state.tolist())

    def close(self) -> None:
        """Free the engine."""
        self.copies.close()
