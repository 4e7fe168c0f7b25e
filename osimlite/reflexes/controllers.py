"""Reflexes of muscles and coordinates, on while a leg is in some state: SCONE's GaitStateController.

All reflexes are sums of terms ``gain * (sensor - offset)`` with a delay, so that those of all candidates are evaluated
at once.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from osimlite.multibody.spatial import Array
from osimlite.reflexes.parameters import Parameters
from osimlite.reflexes.settings import Node
from osimlite.reflexes.walkers import SIDES, Felt, Walkers
from osimlite.text import or_known

STATES = "EarlyStance", "LateStance", "Liftoff", "Swing", "Landing"
EARLY_STANCE, LATE_STANCE, LIFTOFF, SWING, LANDING = range(5)
UNKNOWN = -1
FREE, OF_SENSOR, OF_RESULT = 0, 1, 2
"""What may not be negative: nothing, how far a sensor is above its offset, or what comes of that."""
CONTROLLERS = "GaitStateController", "ReflexController"
"""What is done here."""
NEVER = -1.0
"""A threshold that has no effect."""


class Term(NamedTuple):
    """A part of a reflex.

    Attributes:
        target: number of the muscle.
        sensor: number of the sensor; -1 for none, so that the gain itself is added.
        delay: s, of each candidate (w,).
        gain, offset: (w,).
        kind: one of FREE, OF_SENSOR, OF_RESULT.
        leg: number of the leg whose state decides.
        states: in which it is on (5,).
        gate: number of what may suppress it; -1 for nothing.
    """

    target: int
    sensor: int
    delay: Array
    gain: Array
    offset: Array
    kind: int
    leg: int
    states: tuple[bool, ...]
    gate: int = -1


class Gate(NamedTuple):
    """A range of a coordinate: terms rest while it is beyond and moves further.

    Attributes:
        sensor: number of that of its value.
        speed: number of that of its speed.
        delay, low, high: s, rad or m, of each candidate (w,).
    """

    sensor: int
    speed: int
    delay: Array
    low: Array
    high: Array


class Sensors:
    """What reflexes go by, with its history."""

    def __init__(self, walkers: Walkers) -> None:
        self.walkers = walkers
        muscles, coordinates = len(walkers.names), len(walkers.coordinates)
        self._first = {"L": 0, "V": muscles, "F": 2 * muscles, "DP": 3 * muscles, "DV": 3 * muscles + coordinates}
        self._load = 3 * muscles + 2 * coordinates
        self._count = self._load + len(walkers.legs)
        self._history: Array = np.zeros((0, 0, 0))
        self._frames = 0

    def muscle(self, kind: str, number: int) -> int:
        """The number of a sensor of a muscle: its length (L), velocity (V) or force (F)."""
        return self._first[kind] + number

    def coordinate(self, kind: str, number: int) -> int:
        """The number of a sensor of a coordinate: its value (DP) or speed (DV)."""
        return self._first[kind] + number

    def load(self, leg: int) -> int:
        """The number of the sensor of the load of a leg."""
        return self._load + leg

    def begin(self, longest: float) -> None:
        """Forget everything, and remember as much as a delay needs (s)."""
        size = int(np.ceil(longest / self.walkers.step)) + 2
        self._history = np.zeros((size, self.walkers.count, self._count))
        self._frames = 0

    def note(self, felt: Felt) -> None:
        """Remember what is felt at the end of a control step."""
        size = len(self.walkers.coordinates)
        row = np.hstack([felt.lengths, felt.velocities, felt.forces, felt.states[:, : 2 * size], felt.loads])
        self._history[self._frames % len(self._history)] = row
        self._frames += 1

    def at(self, sensors: Array, delays: Array) -> Array:
        """Sensors (n,) as they were before delays (w, n), s; before the beginning all was as at the beginning."""
        back = np.minimum(delays / self.walkers.step, self._frames - 1.0)
        # A delay of whole steps is one, whatever it was divided to.
        whole = np.floor(back + 1e-9)
        part = np.clip(back - whole, 0.0, 1.0)
        size, latest = len(self._history), self._frames - 1
        rows = np.arange(self.walkers.count)[:, None]
        near = (latest - whole).astype(int) % size
        far = np.maximum(latest - whole - 1.0, 0.0).astype(int) % size
        result = self._history[near, rows, sensors]
        result += part * (self._history[far, rows, sensors] - result)
        return result


class Reflexes:
    """The reflexes of a GaitStateController, whose legs are in one of five states, or of a ReflexController alone.

    Args:
        node: of the controller.
        kind: its class.
        walkers: that it moves.
        parameters: of the candidates.

    Raises:
        DocumentError: it has a part that is not done here; its name and line are told.
    """

    def __init__(self, node: Node, kind: str, walkers: Walkers, parameters: Parameters) -> None:
        self.walkers, self.node = walkers, node
        self.sensors = Sensors(walkers)
        self._terms: list[Term] = []
        self._gates: list[Gate] = []
        self._load_delay = 0.0
        self._has_states, self._is_sided = kind == "GaitStateController", True
        if self._has_states:
            walkers.expect_legs()
            self._read_states(node, parameters)
        else:
            self.symmetric = node.flag("symmetric", False)
            self._is_sided = node.flag("dual_sided", True)
            for leg in (0, 1) if self._is_sided else (0,):
                self._add_reflexes(node, parameters, "", leg, (True,) * len(STATES))
        self._compile()

    def _read_states(self, node: Node, parameters: Parameters) -> None:
        parameters.auto = node.number("auto_std_factor", parameters.auto)
        self.symmetric = node.flag("symmetric", True)
        for key in ("signature_postfix", "name"):
            node.get(key)
        for key in ("use_model_com_reference_pos", "omnidirectional"):
            if node.flag(key, False):
                raise node.error(f"{key} is not done here")
        self._swings_from_stance = node.flag("allow_stance_swing_transition", False)
        self._load_delay = node.number("leg_load_sensor_delay", 0.0)
        self._lengths = np.array([node.number("override_leg_length", leg.length) for leg in self.walkers.legs])
        limits: list[dict[str, Array]] = []
        for leg, side in enumerate(SIDES):
            prefix = "" if self.symmetric else f"leg{leg}{side}."
            of = {name: parameters.of(node, name, value, prefix + name) for name, value in (
                ("stance_load_threshold", 0.1), ("landing_threshold", 0.0), ("late_stance_threshold", 0.0),
                ("liftoff_threshold", NEVER),
            )}  # fmt: skip
            stance = of["stance_load_threshold"]
            swing = node.get("swing_load_threshold")
            of["swing_load_threshold"] = (
                stance if swing is None else parameters.read(swing, prefix + "swing_load_threshold")
            )
            limits.append(of)
        self._limits = {name: np.column_stack([of[name] for of in limits]) for name in limits[0]}
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
                    raise node.error(f"legs have no state '{name}'{or_known(name, STATES)}")
            states = tuple(name in names for name in STATES)
            prefix = "S" + "".join("1" if on else "0" for on in reversed(states)) + "."
            for leg in range(len(SIDES)):
                if side and side.lower() not in (SIDES[leg].strip("_"), ("left", "right")[leg]):
                    continue
                for _, controller in node.all_of("ReflexController"):
                    self._add_reflexes(controller, parameters, prefix, leg, states)
        node.expect_all_asked("a ConditionalController")

    def _add_reflexes(
        self, node: Node, parameters: Parameters, prefix: str, leg: int, states: tuple[bool, ...]
    ) -> None:
        symmetric = node.flag("symmetric", self.symmetric)
        blocks = [node, *(block for _, block in node.all_of("Reflexes"))]
        for block in blocks:
            for kind, reflex in block.all_of("MuscleReflex", "ConditionalMuscleReflex", "DofReflex"):
                make = self._coordinate_reflex if kind == "DofReflex" else self._muscle_reflex
                make(reflex, parameters, prefix, leg, states, symmetric)
                reflex.expect_all_asked(f"a {kind}")
            block.expect_all_asked("a ReflexController")

    def _named(self, node: Node, name: str, names: list[str], leg: int) -> int:
        """The number of what has a name, with or without the side of a leg."""
        for full in (name, name + SIDES[leg]):
            if full in names:
                return names.index(full)
        raise node.error(f"the model has no '{name}' or '{name}{SIDES[leg]}'{or_known(name, names)}")

    def _begin(self, node: Node, prefix: str, leg: int, symmetric: bool) -> tuple[int, str, str]:
        """Target, name of the source, and what stands before the names of parameters."""
        for key in ("min_control_value", "max_control_value", "condition", "filter_cutoff_frequency", "P0_source"):
            if node.get(key) is not None:
                raise node.error(f"'{key}' of reflexes is not done here")
        target = node.text("target")
        source = node.text("source", target)

        def named(name: str) -> str:
            bare = name[:-2] if name.endswith(SIDES) else name
            if not self._is_sided:
                return name
            if not symmetric:
                return name if name.endswith(SIDES) or bare in self.walkers.coordinates else bare + SIDES[leg]
            return f"{bare}_o" if name.endswith(SIDES) and not name.endswith(SIDES[leg]) else bare

        first, second = named(target), named(source)
        own = node.text("par_name", "")
        name = named(own) if own else first if first == second else f"{first}-{second}"
        return self._named(node, target, self.walkers.names, leg), source, f"{prefix}{name}."

    def _muscle_reflex(
        self, node: Node, parameters: Parameters, prefix: str, leg: int, states: tuple[bool, ...], symmetric: bool
    ) -> None:
        target, source, before = self._begin(node, prefix, leg, symmetric)
        number = self._named(node, source, self.walkers.names, leg)
        delay = parameters.of(node, "delay", 0.0, before + "delay")
        gate = self._gate(node, parameters, before, leg)
        for kind, rest, negative in (("L", 1.0, True), ("V", 0.0, False), ("F", 0.0, True)):
            gain = parameters.of(node, f"K{kind}", 0.0, f"{before}K{kind}")
            offset = parameters.of(node, f"{kind}0", rest, f"{before}{kind}0")
            free = node.flag(f"allow_neg_{kind}", negative)
            if np.any(gain != 0.0):
                sensor = self.sensors.muscle(kind, number)
                self._terms.append(
                    Term(target, sensor, delay, gain, offset, FREE if free else OF_SENSOR, leg, states, gate)
                )
        self._constant(node, parameters, before, target, leg, states)

    def _gate(self, node: Node, parameters: Parameters, before: str, leg: int) -> int:
        """The number of the range of a ConditionalMuscleReflex."""
        if node.get("dof") is None:
            return -1
        name = node.text("dof")
        number = self._named(node, name, self.walkers.coordinates, leg)
        start = f"{before[:-1]}-{name}."
        delay = parameters.of(node, "delay", 0.0, start + "delay")
        low, high = (
            parameters.of(node, f"pos_{end}", way, f"{start}pos_{end}") for end, way in (("min", -1e12), ("max", 1e12))
        )
        value, speed = (self.sensors.coordinate(kind, number) for kind in ("DP", "DV"))
        self._gates.append(Gate(value, speed, delay, low, high))
        return len(self._gates) - 1

    def _coordinate_reflex(
        self, node: Node, parameters: Parameters, prefix: str, leg: int, states: tuple[bool, ...], symmetric: bool
    ) -> None:
        target, source, before = self._begin(node, prefix, leg, symmetric)
        number = self._named(node, source, self.walkers.coordinates, leg)
        for key in ("source_parent", "mirror_left", "KA"):
            if node.get(key) is not None:
                raise node.error(f"'{key}' of a DofReflex is not done here")
        delay = parameters.of(node, "delay", 0.0, before + "delay")
        for kind, sensor in (("P", "DP"), ("V", "DV")):
            offset = parameters.of(node, f"{kind}0", 0.0, f"{before}{kind}0")
            gain = parameters.of(node, f"K{kind}", 0.0, f"{before}K{kind}")
            free = node.flag(f"allow_neg_{kind}", True)
            if np.any(gain != 0.0):
                place = self.sensors.coordinate(sensor, number)
                self._terms.append(Term(target, place, delay, -gain, offset, FREE if free else OF_RESULT, leg, states))
        self._constant(node, parameters, before, target, leg, states)

    def _constant(
        self, node: Node, parameters: Parameters, before: str, target: int, leg: int, states: tuple[bool, ...]
    ) -> None:
        constant = parameters.of(node, "C0", 0.0, f"{before}C0")
        if np.any(constant != 0.0):
            zero = np.zeros_like(constant)
            self._terms.append(Term(target, -1, zero, constant, zero, FREE, leg, states))

    def _compile(self) -> None:
        terms, count = self._terms, self.walkers.count
        own = [term for term in terms if term.sensor >= 0]
        rest = [term for term in terms if term.sensor < 0]
        self._terms = [*own, *rest]

        def columns(name: str, of: list[Any]) -> Array:
            return np.array([getattr(term, name) for term in of]).T.reshape(-1, len(of)) if of else np.zeros((count, 0))

        self._sensors = np.array([term.sensor for term in own], dtype=int)
        self._delays, self._gains, self._offsets = (columns(name, own) for name in ("delay", "gain", "offset"))
        self._constants = columns("gain", rest)
        self._gate_of = np.array([term.gate for term in own], dtype=int)
        self._gated = np.array([(gate.sensor, gate.speed) for gate in self._gates], dtype=int).reshape(-1, 2)
        gates: list[Any] = list(self._gates)
        self._gate_delays, self._gate_lows, self._gate_highs = (
            columns(name, gates) for name in ("delay", "low", "high")
        )
        self._of_sensor = np.array([term.kind == OF_SENSOR for term in own], dtype=bool)
        self._of_result = np.array([term.kind == OF_RESULT for term in own], dtype=bool)
        self._leg_of = np.array([term.leg for term in self._terms], dtype=int)
        self._masks = np.array([term.states for term in self._terms], dtype=bool).reshape(-1, 5)
        # Terms that no two of have one target are added at once, in an order that is the same for one candidate and for
        # many, as a product of matrices is not.
        rounds: list[list[tuple[int, int]]] = []
        for number, term in enumerate(self._terms):
            free = next((each for each in rounds if all(term.target != target for _, target in each)), None)
            if free is None:
                rounds.append(free := [])
            free.append((number, term.target))
        self._rounds = [np.array(each).T for each in rounds]

    # ------------------------------------------------------------------------------------------- while walking
    def begin(self, felt: Felt) -> None:
        """Begin anew, from what is felt at the start."""
        delays = self._delays.max(initial=0.0), self._gate_delays.max(initial=0.0), self._load_delay
        longest = float(max(delays))
        self.sensors.begin(longest)
        self.states = np.full((self.walkers.count, len(SIDES)), UNKNOWN if self._has_states else EARLY_STANCE)
        self.sensors.note(felt)

    def inputs(self, felt: Felt) -> Array:
        """What the muscles are excited by (w, m), before bounds; the states of the legs go on."""
        if self._has_states:
            self._go_on(felt)
        values = self.sensors.at(self._sensors, self._delays) - self._offsets
        values[:, self._of_sensor] = np.maximum(values[:, self._of_sensor], 0.0)
        values *= self._gains
        values[:, self._of_result] = np.maximum(values[:, self._of_result], 0.0)
        if len(self._gates):
            where = self.sensors.at(self._gated[:, 0], self._gate_delays)
            speed = self.sensors.at(self._gated[:, 1], self._gate_delays)
            beyond = ((where < self._gate_lows) & (speed < 0.0)) | ((where > self._gate_highs) & (speed >= 0.0))
            passes = np.column_stack([~beyond, np.ones(len(beyond), dtype=bool)])
            values *= passes[:, self._gate_of]
        each = np.hstack([values, self._constants])
        on = np.take_along_axis(self._masks.T, self.states[:, self._leg_of], axis=0)
        each *= on
        result = np.zeros((self.walkers.count, len(self.walkers.names)))
        for numbers, targets in self._rounds:
            result[:, targets] += each[:, numbers]
        return result

    def _go_on(self, felt: Felt) -> None:
        legs = self.walkers.legs
        delays = np.full((self.walkers.count, len(legs)), self._load_delay)
        loads = self.sensors.at(np.array([self.sensors.load(leg) for leg in range(len(legs))]), delays)
        ahead = np.column_stack([felt.bodies[:, leg.foot, 0] - felt.bodies[:, leg.base, 0] for leg in legs])

        limits = self._limits
        stands, swings = loads > limits["stance_load_threshold"], loads <= limits["swing_load_threshold"]
        late = ahead < self._lengths * limits["late_stance_threshold"]
        leaves = ahead < self._lengths * limits["liftoff_threshold"]
        lands = ahead > self._lengths * limits["landing_threshold"]
        before, after = ahead > ahead[:, ::-1], ahead < ahead[:, ::-1]
        follows = stands[:, ::-1] & after
        states = self.states
        to_swing = self._swings_from_stance & swings
        new = states.copy()
        unknown, early, stance = states == UNKNOWN, states == EARLY_STANCE, states == LATE_STANCE
        new[unknown] = np.where(
            stands,
            np.where(follows, LIFTOFF, np.where(late, LATE_STANCE, EARLY_STANCE)),
            np.where(lands, LANDING, SWING),
        )[unknown]
        new[early] = np.where(to_swing, SWING, np.where(follows, LIFTOFF, np.where(late, LATE_STANCE, EARLY_STANCE)))[
            early
        ]
        new[stance] = np.where(to_swing, SWING, np.where(follows | leaves, LIFTOFF, LATE_STANCE))[stance]
        new[(states == LIFTOFF) & swings] = SWING
        swing = states == SWING
        new[swing & stands & before] = EARLY_STANCE
        new[swing & ~stands & lands] = LANDING
        new[(states == LANDING) & stands] = EARLY_STANCE
        self.states = new
