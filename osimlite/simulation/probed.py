"""What probes report along a motion: values, integrals, rates and extremes of what they read.

Integrals are states. Rates and extremes are those of Simbody's measures: from the ends of the steps
that were taken, and the moment itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import inf

from osimlite.base.records import dataclass
from osimlite.simulation.elements.probe import INTEGRATE, DeclaredProbe
from osimlite.simulation.engines.protocol import Engine

Moment = tuple[float, Sequence[float]]
"""Time (s) and state."""

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
