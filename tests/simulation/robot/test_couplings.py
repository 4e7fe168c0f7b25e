"""Tests of the detection of functions that are straight lines, by which a joint of a robot can mimic another."""

from __future__ import annotations

from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.functions import Linear, ScaledFunction
from osimlite.simulation.robot.couplings import StraightLine, find_line

X, Y = (0.0, 1.0, 2.0, 3.5), (0.0, 1.0, -1.0, 0.5)


def test_straight_lines_are_known_in_any_form():
    lines = [
        Linear(2.0, 1.0),
        f.WeightedSum((2.0,), 1.0),
        f.Polynomial((0.0, 2.0, 1.0)),
        f.MultivariatePolynomial.complete((1.0, 2.0, 0.0), 1, 2),
        ScaledFunction(-2.0, Linear(-1.0, -0.5)),
        f.SimmCubicSpline((-1.0, 3.0), (-1.0, 7.0)),
        ScaledFunction(0.5, f.SimmCubicSpline((-1.0, 3.0), (-2.0, 14.0))),
        f.PiecewiseLinear((-1.0, 3.0), (-1.0, 7.0)),
    ]
    assert [find_line(function) for function in lines] == [StraightLine(2.0, 1.0)] * len(lines)
    assert find_line(f.SimmCubicSpline(X, [0.3] * len(X))) == StraightLine(0.0, 0.3)
    curves = [
        f.Polynomial((1.0, 2.0, 1.0)),
        f.WeightedSum((1.0, 2.0)),
        f.MultivariatePolynomial.complete((1.0, 2.0, 3.0), 1, 2),
        f.MultivariatePolynomial.complete((1.0, 2.0, 3.0), 2, 1),
        f.SineWave(1.0, 1.0, 0.0, 0.0),
        ScaledFunction(2.0, f.SimmCubicSpline(X, Y)),
        f.SimmCubicSpline((0.0, 0.0), (0.0, 1.0)),
        f.PiecewiseLinear(X, Y),
    ]
    assert [find_line(function) for function in curves] == [None] * len(curves)
