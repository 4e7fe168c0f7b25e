"""Between which bounds what an optimization finds has to be: what the study says, and Moco's rules for the rest."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.actuators import ActivationCoordinateActuator, ScalarActuator
from osimlite.schema.base import Component
from osimlite.schema.moco.parts import MocoVariableInfo
from osimlite.schema.moco.studies import MocoPhase
from osimlite.schema.muscles import DeGrooteFregly2016Muscle, Muscle
from osimlite.schema.patterns import Pattern

Range = tuple[float, float]
FREE: Range = (-math.inf, math.inf)
MIN_TENDON_FORCE, MAX_TENDON_FORCE = 0.0, 5.0
"""Of a normalized tendon force, by ``statebounds_normalized_tendon_force``."""


@dataclass(frozen=True)
class Bounds:
    """Of one variable.

    Attributes:
        within: over the whole motion.
        first: at the start.
        last: at the end.
    """

    within: Range
    first: Range
    last: Range

    @classmethod
    def from_ranges(cls, within: Range, first: Range = FREE, last: Range = FREE) -> Bounds:
        """Those at the ends are never wider than the others, as in Moco."""
        return cls(within, _intersect(first, within), _intersect(last, within))


def _intersect(inner: Range, outer: Range) -> Range:
    return max(inner[0], outer[0]), min(inner[1], outer[1])


def read_range(bounds: Any) -> Range | None:
    """What a ``MocoBounds`` or a list of one or two numbers says; None if it says nothing."""
    given = tuple(getattr(bounds, "bounds", bounds))
    return None if not given else (float(given[0]), float(given[-1]))


class _VariableInfos:
    """What the study says of each of some variables."""

    def __init__(
        self,
        patterns: Iterable[MocoVariableInfo],
        infos: Iterable[MocoVariableInfo],
        names: Sequence[str],
    ) -> None:
        self.infos: dict[str, MocoVariableInfo] = {}
        for info in patterns:
            matches = Pattern(info.name).fullmatch
            self.infos |= {name: info for name in names if matches(name)}
        self.infos |= {info.name: info for info in infos}

    def bounds(self, name: str, otherwise: Range) -> Bounds:
        info = self.infos.get(name)
        if info is None:
            return Bounds.from_ranges(otherwise)
        return Bounds.from_ranges(
            read_range(info.bounds) or otherwise,
            read_range(info.initial_bounds) or FREE,
            read_range(info.final_bounds) or FREE,
        )


def find_control_bounds(
    phase: MocoPhase, names: Sequence[str], components: Mapping[str, Component]
) -> dict[str, Bounds]:
    """Of controls; without any word of the study those of the actuator."""
    infos = _VariableInfos(phase.control_infos_pattern, phase.control_infos, names)
    result = {}
    for name in names:
        actuator = components.get(name)
        own = (
            (actuator.min_control, actuator.max_control)
            if isinstance(actuator, ScalarActuator)
            else FREE
        )
        result[name] = infos.bounds(name, own)
    return result


def find_state_bounds(
    phase: MocoPhase,
    names: Sequence[str],
    components: Mapping[str, Component],
    controls: Mapping[str, Bounds],
) -> dict[str, Bounds]:
    """Of states; values without a word have the range of the coordinate, activations that of the excitation."""
    infos = _VariableInfos(phase.state_infos_pattern, phase.state_infos, names)
    speeds = read_range(phase.default_speed_bounds) or FREE
    result = {}
    for name in names:
        path, _, what = name.rpartition("/")
        owner: Any = components.get(path)
        otherwise = FREE
        if what == "value":
            otherwise = tuple(owner.range)
        elif what == "speed":
            otherwise = speeds
        elif what == "normalized_tendon_force" and isinstance(owner, DeGrooteFregly2016Muscle):
            otherwise = MIN_TENDON_FORCE, MAX_TENDON_FORCE
        elif what == "activation" and isinstance(owner, ActivationCoordinateActuator):
            otherwise = owner.min_control, owner.max_control
        elif (
            what == "activation"
            and isinstance(owner, Muscle)
            and phase.bound_activation_from_excitation
        ):
            otherwise = (
                controls[path].within
                if path in controls
                else (owner.min_control, owner.max_control)
            )
        result[name] = infos.bounds(name, otherwise)
    return result


def compute_scaling(low: float, high: float) -> tuple[float, float]:
    """Factor and offset that a variable has by its scaled self, as Moco makes them: the width of
    its bounds, and the middle between them with the other sign.
    """
    width = high - low
    if not math.isfinite(width):
        return 1.0, 0.0
    return (width, -0.5 * (high + low)) if width else (1.0, high)


def compute_midpoint(low: Array, high: Array) -> Array:
    """Where a search begins: between the bounds, at the only one, or at zero."""
    has_low, has_high = np.isfinite(low), np.isfinite(high)
    ends = np.where(has_low, low, 0.0), np.where(has_high, high, 0.0)
    return (ends[0] + ends[1]) * np.where(has_low & has_high, 0.5, 1.0)
