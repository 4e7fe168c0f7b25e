"""The compiled engine: accelerations, steps and events in machine code.

What is compiled are the functions of :mod:`osimlite.simulation.kernels` with the force laws and the step control that
they call, none of which knows of it. The code is kept in numba's cache, and serves every model: models and parameters
are arrays.
"""

from __future__ import annotations

import dis
import hashlib
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from math import inf
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from osimlite._require import require
from osimlite.errors import OsimliteError, SimulationError
from osimlite.forces.coordinate_limit import limit_energy, limit_force
from osimlite.forces.hunt_crossley import contact_energy
from osimlite.multibody.mechanism import GROUND, Mechanism
from osimlite.simulation.contact_elements import HuntCrossley
from osimlite.simulation.elements import CoordinateLimit, Forces
from osimlite.simulation.engines.protocol import FreeState, Settings
from osimlite.simulation.integrators import Observer, RungeKuttaMerson, SemiImplicitEuler, Stepper
from osimlite.simulation.kernels import dynamics, merson
from osimlite.simulation.kernels.arrays import Floats, numbers_of, vector_of, work_for
from osimlite.simulation.kernels.motion import FINE, SINGULAR_MASS, SINGULAR_RATES
from osimlite.simulation.kernels.pack import pack

numba = require("numba", extra="fast", purpose="the compiled engine")

LEAN = tuple(
    f"osimlite.{name}" for name in ("forces", *(f"simulation.kernels.{x}" for x in ("functions", "motion", "dynamics")))
)
"""Modules whose functions allocate nothing."""

SHARED = ("evaluate", "contacts_at", "ball", "limit_force", "contact_force")
"""Functions of them that are called, not copied to where they are called."""

LOGGED_STEPS = 2048
"""So many steps are taken in one call of a motion that is watched."""

NO_LIMIT = 2**62


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of ours in machine code, from the cache if it is there; it runs without Python's lock."""
    found: Callable[..., Any] = _compile(function, True)
    return found


@cache
def _compile(function: Any, is_kept: bool) -> Any:
    """Compile a function and all functions of ours that it calls; what is kept has its callees within."""
    scope = dict(function.__globals__)
    for name in {item.argval for item in dis.get_instructions(function) if item.opname == "LOAD_GLOBAL"}:
        value = scope.get(name)
        if isinstance(value, FunctionType) and value.__module__.startswith("osimlite."):
            scope[name] = _compile(value, False)
    copy = FunctionType(function.__code__, scope, function.__name__, function.__defaults__, None)
    # Numba looks at the time of one source file only; a kept function depends on several.
    copy.__qualname__ = f"{function.__qualname__}_{_digest()}" if is_kept else function.__qualname__
    copy.__module__ = function.__module__
    if not function.__module__.startswith(LEAN):
        return numba.njit(copy, nogil=True, cache=is_kept, error_model="numpy")
    # These work on arrays that somebody else holds; counting references to them would take half of the time.
    inline = not is_kept and function.__name__ not in SHARED
    return numba.njit(copy, nogil=True, cache=is_kept, error_model="numpy", forceinline=inline, _nrt=False)


