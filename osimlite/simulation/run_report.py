"""Reports of a run: contact events, largest forces, probes and the summary."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import inf, sqrt
from typing import Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.simulation.elements.probe_type import INTEGRATE, DeclaredProbe
from osimlite.simulation.engines.protocol import Engine
from osimlite.simulation.stepper import Stepper

Moment = tuple[float, Sequence[float]]
"""Time (s) and state in the engine's order."""

EVENT_TIME_TOLERANCE_S = 1e-9
"""Accuracy of the times of events on the interpolated motion, s."""


class ContactEvent(NamedTuple):
    """Begin or end of a contact.

    Attributes:
        time: time of the event, s.
        contact: name of the contact.
        begins: whether the contact begins; else it ends.
    """

    time: float
    contact: str
    begins: bool


class _ContactChange(NamedTuple):
    """Step within which contacts began or ended.

    Attributes:
        start: start of the step, s.
        end: end of the step, s.
        state: interpolation of the state within the step.
        before: one bit for each contact that touched at the start.
        after: one bit for each contact that touches at the end.
    """

    start: float
    end: float
    state: Callable[[float], list[float]]
    before: int
    after: int


class Recorder:
    """Observer of the steps of one motion.

    A contact touches while it exerts a force. Contacts that begin and end within one step are
    missed. The largest force of a contact is taken from the ends of the steps and the start of the
    motion.

    Args:
        engine: engine that computes the motion; its `loads` belong to the step that is observed.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._loads: list[Any] = engine.loads
        # One bit for each contact that touches, at the start and after the last step.
        self._initially_touching = self._touching = 0
        self._changes: list[_ContactChange] = []
        self._start = self._last = 0.0
        self._set_bits: dict[int, tuple[int, ...]] = {0: ()}
        # Largest force (N) of each contact, and its time (s).
        self._largest = [(0.0, 0.0)] * len(engine.contacts)
        self._stepper: Stepper | None = None
        self._keeps_steps = need_steps(engine.probes)
        self._steps: list[Moment] = []

    def start(self, stepper: Stepper) -> None:
        """Record the initial state, directly after the stepper was made."""
        self._stepper = stepper
        self._start = self._last = stepper.time
        # The last entry of the loads has one bit for each contact that touches.
        self._initially_touching = self._touching = self._loads[-1]
        self._steps = [(stepper.time, stepper.state)]
        self._update_largest_forces(stepper.time)

    def observe_step(self, t: float, y: list[float]) -> None:
        """Record an accepted step.

        Args:
            t: time at its end, s.
            y: state at its end.
        """
        touching = self._loads[-1]
        if touching != self._touching:
            assert self._stepper is not None
            # The interpolant is stored; events are located when the summary is read.
            change = _ContactChange(
                self._last, t, self._stepper.make_interpolant(), self._touching, touching
            )
            self._changes.append(change)
            self._touching = touching
        self._last = t
        if touching:
            self._update_largest_forces(t)
        if self._keeps_steps:
            self._steps.append((t, y))

    def get_steps(self) -> list[Moment]:
        """Return the start and the ends of all steps if a probe needs them, else the start alone."""
        self._observe_outstanding_steps()
        return self._steps

    def get_largest_forces(self) -> dict[str, tuple[float, float]]:
        """Return the largest contact forces.

        Returns:
            Force (N) and its time (s) by contact, for contacts that touched.
        """
        self._observe_outstanding_steps()
        return {
            name: largest
            for name, largest in zip(self._engine.contacts, self._largest, strict=True)
            if largest[0] > 0.0
        }

    def locate_events(self) -> list[ContactEvent]:
        """Return the begins and ends of all contacts in order of time.

        Contacts that touch at the start of the motion begin there.
        """
        self._observe_outstanding_steps()
        result = [
            ContactEvent(self._start, name, begins=True)
            for name in self._get_contact_names(self._initially_touching)
        ]
        for change in self._changes:
            result += sorted(self._locate_changes(change))
        return result

    def _locate_changes(self, change: _ContactChange) -> Iterator[ContactEvent]:
        """Yield the events of a step in which contacts changed, located by bisection.

        Args:
            change: the step.
        """
        for contact_index in self._get_set_bits(change.before ^ change.after):
            bit = 1 << contact_index
            low, high = change.start, change.end
            # Bisection, since the force of a contact is not smooth where it begins.
            # The bit at the middle says in which half the contact changed.
            while high - low > EVENT_TIME_TOLERANCE_S:
                middle = 0.5 * (low + high)
                if (
                    self._engine.find_touching_contacts(middle, change.state(middle)) ^ change.after
                ) & bit:
                    low = middle
                else:
                    high = middle
            yield ContactEvent(
                0.5 * (low + high),
                self._engine.contacts[contact_index],
                begins=bool(change.after & bit),
            )

    def _observe_outstanding_steps(self) -> None:
        """Observe the steps that the stepper has taken but not reported yet."""
        if self._stepper is not None:
            self._stepper.catch_up()

    def _update_largest_forces(self, t: float) -> None:
        """Record the forces of the touching contacts that are the largest so far.

        Args:
            t: time, s.
        """
        for contact_index in self._get_set_bits(self._touching):
            x, y, z = self._loads[contact_index]
            size = sqrt(x * x + y * y + z * z)
            if size > self._largest[contact_index][0]:
                self._largest[contact_index] = size, t

    def _get_contact_names(self, bits: int) -> list[str]:
        """Return the names of the contacts whose bits are set."""
        return [self._engine.contacts[contact_index] for contact_index in self._get_set_bits(bits)]

    def _get_set_bits(self, bits: int) -> tuple[int, ...]:
        """Return the indices of the bits that are set."""
        # Feet touch in few combinations, so the indices of each are cached.
        indices = self._set_bits.get(bits)
        if indices is None:
            indices = tuple(index for index in range(bits.bit_length()) if bits >> index & 1)
            self._set_bits[bits] = indices
        return indices


EXTREME_RULES: dict[str, tuple[float, Callable[[float, float], bool]]] = {
    "minimum": (inf, lambda new, old: new < old),
    "maximum": (-inf, lambda new, old: new > old),
    "minabs": (inf, lambda new, old: abs(new) < abs(old)),
    "maxabs": (0.0, lambda new, old: abs(new) > abs(old)),
}
"""Initial value of the extreme of each operation, and the comparison by which a number replaces it."""


class Extreme:
    """Smallest or largest value so far, with its sign.

    Args:
        operation: a key of `EXTREME_RULES`.
        starts_at_zero: whether the search starts at 0, as in OpenSim for a prescribed motion, which is
            not integrated.
    """

    def __init__(self, operation: str, *, starts_at_zero: bool = False) -> None:
        self._extreme, self._is_new = EXTREME_RULES[operation]
        if starts_at_zero:
            self._extreme = 0.0

    def evaluate(self, t: float, value: float) -> float:
        """Return the extreme at a time.

        Args:
            t: time, s.
            value: value at this time.
        """
        return value if self._is_new(value, self._extreme) else self._extreme

    def accept(self, t: float, value: float) -> None:
        """Record the value at the end of a step.

        Args:
            t: time, s.
            value: value at this time.
        """
        self._extreme = self.evaluate(t, value)


@dataclass
class Rate:
    """Rate of change since the last step, as Simbody's Measure::Differentiate computes it.

    The first step gives the slope of a line, of first order. Later steps give the slope at the end
    of the parabola through both values with the earlier rate at its start, of second order.

    Attributes:
        time: time of the last accepted value, s; minus infinity before the first.
        value: value at this time.
        rate: rate at this time.
        is_good: whether `rate` is the result of a step.
    """

    time: float = -inf
    value: float = 0.0
    rate: float = 0.0
    is_good: bool = False

    def evaluate(self, t: float, value: float) -> float:
        """Return the rate at a time.

        Args:
            t: time, s.
            value: value at this time.
        """
        # At the first time there is no earlier value.
        if t == self.time or self.time == -inf:
            return self.rate
        line = (value - self.value) / (t - self.time)
        # The mean slope of a parabola is the mean of the slopes at its ends.
        return 2.0 * line - self.rate if self.is_good else line

    def accept(self, t: float, value: float) -> None:
        """Record the value at the end of a step.

        Args:
            t: time, s.
            value: value at this time.
        """
        rate = self.evaluate(t, value)
        self.is_good = self.time != -inf
        self.time, self.value, self.rate = t, value, rate


def need_steps(probes: Sequence[DeclaredProbe]) -> bool:
    """Return whether a result of some probes depends on earlier steps."""
    return any(probe.operation not in ("value", INTEGRATE) for probe in probes)


def list_probe_labels(probes: Sequence[DeclaredProbe]) -> list[str]:
    """Return the labels of the probes' results as OpenSim's ProbeReporter has them."""
    return [label for probe in probes for label in probe.reading.labels]


def compute_probe_rows(
    engine: Engine, moments: Sequence[Moment], steps: Sequence[Moment]
) -> Iterator[list[float]]:
    """Yield the results of the engine's probes at times.

    Integrals are states. Rates and extremes are those of Simbody's measures: they follow from the
    ends of the accepted steps and from the present state.

    Args:
        engine: engine that computed the motion.
        moments: times (s) and states of the rows.
        steps: start of the motion and ends of its steps; empty for a motion that was not
            integrated.
    """

    def make_memory(operation: str) -> Rate | Extreme:
        """Return the state of a measure that depends on earlier steps."""
        return (
            Rate() if operation == "differentiate" else Extreme(operation, starts_at_zero=not steps)
        )

    memories = [
        [make_memory(probe.operation) for _ in probe.reading.labels] if need_steps([probe]) else []
        for probe in engine.probes
    ]
    # Steps and rows are merged in order of time; `pop` takes the earliest from the end.
    waiting = list(reversed(steps)) if need_steps(engine.probes) else []
    for t, y in moments:
        while waiting and waiting[-1][0] <= t:
            time, state = waiting.pop()
            for memory, values in zip(memories, engine.evaluate_probes(time, state), strict=True):
                for item, value in zip(memory, values, strict=False):
                    item.accept(time, value)
        integrals = dict(zip(engine.state.paths, engine.state.auxiliary(y), strict=True))
        row: list[float] = []
        for probe, memory, values in zip(
            engine.probes, memories, engine.evaluate_probes(t, y), strict=True
        ):
            if probe.operation == INTEGRATE:
                paths = [variable.path for variable in probe.states]
                values = [
                    integrals[path] + start
                    for path, start in zip(paths, probe.initial, strict=True)
                ]
            elif memory:
                values = [
                    item.evaluate(t, value) for item, value in zip(memory, values, strict=True)
                ]
            row += [probe.gain * value for value in values]
        yield row


def summarize_integration(
    stepper: Stepper, settings: Mapping[str, Any], wall: float
) -> dict[str, Any]:
    """Return the summary of an integration as JSON-ready data.

    Args:
        stepper: the stepper at the end of the motion.
        settings: the requested options.
        wall: computing time, s.

    Returns:
        Integrator, settings and counts.
    """
    return {
        "integrator": stepper.name,
        "settings": dict(settings),
        "steps": stepper.accepted,
        "attempted_steps": stepper.attempted,
        "evaluations": stepper.evaluations,
        "wall_time_s": wall,
        "interrupted": stepper.ended is not None,
        "time_reached_s": stepper.time,
    }


def summarize_result(
    engine: Engine, recorder: Recorder, start: Moment, end: Moment
) -> dict[str, Any]:
    """Return the summary of a motion as JSON-ready data.

    Args:
        engine: engine that computed the motion.
        recorder: recorder of the motion.
        start: first time and state.
        end: last time and state.

    Returns:
        Energies at both ends, contact events, and the largest contact forces.
    """
    return {
        "energy_J": {
            "start": compute_energies(engine, *start),
            "end": compute_energies(engine, *end),
        },
        "contact_events": [
            {
                "time_s": event.time,
                "contact": event.contact,
                "event": "begin" if event.begins else "end",
            }
            for event in recorder.locate_events()
        ],
        "largest_contact_forces": {
            name: {"force_N": size, "time_s": t}
            for name, (size, t) in recorder.get_largest_forces().items()
        },
    }


def compute_energies(engine: Engine, t: float, y: Sequence[float]) -> dict[str, float]:
    """Compute the energies at a time (s) in a state.

    Returns:
        Energies (J) by name.
    """
    kinetic, gravity, stored = engine.compute_energies(t, y)
    return {
        "kinetic": kinetic,
        "potential": gravity + stored,
        "gravity": gravity,
        "stored": stored,
        "total": kinetic + gravity + stored,
    }


def collect_versions(engine: Engine) -> dict[str, str]:
    """Return the versions of the programs that computed a motion.

    Returns:
        Versions of osimlite, the engine and Python.
    """
    from osimlite import __version__

    return {"osimlite": __version__, "engine": engine.version, "python": sys.version.split()[0]}
