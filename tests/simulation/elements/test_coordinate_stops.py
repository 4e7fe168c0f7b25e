"""Tests of forces that OpenSim introduced after 4.6, against their formulas, because OpenSim 4.6 cannot be compared."""

from __future__ import annotations

import math

import numpy as np
import pytest

import osimlite
from osimlite.errors import ModelError
from osimlite.schema.springs import (
    CoordinateLinearStopForce,
    ExponentialCoordinateLimitForce,
)
from osimlite.simulation import Simulation
from osimlite.simulation.elements.force_types.coordinate_forces import (
    compute_exponential_limit,
    compute_linear_stop,
)
from tests.simple_models import make_slide


def slide(force) -> osimlite.Model:
    """Return a model of a body of 2 kg on a slide without gravity."""
    return make_slide(force, mass=2.0, gravity=(0.0, 0.0, 0.0))


def linear(**more) -> CoordinateLinearStopForce:
    given = {"stiffness": 100.0, "damping": 0.5, "upper_limit": 0.1, "lower_limit": -0.2, **more}
    return CoordinateLinearStopForce(name="stop", socket_coordinate="/jointset/slide/x", **given)


def exponential(lower=(50.0, 75.0)) -> ExponentialCoordinateLimitForce:
    return ExponentialCoordinateLimitForce(
        name="stop",
        socket_coordinate="/jointset/slide/x",
        lower_limit=-0.2,
        upper_limit=0.3,
        lower_shape_parameters=lower,
        upper_shape_parameters=(20.0, 25.0),
    )


@pytest.mark.parametrize(
    ("x", "v", "force", "energy"),
    [
        (0.05, 3.0, 0.0, 0.0),
        (0.3, 0.0, -20.0, 2.0),
        (0.3, 1.0, -30.0, 2.0),
        (0.3, -3.0, 0.0, 2.0),
        (-0.3, 0.0, 10.0, 0.5),
        (-0.3, -1.0, 15.0, 0.5),
        (-0.3, 4.0, 0.0, 0.5),
    ],
)
@pytest.mark.parametrize("engine", ["bullet", "compiled"])
def test_linear_stop(engine, x, v, force, energy):
    with Simulation(slide(linear()), engine) as simulation:
        y = simulation.initial_state({"x": x}, {"x": v})
        assert simulation.engine.compute_derivative(0.0, y)[1] == pytest.approx(force / 2.0)
        assert simulation.engine.columns == ("stop", "PotentialEnergy")
        assert simulation.engine.force_records(0.0, y) == pytest.approx([force, energy])


@pytest.mark.parametrize("x", [-0.25, -0.1, 0.0, 0.31])
def test_exponential_limits(x):
    expected = 50.0 * math.exp(-75.0 * (x + 0.2)) - 20.0 * math.exp(25.0 * (x - 0.3))
    with Simulation(slide(exponential()), "compiled") as simulation:
        y = simulation.initial_state({"x": x}, {"x": 1.0})
        assert simulation.engine.compute_derivative(0.0, y)[1] == pytest.approx(expected / 2.0)


def test_the_force_is_what_the_energy_falls_by():
    h = 1e-6
    for x in np.linspace(-0.3, 0.4, 29):
        for law, numbers in (
            (compute_linear_stop, (100.0, 0.0, 0.1, -0.2)),
            (compute_exponential_limit, (-0.2, 0.3, 50.0, 75.0, 20.0, 25.0)),
        ):
            (_, before), (force, _), (_, after) = (law(x + d, 0.0, *numbers) for d in (-h, 0.0, h))
            assert force == pytest.approx((before - after) / (2.0 * h), rel=1e-6, abs=1e-4)


@pytest.mark.parametrize(
    ("force", "message"),
    [
        (linear(stiffness=-1.0), "not negative"),
        (linear(lower_limit=0.2), "not above the upper_limit"),
        (exponential(lower=(0.0, 1.0)), "shape parameters .* positive"),
    ],
)
def test_parameters_without_a_meaning(force, message):
    with pytest.raises(ModelError, match=message):
        Simulation(slide(force), "compiled")
