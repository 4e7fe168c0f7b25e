"""The compiled engine: accelerations, steps and events in machine code.

What is compiled are the functions of :mod:`osimlite.simulation.kernels` with the force laws and the step control that
they call. The code serves every model: models and parameters are arrays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from osimlite.errors import OsimliteError, SimulationError
from osimlite.multibody.dynamics import massless
from osimlite.multibody.mechanism import GROUND, Mechanism
from osimlite.simulation.constrained import Constrained
from osimlite.simulation.contact_elements import PairContact
from osimlite.simulation.elements import Forces
from osimlite.simulation.engines.batch import Batch
from osimlite.simulation.engines.machine_code import VERSION, address_of, entry_point
from osimlite.simulation.engines.protocol import Settings
from osimlite.simulation.euler import SemiImplicitEuler
from osimlite.simulation.integrators import RungeKuttaMerson
from osimlite.simulation.kernels import layout, merson
from osimlite.simulation.kernels.pack import pack
from osimlite.simulation.kernels.pointers import Floats
from osimlite.simulation.kernels.table import LAW_NUMBERS
from osimlite.simulation.states import StateLayout
from osimlite.simulation.stepper import Observer, Stepper

LOGGED_STEPS = 512
"""So many steps are taken in one call of a motion that is watched."""


def make(mechanism: Mechanism, forces: Forces, settings: Settings) -> CompiledEngine:
    """Make the engine."""
    if settings.show:
        raise SimulationError("the compiled engine shows no window; take --engine bullet for --gui")
    if settings.route not in ("auto", CompiledEngine.route):
        raise OsimliteError(f"the compiled engine has no route '{settings.route}'; there is {CompiledEngine.route}")
    return CompiledEngine(mechanism, forces)


class CompiledEngine:
    """The accelerations of a mechanism in machine code; see the protocol for what it offers.

    Args:
        mechanism: what moves.
        forces: what pushes it, besides gravity.

    Attributes:
        structure: what is connected to what, integers; equal for models that differ in numbers only.
        numbers: all numbers in one vector.
        program: the structure with the addresses of the machine code, good in this process only.

    Raises:
        UnsupportedError: a joint, a function, a constraint or a force that it does not know.
    """

    name = "compiled"
    version = VERSION
    route = "composite-rigid-body"

    def __init__(self, mechanism: Mechanism, forces: Forces) -> None:
        packed = pack(mechanism, forces)
        self.mechanism = mechanism
        self.forces = forces
        self.structure = packed.structure
        self.numbers = packed.numbers
        self.order = packed.order
        self.placements = packed.placements
        self.state = StateLayout(mechanism, self.order, forces.elements)
        self.constrained = Constrained(mechanism, self.order)
        contacts = [element for element in forces.elements if isinstance(element, PairContact)]
        self.contacts = tuple(item.pair_name(place) for item in contacts for place in range(len(item.pairs)))
        self.columns = tuple(label for element in forces.elements for label in element.columns)
        self.loads: list[Any] = [None] * len(self.contacts) + [0]
        self.program = packed.structure.copy()
        for law in packed.laws:
            self.program[layout.LAWS + LAW_NUMBERS[law]] = address_of(law)
        self._items = packed.items
        self._w = np.zeros(self.structure[layout.WORK_SIZE])
        start, links = self.structure[layout.WORK_LINK], self.structure[layout.LINKS]
        self._links = self._w[start : start + layout.LINK_WORK * links].reshape(links, layout.LINK_WORK)
        start = self.structure[layout.WORK_CONTACT]
        self._pairs = self._w[start : start + layout.CONTACT_WORK * len(self.contacts)].reshape(-1, layout.CONTACT_WORK)
        self._y, self._f = (np.zeros(self.structure[layout.STATE_SIZE]) for _ in range(2))
        self._evaluate = entry_point("evaluate")
        self._addresses = tuple(part.ctypes.data for part in (self._w, self._y, self._f))
        self.program_address: int = self.program.ctypes.data

    def __reduce__(self) -> Any:
        # Addresses mean nothing in another process.
        return CompiledEngine, (self.mechanism, self.forces)

    # ---------------------------------------------------------------------------------------- accelerations
    def derivative(self, t: float, y: Sequence[float]) -> list[float]:
        """(qdot, udot, zdot) at a state."""
        status = self._at(t, y, layout.WHOLE)
        if status != layout.FINE:
            raise self._refusal(status, t, y)
        self._note_loads(self._pairs[:, :3])
        found: list[float] = self._f.tolist()
        return found

    def _at(self, t: float, y: Sequence[float], how_far: int) -> int:
        if len(y) != len(self._y):
            raise self.state.wrong_length(len(y))
        self._w[layout.TIME] = t
        self._y[:] = y
        return self._evaluate(self.program_address, self.numbers.ctypes.data, *self._addresses, how_far)

    def acceleration(self, t: float, q: Sequence[float], u: Sequence[float]) -> list[float]:
        """Derivatives of the speeds of all coordinates, in the mechanism's order; zero if locked."""
        udot = self.derivative(t, self.state.pack(q, u))[len(self.order) : 2 * len(self.order)]
        return self.state.spread(udot, [0.0] * len(self.mechanism.coordinates))

    def _refusal(self, status: int, t: float, y: Sequence[float]) -> SimulationError:
        if not np.isfinite(np.array(y)).all():
            return SimulationError("the state of the motion is not finite any more; ask for more accuracy")
        if status == layout.SINGULAR_RATES:
            try:
                self.mechanism.rate_matrix(self.state.values(y))
            except SimulationError as error:
                return error
        if status == layout.SINGULAR_MASS and self.constrained.names:
            try:
                self.mechanism.acceleration(self.state.values(y), self.state.speeds(y), time=t)
            except SimulationError as error:
                return error
        elif status == layout.SINGULAR_MASS:
            return massless(self.mechanism.coordinates[self.order[int(self._f[0])]].name)
        return SimulationError("the motion cannot be computed any further; ask for more accuracy")

    # ---------------------------------------------------------------------------------------------- reports
    def touching(self, t: float, y: Sequence[float]) -> int:
        """The bits of the contacts that touch; sets `loads`."""
        self._touch(t, y)
        return int(self.loads[-1])

    def force_records(self, t: float, y: Sequence[float]) -> list[float]:
        """One number for each of the columns."""
        self._touch(t, y)
        origins = [self._origin(body) for body in range(len(self.placements))] + [(0.0, 0.0, 0.0)]
        row: list[float] = []
        for element, values in self._reported(y):
            row += element.record(values, origins)
        return row

    def energies(self, t: float, y: Sequence[float]) -> tuple[float, float, float]:
        """Kinetic energy, potential energy of gravity, energy stored in forces, J."""
        self._touch(t, y)
        kinetic, gravity = self._mechanical()
        for (link, frame), body in zip(self.placements, self.mechanism.bodies, strict=True):
            if link == GROUND:
                center = frame[:3, :3] @ body.mass_properties.center + frame[:3, 3]
                gravity -= body.mass_properties.mass * float(self.mechanism.gravity @ center)
        stored = sum(value[-1] for _, values in self._reported(y) for value in values if value is not None)
        return float(kinetic), float(gravity), float(stored)

    def _mechanical(self) -> tuple[float, float]:
        """Kinetic energy and potential energy of gravity of all links, after `_touch`."""
        w, links = self._links, len(self._links)
        inertia = self.numbers[layout.INERTIA_AT : layout.INERTIA_AT + 10 * links].reshape(links, 10)
        rotations, velocity = w[:, :9].reshape(-1, 3, 3), w[:, layout.VELOCITY : layout.VELOCITY + 6]
        position, origin = (w[:, place : place + 3] for place in (layout.POSITION, layout.ORIGIN))
        turning, arms = velocity[:, :3], position - origin + (rotations @ inertia[:, 1:4, None])[:, :, 0]
        v = velocity[:, 3:] + np.cross(turning, arms)
        own = (turning[:, None, :] @ rotations)[:, 0]
        moments = inertia[:, [4, 7, 8, 7, 5, 9, 8, 9, 6]].reshape(-1, 3, 3)
        spin = np.sum(own * (moments @ own[:, :, None])[:, :, 0])
        kinetic = 0.5 * float(inertia[:, 0] @ np.sum(v * v, axis=1) + spin)
        return kinetic, -float(inertia[:, 0] @ (arms + origin) @ self.mechanism.gravity)

    def _touch(self, t: float, y: Sequence[float]) -> None:
        self._at(t, y, layout.TOUCHED)
        self._note_loads(self._pairs[:, :3])

    def _reported(self, y: Sequence[float]) -> Iterator[tuple[Any, list[Any]]]:
        """Each element with what it wants for its record, after `_touch`."""
        values, speeds, work = self.state.values(y), self.state.speeds(y), self._w.tolist()
        for element, items in zip(self.forces.elements, self._items, strict=True):
            yield element, [kept for item, place in items for kept in item.kept(work[place:], values, speeds)]

    def _origin(self, body: int) -> tuple[float, float, float]:
        link, frame = self.placements[body]
        x, y, z = frame[:3, 3].tolist()
        if link == GROUND:
            return x, y, z
        here = self._links[link]
        place = here[layout.POSITION : layout.POSITION + 3] + here[:9].reshape(3, 3) @ frame[:3, 3]
        x, y, z = place.tolist()
        return x, y, z

    def _note_loads(self, forces: Floats) -> None:
        bits = 0
        for number, force in enumerate(forces.tolist()):
            if any(force):
                bits |= 1 << number
                self.loads[number] = tuple(force)
        self.loads[-1] = bits

    # ---------------------------------------------------------------------------------------------- motion
    def stepper(self, t: float, y: Sequence[float], settings: Settings, observe: Observer) -> Stepper:
        """What integrates from a state on: Runge-Kutta-Merson, or fixed steps of semi-implicit Euler."""
        if settings.fixed_step is not None:
            rates = None if all(body.mobilizer.speeds_are_rates for body in self.mechanism.bodies) else self._rates
            return SemiImplicitEuler(
                self.derivative,
                t,
                y,
                len(self.order),
                settings.fixed_step,
                rates=rates,
                observe=observe,
                names=self.state.names,
                projection=self.constrained,
            )
        return CompiledMerson(self, t, y, settings.accuracy, observe, self.state.names)

    def _rates(self, q: list[float], u: list[float]) -> list[float]:
        # They depend on nothing else.
        return self.derivative(0.0, q + u + [0.0] * len(self.state.variables))[: len(self.order)]

    def close(self) -> None:
        """Nothing is held."""

    def __enter__(self) -> CompiledEngine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class CompiledMerson(RungeKuttaMerson):
    """The same steps as its base, many of them in one call of machine code where reports are asked for.

    Args:
        engine: whose mechanism.
        t: initial time, s.
        y: initial state.
        accuracy: as OpenSim understands it.
        observe: called with (time, state) for each step, once somebody wants to know.
        names: what the entries of y are called in messages.
    """

    @property
    def name(self) -> str:
        """Of the method: the steps are its, whoever computes them."""
        return RungeKuttaMerson.__name__

    def __init__(
        self,
        engine: CompiledEngine,
        t: float,
        y: Sequence[float],
        accuracy: float,
        observe: Observer,
        names: Sequence[str],
    ) -> None:
        self._engine = engine
        count = len(engine.mechanism.coordinates)
        spare = sum(not body.mobilizer.speeds_are_rates for body in engine.mechanism.bodies)
        super().__init__(
            engine.derivative,
            t,
            y,
            len(engine.order),
            nu=len(engine.order),
            accuracy=accuracy,
            count_q=count + spare,
            count_u=count,
            observe=observe,
            names=names,
            projection=engine.constrained if engine.constrained.names else None,
        )
        self._put_off: list[tuple[Floats, Floats]] = []
        self._seen: tuple[float, list[float], Sequence[float]] = (self.time, self.state, self.derivative)

    def reports(self, times: Sequence[float]) -> Iterator[tuple[float, list[float]]]:
        """Yield (time, state) at times that do not decrease, s; the steps are those of the base."""
        for moments, rows in self._blocks(times):
            yield from zip(moments, rows.tolist(), strict=True)

    def table(self, times: Sequence[float], progress: Callable[[float], object] | None = None) -> Sequence[Any]:
        """The states at times that do not decrease (s) as an array."""
        found = []
        for moments, rows in self._blocks(times):
            found.append(rows)
            if progress is not None:
                for moment in moments:
                    progress(moment)
        table: Any = found[0] if len(found) == 1 else np.concatenate(found)
        return table  # type: ignore[no-any-return]

    def _blocks(self, times: Sequence[float]) -> Iterator[tuple[Sequence[float], Floats]]:
        """Times and states, as many as one call of machine code gives."""
        if times and times[0] < self.time:
            raise ValueError(f"t = {times[0]:.9g} s is before the present {self.time:.9g} s")
        batch = Batch(
            self._engine,
            [self.state],
            times[-1],
            self._accuracy,
            start=self.time,
            next_step=self._next_step,
            times=times,
            most_logged=LOGGED_STEPS,
            start_holds=True,
        )
        (count,), done = batch.counts, 0
        count[: merson.REPORTED] = self.taken, self.attempted, self.evaluations
        ending = merson.FULL
        while ending == merson.FULL:
            count[merson.LOGGED] = 0
            batch.run()
            (ending,), logged = batch.endings.tolist(), count[merson.LOGGED]
            self._put_off.append((batch.log[:logged].copy(), batch.forces[:logged].copy()))
            self.time, self._next_step = batch.clocks[0].tolist()
            self.state = batch.states[0].tolist()
            self.taken, self.attempted, self.evaluations = count[: merson.REPORTED].tolist()
            if ending == merson.FAILED:
                self._explain()
            reached = int(count[merson.REPORTED])
            yield times[done:reached], batch.reports[0, done:reached]
            done = reached

    def catch_up(self) -> None:
        """Call `observe` for all steps that it was not called for."""
        waiting, self._put_off = self._put_off, []
        engine, size, end = self._engine, len(self.state), self.state
        now = self.time
        for log, forces in waiting:
            for row, pushes in zip(log.tolist(), forces, strict=True):
                t, y, f = row[0], row[1 : 1 + size], row[1 + size :]
                self._previous = self._seen
                self.time, self.state, self.derivative = self._seen = t, y, f
                engine._note_loads(pushes)
                if self._observe is not None:
                    self._observe(t, y)
        self.time, self.state = now, end

    def _explain(self) -> None:
        """Raise the error that the steps in Python end with, from where the compiled ones ended."""
        self.derivative = self._evaluate(self.time, self.state)
        # A step that failed has made the next one shorter than the shortest, and the time might not move with it.
        self._next_step = max(self._next_step, 4.0 * 2.0**-52 * max(1.0, abs(self.time)))
        for _ in range(100):
            super().step()
        raise SimulationError(f"the motion cannot be computed beyond t = {self.time:.9g} s; ask for more accuracy")
