"""Bounds of variables: those of the study, and Moco's rules for the rest."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.actuators import ActivationCoordinateActuator
from osimlite.schema.base import Component
from osimlite.schema.forces import ScalarActuator
from osimlite.schema.moco.parts import MocoVariableInfo
from osimlite.schema.moco.studies import MocoPhase
from osimlite.schema.muscles import Muscle
from osimlite.schema.patterns import Pattern
from osimlite.schema.smooth_muscles import DeGrooteFregly2016Muscle

Range = tuple[float, float]
"""Lower and upper bound."""
UNBOUNDED: Range = (-math.inf, math.inf)
"""Range without bounds."""
MIN_TENDON_FORCE = 0.0
"""Lower bound of a normalized tendon force, from ``statebounds_normalized_tendon_force``."""
MAX_TENDON_FORCE = 5.0
"""Upper bound of a normalized tendon force, from ``statebounds_normalized_tendon_force``."""


@dataclass(frozen=True)
class Bounds:
    """Bounds of one variable, in the unit of the variable.

    Attributes:
        overall: bounds over the whole motion.
        first: bounds at the start.
        last: bounds at the end.
    """

    overall: Range
    first: Range
    last: Range

    @classmethod
    def from_ranges(
        cls, motion_range: Range, start_range: Range = UNBOUNDED, end_range: Range = UNBOUNDED
    ) -> Bounds:
        """Return bounds in which the ends of the motion are never wider than the motion, as in Moco.

        Args:
            motion_range: bounds over the motion.
            start_range: bounds at the start.
            end_range: bounds at the end.

        Returns:
            Bounds; those at the ends lie within those over the motion.
        """
        return cls(
            motion_range,
            _intersect_ranges(start_range, motion_range),
            _intersect_ranges(end_range, motion_range),
        )


def _intersect_ranges(range_to_limit: Range, limits: Range) -> Range:
    """Return the part of one range within another; its ends are reversed if both have nothing in common."""
    return max(range_to_limit[0], limits[0]), min(range_to_limit[1], limits[1])


def read_range(bounds: Any) -> Range | None:
    """Return the range of a ``MocoBounds`` or of a list of one or two numbers.

    Args:
        bounds: bounds of the study.

    Returns:
        Range, whose ends are equal for one number; None if there is no number.
    """
    limits = tuple(getattr(bounds, "bounds", bounds))
    return None if not limits else (float(limits[0]), float(limits[-1]))


class _VariableInfos:
    """Entries of a study for states or controls; entries by name override those by pattern.

    Args:
        patterns: entries by pattern; of several that match a name the last one counts.
        infos: entries by name.
        names: paths of the variables.
    """

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

    def bounds(self, name: str, default: Range) -> Bounds:
        """Return the bounds of a variable.

        Args:
            name: path of the variable.
            default: bounds over the motion if the study gives none.

        Returns:
            Bounds of the variable; ends without an entry have those over the motion.
        """
        info = self.infos.get(name)
        if info is None:
            return Bounds.from_ranges(default)
        return Bounds.from_ranges(
            read_range(info.bounds) or default,
            read_range(info.initial_bounds) or UNBOUNDED,
            read_range(info.final_bounds) or UNBOUNDED,
        )


def find_control_bounds(
    phase: MocoPhase, names: Sequence[str], components: Mapping[str, Component]
) -> dict[str, Bounds]:
    """Find the bounds of controls; without an entry in the study they are those of the actuator.

    Args:
        phase: phase of the study.
        names: paths of the controls.
        components: components of the model by path.

    Returns:
        Bounds by path.
    """
    infos = _VariableInfos(phase.control_infos_pattern, phase.control_infos, names)
    result = {}
    for name in names:
        actuator = components.get(name)
        limits = (
            (actuator.min_control, actuator.max_control)
            if isinstance(actuator, ScalarActuator)
            else UNBOUNDED
        )
        result[name] = infos.bounds(name, limits)
    return result


def find_state_bounds(
    phase: MocoPhase,
    names: Sequence[str],
    components: Mapping[str, Component],
    controls: Mapping[str, Bounds],
) -> dict[str, Bounds]:
    """Find the bounds of states by Moco's rules.

    Without an entry in the study, values have the range of the coordinate and activations that of
    the excitation.

    Args:
        phase: phase of the study.
        names: paths of the states.
        components: components of the model by path.
        controls: bounds of the controls by path.

    Returns:
        Bounds by path.
    """
    infos = _VariableInfos(phase.state_infos_pattern, phase.state_infos, names)
    # Coordinates have a range, but the schema of coordinates has none for speeds: the phase gives
    # one for all of them.
    speeds = read_range(phase.default_speed_bounds) or UNBOUNDED
    result = {}
    for name in names:
        path, _, quantity = name.rpartition("/")
        component: Any = components.get(path)
        default = UNBOUNDED
        if quantity == "value":
            default = tuple(component.range)
        elif quantity == "speed":
            default = speeds
        elif quantity == "normalized_tendon_force" and isinstance(
            component, DeGrooteFregly2016Muscle
        ):
            default = MIN_TENDON_FORCE, MAX_TENDON_FORCE
        # Moco bounds activations by excitations, those of muscles only if the phase says so.
        elif quantity == "activation" and isinstance(component, ActivationCoordinateActuator):
            default = component.min_control, component.max_control
        elif (
            quantity == "activation"
            and isinstance(component, Muscle)
            and phase.bound_activation_from_excitation
        ):
            default = (
                controls[path].overall
                if path in controls
                else (component.min_control, component.max_control)
            )
        result[name] = infos.bounds(name, default)
    return result


def compute_scaling(lower: float, upper: float) -> tuple[float, float]:
    """Compute the factor and the offset of a variable ``w = factor x + offset``, as Moco does.

    Args:
        lower: lower bound of w.
        upper: upper bound of w.

    Returns:
        Width of the bounds, and the negative of their middle; (1, 0) without finite bounds, and
        (1, bound) if both bounds are equal.
    """
    width = upper - lower
    if not math.isfinite(width):
        return 1.0, 0.0
    # The offset has Moco's sign. It does not center x on zero, but costs on squares of x must agree
    # with Moco.
    return (width, -0.5 * (upper + lower)) if width else (1.0, upper)


def compute_midpoint(lower: Array, upper: Array) -> Array:
    """Return the point where a search starts without a guess.

    Args:
        lower: lower bounds (n,).
        upper: upper bounds (n,).

    Returns:
        Middle between the bounds (n,); the finite bound if there is only one, and zero without any.
    """
    # Infinite bounds become 0 before the sum, as inf - inf would be NaN.
    has_lower = np.isfinite(lower)
    has_upper = np.isfinite(upper)
    finite_bounds = np.where(has_lower, lower, 0.0), np.where(has_upper, upper, 0.0)
    return (finite_bounds[0] + finite_bounds[1]) * np.where(has_lower & has_upper, 0.5, 1.0)
