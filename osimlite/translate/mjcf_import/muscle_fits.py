"""MuJoCo's muscle curves, as formulas and as fitted curves of Millard's muscle.

The curves are piecewise parabolas (MuJoCo's manual, Modeling, "Muscles"; `mju_muscleGainLength`).
With the normalized length L and velocity V, a = (lmin + 1)/2, b = (1 + lmax)/2 and y = fvmax - 1:

- active: ((L - lmin)/(a - lmin))^2/2 up to a, 1 - ((1 - L)/(1 - a))^2/2 up to 1, and the same on
  the other side,
- velocity: (V + 1)^2 up to 0, fvmax - (y - V)^2/y up to y, fvmax beyond,
- passive: fpmax ((L - 1)/(b - 1))^2/2 up to b, a line beyond.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.require import require
from osimlite.mechanics.laws.bezier import curve_value
from osimlite.mechanics.laws.muscle_curves import (
    active_force_length,
    fiber_force_length,
    force_velocity,
)
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.muscle_curves import (
    ActiveForceLengthCurve,
    FiberForceLengthCurve,
    ForceVelocityCurve,
)
from osimlite.translate.mjcf.isometric import compute_mujoco_active_force

CURVE_POINTS = 27
"""Number of points in which a curve is fitted."""
FITTED_LENGTHS = (0.4, 1.65)
"""Normalized lengths between which the active curve is fitted: fibers are hardly ever outside."""
FIT_TOLERANCE = 1e-6
"""Relative change of the error, or of the numbers, at which a search ends."""
NO_CURVE = 10.0
"""Error in each point if the properties do not define a curve."""
SEARCH_COUNT = 1
"""Number of the best starting points from which a fit is searched; a second one changes little."""
CACHE_DIGITS = 6
"""Digits of the parameters that the cache of fitted curves distinguishes."""
MIN_FVMAX = 1.001
"""Least force of lengthening fibers that a ForceVelocityCurve can have: it must be above 1."""
LENGTH_STEP = 0.05
"""Step of the largest length of a fit, so that similar muscles share a cached curve."""
MIN_LENGTH = 0.01
"""Least active fiber length of an ActiveForceLengthCurve."""


class Shape(NamedTuple):
    """Dimensionless parameters of a muscle of MuJoCo."""

    lmin: float
    lmax: float
    fvmax: float
    passive_start: float = 1.0  # normalized length at which the passive force begins
    passive_width: float = 0.3  # distance from there to where it becomes a line
    fpmax: float = 1.3  # twice the passive force there

    def active(self, x: Array) -> Array:
        """Return the active force at normalized lengths."""
        return compute_mujoco_active_force(x, self.lmin, self.lmax)

    def velocity(self, v: Array) -> Array:
        """Return the factor of the active force at normalized velocities."""
        eccentric_end = self.fvmax - 1.0
        lengthening = (
            self.fvmax - (eccentric_end - v) ** 2 / eccentric_end
            if eccentric_end > 0.0
            else np.ones_like(v)
        )
        return np.where(
            v <= -1.0,
            0.0,
            np.where(
                v <= 0.0, (v + 1.0) ** 2, np.where(v <= eccentric_end, lengthening, self.fvmax)
            ),
        )

    def passive(self, x: Array) -> Array:
        """Return the passive force at normalized lengths."""
        # A parabola up to the end of the width, then a line with the slope that it has there.
        stretch = np.maximum((x - self.passive_start) / self.passive_width, 0.0)
        return np.asarray(self.fpmax * np.where(stretch <= 1.0, 0.5 * stretch**2, stretch - 0.5))

    def formulas(self) -> tuple[str, str, str]:
        """Write the curves as formulas of OpenSim in the variable ``x``.

        Returns:
            Active force, passive force and velocity factor.
        """
        rising_mid, falling_mid = 0.5 * (self.lmin + 1.0), 0.5 * (1.0 + self.lmax)
        y = self.fvmax - 1.0

        # `step` of OpenSim's expressions switches between the pieces.
        def write_step(first: float, last: float) -> str:
            return f"step(x-{_n(first)})*(1-step(x-{_n(last)}))"

        active = "+".join(
            (
                f"{write_step(self.lmin, rising_mid)}*0.5*((x-{_n(self.lmin)})/{_n(rising_mid - self.lmin)})^2",
                f"{write_step(rising_mid, 1.0)}*(1-0.5*((1-x)/{_n(1.0 - rising_mid)})^2)",
                f"{write_step(1.0, falling_mid)}*(1-0.5*((x-1)/{_n(falling_mid - 1.0)})^2)",
                f"{write_step(falling_mid, self.lmax)}*0.5*(({_n(self.lmax)}-x)/{_n(self.lmax - falling_mid)})^2",
            )
        )
        start = self.passive_start
        end = self.passive_start + self.passive_width
        stretch = f"((x-{_n(start)})/{_n(self.passive_width)})"
        passive = (
            f"{write_step(start, end)}*{_n(0.5 * self.fpmax)}*{stretch}^2"
            f"+step(x-{_n(end)})*{_n(self.fpmax)}*({stretch}-0.5)"
        )
        velocity = f"{write_step(-1.0, 0.0)}*(x+1)^2"
        if y > 0.0:
            velocity += f"+{write_step(0.0, y)}*({_n(self.fvmax)}-({_n(y)}-x)^2/{_n(y)})"
        velocity += f"+step(x-{_n(y)})*{_n(self.fvmax)}"
        return active, passive, velocity


def _n(value: float) -> str:
    return f"({value!r})" if value < 0.0 else repr(value)


class FittedCurves(NamedTuple):
    """Curves of a Millard muscle: properties, and functions that evaluate them."""

    active: dict[str, float]
    velocity: dict[str, float]
    passive: dict[str, float]

    def evaluate(self, lengths: Array, velocities: Array) -> tuple[Array, Array, Array]:
        """Evaluate the curves.

        Args:
            lengths: arguments of the active and passive force curves.
            velocities: arguments of the velocity curve.

        Returns:
            Active force, passive force and velocity factor.
        """
        return (
            _evaluate(active_force_length(*self.active.values()), lengths),
            _evaluate(fiber_force_length(*self.passive.values()), lengths),
            _evaluate(force_velocity(*self.velocity.values()), velocities),
        )

    def components(
        self,
    ) -> tuple[ActiveForceLengthCurve, ForceVelocityCurve, FiberForceLengthCurve]:
        """Create the curves as components of a muscle.

        Returns:
            Curves of active force, velocity and passive force.
        """
        return (
            ActiveForceLengthCurve(name="ActiveForceLengthCurve", **self.active),
            ForceVelocityCurve(name="ForceVelocityCurve", **self.velocity),
            FiberForceLengthCurve(name="FiberForceLengthCurve", **self.passive),
        )


def fit_curves(shape: Shape, longest: float = 1.0) -> FittedCurves:
    """Return the curves of a Millard muscle that are nearest to MuJoCo's.

    Args:
        shape: parameters of MuJoCo's muscle.
        longest: largest normalized length that occurs; the passive curve is fitted up to there.
    """
    # Rounded numbers let muscles of equal shape share a fit.
    rounded_shape = Shape(*(round(float(value), CACHE_DIGITS) for value in shape))
    return FittedCurves(
        _fit_active(rounded_shape.lmin, rounded_shape.lmax),
        _fit_velocity(rounded_shape.fvmax),
        _fit_passive(
            rounded_shape.passive_start,
            rounded_shape.passive_width,
            rounded_shape.fpmax,
            round(math.ceil(longest / LENGTH_STEP) * LENGTH_STEP, CACHE_DIGITS),
        ),
    )


def _evaluate(curve: Sequence[float], x: Array) -> Array:
    return np.array([curve_value(curve, float(value))[0] for value in x])


@lru_cache(maxsize=1024)
def _fit_active(lmin: float, lmax: float) -> dict[str, float]:
    x = np.linspace(
        max(lmin - 0.1, FITTED_LENGTHS[0]), min(lmax + 0.1, FITTED_LENGTHS[1]), CURVE_POINTS
    )
    target = Shape(lmin, lmax, 1.4).active(x)

    def properties(p: Array) -> dict[str, float]:
        shortest, transition_fraction, longest, slope = map(float, p)
        transition = shortest + transition_fraction * (1.0 - shortest)
        return {
            "min_norm_active_fiber_length": shortest,
            "transition_norm_fiber_length": transition,
            "max_norm_active_fiber_length": longest,
            "shallow_ascending_slope": slope / (1.0 - transition),
            "minimum_value": 0.0,
        }

    lower_length = max(lmin, MIN_LENGTH)
    # The bounds keep the properties in the order that the curve requires.
    longest = max(lmax, 1.06)
    return _search(
        properties,
        lambda p: _evaluate(active_force_length(*p.values()), x) - target,
        {
            "min_norm_active_fiber_length": 0.4441,
            "transition_norm_fiber_length": 0.73,
            "max_norm_active_fiber_length": max(lmax, 1.2),
            "shallow_ascending_slope": 0.8616,
            "minimum_value": 0.0,
        },
        *(
            (
                min(lower_length + 0.1 * (1.0 - lower_length), 0.85),
                transition_fraction,
                longest,
                slope,
            )
            for transition_fraction in (0.3, 0.45, 0.6, 0.75, 0.9)
            for slope in (0.1, 0.3, 0.5, 0.7)
        ),
        (MIN_LENGTH, 0.05, 1.06, 0.02),
        (0.95, 0.95, max(1.5 * longest, 2.0), 0.95),
    )


@lru_cache(maxsize=1024)
def _fit_velocity(fvmax: float) -> dict[str, float]:
    eccentric_force = max(fvmax, MIN_FVMAX)
    x = np.linspace(-1.05, 1.05, CURVE_POINTS)
    target = Shape(0.5, 1.6, eccentric_force).velocity(x)
    # The curve must be steeper at 0 than on average beyond.
    max_slope = max(2.0, 2.0 * (eccentric_force - 1.0))

    def properties(p: Array) -> dict[str, float]:
        near_vmax, isometric_slope, eccentric_slope, concentric_curviness, eccentric_curviness = (
            map(float, p)
        )
        return {
            "concentric_slope_at_vmax": 0.0,
            "concentric_slope_near_vmax": near_vmax,
            "isometric_slope": isometric_slope,
            "eccentric_slope_at_vmax": 0.0,
            "eccentric_slope_near_vmax": eccentric_slope * (eccentric_force - 1.0),
            "max_eccentric_velocity_force_multiplier": eccentric_force,
            "concentric_curviness": concentric_curviness,
            "eccentric_curviness": eccentric_curviness,
        }

    return _search(
        properties,
        lambda p: _evaluate(force_velocity(*p.values()), x) - target,
        properties(np.array((0.25, max_slope, 0.1, 0.6, 0.9))),
        (0.25, max_slope, 0.1, 0.6, 0.9),
        (0.02, 1.02, 1e-3, 0.0, 0.0),
        (0.95, 6.0 * max_slope, 0.9, 1.0, 1.0),
    )


@lru_cache(maxsize=1024)
def _fit_passive(start: float, width: float, fpmax: float, longest: float) -> dict[str, float]:
    if fpmax < 1e-6:
        # A curve that begins beyond all lengths that occur.
        return {"strain_at_zero_force": 9.0, "strain_at_one_norm_force": 10.0}
    # The length at which the force is 1.
    length_at_unit_force = start + width * (
        np.sqrt(2.0 / fpmax) if fpmax >= 2.0 else 1.0 / fpmax + 0.5
    )
    x = np.linspace(
        start - 0.1,
        max(max(length_at_unit_force, 1.0) + 0.3 * (length_at_unit_force - start), longest),
        CURVE_POINTS,
    )
    target = Shape(0.5, 1.6, 1.4, start, width, fpmax).passive(x)
    zero_strain = start - 1.0

    def properties(p: Array) -> dict[str, float]:
        first, last, low_stiffness, stiffness, curviness = map(float, p)
        lower = zero_strain + first * (length_at_unit_force - start)
        upper = length_at_unit_force - 1.0 + last * (length_at_unit_force - start)
        mean = 1.0 / (upper - lower)
        return {
            "strain_at_zero_force": lower,
            "strain_at_one_norm_force": upper,
            "stiffness_at_low_force": low_stiffness * mean,
            "stiffness_at_one_norm_force": stiffness * mean,
            "curviness": curviness,
        }

    return _search(
        properties,
        lambda p: _evaluate(fiber_force_length(*p.values()), x) - target,
        {
            "strain_at_zero_force": zero_strain,
            "strain_at_one_norm_force": length_at_unit_force - 1.0,
        },
        (0.0, 0.0, 0.2, 2.0, 0.75),
        (-0.3, -0.2, 0.01, 1.05, 0.0),
        (0.3, 0.2, 0.95, 6.0, 1.0),
    )


def _search(
    properties: Callable[[Array], dict[str, float]],
    residual: Callable[[dict[str, float]], Array],
    fallback: dict[str, float],
    *numbers: tuple[float, ...],
) -> dict[str, float]:
    """Return the properties with the least sum of squares.

    Args:
        properties: properties of a curve by the numbers that are sought.
        residual: errors of a curve with these properties; ValueError if there is no such curve.
        fallback: properties of a curve that exists, for the case that none is found.
        *numbers: numbers to start from, once or several times, then the bounds of the numbers.
    """
    *starts, lower, upper = numbers
    optimize: Any = require("scipy.optimize", extra="sim", purpose="the fit of muscle curves")

    def errors(p: Array) -> Array:
        try:
            return residual(properties(p))
        # Properties that define no curve get a large error, so that the search leaves them.
        except ValueError:
            return np.full(CURVE_POINTS, NO_CURVE)

    # Starts at a bound would have no gradient.
    initial_points = [
        np.clip(start, np.array(lower) + 1e-3, np.array(upper) - 1e-3) for start in starts
    ]
    initial_points.sort(key=lambda p: float(np.sum(np.square(errors(p)))))
    solutions = [
        optimize.least_squares(
            errors,
            start,
            bounds=(lower, upper),
            x_scale=np.ptp((lower, upper), axis=0),
            ftol=FIT_TOLERANCE,
            xtol=FIT_TOLERANCE,
        )
        for start in initial_points[:SEARCH_COUNT]
    ]
    best = min(solutions, key=lambda solution: float(solution.cost))
    if float(best.cost) >= 0.5 * CURVE_POINTS * NO_CURVE**2:
        return fallback
    return properties(best.x)
