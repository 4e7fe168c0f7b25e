"""Reflexes of muscles and coordinates, on while a leg is in some state: SCONE's
GaitStateController; functions of time; noise.

All reflexes are sums of terms ``gain * (sensor - offset)`` with a delay, functions of time sums of
terms ``gain * (t - start)**power``, which the kernels add.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from osimlite.base.quantity import warn_caller
from osimlite.base.text import join_words, suggest_or_list
from osimlite.mechanics.kernels.pointers import Ints
from osimlite.mechanics.kernels.reflexes import FREE, LIMITS, OF_RESULT, OF_SENSOR, REFLEXES, TERM
from osimlite.mechanics.kernels.walks import LEGS
from osimlite.mechanics.multibody.spatial import Array
from osimlite.studies.reflexes.parameters import Parameters
from osimlite.studies.reflexes.settings import Node, matches_pattern
from osimlite.studies.reflexes.sources import KINDS, SPEED, VALUE, Kind, Source, load
from osimlite.studies.reflexes.walkers import SIDES, Felt

STATES = "EarlyStance", "LateStance", "Liftoff", "Swing", "Landing"
COMPOSITE, FEED_FORWARD, NOISE = "CompositeController", "FeedForwardController", "NoiseController"
CONTROLLERS = "GaitStateController", "ReflexController", FEED_FORWARD, COMPOSITE
"""What is done here, and besides noise within a CompositeController."""
CONDITIONAL, OTHER = "ConditionalMuscleReflex", "_o"
"""A kind of reflexes that have a gate; the end of names of what is on the other side."""
LONGEST = 10.0
"""Delay, s."""
NEVER = -1.0
"""A threshold that has no effect."""
LARGEST_SEED = 10**15
"""Seeds below are exact as numbers of a file, and in 64 bits."""


class Part(NamedTuple):
    """A term of a reflex, or a gate: a range of a coordinate, beyond which terms rest while it moves further."""

    ints: tuple[int, ...]  # as the kernels have them
    delay: Array  # s, as the next of each candidate (w,)
    first: Array  # gain, or least value
    second: Array  # offset, or largest value


Powers = Iterable[tuple[int, Array, Array]]
"""Terms that a function of time is the sum of: power, and of each candidate start (s) and gain (w,)."""


def _read_integer(node: Node, key: str, least: int) -> int:
    number = node.number(key)
    if number not in range(least, MOST_POINTS + 1):
        raise node.error(
            f"'{key}' must be a whole number from {least} to {MOST_POINTS}, not {number:g}"
        )
    return int(number)


def _read_control_points(node: Node, parameters: Parameters, before: str) -> tuple[Array, Array]:
    """Times (n, w) and values of the control points of a function."""
    count = _read_integer(node, "control_points", 1)
    node.text("control_point_y")
    if node.get("control_point_dt") is None and count > 1:
        raise node.error("several control points need 'control_point_dt'")
    values = [parameters.of(node, "control_point_y", 0.0, f"{before}Y{k}") for k in range(count)]
    spans = [
        parameters.of(node, "control_point_dt", 0.0, f"{before}DT{k}") for k in range(count - 1)
    ]
    if np.any(np.array(spans) <= 0.0):
        raise node.error("'control_point_dt' must be positive")
    return np.cumsum([np.zeros_like(values[0]), *spans], axis=0), np.array(values)


def _make_constants(node: Node, parameters: Parameters, before: str) -> Powers:
    times, values = _read_control_points(node, parameters, before)
    return [(0, *each) for each in zip(times, np.diff(values, axis=0, prepend=0.0), strict=True)]


def _make_lines(node: Node, parameters: Parameters, before: str) -> Powers:
    """The last goes on, unless it is flat there."""
    times, values = _read_control_points(node, parameters, before)
    slopes = np.diff(values, axis=0) / np.diff(times, axis=0)
    ends = [np.zeros_like(values[:1])] if node.flag("flat_extrapolation", False) else []
    bends = np.diff(np.concatenate([np.zeros_like(values[:1]), slopes, *ends]), axis=0)
    return [(0, times[0], values[0]), *((1, *each) for each in zip(times, bends, strict=False))]


def _read_polynomial(node: Node, parameters: Parameters, before: str) -> Powers:
    degree = _read_integer(node, "degree" if node.get("order") is None else "order", 0)
    for k in range(degree + 1):
        node.text(f"coefficient{k}")
    gains = [
        parameters.of(node, f"coefficient{k}", 0.0, f"{before}C{k}") for k in range(degree + 1)
    ]
    return [(k, np.zeros_like(gain), gain) for k, gain in enumerate(gains)]


MOST_POINTS = 99
FUNCTIONS: dict[str, Callable[[Node, Parameters, str], Powers]] = {
    "PieceWiseConstant": _make_constants,
    "PieceWiseLinear": _make_lines,
    "Polynomial": _read_polynomial,
}
"""Of time, by the names that scenarios have for them."""


class Reflexes:
    """Reflexes whose legs are in one of five states (GaitStateController), reflexes alone, functions of time, noise.

    Args:
        node: of the controller.
        kind: its class.
        walkers: that it moves.
        parameters: of the candidates.

    Attributes:
        terms: of all reflexes.
        sources: what they feel, and the numbers of the sensors for it.

    Raises:
        DocumentError: it has a part that is not done here; its name and line are told.
    """

    def __init__(self, node: Node, kind: str, walkers: Felt, parameters: Parameters) -> None:
        self.walkers = walkers
        self.terms: list[Part] = []
        self.sources: dict[Source, int] = {}
        self._gates: list[Part] = []
        self._limits, self._swings_from_stance = np.zeros((walkers.count, LIMITS.HEAD)), False
        self._has_states = self._is_noisy = False
        parts = [(kind, node)]
        if kind == COMPOSITE:
            parts = [*node.all_of(*CONTROLLERS[:-1]), *node.all_of(NOISE)]
            node.expect_all_asked(f"a {COMPOSITE}", (*CONTROLLERS[:-1], NOISE))
        if any(name == "GaitStateController" for name, _ in parts):
            walkers.expect_legs()
            for leg in range(len(SIDES)):
                self._sensor(load(walkers, leg))
        for name, part in parts:
            if name == NOISE:
                self._read_noise(part)
            elif name == FEED_FORWARD:
                self._read_functions(part, parameters)
            elif name == "ReflexController":
                self.symmetric, self._is_sided = (
                    part.flag("symmetric", False),
                    part.flag("dual_sided", True),
                )
                for leg in (0, 1) if self._is_sided else (0,):
                    self._add_reflexes(part, parameters, "", leg, (1 << len(STATES)) - 1)
            elif self._has_states:
                raise part.error(
                    "legs are in the states of one GaitStateController, and this is another one"
                )
            else:
                self._has_states = self._is_sided = True
                self._read_states(part, parameters)

    def _read_noise(self, node: Node) -> None:
        """SCONE's noise of the controls; that of the sensors is ours."""
        if self._is_noisy:
            raise node.error(f"there is a {NOISE} already")
        self._is_noisy, noise = True, self._limits[:, LIMITS.SEED :]
        noise[:, 0] = seed = node.number("random_seed", 123.0)
        if not (seed.is_integer() and abs(seed) < LARGEST_SEED):
            raise node.error(
                f"'random_seed' must be a whole number of up to 15 digits, not {seed:g}"
            )
        for place, key in enumerate(
            ("base_noise", "proportional_noise", "sensor_noise", "proportional_sensor_noise")
        ):
            noise[:, 1 + place] = width = node.number(key, 0.0)
            if width < 0.0:
                raise node.error(f"'{key}' must not be negative, and is {width:g}")
        node.expect_all_asked(f"a {NOISE}")
        if node.file.endswith(".scone"):
            warn_caller(
                "noise is as large as SCONE's, but not the same: its numbers depend on the compiler of SCONE"
            )

    def _read_functions(self, node: Node, parameters: Parameters) -> None:
        """What excites actuators over time, the same on both sides if it is symmetric."""
        symmetric = node.flag("symmetric", True)
        include, exclude = node.text("include", "*"), node.text("exclude", "")
        found = [*node.all_of(*FUNCTIONS)]
        node.expect_all_asked(f"a {FEED_FORWARD}")
        if len(found) != 1:
            raise node.error(f"a {FEED_FORWARD} needs one function: {join_words(list(FUNCTIONS))}")
        kind, function = found[0]
        names = {
            k: n
            for k, n in enumerate(self.walkers.names)
            if matches_pattern(n, include) and not matches_pattern(n, exclude)
        }
        if not names:
            raise node.error(f"no actuator is in '{include}' and not in '{exclude}'")
        for target, name in names.items():
            before = name[:-2] if symmetric and name.endswith(SIDES) else name
            for power, start, gain in FUNCTIONS[kind](function, parameters, f"{before}."):
                term = target, -1, power, 0, (1 << len(STATES)) - 1, -1
                self.terms.append(
                    Part(term, start, gain * self.walkers.step**power, np.zeros_like(gain))
                )
        function.expect_all_asked(f"a {kind}")

    def _read_states(self, node: Node, parameters: Parameters) -> None:
        parameters.auto = node.number("auto_std_factor", parameters.auto)
        self.symmetric = node.flag("symmetric", True)
        for key in ("use_model_com_reference_pos", "omnidirectional"):
            if node.flag(key, False):
                raise node.error(f"{key} is not done here")
        self._swings_from_stance = node.flag("allow_stance_swing_transition", False)
        self._limits[:, LIMITS.DELAY] = (
            node.number("leg_load_sensor_delay", 0.0) / self.walkers.step
        )
        for leg, side in enumerate(SIDES):
            length = node.number("override_leg_length", self.walkers.legs[leg].length)
            prefix = "" if self.symmetric else f"leg{leg}{side}."
            of = {
                name: parameters.of(node, name, value, prefix + name)
                for name, value in (
                    ("stance_load_threshold", 0.1),
                    ("landing_threshold", 0.0),
                    ("late_stance_threshold", 0.0),
                    ("liftoff_threshold", NEVER),
                )
            }
            stance, swing = of["stance_load_threshold"], node.get("swing_load_threshold")
            loads = (
                stance,
                stance
                if swing is None
                else parameters.read(swing, prefix + "swing_load_threshold"),
            )
            ahead = (
                length * of[f"{name}_threshold"] for name in ("late_stance", "liftoff", "landing")
            )
            first = 1 + LIMITS.OF_LEG * leg
            self._limits[:, first : first + LIMITS.OF_LEG] = np.column_stack([*loads, *ahead])
        conditional = node.get("ConditionalControllers")
        if conditional is None:
            raise node.error("a GaitStateController needs ConditionalControllers")
        for _, each in conditional.all_of("ConditionalController"):
            self._add_conditional(each, parameters)
        conditional.expect_all_asked("ConditionalControllers")
        node.expect_all_asked("a GaitStateController")

    # ---------------------------------------------------------------------------------------------- reading
    def _add_conditional(self, node: Node, parameters: Parameters) -> None:
        side = node.text("legs", "")
        for mask in node.text("states").replace(";", ",").split(","):
            names = mask.split()
            for name in names:
                if name not in STATES:
                    raise node.error(f"legs have no state '{name}'{suggest_or_list(name, STATES)}")
            states = sum(1 << STATES.index(name) for name in set(names))
            prefix = f"S{states:05b}."
            for leg in range(len(SIDES)):
                if side and side.lower() not in (SIDES[leg].strip("_"), ("left", "right")[leg]):
                    continue
                for _, controller in node.all_of("ReflexController"):
                    self._add_reflexes(controller, parameters, prefix, leg, states)
        node.expect_all_asked("a ConditionalController")

    def _add_reflexes(
        self, node: Node, parameters: Parameters, prefix: str, leg: int, states: int
    ) -> None:
        symmetric = node.flag("symmetric", self.symmetric)
        blocks = [node, *(block for _, block in node.all_of("Reflexes"))]
        for block in blocks:
            for kind, reflex in block.all_of(*KINDS):
                self._add_reflex(kind, reflex, parameters, prefix, leg, states, symmetric)
            block.expect_all_asked("a ReflexController", tuple(KINDS))
        if not any(kind in KINDS for block in blocks for kind, _ in block.parts):
            raise node.error("a ReflexController needs reflexes")

    def _find_index(self, node: Node, name: str, names: list[str], leg: int) -> int:
        """The number of what has a name, with or without the side of a leg; `_o` is the other one."""
        own = name[:-2] + SIDES[1 - leg] if self._is_sided and name.endswith(OTHER) else name
        for full in (own, own + SIDES[leg]) if self._is_sided else (own,):
            if full in names:
                return names.index(full)
        beside = f" or '{own}{SIDES[leg]}'" if self._is_sided else ""
        raise node.error(f"the model has no '{own}'{beside}{suggest_or_list(own, names)}")

    def _begin_reflex(
        self, node: Node, prefix: str, leg: int, symmetric: bool, kind: Kind
    ) -> tuple[int, int, str]:
        """Numbers of the target and of the source, and what stands before the names of parameters."""
        for key in ("min_control_value", "max_control_value", *kind.refused):
            if node.get(key) is not None:
                raise node.error(f"'{key}' of reflexes is not done here")
        target = node.text("target")
        source = node.text("source", target if kind.is_own else None)

        def named(name: str) -> str:
            bare = name[:-2] if name.endswith((*SIDES, OTHER)) else name
            if not self._is_sided:
                return name
            if not symmetric:
                if name.endswith(SIDES) or bare in self.walkers.coordinates:
                    return name
                return bare + SIDES[1 - leg if name.endswith(OTHER) else leg]
            return f"{bare}{OTHER}" if name != bare and not name.endswith(SIDES[leg]) else bare

        first, second = named(target), named(source)
        own = node.text("par_name", "")
        name = named(own) if own else first if first == second else f"{first}-{second}"
        number = self._find_index(node, target, self.walkers.names, leg)
        return (
            number,
            self._find_index(node, source, kind.names(self.walkers), leg),
            f"{prefix}{name}.",
        )

    @staticmethod
    def _delay(node: Node, parameters: Parameters, before: str) -> Array:
        delay = parameters.of(node, "delay", 0.0, before + "delay")
        if np.any(delay < 0.0):
            raise node.error(f"a delay of {delay.min():g} s knows what is to come")
        if not np.all(delay <= LONGEST):
            raise node.error(
                f"a delay of {delay.max():g} s is more than {LONGEST:g} s, the longest that is remembered"
            )
        return delay

    def _sensor(self, source: Source) -> int:
        """The number of the sensor that feels something."""
        return self.sources.setdefault(source, len(self.sources))

    def _add_reflex(
        self,
        name: str,
        node: Node,
        parameters: Parameters,
        prefix: str,
        leg: int,
        states: int,
        symmetric: bool,
    ) -> None:
        kind = KINDS[name]
        node.asked.update(kind.settings)
        target, number, before = self._begin_reflex(node, prefix, leg, symmetric, kind)
        delay = self._delay(node, parameters, before)
        gate = self._gate(node, parameters, before, leg) if name == CONDITIONAL else -1
        written = {key for key, _ in node.parts}
        for letter, feel, rest, is_free in kind.channels:
            keys = {
                f"K{letter}",
                f"{letter}0",
                *(() if is_free is None else (f"allow_neg_{letter}",)),
            }
            node.asked |= keys
            if written.isdisjoint(keys):
                continue
            settings = (f"{letter}0", rest), (f"K{letter}", 0.0)
            found = {
                key: parameters.of(node, key, value, before + key)
                for key, value in (settings if kind.corrects else settings[::-1])
            }
            gain, free = (
                found[f"K{letter}"],
                is_free is None or node.flag(f"allow_neg_{letter}", is_free),
            )
            if np.any(gain != 0.0) or f"{before}K{letter}" in parameters.found:
                source = feel(self.walkers, node, number, SIDES[leg] if self._is_sided else "")
                held = FREE if free else OF_RESULT if kind.corrects else OF_SENSOR
                term = target, self._sensor(source), held, leg, states, gate
                self.terms.append(
                    Part(term, delay, -gain if kind.corrects else gain, found[f"{letter}0"])
                )
        constant = parameters.of(node, "C0", 0.0, f"{before}C0")
        if np.any(constant != 0.0) or f"{before}C0" in parameters.found:
            zero = np.zeros_like(constant)
            self.terms.append(Part((target, -1, FREE, leg, states, -1), zero, constant, zero))
        node.expect_all_asked(f"a {name}")

    def _gate(self, node: Node, parameters: Parameters, before: str, leg: int) -> int:
        """The number of the range of a ConditionalMuscleReflex."""
        if node.get("dof") is None:
            return -1
        name = node.text("dof")
        number = self._find_index(node, name, self.walkers.coordinates, leg)
        start = f"{before[:-1]}-{name}."
        delay = self._delay(node, parameters, start)
        low, high = (
            parameters.of(node, f"pos_{end}", way, f"{start}pos_{end}")
            for end, way in (("min", -1e12), ("max", 1e12))
        )
        value, speed = (
            self._sensor(feel(self.walkers, node, number, "")) for feel in (VALUE, SPEED)
        )
        self._gates.append(Part((value, speed), delay, low, high))
        return len(self._gates) - 1

    def pack(self) -> tuple[Ints, Array]:
        """What the kernels go by (see :mod:`osimlite.mechanics.kernels.reflexes`): integers, and of
        each candidate the numbers (w, r).
        """
        # What goes by sensors is added first.
        parts = [*sorted(self.terms, key=lambda term: term.ints[TERM.SENSOR] < 0), *self._gates]
        delays = [part.delay / self.walkers.step for part in parts]
        each = [(delay, part.first, part.second) for delay, part in zip(delays, parts, strict=True)]
        numbers = np.column_stack(
            [self._limits, *(column for columns in each for column in columns)]
        )
        felt = (
            np.max(delay)
            for part, delay in zip(parts, delays, strict=True)
            if part.ints[TERM.SENSOR] >= 0
        )
        kept = int(np.ceil(max([*felt, self._limits[0, LIMITS.DELAY]]))) + 2
        ints, more = [number for part in parts for number in part.ints], list[float]()
        for source in self.sources:
            ints += (
                source.kind,
                source.place,
                numbers.shape[1] + len(more) if source.numbers else source.more,
            )
            more += source.numbers
        numbers = np.column_stack([numbers, np.tile(more, (len(numbers), 1))])
        head, sensors = np.zeros(REFLEXES.HEAD, dtype=np.int64), len(self.sources)
        head[: REFLEXES.ROOM + 1] = (
            *(
                len(self.terms),
                len(self._gates),
                kept,
                sensors,
                self._has_states,
                self._swings_from_stance,
            ),
            *(numbers.shape[1], LEGS + kept * sensors),
        )
        head[REFLEXES.IS_NOISY] = self._is_noisy
        return np.array([*head, *ints], dtype=np.int64), np.ascontiguousarray(numbers)
