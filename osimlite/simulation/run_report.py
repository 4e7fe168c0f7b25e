"""What is noted during a motion: contacts that begin and end, the largest forces, counts."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import inf, sqrt
from typing import Any, NamedTuple

from osimlite.base.records import dataclass
from osimlite.simulation.elements.probe_type import INTEGRATE, DeclaredProbe
from osimlite.simulation.engines.protocol import Engine
from osimlite.simulation.stepper import Stepper

Moment = tuple[float, Sequence[float]]
"""Time (s) and state in the engine's order."""

TIME_OF_EVENT = 1e-9
"""How exactly the time of an event is found on the interpolated motion, s."""


class ContactEvent(NamedTuple):
    """A contact that begins or ends at a time (s)."""

    time: float
    contact: str
    begins: bool


class _Change(NamedTuple):
    """A step within which contacts began or ended."""

    start: float
    end: float
    state: Callable[[float], list[float]]
    before: int
    after: int


class Recorder:
    """Watches the steps of one motion.

    Contacts are those that exert a force. What begins and ends within one step is not seen. The
    largest force of a contact is that at the end of a step (or at the start of the motion).
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._loads: list[Any] = engine.loads
        self._touching = 0
        self._changes: list[_Change] = []
        self._start = self._last = 0.0
        self._numbers: dict[int, tuple[int, ...]] = {0: ()}
        self._largest = [(0.0, 0.0)] * len(engine.contacts)
        self._stepper: Stepper | None = None
        self._keeps_steps = has_memory(engine.probes)
        self._steps: list[Moment] = []

    def begin(self, stepper: Stepper) -> None:
        """Note the state that the stepper starts from, just after it was made."""
        self._stepper = stepper
        self._start = self._last = stepper.time
        self._touching = self._loads[-1]
        self.initially = self._touching
        self._steps = [(stepper.time, stepper.state)]
        self._note_forces(stepper.time)

    def observe(self, t: float, y: list[float]) -> None:
        """Note a step that was taken."""
        touching = self._loads[-1]
        if touching != self._touching:
            assert self._stepper is not None
            change = _Change(self._last, t, self._stepper.interpolant(), self._touching, touching)
            self._changes.append(change)
            self._touching = touching
        self._last = t
        if touching:
            self._note_forces(t)
        if self._keeps_steps:
            self._steps.append((t, y))

    def steps(self) -> list[Moment]:
        """The start and the ends of all steps, if a probe must know them; the start if not."""
        self._catch_up()
        return self._steps

    def largest_forces(self) -> dict[str, tuple[float, float]]:
        """By contact that ever touched, its largest force (N) and when that was (s)."""
        self._catch_up()
        return {
            name: largest
            for name, largest in zip(self._engine.contacts, self._largest, strict=True)
            if largest[0] > 0.0
        }

    def events(self) -> list[ContactEvent]:
        """All beginnings and ends in the order of their times; those at the start are the contacts there were."""
        self._catch_up()
        result = [ContactEvent(self._start, name, True) for name in self._named(self.initially)]
        for change in self._changes:
            result += sorted(self._times(change))
        return result

    def _times(self, change: _Change) -> Iterator[ContactEvent]:
        """Bisect for every contact that changed within a step."""
        for number in self._bits(change.before ^ change.after):
            bit = 1 << number
            low, high = change.start, change.end
            while high - low > TIME_OF_EVENT:
                middle = 0.5 * (low + high)
                if (self._engine.touching(middle, change.state(middle)) ^ change.after) & bit:
                    low = middle
                else:
                    high = middle
            yield ContactEvent(
                0.5 * (low + high), self._engine.contacts[number], bool(change.after & bit)
            )

    def _catch_up(self) -> None:
        if self._stepper is not None:
            self._stepper.catch_up()

    def _note_forces(self, t: float) -> None:
        for number in self._bits(self._touching):
            x, y, z = self._loads[number]
            size = sqrt(x * x + y * y + z * z)
            if size > self._largest[number][0]:
                self._largest[number] = size, t

    def _named(self, bits: int) -> list[str]:
        return [self._engine.contacts[number] for number in self._bits(bits)]

    def _bits(self, bits: int) -> tuple[int, ...]:
        """The numbers of the bits that are set."""
        known = self._numbers.get(bits)
        if known is None:
            known = tuple(number for number in range(bits.bit_length()) if bits >> number & 1)
            self._numbers[bits] = known
        return known


EXTREMES: dict[str, tuple[float, Callable[[float, float], bool]]] = {
    "minimum": (inf, lambda new, old: new < old),
    "maximum": (-inf, lambda new, old: new > old),
    "minabs": (inf, lambda new, old: abs(new) < abs(old)),
    "maxabs": (0.0, lambda new, old: abs(new) > abs(old)),
}
"""By operation, what an extreme begins with, and whether a number is a new one."""


class Extreme:
    """The least or greatest value so far, with its sign; where nothing was integrated, OpenSim takes 0 for one."""

    def __init__(self, operation: str, *, is_known: bool = False) -> None:
        self._extreme, self._is_new = EXTREMES[operation]
        if is_known:
            self._extreme = 0.0

    def at(self, t: float, value: float) -> float:
        """It at a time (s)."""
        return value if self._is_new(value, self._extreme) else self._extreme

    def take(self, t: float, value: float) -> None:
        """Note the end of a step."""
        self._extreme = self.at(t, value)


@dataclass
class Rate:
    """The rate of change since the last step: of first order in the first one, of second order from then on."""

    time: float = -inf
    value: float = 0.0
    rate: float = 0.0
    is_good: bool = False

    def at(self, t: float, value: float) -> float:
        """It at a time (s)."""
        if t == self.time or self.time == -inf:
            return self.rate
        line = (value - self.value) / (t - self.time)
        return 2.0 * line - self.rate if self.is_good else line

    def take(self, t: float, value: float) -> None:
        """Note the end of a step."""
        rate, self.is_good = self.at(t, value), self.time != -inf
        self.time, self.value, self.rate = t, value, rate


def has_memory(probes: Sequence[DeclaredProbe]) -> bool:
    """Whether what some probes report depends on the steps before."""
    return any(probe.operation not in ("value", INTEGRATE) for probe in probes)


def probe_labels(probes: Sequence[DeclaredProbe]) -> list[str]:
    """Labels of what they report, as OpenSim's ProbeReporter has them."""
    return [label for probe in probes for label in probe.reading.labels]


