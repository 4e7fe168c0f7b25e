"""Tests of gradients of objectives: they equal finite differences of simulations, and gradient searches converge."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.errors import SettingError, SimulationError, UnsupportedError
from osimlite.models.walkers import furthest_walker
from osimlite.studies.sweep import registry
from osimlite.studies.sweep.measures import get_measure_name
from osimlite.studies.sweep.optimize import Objective, optimize
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.runner import Runner
from tests.derivatives.support import human, pendulum


def swing(run):
    """Return a measure of the angle at the end, the speeds, and the parameter `angle`."""
    return (
        (run.end["angle"] - 2.0) ** 2
        + 1e-3 * float(np.sum(run.history("angle/speed") ** 2))
        + run.values["angle"]
    )


def steps(run):
    return float(len(run.events))


def both(made, values):
    """Differentiate the first measure.

    Args:
        made: plan of the search.
        values: values of its variables.

    Returns:
        Gradient, and extrapolated central differences of simulations.
    """
    free, runner, name = list(range(len(values))), Runner(made), get_measure_name(made.measures[0])

    def moved(place, by):
        row = np.array(values)
        row[place] += by
        return runner.run(row[None]).measures[name][0]

    def slope(place, h):
        return (
            8.0 * (moved(place, h) - moved(place, -h)) - moved(place, 2 * h) + moved(place, -2 * h)
        ) / (12.0 * h)

    wanted = [
        slope(place, 1e-3 * (made.variables[place].high - made.variables[place].low))
        for place in free
    ]
    return registry.make_gradients(made).evaluate(values, free), np.array(wanted)


@pytest.mark.parametrize(
    "measure", [swing, "mean(motor) + end(angle)^2 - sin(max(angle))", "energy", "angle/speed"]
)
def test_a_pendulum(measure):
    vary = {
        "angle": (0.1, 1.0),
        "angle/speed": (0.0, 1.0),
        "/bodyset/rod/mass": (1.0, 3.0),
        "/bodyset/rod/mass_center/0": (0.05, 0.2),
        "motor/control@0": (-1.0, 1.0),
        "motor/control@0.3": (-1.0, 1.0),
        "slope": (-0.1, 0.1),
    }
    made = plan(pendulum(), vary, measures=(measure,), to=0.5, accuracy=1e-12, report_interval=0.05)
    found, wanted = both(made, [0.6, 0.3, 2.2, 0.1, 0.5, -0.2, 0.03])
    assert found == pytest.approx(wanted, rel=0.0, abs=1e-8 * np.abs(wanted).max())


def test_muscles_with_tendons_that_start_in_equilibrium():
    vary = {
        "soleus_?/control": (0.1, 0.9),
        "/forceset/soleus_r/max_isometric_force": (2000.0, 6000.0),
    }
    made = plan(
        human(), vary, measures=("end(center_of_mass_Y) + 0.1*mean(soleus_r/activation)",), to=0.05, accuracy=1e-9,
        equilibrate=True,
    )  # fmt: skip
    found, wanted = both(made, [0.5, 4000.0])
    assert found == pytest.approx(wanted, rel=1e-5)


@pytest.mark.full
def test_a_search_arrives(tmp_path):
    """The motor must lift the rod with minimal effort."""
    vary = {f"motor/control@{t:g}": (-20.0, 20.0) for t in (0.0, 0.2, 0.4)}
    cost = "100*(end(angle) - 1.2)^2 + 100*end(angle/speed)^2 + 0.01*integral(motor/control^2)"
    made = plan(pendulum(), vary, measures=(), to=0.4, accuracy=1e-8)
    found = optimize(made, Objective(cost), tmp_path / "gradient", method="gradient", budget=60)
    assert found.ended.startswith("converged") and found.evaluations < 60
    slopes = registry.make_gradients(
        plan(pendulum(), vary, measures=(cost,), to=0.4, accuracy=1e-8)
    )
    assert np.abs(slopes.evaluate([*found.values.values()], [0, 1, 2])).max() < 1e-3
    again = optimize(made, Objective(cost), tmp_path / "part", method="gradient", budget=4)
    assert again.evaluations == 4
    rest = optimize(
        made, Objective(cost), tmp_path / "part", method="gradient", budget=60, resume=True
    )
    assert (rest.value, rest.values, rest.evaluations) == (
        found.value,
        found.values,
        found.evaluations,
    )


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        ({"integrator": "rosenbrock"}, "integrator 'merson'"),
        ({"below": {"Pelvis_ty": 0.1}}, "remove the levels that end runs"),
        ({"measures": ("steps",)}, "depends on events"),
    ],
)
def test_what_has_no_derivatives_is_refused(choices, message):
    made = plan(
        furthest_walker(), {"RHip_rz": (0.3, 0.7)}, to=0.1, **{"measures": ("distance",), **choices}
    )
    with pytest.raises((SettingError, UnsupportedError), match=message):
        registry.make_gradients(made)


@pytest.mark.parametrize("measure", ["largest_force", steps])
def test_measures_of_more_than_states_are_refused(measure):
    made = plan(furthest_walker(), {"RHip_rz": (0.3, 0.7)}, to=0.1, measures=(measure,))
    with pytest.raises((SimulationError, UnsupportedError), match="another measure"):
        registry.make_gradients(made).evaluate([0.5], [0])


def test_constraints_go_with_a_motion():
    model = pendulum()
    slide = model.add(osimlite.Body(name="slide", mass=1.0, inertia=(1.0, 1.0, 1.0, 0, 0, 0)))
    other = osimlite.Coordinate(name="way")
    model.add(osimlite.SliderJoint(name="guide", coordinates=[other]).between(model.ground, slide))
    line = osimlite.LinearFunction(coefficients=(0.1, 0.0))
    model.add(
        osimlite.CoordinateCouplerConstraint(
            name="gear",
            independent_coordinate_names=["angle"],
            dependent_coordinate_name="way",
            coupled_coordinates_function=line,
        )
    )
    vary = {"/bodyset/rod/mass": (1.0, 3.0), "angle": (0.2, 0.8)}
    made = plan(model, vary, measures=("end(way) + end(angle/speed)",), to=0.3, accuracy=1e-11)
    found, wanted = both(made, [2.0, 0.5])
    assert found == pytest.approx(wanted, rel=0.0, abs=1e-8 * np.abs(wanted).max())
