"""Controllers of SCONE as data of the kernels: reflexes, states of legs, functions of time, noise.

Supported are GaitStateController, ReflexController, FeedForwardController, CompositeController and
NoiseController. The kernels add terms `gain * (sensor - offset)` with a delay, which may depend on
the state of a leg, and terms `gain * (t - start)**power`; see
:mod:`osimlite.mechanics.kernels.reflexes`.
"""

from __future__ import annotations

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.quantity import warn_caller
from osimlite.base.text import join_words, suggest_or_list
from osimlite.mechanics.kernels.pointers import Ints
from osimlite.mechanics.kernels.reflexes import LIMITS, REFLEXES, TERM, TERM_TYPE
from osimlite.mechanics.kernels.walks import LEGS
from osimlite.mechanics.multibody.spatial import Array
from osimlite.studies.reflexes.parameters import Parameters
from osimlite.studies.reflexes.settings import SettingNode, matches_pattern
from osimlite.studies.reflexes.sources import (
    REFLEX_TYPES,
    SPEED_SOURCE,
    VALUE_SOURCE,
    ReflexType,
    Source,
    make_load_source,
)
from osimlite.studies.reflexes.time_functions import TIME_FUNCTIONS
from osimlite.studies.reflexes.walkers import SIDES, SensedModel

LEG_STATES = "EarlyStance", "LateStance", "Liftoff", "Swing", "Landing"
"""States of a leg by SCONE's names, in the order of the numbers that the kernels give them."""
ALL_LEG_STATES = (1 << len(LEG_STATES)) - 1
"""Bit mask of all states of a leg: a term that is always active."""
COMPOSITE = "CompositeController"
"""Controller that adds others."""
FEED_FORWARD = "FeedForwardController"
"""Controller of functions of time."""
NOISE = "NoiseController"
"""Controller of noise, which is supported within a CompositeController only."""
CONTROLLERS = "GaitStateController", "ReflexController", FEED_FORWARD, COMPOSITE
"""Controllers that a scenario may have; all but the last may be parts of the last."""
CONDITIONAL = "ConditionalMuscleReflex"
"""Type of reflexes that a range of a coordinate gates."""
OTHER_SIDE_SUFFIX = "_o"
"""Ending of names for the leg opposite to that of the reflex."""
MAX_DELAY_S = 10.0
"""Longest delay (s), which bounds the history of the sensors."""
DISABLED_THRESHOLD = -1.0
"""Liftoff threshold in leg lengths that has no effect: no foot is a leg length behind the pelvis."""
MAX_NOISE_SEED = 10**15
"""Seeds are below this number, so that they are exact as floating-point numbers and in 64 bits."""


class TermOrGate(NamedTuple):
    """Term of a controller, or a gate.

    A gate is a range of a coordinate beyond which terms rest while the coordinate moves away.

    Attributes:
        ints: integers for the kernels: `TERM`, or for a gate the sensors of the coordinate and its
            speed.
        delay: delay (w,) (s); of a term without a sensor the time at which it starts.
        first: gain of a term, or smallest value of a gate (w,).
        second: offset of a term, or largest value of a gate (w,).
    """

    ints: tuple[int, ...]
    delay: Array
    first: Array
    second: Array