def probe_rows(
    engine: Engine, moments: Sequence[Moment], steps: Sequence[Moment]
) -> Iterator[list[float]]:
    """What the probes of an engine report.

    Args: engine: that computed the motion. moments: of the rows. steps: the start of the motion and
        the ends of its steps; none of a motion that is known from elsewhere.
    """

    def memory_of(operation: str) -> Rate | Extreme:
        return Rate() if operation == "differentiate" else Extreme(operation, is_known=not steps)

    memories = [
        [memory_of(probe.operation) for _ in probe.reading.labels] if has_memory([probe]) else []
        for probe in engine.probes
    ]
    waiting = list(reversed(steps)) if has_memory(engine.probes) else []
    for t, y in moments:
        while waiting and waiting[-1][0] <= t:
            time, state = waiting.pop()
            for memory, values in zip(memories, engine.probe_results(time, state), strict=True):
                for item, value in zip(memory, values, strict=False):
                    item.take(time, value)
        integrals = dict(zip(engine.state.paths, engine.state.auxiliary(y), strict=True))
        row: list[float] = []
        for probe, memory, values in zip(
            engine.probes, memories, engine.probe_results(t, y), strict=True
        ):
            if probe.operation == INTEGRATE:
                paths = [variable.path for variable in probe.states]
                values = [
                    integrals[path] + start
                    for path, start in zip(paths, probe.initial, strict=True)
                ]
            elif memory:
                values = [item.at(t, value) for item, value in zip(memory, values, strict=True)]
            row += [probe.gain * value for value in values]
        yield row


def integration_summary(
    stepper: Stepper, settings: Mapping[str, Any], wall: float
) -> dict[str, Any]:
    """How a motion was followed.

    Args:
        stepper: at the end of it.
        settings: what was asked for.
        wall: how long it took, s.
    """
    return {
        "integrator": stepper.name,
        "settings": dict(settings),
        "steps": stepper.taken,
        "attempted_steps": stepper.attempted,
        "evaluations": stepper.evaluations,
        "wall_time_s": wall,
        "interrupted": stepper.ended is not None,
        "time_reached_s": stepper.time,
    }


def result_summary(
    engine: Engine, recorder: Recorder, start: Moment, end: Moment
) -> dict[str, Any]:
    """What became of a motion: its energies at both ends, when contacts began and ended, and how hard they pushed.

    Args:
        engine: that computed it.
        recorder: that watched it.
        start: its first moment.
        end: its last one.
    """
    return {
        "energy_J": {"start": energies(engine, *start), "end": energies(engine, *end)},
        "contact_events": [
            {
                "time_s": event.time,
                "contact": event.contact,
                "event": "begin" if event.begins else "end",
            }
            for event in recorder.events()
        ],
        "largest_contact_forces": {
            name: {"force_N": size, "time_s": t}
            for name, (size, t) in recorder.largest_forces().items()
        },
    }


def energies(engine: Engine, t: float, y: Sequence[float]) -> dict[str, float]:
    """Energies at a time (s) in a state, J."""
    kinetic, gravity, stored = engine.energies(t, y)
    return {
        "kinetic": kinetic,
        "potential": gravity + stored,
        "gravity": gravity,
        "stored": stored,
        "total": kinetic + gravity + stored,
    }


def versions(engine: Engine) -> dict[str, str]:
    """Versions of what computed a motion."""
    from osimlite import __version__

    return {"osimlite": __version__, "engine": engine.version, "python": sys.version.split()[0]}
