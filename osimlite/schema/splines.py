"""Functions that interpolate between points."""

from typing import Annotated

from osimlite.schema.fields import (
    LegacyReals,
    Value,
    real,
)
from osimlite.schema.functions import Function, FunctionSet


class PiecewiseConstantFunction(Function):
    """Steps between constant values."""

    x: LegacyReals = ()
    """Arguments at which the value changes, in ascending order."""
    y: LegacyReals = ()
    """Value from each x up to the next; the first also applies before its x, the last after it."""


class PiecewiseLinearFunction(Function):
    """Straight lines between the points (`x`, `y`), continued beyond the first and the last."""

    x: LegacyReals = ()
    """Arguments of the points, in ascending order."""
    y: LegacyReals = ()
    """Values at the points; the outer lines continue beyond them."""


# OpenSim prints these lists of the first property system with six digits: a model that it has
# written again has slightly different splines.
class SimmSpline(Function):
    """A cubic spline through the points (`x`, `y`) by the formulas of SIMM, continued as straight lines."""

    x: LegacyReals = ()
    """Arguments of the points, in ascending order; two make a line."""
    y: LegacyReals = ()
    """Values at the points; beyond the ends the function is a line with the slope there."""


# In the lists OpenSim accepts commas and one pair of brackets, but neither nan nor inf: they belong
# to its first property system.
class GCVSpline(Function):
    """A spline of degree 2 `half_order` - 1 (Woltring's), smoothed as far as `error_variance` allows."""

    half_order: Annotated[int, Value("int", legacy=True, domain=">= 0")] = 0
    """Half of degree + 1: 1 is linear, 2 cubic, 3 quintic, 4 heptic."""
    error_variance: Annotated[float, real(legacy=True)] = 0.0
    """Variance of the noise in `y`: with 0 the spline runs through all points, below 0 cross-validation decides."""
    x: LegacyReals = ()
    """Arguments of the points, in ascending order; at least twice as many as `half_order`."""
    y: LegacyReals = ()
    """Values at the points."""
    weights: LegacyReals = ()
    """A number for each point; OpenSim's fit lets all points count the same."""
    coefficients: LegacyReals = ()
    """Coefficients of the fit; OpenSim computes them anew from the points."""


class GCVSplineSet(FunctionSet):
    """A list of GCV splines, one for each column of a table."""