class Reflexes:
    """Controller of a scenario with its parts, compiled for a number of candidates.

    Args:
        node: node of the controller.
        controller_type: name of the controller's class, one of `CONTROLLERS`.
        walkers: model with its actuators, legs and sensors.
        parameters: values of the parameters of all candidates.

    Attributes:
        terms: terms of all parts.
        sources: sensors that the terms use, with their indices.

    Raises:
        DocumentError: the controller has a part that is not supported; the error has its name and
            line.
    """

    def __init__(
        self, node: SettingNode, controller_type: str, walkers: SensedModel, parameters: Parameters
    ) -> None:
        self.walkers = walkers
        self.terms: list[TermOrGate] = []
        self.sources: dict[Source, int] = {}
        self._gates: list[TermOrGate] = []
        self._limits = np.zeros((walkers.count, LIMITS.HEAD))
        self._swings_from_stance = False
        self._has_states = False
        self._is_noisy = False
        controllers = [(controller_type, node)]
        # Noise is the last part: it is added to what all other parts compute.
        if controller_type == COMPOSITE:
            controllers = [*node.select_all(*CONTROLLERS[:-1]), *node.select_all(NOISE)]
            node.refuse_unread_parts(f"a {COMPOSITE}", (*CONTROLLERS[:-1], NOISE))
        # The kernels expect the loads of the legs as the first two sensors.
        if any(name == "GaitStateController" for name, _ in controllers):
            walkers.expect_legs()
            for leg in range(len(SIDES)):
                self._add_sensor(make_load_source(walkers, leg))
        for name, controller in controllers:
            if name == NOISE:
                self._read_noise(controller)
            elif name == FEED_FORWARD:
                self._read_functions(controller, parameters)
            elif name == "ReflexController":
                # A ReflexController alone is not symmetric by default, one within a
                # GaitStateController is.
                self.symmetric = controller.flag("symmetric", False)
                self._is_sided = controller.flag("dual_sided", True)
                for leg in (0, 1) if self._is_sided else (0,):
                    self._add_reflexes(controller, parameters, "", leg, ALL_LEG_STATES)
            # The kernels store one state per leg, so that two gait state machines cannot coexist.
            elif self._has_states:
                raise controller.error(
                    "legs are in the states of one GaitStateController, and this is another one"
                )
            else:
                self._has_states = self._is_sided = True
                self._read_states(controller, parameters)

    def _read_noise(self, node: SettingNode) -> None:
        """Read the noise of controls, as in SCONE, and of sensors, which is an addition of ours."""
        if self._is_noisy:
            raise node.error(f"this controller has a second {NOISE}; keep one")
        self._is_noisy = True
        noise = self._limits[:, LIMITS.SEED :]
        noise[:, 0] = seed = node.number("random_seed", 123.0)
        # Numbers of the kernels are doubles, and the seed is one of them.
        if not (seed.is_integer() and abs(seed) < MAX_NOISE_SEED):
            raise node.error(
                f"'random_seed' must be a whole number of up to 15 digits, not {seed:g}"
            )
        for index, key in enumerate(
            ("base_noise", "proportional_noise", "sensor_noise", "proportional_sensor_noise")
        ):
            noise[:, 1 + index] = width = node.number(key, 0.0)
            if width < 0.0:
                raise node.error(f"'{key}' must not be negative, but is {width:g}")
        node.refuse_unread_parts(f"a {NOISE}")
        # Python data and YAML are written for osimlite, so that only users of SCONE may expect its
        # noise.
        if node.file.endswith(".scone"):
            warn_caller(
                "the noise is as large as in SCONE, but its random numbers differ: those of SCONE depend on its compiler"
            )

    def _read_functions(self, node: SettingNode, parameters: Parameters) -> None:
        """Read a function of time for some actuators.

        A symmetric function has the same parameters on both sides.
        """
        symmetric = node.flag("symmetric", True)
        include = node.text("include", "*")
        exclude = node.text("exclude", "")
        functions = [*node.select_all(*TIME_FUNCTIONS)]
        node.refuse_unread_parts(f"a {FEED_FORWARD}")
        if len(functions) != 1:
            raise node.error(
                f"a {FEED_FORWARD} needs one function; supported: {join_words(list(TIME_FUNCTIONS))}"
            )
        function_type, function = functions[0]
        names = {
            k: n
            for k, n in enumerate(self.walkers.names)
            if matches_pattern(n, include) and not matches_pattern(n, exclude)
        }
        if not names:
            raise node.error(
                f"no actuator matches include = '{include}' without matching exclude = '{exclude}'"
            )
        for target, name in names.items():
            # Without its side the name of a parameter is the same for both legs.
            prefix = name[:-2] if symmetric and name.endswith(SIDES) else name
            for power, start, gain in TIME_FUNCTIONS[function_type](
                function, parameters, f"{prefix}."
            ):
                term = target, -1, power, 0, ALL_LEG_STATES, -1
                # The kernels count time in control steps.
                self.terms.append(
                    TermOrGate(term, start, gain * self.walkers.step**power, np.zeros_like(gain))
                )
        function.refuse_unread_parts(f"a {function_type}")

    def _read_states(self, node: SettingNode, parameters: Parameters) -> None:
        """Read the thresholds of a GaitStateController and its conditional reflexes."""
        parameters.auto_std_factor = node.number("auto_std_factor", parameters.auto_std_factor)
        self.symmetric = node.flag("symmetric", True)
        options = ("use_model_com_reference_pos", "omnidirectional")
        node.refuse_flags("a GaitStateController", options)
        self._swings_from_stance = node.flag("allow_stance_swing_transition", False)
        self._limits[:, LIMITS.DELAY] = (
            node.number("leg_load_sensor_delay", 0.0) / self.walkers.step
        )
        for leg, side in enumerate(SIDES):
            # Thresholds of foot positions are relative to the length of the leg.
            length = node.number("override_leg_length", self.walkers.legs[leg].length)
            prefix = "" if self.symmetric else f"leg{leg}{side}."
            thresholds = {
                name: parameters.get_number(node, name, value, prefix + name)
                for name, value in (
                    ("stance_load_threshold", 0.1),
                    ("landing_threshold", 0.0),
                    ("late_stance_threshold", 0.0),
                    ("liftoff_threshold", DISABLED_THRESHOLD),
                )
            }
            stance = thresholds["stance_load_threshold"]
            swing = node.get("swing_load_threshold")
            # One load threshold serves both transitions unless the scenario sets a second one for
            # swing, which makes a hysteresis.
            loads = (
                stance,
                stance
                if swing is None
                else parameters.parse_number(swing, prefix + "swing_load_threshold"),
            )
            position_limits = (
                length * thresholds[f"{name}_threshold"]
                for name in ("late_stance", "liftoff", "landing")
            )
            first_column = 1 + LIMITS.OF_LEG * leg
            self._limits[:, first_column : first_column + LIMITS.OF_LEG] = np.column_stack(
                [*loads, *position_limits]
            )
        conditional = node.get("ConditionalControllers")
        if conditional is None:
            raise node.error("a GaitStateController needs ConditionalControllers")
        for _, controller in conditional.select_all("ConditionalController"):
            self._add_conditional(controller, parameters)
        conditional.refuse_unread_parts("ConditionalControllers")
        node.refuse_unread_parts("a GaitStateController")

    # ---------------------------------------------------------------------------------------------- reading
    def _add_conditional(self, node: SettingNode, parameters: Parameters) -> None:
        """Add the reflexes that act in some states of a leg."""
        side = node.text("legs", "")
        for mask in node.text("states").replace(";", ",").split(","):
            names = mask.split()
            for name in names:
                if name not in LEG_STATES:
                    raise node.error(
                        f"legs have no state '{name}'{suggest_or_list(name, LEG_STATES)}"
                    )
            states = sum(1 << LEG_STATES.index(name) for name in set(names))
            prefix = f"S{states:05b}."
            # Several states in one mask are one reflex that is active in each of them; masks that a
            # comma separates are reflexes with parameters of their own.
            for leg in range(len(SIDES)):
                # A side may be a word or a letter.
                if side and side.lower() not in (SIDES[leg].strip("_"), ("left", "right")[leg]):
                    continue
                for _, controller in node.select_all("ReflexController"):
                    self._add_reflexes(controller, parameters, prefix, leg, states)
        node.refuse_unread_parts("a ConditionalController")

    def _add_reflexes(
        self, node: SettingNode, parameters: Parameters, prefix: str, leg: int, states: int
    ) -> None:
        """Add the reflexes of a controller for one leg and some of its states, a bit each."""
        symmetric = node.flag("symmetric", self.symmetric)
        blocks = [node, *(block for _, block in node.select_all("Reflexes"))]
        for block in blocks:
            for reflex_name, reflex in block.select_all(*REFLEX_TYPES):
                self._add_reflex(reflex_name, reflex, parameters, prefix, leg, states, symmetric)
            block.refuse_unread_parts("a ReflexController", tuple(REFLEX_TYPES))
        if not any(
            reflex_name in REFLEX_TYPES for block in blocks for reflex_name, _ in block.parts
        ):
            raise node.error("a ReflexController needs reflexes")

    def _find_index(self, node: SettingNode, name: str, names: list[str], leg: int) -> int:
        """Return the index of a name with or without the side of a leg.

        The ending `_o` means the opposite leg.

        Args:
            node: node for errors.
            name: name in the scenario.
            names: names in the model.
            leg: index of the leg of the reflex.
        """
        # A name that fits as it is goes before the same name with a side.
        local_name = (
            name[:-2] + SIDES[1 - leg]
            if self._is_sided and name.endswith(OTHER_SIDE_SUFFIX)
            else name
        )
        for candidate in (local_name, local_name + SIDES[leg]) if self._is_sided else (local_name,):
            if candidate in names:
                return names.index(candidate)
        alternative = f" or '{local_name}{SIDES[leg]}'" if self._is_sided else ""
        raise node.error(
            f"the model has no '{local_name}'{alternative}{suggest_or_list(local_name, names)}"
        )

    def _resolve_target_and_source(
        self, node: SettingNode, prefix: str, leg: int, symmetric: bool, reflex_type: ReflexType
    ) -> tuple[int, int, str]:
        """Find target and source of a reflex, and the prefix of its parameters.

        Args:
            node: node of the reflex.
            prefix: prefix of the states in which it is active.
            leg: index of its leg.
            symmetric: whether both legs share parameters.
            reflex_type: type of the reflex.

        Returns:
            Index of the actuator, index of the source, and prefix of the parameters.
        """
        # Refused explicitly, as ignoring them would change the walk silently.
        keys = ("min_control_value", "max_control_value", *reflex_type.refused)
        node.refuse_parts("reflexes", keys)
        target = node.text("target")
        source = node.text("source", target if reflex_type.defaults_to_target else None)

        def format_name(name: str) -> str:
            """Return the name of a target or source as SCONE writes it in names of parameters."""
            # SCONE names parameters by target and source: symmetric ones without the side of the
            # reflex, with "_o" for the opposite leg; others with the full name.
            stem = name[:-2] if name.endswith((*SIDES, OTHER_SIDE_SUFFIX)) else name
            if not self._is_sided:
                return name
            if not symmetric:
                if name.endswith(SIDES) or stem in self.walkers.coordinates:
                    return name
                return stem + SIDES[1 - leg if name.endswith(OTHER_SIDE_SUFFIX) else leg]
            return (
                f"{stem}{OTHER_SIDE_SUFFIX}"
                if name != stem and not name.endswith(SIDES[leg])
                else stem
            )

        target_name = format_name(target)
        source_name = format_name(source)
        parameter_name = node.text("par_name", "")
        name = (
            format_name(parameter_name)
            if parameter_name
            else target_name
            if target_name == source_name
            else f"{target_name}-{source_name}"
        )
        number = self._find_index(node, target, self.walkers.names, leg)
        return (
            number,
            self._find_index(node, source, reflex_type.names(self.walkers), leg),
            f"{prefix}{name}.",
        )

    @staticmethod
    def _read_delay(node: SettingNode, parameters: Parameters, prefix: str) -> Array:
        """Return the delay (s) of a reflex for each candidate."""
        delay = parameters.get_number(node, "delay", 0.0, prefix + "delay")
        if np.any(delay < 0.0):
            raise node.error(f"a delay of {delay.min():g} s is negative; set a delay of at least 0")
        # Written so that NaN is refused, too.
        if not np.all(delay <= MAX_DELAY_S):
            raise node.error(
                f"a delay of {delay.max():g} s is too long; the maximum is {MAX_DELAY_S:g} s"
            )
        return delay

    def _add_sensor(self, source: Source) -> int:
        """Return the index of a sensor, which is added if it is new."""
        return self.sources.setdefault(source, len(self.sources))

    def _add_reflex(
        self,
        name: str,
        node: SettingNode,
        parameters: Parameters,
        prefix: str,
        leg: int,
        states: int,
        symmetric: bool,
    ) -> None:
        """Add one reflex of a leg, with a term for each of its channels."""
        reflex_type = REFLEX_TYPES[name]
        node.read_keys.update(reflex_type.settings)
        target, number, reflex_prefix = self._resolve_target_and_source(
            node, prefix, leg, symmetric, reflex_type
        )
        delay = self._read_delay(node, parameters, reflex_prefix)
        gate = self._add_gate(node, parameters, reflex_prefix, leg) if name == CONDITIONAL else -1
        written_keys = {key for key, _ in node.parts}
        for letter, make_source, default_offset, allows_negative in reflex_type.channels:
            keys = {
                f"K{letter}",
                f"{letter}0",
                *(() if allows_negative is None else (f"allow_neg_{letter}",)),
            }
            node.read_keys |= keys
            if written_keys.isdisjoint(keys):
                continue
            # SCONE reads offset and gain in this order, which is the order of the parameters.
            settings = (f"{letter}0", default_offset), (f"K{letter}", 0.0)
            numbers = {
                key: parameters.get_number(node, key, value, reflex_prefix + key)
                for key, value in (settings if reflex_type.corrects else settings[::-1])
            }
            gain = numbers[f"K{letter}"]
            takes_any_sign = allows_negative is None or node.flag(
                f"allow_neg_{letter}", allows_negative
            )
            # A gain of 0 that is no parameter needs no sensor.
            if np.any(gain != 0.0) or f"{reflex_prefix}K{letter}" in parameters.requested:
                source = make_source(
                    self.walkers, node, number, SIDES[leg] if self._is_sided else ""
                )
                sign = (
                    TERM_TYPE.FREE
                    if takes_any_sign
                    else TERM_TYPE.OF_RESULT
                    if reflex_type.corrects
                    else TERM_TYPE.OF_SENSOR
                )
                term = target, self._add_sensor(source), sign, leg, states, gate
                self.terms.append(
                    TermOrGate(
                        term, delay, -gain if reflex_type.corrects else gain, numbers[f"{letter}0"]
                    )
                )
        constant = parameters.get_number(node, "C0", 0.0, f"{reflex_prefix}C0")
        # A constant excitation is a function of time of degree 0 that starts at once.
        if np.any(constant != 0.0) or f"{reflex_prefix}C0" in parameters.requested:
            zero = np.zeros_like(constant)
            self.terms.append(
                TermOrGate((target, -1, TERM_TYPE.FREE, leg, states, -1), zero, constant, zero)
            )
        node.refuse_unread_parts(f"a {name}")

    def _add_gate(self, node: SettingNode, parameters: Parameters, prefix: str, leg: int) -> int:
        """Add the range of a ConditionalMuscleReflex as a gate.

        Returns:
            Index of the gate, or -1 for a reflex without a range.
        """
        if node.get("dof") is None:
            return -1
        name = node.text("dof")
        number = self._find_index(node, name, self.walkers.coordinates, leg)
        start = f"{prefix[:-1]}-{name}."
        # Names of the gate's parameters contain the coordinate.
        delay = self._read_delay(node, parameters, start)
        lower, upper = (
            parameters.get_number(node, f"pos_{end}", limit, f"{start}pos_{end}")
            # A limit beyond any value leaves the range open at this end.
            for end, limit in (("min", -1e12), ("max", 1e12))
        )
        value, speed = (
            self._add_sensor(make_source(self.walkers, node, number, ""))
            for make_source in (VALUE_SOURCE, SPEED_SOURCE)
        )
        self._gates.append(TermOrGate((value, speed), delay, lower, upper))
        return len(self._gates) - 1

    def pack(self) -> tuple[Ints, Array]:
        """Return the controller as the kernels take it.

        See :mod:`osimlite.mechanics.kernels.reflexes`.

        Returns:
            Integers, and the numbers of each candidate (w, r).
        """
        # Terms with sensors come first; sums are rounded in this order.
        terms_and_gates = [
            *sorted(self.terms, key=lambda term: term.ints[TERM.SENSOR] < 0),
            *self._gates,
        ]
        # The kernels interpolate the history in units of control steps.
        delays = [record.delay / self.walkers.step for record in terms_and_gates]
        columns_of_parts = [
            (delay, record.first, record.second)
            for delay, record in zip(delays, terms_and_gates, strict=True)
        ]
        numbers = np.column_stack(
            [self._limits, *(column for columns in columns_of_parts for column in columns)]
        )
        sensor_delays = (
            np.max(delay)
            for record, delay in zip(terms_and_gates, delays, strict=True)
            if record.ints[TERM.SENSOR] >= 0
        )
        # One step more for the current sensors, and one for the interpolation between two steps.
        history = int(np.ceil(max([*sensor_delays, self._limits[0, LIMITS.DELAY]]))) + 2
        ints = [number for record in terms_and_gates for number in record.ints]
        sensor_numbers = list[float]()
        for source in self.sources:
            ints += (
                source.kind,
                source.sensor_index,
                numbers.shape[1] + len(sensor_numbers) if source.numbers else source.more,
            )
            # Numbers of sensors follow those of all terms and gates, and are the same for all
            # candidates.
            sensor_numbers += source.numbers
        numbers = np.column_stack([numbers, np.tile(sensor_numbers, (len(numbers), 1))])
        header = np.zeros(REFLEXES.HEAD, dtype=np.int64)
        sensors = len(self.sources)
        header[: REFLEXES.MEMORY_SIZE + 1] = (
            *(
                len(self.terms),
                len(self._gates),
                history,
                sensors,
                self._has_states,
                self._swings_from_stance,
            ),
            *(numbers.shape[1], LEGS + history * sensors),
        )
        header[REFLEXES.IS_NOISY] = self._is_noisy
        return np.array([*header, *ints], dtype=np.int64), np.ascontiguousarray(numbers)
