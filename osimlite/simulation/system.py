"""A mechanism with its forces, evaluated stage by stage; every engine has its forces from here.

The stages are those of Simbody: where the links are (position), how they move (velocity), what is
applied to them (force), how they accelerate. What an evaluation finds stays in the work vector that
reports read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from copy import copy
from functools import cached_property, partial
from math import isnan
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from osimlite.errors import SimulationError
from osimlite.mechanics.kernels import layout
from osimlite.mechanics.kernels.layout import (
    CONTACT_WORK,
    ITEM,
    LINK_WORK,
    MODEL,
    OUTCOME,
    STAGE,
    WORK,
)
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.multibody.dynamics import describe_massless_motion
from osimlite.mechanics.multibody.mechanism import GROUND, Mechanism
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.contact import PairContact
from osimlite.simulation.elements.controls import Controls
from osimlite.simulation.elements.force_records import CONTROLS, ForceElement
from osimlite.simulation.elements.muscle import STRENGTH
from osimlite.simulation.elements.probe_type import DeclaredProbe
from osimlite.simulation.engines.linking import Code, Program, best
from osimlite.simulation.link_motion import Moments, moving
from osimlite.simulation.pack import pack
from osimlite.simulation.states import StateLayout
from osimlite.simulation.stepper import NoSolution

if TYPE_CHECKING:
    from osimlite.simulation.pack_chain import Chain


MOMENTS_AT_ONCE = 4096
"""So many moments are evaluated together."""


class System:
    """A mechanism and its forces, laid out for the kernels.

    Args:
        mechanism: what moves.
        forces: what pushes it, besides gravity.
        chain: of joints whose mass matrix another program computes; the kernels do without one.
        code: what runs the kernels; the best that is installed if left out.
        apart: whether every body is a link of its own, also one that never moves in another.

    Attributes: structure: what is connected to what, integers; equal for models that differ in
        numbers only. numbers: all numbers in one vector. program: the structure with the addresses
        of what it calls. order: place in the mechanism of each coordinate of the state. state: what
        the numbers of a state are. placements: link of each body (-1 for ground), and the body's
        frame in it. contacts: names of the contacts, by number. columns: labels of the force
        records. probes: of the model. loads: after an evaluation: the last entry has the bits of
        the contacts that touch; entry i is the force (N, in ground) of contact i if it does.

    Raises:
        UnsupportedError: a joint, a function, a constraint or a force that the kernels do not know.
    """

    entries: tuple[str, ...] = ("evaluate",)
    """Names of the functions of the kernels that it calls."""

    def __init__(
        self,
        mechanism: Mechanism,
        forces: Forces,
        chain: Chain | None = None,
        code: Code | None = None,
        *,
        apart: bool = False,
    ) -> None:
        packed = pack(mechanism, forces, chain, apart=apart)
        self.structure, self.placements, self.order = (
            packed.structure,
            packed.placements,
            packed.order,
        )
        contacts = [element for element in forces.elements if isinstance(element, PairContact)]
        self.contacts = tuple(
            item.pair_name(place) for item in contacts for place in range(len(item.pairs))
        )
        self.columns = tuple(label for element in forces.elements for label in element.columns)
        self.loads: list[Any] = [None] * len(self.contacts) + [0]
        self.program = Program(packed, best() if code is None else code, self.entries)
        self._items, self._owners = packed.items, packed.owners
        places = {owner: place for place, owner in packed.owners.items()}
        probes = (k for k, item in enumerate(forces.elements) if isinstance(item, DeclaredProbe))
        self._probe_places = [places.get(k, 0) for k in probes]
        self._w = np.zeros(self.structure[MODEL.WORK_SIZE])
        self._links = self._rows(MODEL.WORK_LINK, MODEL.LINKS, LINK_WORK.SIZE)
        self._pairs = self._rows(MODEL.WORK_CONTACT, MODEL.CONTACTS, CONTACT_WORK.SIZE)
        size = int(self.structure[MODEL.STATE_SIZE])
        self._y, self._f = np.zeros(size), np.zeros(size)
        self._take(mechanism, forces, packed.numbers)

    def _take(self, mechanism: Mechanism, forces: Forces, numbers: Floats) -> None:
        self.mechanism, self.forces, self.numbers = mechanism, forces, numbers
        self.state = StateLayout(mechanism, self.order, forces.elements)
        self.probes = tuple(item for item in forces.elements if isinstance(item, DeclaredProbe))
        self._controls = forces.controls
        self._driven_by: object = None
        self._bind()

    def renumbered(self, mechanism: Mechanism, forces: Forces, numbers: Floats) -> Self:
        """The system of a model of which only numbers are others; it works in the same arrays as this one."""
        # Copying by its own ways makes an engine from the beginning.
        other = object.__new__(type(self))
        other.__dict__ |= self.__dict__
        other.program = copy(self.program)
        other.__dict__.pop("masses_in_ground", None)
        other._take(mechanism, forces, numbers)
        return other

    def _bind(self) -> None:
        self._equilibrate: Callable[[int], int] | None = None
        self._evaluate = self.program.code.bound(
            "evaluate", self.program.ints, self.numbers, self._w, self._y, self._f
        )

    def drive(self, controls: Controls) -> None:
        """Have the actuators driven by other controls of the same names in all evaluations and motions from now on."""
        place = self.structure[MODEL.CONTROLS]
        if controls is self._controls or not place:
            return
        own, numbers, kernel = controls.make_record()
        first = self.structure[place + ITEM.NUMBERS]
        if self._driven_by == (own, len(numbers), kernel):
            # Other numbers in the same places, of which whoever runs the kernels need not be told.
            self.numbers[first:] = numbers
            self._controls = controls
            return
        self._driven_by = own, len(numbers), kernel
        self.structure = np.concatenate(
            (self.structure[: place + ITEM.OWN], np.array(own, dtype=np.int64))
        )
        self.numbers = np.concatenate((self.numbers[:first], np.array(numbers, dtype=np.float64)))
        self.program.drive(self.structure, kernel)
        self._bind()
        self._controls = controls

    @property
    def driving(self) -> Controls:
        """The controls that drive the actuators."""
        return self._controls

    def _rows(self, start: int, count: int, size: int) -> Floats:
        first, rows = self.structure[start], self.structure[count]
        return self._w[first : first + size * rows].reshape(rows, size)

    # ------------------------------------------------------------------------------------------- evaluation
    def realize(self, t: float, y: Sequence[float], stage: int) -> int:
        """Evaluate a state (y,) up to a stage; returns what the kernels say.

        Raises:
            OsimliteError: the state has a wrong length, or a part in Python has raised.
        """
        self._set(t, y)
        return self._run(self._evaluate, stage)

    def _run(self, function: Callable[..., int], *parts: Any) -> int:
        status = self.program.run(function, *parts)
        if status == OUTCOME.FAILED:
            raise self.program.failures.pop()
        return status

    def _set(self, t: float, y: Sequence[float]) -> None:
        if len(y) != len(self._y):
            raise self.state.wrong_length(len(y))
        self._w[WORK.TIME] = t
        self._y[:] = y

    def found(self) -> list[float]:
        """The derivative (y,) of the state; after the stage of forces, generalized forces in the place of udot."""
        return self._f.tolist()

    def applied(self, t: float, y: Sequence[float]) -> list[float]:
        """The derivative (y,) at a state, with the applied generalized forces (n,) in the place of udot.

        They are conjugate to the generalized speeds; gravity is not among them.

        Raises:
            SimulationError: the rates of coordinates are not defined there.
        """
        status = self.realize(t, y, STAGE.FORCE)
        if status != OUTCOME.OK:
            raise self.refusal(status, t, y)
        self.note_loads(self._pairs[:, :3])
        return self.found()

    def missing(self, moments: Floats, udot: Floats) -> Floats:
        """Generalized forces (k, n) that states need for accelerations (k, n) beside gravity and all that pushes.

        Both are in the order of the state. Constraints are left aside. Moments and errors are those
        of :meth:`looked`.
        """
        first = self.room + len(self.order)
        return self.looked(moments, range(first, first + len(self.order)), udot=udot)

    def links_in_motion(self, moments: Floats, udot: Floats) -> Floats:
        """What the kernels find of all links (k, l, n) that accelerate so.

        The wrench of each is what pushes it and all that it carries, gravity too, less what
        accelerates them: joints and constraints make up for it. Moments and errors are those of
        :meth:`looked`.
        """
        first = int(self.structure[MODEL.WORK_LINK])
        result = self.looked(moments, range(first, first + self._links.size), udot=udot)
        return result.reshape(-1, *self._links.shape)

    def equilibrated(
        self, t: float, y: Sequence[float], numbers: Floats | None = None
    ) -> list[float]:
        """A state (y,) with the auxiliary states that have an equilibrium in it, as Model::equilibrateMuscles gives it.

        Args:
            t: time, s.
            y: the state.
            numbers: of a model of the same structure; the system's own by default.

        Raises: SimulationError: a force has no equilibrium, or the rates of coordinates are not
            defined there.
        """
        result, failed = self._equilibrate_all(t, y, numbers)
        if failed is not None:
            muscle = self._told(
                self.structure[self._equilibrium_at(failed) + layout.EQUILIBRIUM.ITEM]
            )
            raise SimulationError(
                f"no equilibrium was found of {muscle}; start elsewhere, or without an equilibrium"
            )
        return result

    def equilibrate_each(self, t: float, y: Sequence[float]) -> tuple[list[float], dict[str, str]]:
        """Bring every muscle that can be into equilibrium, whether or not others can.

        Args:
            t: time, s.
            y: the state (y,).

        Returns: The state (y,), in which muscles without equilibrium keep their states, and by the
            paths of these muscles what is said of each.

        Raises:
            SimulationError: the rates of coordinates are not defined there.
        """
        result, failed = self._equilibrate_all(t, y)
        if failed is None:
            return result, {}
        reasons, count = {}, int(self.structure[MODEL.EQUILIBRIA])
        code, room = self.program.code, (self._w, self._y, self._f)
        code.make_ready(("equilibrate",))
        while failed is not None:
            item = int(self.structure[self._equilibrium_at(failed) + layout.EQUILIBRIUM.ITEM])
            reasons[self.forces.elements[self._owners[item]].path] = self._told(item)
            # The kernel names the first failure only: it is asked again, of those behind it.
            ints = self.program.ints.copy()
            ints[MODEL.EQUILIBRIA] = count - (failed + 1)
            ints[MODEL.EQUILIBRIUM_AT] = self._equilibrium_at(failed + 1)
            self._set(t, y)
            status = self._run(
                partial(code.entry("equilibrate"), ints, self.numbers, *room), STAGE.VELOCITY
            )
            failed = failed + 1 + int(self._f[0]) if status == OUTCOME.UNSOLVED else None
        for element in self.forces.elements:
            if element.path in reasons and element.states:
                first = self.state.first_of(element)
                result[first : first + len(element.states)] = y[first : first + len(element.states)]
        return result, reasons

    def _equilibrium_at(self, number: int) -> int:
        """Return the offset of the record of one of the equilibria."""
        return int(self.structure[MODEL.EQUILIBRIUM_AT]) + layout.EQUILIBRIUM.SIZE * number

    def _equilibrate_all(
        self, t: float, y: Sequence[float], numbers: Floats | None = None
    ) -> tuple[list[float], int | None]:
        """Bring all muscles into equilibrium; return the state and the number of the first without one, if any.

        Raises:
            SimulationError: the rates of coordinates are not defined there.
        """
        if not self.structure[MODEL.EQUILIBRIA]:
            return list(y), None
        code, ints, room = self.program.code, self.program.ints, (self._w, self._y, self._f)
        if self._equilibrate is None:
            self.program.link_equilibria()
            self._equilibrate = code.bound("equilibrate", ints, self.numbers, *room)
        self._set(t, y)
        run = (
            self._equilibrate
            if numbers is None
            else partial(code.entry("equilibrate"), ints, numbers, *room)
        )
        try:
            status = self._run(run, STAGE.VELOCITY)
        except (ArithmeticError, ValueError) as failure:
            # Kernels as Python raise what machine code computes as no number.
            raise SimulationError(
                f"the equilibrium of the muscles cannot be computed: {failure}"
            ) from failure
        if status == OUTCOME.UNSOLVED:
            return self._y.tolist(), int(self._f[0])
        if status != OUTCOME.OK:
            raise self.refusal(status, t, y)
        return self._y.tolist(), None

    def _told(self, item: int) -> str:
        """What an item is that has no solution."""
        from osimlite.mechanics.kernels.paths import LENGTH
        from osimlite.simulation.elements.force_type import DeclaredForce
        from osimlite.simulation.elements.geometries.path import PATH

        owner = self._owners[item]
        element: Any = self.forces.elements[owner]
        *parts, (place, room) = self._items[owner]
        on_path = isinstance(element, DeclaredForce) and element.force_type.geometry is PATH
        if on_path and isnan(self._w[parts[-1][0] + LENGTH]):
            return f"'{element.path}', whose path has no length in this pose"
        return element.describe_failure(self._w[place : place + room].tolist())

    def refusal(self, status: int, t: float, y: Sequence[float]) -> SimulationError:
        """The error for what the kernels say of a state."""
        if not np.isfinite(np.array(y)).all():
            return SimulationError(
                "the state of the motion is not finite any more; ask for more accuracy"
            )
        if status == OUTCOME.UNSOLVED:
            item = self.structure[self.structure[MODEL.ITEM_AT] + int(self._f[0])]
            return NoSolution(f"there is no solution of the equations of {self._told(item)}")
        if status == OUTCOME.SINGULAR_RATES:
            try:
                self.mechanism.rate_matrix(self.state.values(y))
            except SimulationError as error:
                return error
        if status == OUTCOME.SINGULAR_MASS and self.structure[MODEL.CONSTRAINED]:
            try:
                self.mechanism.acceleration(self.state.values(y), self.state.speeds(y), time=t)
            except SimulationError as error:
                return error
        elif status == OUTCOME.SINGULAR_MASS:
            return describe_massless_motion(
                self.mechanism.coordinates[self.order[int(self._f[0])]].name
            )
        return SimulationError("the motion cannot be computed any further; ask for more accuracy")

    # ---------------------------------------------------------------------------------------------- reports
    def recorded(self, path: str, place: int) -> float:
        """A number in the record of an element, or of the controls, after an evaluation."""
        start = self.structure[MODEL.WORK_CONTROL] if path == CONTROLS else self._records_at[path]
        return float(self._w[start + place])

    def places_of(self, path: str, names: Iterable[str]) -> list[int]:
        """Where the work vector has what is known of an element, by the names of its kind."""
        known = self.kind_at(path).record_names
        return [self._records_at[path] + known[name] for name in names]

    def knows(self, path: str, name: str) -> bool:
        """Whether that is known of an element."""
        return name in self.kind_at(path).record_names

    def kind_at(self, path: str) -> Any:
        """Return the declaration of the force at this path."""
        element: Any = next(item for item in self.forces.elements if item.path == path)
        return element.force_type

    @property
    def work_vector(self) -> Floats:
        """The numbers that the kernels leave, laid out as `kernels/layout.py` says."""
        return self._w

    @property
    def room(self) -> int:
        """Length of the work vector."""
        return len(self._w)

    def looked(
        self,
        moments: Floats,
        places: Sequence[int],
        stage: int = STAGE.FORCE,
        udot: Floats | None = None,
    ) -> Floats:
        """What is found at some moments, all in one call of the kernels.

        Args: moments: time (s) and state (k, 1 + y). places: of the work vector (m,); from `room`
            on those of the derivative of the state. stage: up to which the states are evaluated.
            udot: accelerations (k, n) in the order of the state, whose generalized forces are found
            instead.

        Raises: SimulationError: the rates of coordinates are not defined at one of them, or a force
            cannot be computed.
        """
        if moments.shape[1] != 1 + len(self._y):
            raise self.state.wrong_length(moments.shape[1] - 1)
        law, code = "evaluate" if udot is None else "inverse", self.program.code
        code.make_ready(("look", law))
        moving = np.empty((len(moments), 0)) if udot is None else udot
        given, result = (
            np.ascontiguousarray(np.hstack([moments, moving])),
            np.empty((len(moments), len(places))),
        )
        order = np.array(
            [len(given), moving.shape[1], code.address(law), len(places), *places], dtype=np.int64
        )
        parts = (
            self.program.ints,
            self.numbers,
            self._w,
            self._y,
            self._f,
            stage,
            given,
            order,
            result,
        )
        status = self._run(code.entry("look"), *parts)
        if status != OUTCOME.OK:
            raise self.refusal(status, float(self._w[WORK.TIME]), self._y.tolist())
        return result

    def pushed(
        self, moments: Floats, udot: Floats, names: Sequence[str]
    ) -> tuple[Floats, Floats, Floats]:
        """What accelerations need while no actuator pushes, and what each actuator pushes by a control of 1.

        What an actuator pushes must be proportional to its control, and the controls of all be 0.

        Args:
            moments: time (s) and state (k, 1 + y).
            udot: accelerations (k, n) in the order of the state.
            names: paths of a actuators.

        Returns: Generalized forces that are missing (k, n), those of each actuator (k, a, n), and
            the forces (N) of muscles (k, a), 1 of other actuators. Constraints are left aside.
            Errors are those of :meth:`looked`.
        """
        code, size = self.program.code, len(self.order)
        code.make_ready(("push_each", "inverse"))
        items = {self.forces.elements[owner].path: place for place, owner in self._owners.items()}
        controls = dict(zip(self._controls.names, self.places_of_controls, strict=True))
        order = [len(moments), len(names)]
        for name in names:
            item, path, strength = items[name], -1, -1
            if self.knows(name, STRENGTH):
                path = item - int(self.structure[item + ITEM.OWN + self.kind_at(name).text.heads])
                (strength,) = self.places_of(name, (STRENGTH,))
            order += item, controls[name], path, strength
        given, result = (
            np.hstack([moments, udot]),
            np.empty((len(moments), size + len(names) * (size + 1))),
        )
        parts = self.program.ints, self.numbers, self._w, self._y, self._f, code.address("inverse")
        status = self._run(
            code.entry("push_each"), *parts, given, np.array(order, dtype=np.int64), result
        )
        if status != OUTCOME.OK:
            raise self.refusal(status, float(self._w[WORK.TIME]), self._y.tolist())
        each = result[:, size:].reshape(len(moments), len(names), size + 1)
        return result[:, :size], each[:, :, :size], each[:, :, size]

    @cached_property
    def _records_at(self) -> dict[str, int]:
        pairs = zip(self.forces.elements, self._items, strict=True)
        return {element.path: items[-1][0] for element, items in pairs if items}

    def probe_results(self, t: float, y: Sequence[float]) -> list[list[float]]:
        """What each probe gives at a state, before its operation: one number for each of its labels."""
        self.applied(t, y)
        result = []
        for probe, place in zip(self.probes, self._probe_places, strict=True):
            if probe.probe_type.measure is not None:
                result.append(list(probe.probe_type.measure(probe, self, t, y)))
                continue
            self.program.code.entry(probe.probe_type.name)(
                self.program.ints, self.numbers, self._w, self._y, self._f, place
            )
            first = self.structure[place + ITEM.RECORD]
            result.append(self._w[first : first + len(probe.reading.labels)].tolist())
        return result

    @property
    def places_of_controls(self) -> range:
        """Where the work vector has the controls of all actuators, in the order of `Controls.names`."""
        first = int(self.structure[MODEL.WORK_CONTROL])
        return range(first, first + len(self._controls.names))

    def controls(self) -> list[float]:
        """The controls of all actuators after an evaluation, in the order of `Controls.names`."""
        return self._w[self.places_of_controls].tolist()

    def touching(self, t: float, y: Sequence[float]) -> int:
        """The bits of the contacts that touch; sets `loads`."""
        self.applied(t, y)
        return int(self.loads[-1])

    def force_records(self, t: float, y: Sequence[float]) -> list[float]:
        """One number for each of the columns."""
        self.applied(t, y)
        origins = [self._origin(body) for body in range(len(self.placements))] + [(0.0, 0.0, 0.0)]
        return [
            value
            for element, records in self.read_records()
            for value in element.report(records, origins)
        ]

    def force_table(
        self, times: Sequence[float] | Floats, states: Sequence[Sequence[float]] | Floats
    ) -> Floats:
        """Return one row of the columns for each moment, with all moments evaluated in one call of the kernels.

        Args:
            times: of the moments (k,), s.
            states: in the order of the engine (k, y).

        Returns:
            Numbers (k, c), those of :meth:`force_records`.

        Raises: SimulationError: the rates of coordinates are not defined at a moment, or a force
            cannot be computed.
        """
        moments = np.column_stack(
            [times, np.asarray(states, dtype=float).reshape(len(times), len(self._y))]
        )
        result = np.zeros((len(moments), len(self.columns)))
        if not self.columns:
            return result
        slices, places = [], list[int]()
        for items in self._items:
            own = []
            for place, room in items:
                own.append(slice(len(places), len(places) + room))
                places += range(place, place + room)
            slices.append(own)
        links, size = int(self.structure[MODEL.WORK_LINK]), LINK_WORK.SIZE
        count = len(places)
        for number in range(len(self._links)):
            first = links + size * number
            places += [
                *range(first, first + 9),
                *range(first + LINK_WORK.POSITION, first + LINK_WORK.POSITION + 3),
            ]
        # The work vectors of long motions are large.
        for start in range(0, len(moments), MOMENTS_AT_ONCE):
            found = self.looked(moments[start : start + MOMENTS_AT_ONCE], places)
            origins = self._origins_of(found[:, count:].reshape(len(found), -1, 12)).tolist()
            for number, (work, known) in enumerate(
                zip(found[:, :count].tolist(), origins, strict=True), start
            ):
                rows = (
                    element.report([work[part] for part in own], known)
                    for element, own in zip(self.forces.elements, slices, strict=True)
                )
                result[number] = [value for row in rows for value in row]
        return result

    def _origins_of(self, links: Floats) -> Floats:
        """Return the origins of all bodies and of ground (k, b + 1, 3) by rotations and places of links (k, l, 12)."""
        result = np.zeros((len(links), len(self.placements) + 1, 3))
        for body, (link, frame) in enumerate(self.placements):
            offset = frame[:3, 3]
            if link == GROUND:
                result[:, body] = offset
            else:
                result[:, body] = links[:, link, 9:] + links[:, link, :9].reshape(-1, 3, 3) @ offset
        return result

    def energies(self, t: float, y: Sequence[float]) -> tuple[float, float, float]:
        """Kinetic energy, potential energy of gravity, energy stored in forces, J."""
        self.applied(t, y)
        kinetic, gravity = self._mechanical()
        gravity -= sum(
            float(mass * self.mechanism.gravity @ center) for mass, center in self.masses_in_ground
        )
        return (
            kinetic,
            gravity,
            float(sum(element.compute_energy(records) for element, records in self.read_records())),
        )

    def energy_of(self, path: str, t: float, y: Sequence[float]) -> float:
        """Energy stored in one force, J; none in one that does not act."""
        self.applied(t, y)
        return float(
            sum(
                element.compute_energy(records)
                for element, records in self.read_records()
                if element.path == path
            )
        )

    def _mechanical(self) -> tuple[float, float]:
        """Kinetic energy and potential energy of gravity of all links, after an evaluation."""
        w, inertia = self._links, self.inertia
        motion = moving(w, inertia[:, 1:4])
        rotations, turning, v = (
            w[:, :9].reshape(-1, 3, 3),
            w[:, LINK_WORK.VELOCITY : LINK_WORK.VELOCITY + 3],
            motion[:, 3:],
        )
        own = (turning[:, None, :] @ rotations)[:, 0]
        moments = inertia[:, [4, 7, 8, 7, 5, 9, 8, 9, 6]].reshape(-1, 3, 3)
        spin = np.sum(own * (moments @ own[:, :, None])[:, :, 0])
        kinetic = 0.5 * float(inertia[:, 0] @ np.sum(v * v, axis=1) + spin)
        return kinetic, -float(inertia[:, 0] @ motion[:, :3] @ self.mechanism.gravity)

    @property
    def inertia(self) -> Floats:
        """Mass, mass centre and inertia of all links (l, 10)."""
        size = layout.INERTIA.SIZE
        return self.numbers[layout.INERTIA_AT :][: size * len(self._links)].reshape(-1, size)

    @cached_property
    def masses_in_ground(self) -> list[tuple[float, Floats]]:
        """Masses and mass centres of the bodies that are fixed to ground."""
        pairs = zip(self.placements, self.mechanism.bodies, strict=True)
        fixed = [(frame, body.mass_properties) for (link, frame), body in pairs if link == GROUND]
        return [(own.mass, frame[:3, :3] @ own.center + frame[:3, 3]) for frame, own in fixed]

    def links_at(self, moments: Moments) -> Floats:
        """What the kernels find of the motion of all links at some moments (k, l, n)."""
        return self.links_of(
            np.array([(t, *y) for t, y in moments]).reshape(len(moments), 1 + len(self._y))
        )

    def links_of(self, moments: Floats, links: Sequence[int] | None = None) -> Floats:
        """What the kernels find of the motion of l links, or of all (k, l, n), at times (s) with states (k, 1 + y)."""
        first, (count, size) = int(self.structure[MODEL.WORK_LINK]), self._links.shape
        chosen = range(count) if links is None else links
        places = [first + size * link + number for link in chosen for number in range(size)]
        return self.looked(moments, places, STAGE.VELOCITY).reshape(len(moments), len(chosen), size)

    def read_records(self) -> Iterator[tuple[ForceElement, list[list[float]]]]:
        """Return each force element with the records of its items after an evaluation."""
        work = self._w.tolist()
        for element, items in zip(self.forces.elements, self._items, strict=True):
            yield element, [work[place : place + room] for place, room in items]

    def _origin(self, body: int) -> tuple[float, float, float]:
        link, frame = self.placements[body]
        x, y, z = frame[:3, 3].tolist()
        if link == GROUND:
            return x, y, z
        here = self._links[link]
        place = (
            here[LINK_WORK.POSITION : LINK_WORK.POSITION + 3]
            + here[:9].reshape(3, 3) @ frame[:3, 3]
        )
        x, y, z = place.tolist()
        return x, y, z

    def note_loads(self, forces: Floats) -> None:
        """Set `loads` from the forces (P, 3) of the contacts."""
        bits = 0
        for number, force in enumerate(forces.tolist()):
            if any(force):
                bits |= 1 << number
                self.loads[number] = tuple(force)
        self.loads[-1] = bits
