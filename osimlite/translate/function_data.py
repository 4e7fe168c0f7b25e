"""Functions that drive joints, as data for other programs."""

from __future__ import annotations

from typing import Any

from osimlite.errors import UnsupportedError
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.arc import ArcPoint
from osimlite.mechanics.multibody.motions import EllipsoidPoint
from osimlite.mechanics.multibody.smoothing_spline import PiecewisePolynomial


def describe_function(function: f.SmoothFunction) -> dict[str, Any]:
    """Convert a function to data for JSON, without loss.

    Args:
        function: function of coordinates.

    Returns:
        `type` and the parameters of this type, see docs/urdf.md.

    Raises:
        UnsupportedError: the format does not have this class of functions.
    """
    match function:
        case f.ConstantValue(value):
            return {"type": "constant", "value": value}
        case f.Linear(rate, start):
            return {"type": "linear", "slope": rate, "start": start}
        case f.WeightedSum(weights, start):
            return {"type": "weighted-sum", "weights": weights, "start": start}
        case f.Polynomial(coefficients):
            # OpenSim has the highest power first, the format the constant.
            return {"type": "polynomial", "coefficients": coefficients[::-1]}
        case f.SineWave(amplitude, omega, phase, offset):
            return {
                "type": "sine",
                "amplitude": amplitude,
                "omega": omega,
                "phase": phase,
                "offset": offset,
            }
        case f.QuinticStep():
            return {
                "type": "step",
                "x": (function.start, function.end),
                "y": (function.start_value, function.end_value),
            }
        case f.MultivariatePolynomial(coefficients, powers):
            return {
                "type": "multivariate-polynomial",
                "coefficients": coefficients,
                "powers": powers,
            }
        case f.ScaledFunction(scale, inner):
            return {"type": "scaled", "scale": scale, "function": describe_function(inner)}
        case f.PiecewiseLinear(x, y):
            return {"type": "piecewise-linear", "x": x, "y": y}
        case f.PiecewiseConstant(x, y):
            return {"type": "piecewise-constant", "x": x, "y": y}
        case EllipsoidPoint(component, radius):
            return {"type": "ellipsoid-point", "component": component, "radius": radius}
        case ArcPoint(component, length, neutral):
            return {
                "type": "arc-point",
                "component": component,
                "length": length,
                "neutral": neutral,
            }
        case f.SimmCubicSpline():
            # Before the first and after the last point the spline continues linearly.
            first, *_, last = function.pieces
            return {
                "type": "piecewise-polynomial",
                "of": "SimmSpline",
                "y": function.y,
                "x": function.x,
                "pieces": [first[:2], *function.pieces[:-1], last[:2]],
            }
        case PiecewisePolynomial():
            return {
                "type": "piecewise-polynomial",
                "of": "GCVSpline",
                "x": function.knots[1:].tolist(),
                "pieces": function.pieces.tolist(),
            }
    raise UnsupportedError(
        f"a function of class {type(function).__name__} cannot be written as data"
    )
