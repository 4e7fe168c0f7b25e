"""What is noted during a motion: contacts that begin and end, the largest forces, counts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import sqrt
from typing import Any, NamedTuple

from osimlite.simulation.engines.protocol import Engine
from osimlite.simulation.probed import Moment, has_memory
from osimlite.simulation.stepper import Stepper

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