@cache
def _digest() -> str:
    """What tells whether any source of the compiled code has changed."""
    package = Path(__file__).parents[2]
    sources = [*sorted(package.glob("forces/*.py")), *sorted(package.glob("simulation/kernels/*.py"))]
    sources += [package / "simulation" / "integrators.py", Path(__file__)]
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in sources)).hexdigest()[:12]


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
        structure: what is connected to what; equal for models that differ in numbers only.
        numbers: all numbers in one vector.

    Raises:
        UnsupportedError: a joint, a function or a force that it does not know.
    """

    name = "compiled"
    version = f"numba {numba.__version__}"
    route = "composite-rigid-body"

    def __init__(self, mechanism: Mechanism, forces: Forces) -> None:
        packed = pack(mechanism, forces)
        self.mechanism = mechanism
        self.forces = forces
        self.structure = packed.structure
        self.numbers = vector_of(packed.numbers)
        self.order = packed.order
        self.placements = packed.placements
        self.state = FreeState(mechanism, self.order)
        contacts = [element for element in forces.elements if isinstance(element, HuntCrossley)]
        self.contacts = tuple(item.pair_name(place) for item in contacts for place in range(len(item.pairs)))
        self.columns = tuple(label for element in forces.elements for label in element.columns)
        self.loads: list[Any] = [None] * len(self.contacts) + [0]
        self._views = numbers_of(self.structure, self.numbers)
        self._work = work_for(self.structure)
        self._f = np.zeros(2 * len(self.order))
        self._evaluate = compiled(dynamics.evaluate)

    # ---------------------------------------------------------------------------------------- accelerations
    def derivative(self, t: float, y: Sequence[float]) -> list[float]:
        """(qdot, udot) at a state."""
        status = self._evaluate(self.structure, self._views, self._work, np.array(y, dtype=float), self._f)
        if status != FINE:
            raise self._refusal(status, y)
        self._note_loads(self._work.contacts[:, :3])
        found: list[float] = self._f.tolist()
        return found

    def acceleration(self, t: float, q: Sequence[float], u: Sequence[float]) -> list[float]:
        """Derivatives of the speeds of all coordinates, in the mechanism's order; zero if locked."""
        udot = self.derivative(t, self.state.pack(q, u))[len(self.order) :]
        return self.state.spread(udot, [0.0] * len(self.mechanism.coordinates))

    def _refusal(self, status: int, y: Sequence[float]) -> SimulationError:
        if not np.isfinite(np.array(y)).all():
            return SimulationError("the state of the motion is not finite any more; ask for more accuracy")
        if status == SINGULAR_RATES:
            try:
                self.mechanism.rate_matrix(self.state.values(y))
            except SimulationError as error:
                return error
        if status == SINGULAR_MASS:
            name = self.mechanism.coordinates[self.order[int(self._f[0])]].name
            return SimulationError(
                f"coordinate '{name}' moves no mass, or a negative inertia; "
                "give the bodies beyond its joint mass and inertia, or lock it"
            )
        return SimulationError("the motion cannot be computed any further; ask for more accuracy")

    # ---------------------------------------------------------------------------------------------- reports
    def touching(self, t: float, y: Sequence[float]) -> int:
        """The bits of the contacts that touch; sets `loads`."""
        self._touch(y)
        return int(self.loads[-1])

    def force_records(self, t: float, y: Sequence[float]) -> list[float]:
        """One number for each of the columns."""
        self._touch(y)
        origins = [self._origin(body) for body in range(len(self.placements))] + [(0.0, 0.0, 0.0)]
        row: list[float] = []
        for element, values in self._reported(y):
            row += element.record(values, origins)
        return row

    def energies(self, t: float, y: Sequence[float]) -> tuple[float, float, float]:
        """Kinetic energy, potential energy of gravity, energy stored in forces, J."""
        self._touch(y)
        kinetic, gravity = self._mechanical()
        for (link, frame), body in zip(self.placements, self.mechanism.bodies, strict=True):
            if link == GROUND:
                center = frame[:3, :3] @ body.mass_properties.center + frame[:3, 3]
                gravity -= body.mass_properties.mass * float(self.mechanism.gravity @ center)
        stored = sum(value[-1] for _, values in self._reported(y) for value in values if value is not None)
        return float(kinetic), float(gravity), float(stored)

    def _mechanical(self) -> tuple[float, float]:
        """Kinetic energy and potential energy of gravity of all links, after `_touch`."""
        w, inertia = self._work, self._views.inertia
        rotations, turning = w.rotation.reshape(-1, 3, 3), w.velocity[:, :3]
        arms = w.position - w.origin + (rotations @ inertia[:, 1:4, None])[:, :, 0]
        v = w.velocity[:, 3:] + np.cross(turning, arms)
        own = (turning[:, None, :] @ rotations)[:, 0]
        moments = inertia[:, [4, 7, 8, 7, 5, 9, 8, 9, 6]].reshape(-1, 3, 3)
        spin = np.sum(own * (moments @ own[:, :, None])[:, :, 0])
        kinetic = 0.5 * float(inertia[:, 0] @ np.sum(v * v, axis=1) + spin)
        return kinetic, -float(inertia[:, 0] @ (arms + w.origin) @ self._views.gravity)

    def _touch(self, y: Sequence[float]) -> None:
        self._evaluate(self.structure, self._views, self._work, np.array(y, dtype=float), self._f)
        self._note_loads(self._work.contacts[:, :3])

    def _reported(self, y: Sequence[float]) -> Iterator[tuple[Any, list[Any]]]:
        """Each element with what it wants for its record, after `_touch`."""
        values, speeds = self.state.values(y), self.state.speeds(y)
        rows = iter(self._work.contacts.tolist())
        for element in self.forces.elements:
            if isinstance(element, HuntCrossley):
                found: list[Any] = []
                for pair, row in zip(element.pairs, rows, strict=False):
                    energy = contact_energy(row[6], row[7], pair.effective[0])
                    found.append((*row[:6], energy) if row[6] > 0.0 else None)
                yield element, found
            elif isinstance(element, CoordinateLimit):
                q, (Ku, qu, Kl, ql, _, t) = values[element.coordinate], element.constants
                force = limit_force(q, speeds[element.coordinate], *element.constants)
                yield element, [(force, limit_energy(q, Ku, qu, Kl, ql, t))]

    def _origin(self, body: int) -> tuple[float, float, float]:
        link, frame = self.placements[body]
        x, y, z = frame[:3, 3].tolist()
        found: tuple[float, float, float] = dynamics.station(self._work, link, x, y, z)
        return found

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
        infos = [self.mechanism.coordinates[place] for place in self.order]
        names = [info.name for info in infos] + [f"the speed of {info.name}" for info in infos]
        if settings.fixed_step is not None:
            rates = None if all(body.mobilizer.speeds_are_rates for body in self.mechanism.bodies) else self._rates
            return SemiImplicitEuler(
                self.derivative, t, y, len(self.order), settings.fixed_step, rates=rates, observe=observe, names=names
            )
        return CompiledMerson(self, t, y, settings.accuracy, observe, names)

    def _rates(self, q: list[float], u: list[float]) -> list[float]:
        return self.derivative(0.0, q + u)[: len(self.order)]

    def control(self, limit: float, accuracy: float, most_tries: int = NO_LIMIT) -> merson.Control:
        """How to run up to a time (s)."""
        # Simbody counts locked coordinates too, and the fourth number that it keeps for three angles.
        count = len(self.mechanism.coordinates)
        spare = sum(not body.mobilizer.speeds_are_rates for body in self.mechanism.bodies)
        return merson.Control(float(limit), float(accuracy), inf, 0.0, count + spare, count, most_tries)

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
        control = engine.control(t, accuracy)
        super().__init__(
            engine.derivative,
            t,
            y,
            len(engine.order),
            accuracy=accuracy,
            count_q=control.count_q,
            count_u=count,
            observe=observe,
            names=names,
        )
        self._put_off: list[tuple[Floats, Floats]] = []
        self._seen: tuple[float, list[float], Sequence[float]] = (self.time, self.state, self.derivative)

    def reports(self, times: Sequence[float]) -> Iterator[tuple[float, list[float]]]:
        """Yield (time, state) at times that do not decrease, s; the steps are those of the base."""
        engine, size, pairs = self._engine, len(self.state), len(self._engine.contacts)
        if times and times[0] < self.time:
            raise ValueError(f"t = {times[0]:.9g} s is before the present {self.time:.9g} s")
        clocks = np.array(((self.time, self._next_step),))
        counts = np.array(((self.taken, self.attempted, self.evaluations, 0, 0, 0),), dtype=np.int64)
        rows, states = np.array((self.state,), dtype=float), np.zeros((1, len(times), size))
        control, moments = engine.control(times[-1], self._accuracy), np.array(times, dtype=float)
        run, done, endings = compiled(merson.run_several), 0, np.array((merson.FULL,))
        while endings[0] == merson.FULL:
            logs, forces = np.zeros((1, LOGGED_STEPS, 1 + 2 * size)), np.zeros((1, LOGGED_STEPS, pairs, 3))
            counts[0, merson.LOGGED] = 0
            run(
                engine.structure, engine.numbers[None], clocks, counts, rows, control, moments, states,
                np.zeros((1, 0, 3)), np.zeros((1, 0, 2)), np.zeros((0, 3), dtype=np.int64), np.zeros((0, 7)),
                logs, forces, endings, 0, 1,
            )  # fmt: skip
            (clock,), (count,), (y,), log = clocks.tolist(), counts.tolist(), rows.tolist(), logs[0]
            logged = count[merson.LOGGED]
            self._put_off.append((log[:logged], forces[0, :logged]))
            self.time, self._next_step, self.state = clock[0], clock[1], y
            self.taken, self.attempted, self.evaluations = count[:3]
            if endings[0] == merson.FAILED:
                self._explain()
            reached = count[merson.REPORTED]
            yield from zip(times[done:reached], states[0, done:reached], strict=True)
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
        for _ in range(100):
            super().step()
        raise SimulationError(f"the motion cannot be computed beyond t = {self.time:.9g} s; ask for more accuracy")
