"""Tests of sensitivities of motions against extrapolated differences of simulations."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import osimlite
from osimlite.errors import SettingError, SimulationError
from osimlite.models.jumper import jumper
from osimlite.models.walkers import furthest_walker
from osimlite.simulation.properties import find_properties
from tests.derivatives.support import human, pendulum
from tests.simulation.support import MODELS

ACCURACY = 1e-11
ANGLE, SPEED = "/jointset/hinge/angle/value", "/jointset/hinge/angle/speed"


def states_of(trajectory, names):
    columns = dict(trajectory.auxiliary)
    for k, info in enumerate(trajectory.mechanism.coordinates):
        columns |= {
            f"{info.path}/value": trajectory.values[:, k],
            f"{info.path}/speed": trajectory.speeds[:, k],
        }
    return np.column_stack([columns[name] for name in names])


def difference(model, found, number, by, to, **choices):
    """Differentiate the states of simulations by central differences with two extrapolations.

    Args:
        model: the model.
        found: sensitivities, for names and initial values.
        number: path of a state or of a property.
        by: largest step of the differences.
        to: end time (s).
        choices: further options of the simulation.

    Returns:
        Derivatives (n, x) of all states at all times.
    """

    def moved(h):
        changed, initial = model.copy_deep(), dict(choices.get("initial", {}))
        if number in found.states:
            initial[number] = found.motion[0, found.states.index(number)] + h
        else:
            for place in find_properties(changed, number):
                setter = place.make_setter(changed)
                setter.set_value(setter.get_value() + h)
        run = osimlite.simulate(
            changed, to, "compiled", **{**choices, "initial": initial, "accuracy": ACCURACY}
        )
        return states_of(run, found.states)

    rows = [(moved(h) - moved(-h)) / (2.0 * h) for h in (by, by / 2.0, by / 4.0)]
    rows = [(4.0 * b - a) / 3.0 for a, b in pairwise(rows)]
    return (16.0 * rows[1] - rows[0]) / 15.0


def off(model, parameters, states, by, to, accuracy=1e-10, **choices):
    """Return the largest error of the sensitivities by each number, relative to the largest derivative.

    Args:
        model: the model.
        parameters: paths of properties.
        states: states whose initial value is varied.
        by: step of the differences for each number.
        to: end time (s).
        accuracy: accuracy of the integrator.
        choices: further options of the simulation.
    """
    found = osimlite.sensitivity(model, parameters, to, states=states, accuracy=accuracy, **choices)
    assert found.derivatives.shape == (len(found.times), len(found.states), len(by))
    result = {}
    for k, number in enumerate(found.numbers):
        wanted = difference(model, found, number, by[k], to, **choices)
        result[number] = np.abs(found.derivatives[:, :, k] - wanted).max() / np.abs(wanted).max()
    return result


def test_a_pendulum_with_a_motor():
    parameters = "/bodyset/rod/mass", "/bodyset/rod/mass_center/1", "/forceset/motor/optimal_force"
    drive = {"motor": lambda t: np.sin(9.0 * t)}
    found = off(
        pendulum(),
        parameters,
        [ANGLE, SPEED],
        [1e-2] * 5,
        1.0,
        controls=drive,
        report_interval=0.0123,
    )
    assert len(found) == 5 and max(found.values()) < 1e-7


def test_a_walker_in_contact():
    model = furthest_walker()
    assert osimlite.simulate(model, 0.3, "compiled").summary["contact_events"]
    found = off(
        model,
        ["/bodyset/Pelvis/mass"],
        ["/jointset/PelvisToPlatform/Pelvis_tx/speed"],
        [1e-3] * 2,
        0.3,
    )
    assert max(found.values()) < 1e-6


def test_muscles_with_tendons():
    muscle = "/forceset/vasti_r"
    parameters = f"{muscle}/max_isometric_force", f"{muscle}/tendon_slack_length"
    found = off(
        human(), parameters, [f"{muscle}/activation"], [10.0, 1e-4, 1e-3], 0.03, accuracy=1e-9
    )
    assert max(found.values()) < 1e-6


def test_muscles_around_surfaces():
    muscle = "/forceset/vasti_r"
    found = off(jumper(), [f"{muscle}/max_isometric_force"], [], [10.0], 0.03, accuracy=1e-9)
    assert max(found.values()) < 1e-6


def test_bends_are_narrowed_down(monkeypatch):
    """Without short steps where the force of a stop begins, the motion is accurate but its derivative is not."""
    model, mass = pendulum(), "/bodyset/rod/mass"
    stop = osimlite.CoordinateLimitForce(
        name="stop", coordinate="angle", upper_limit=180.0, upper_stiffness=5.0
    )
    stop.lower_limit, stop.lower_stiffness, stop.transition, stop.damping = -20.0, 50.0, 0.001, 0.0
    model.add(stop)
    assert max(off(model, [mass], [ANGLE], [1e-3] * 2, 0.8).values()) < 2e-6
    wanted = osimlite.sensitivity(model, [mass], 0.8, accuracy=1e-11).derivatives
    rough = osimlite.sensitivity(model, [mass], 0.8).derivatives
    assert np.abs(rough - wanted).max() < 1e-4 * np.abs(wanted).max()
    monkeypatch.setattr("osimlite.derivatives.sensitivity.MIN_STEP_S", 1.0)
    rough = osimlite.sensitivity(model, [mass], 0.8).derivatives
    assert np.abs(rough - wanted).max() > 1e-3 * np.abs(wanted).max()


def test_numbers_are_named_and_found():
    found = osimlite.sensitivity(
        pendulum(), ["/bodyset/rod/mass"], 0.1, states=[SPEED], report_interval=0.05
    )
    assert found.numbers == ("/bodyset/rod/mass", SPEED) and found.states == (ANGLE, SPEED)
    assert np.array_equal(found.get_derivative(ANGLE, SPEED), found.derivatives[:, 0, 1])
    assert found.derivatives[0].tolist() == [[0.0, 0.0], [0.0, 1.0]]
    assert np.array_equal(found.motion[:, 0], found.trajectory.values[:, 0])
    rows, columns = found.table
    assert [*rows] == ["time"] and f"{ANGLE}|/bodyset/rod/mass" in columns and len(columns) == 4
    with pytest.raises(osimlite.OsimliteError, match="no number '/bodyset/rod/mas'; did you mean"):
        found.get_derivative(ANGLE, "/bodyset/rod/mas")
    with pytest.raises(osimlite.OsimliteError, match=f"no state 'angle'; did you mean '{ANGLE}'"):
        found.get_derivative("angle", SPEED)


def test_a_path_in_the_place_of_a_model_is_answered_with_how_to_read_it():
    with pytest.raises(osimlite.OsimliteError, match=r"osimlite\.read\('arm\.osim'\)"):
        osimlite.linearize("arm.osim")


def test_tangents_are_taken_for_many_motions():
    model = pendulum()
    tangents = osimlite.tangents(model, ["/bodyset/rod/mass"])
    model.body_set.objects[0].mass = 3.0
    found, wanted = (
        osimlite.sensitivity(model, given, 0.3) for given in (tangents, ["/bodyset/rod/mass"])
    )
    assert np.abs(found.derivatives - wanted.derivatives).max() < 1e-12
    with pytest.raises(
        SettingError, match=r"the derivative of '.*/angle/speed' differs .* from this model"
    ):
        osimlite.sensitivity(pendulum(gravity=3.0), tangents, 0.3)
    with pytest.raises(SettingError, match="of another model"):
        osimlite.sensitivity(furthest_walker(), osimlite.tangents(model), 0.3)


def test_what_is_not_there_is_refused():
    with pytest.raises(SettingError, match="'fixed_step' is not an option of sensitivities"):
        osimlite.sensitivity(pendulum(), fixed_step=0.001)
    with pytest.raises(SettingError, match=f"is an initial value, which is fixed; pass '{ANGLE}'"):
        osimlite.sensitivity(pendulum(), ["/jointset/hinge/angle/default_value"])


@pytest.mark.parametrize("name", ["four_bars", "patella", "rod", "welded", "half_locked"])
def test_constraints_go_with_a_motion(name):
    """Start from a state that fulfils the constraints; a changed state is projected to the nearest one that does."""
    model, to = MODELS[name](), 0.2
    first = osimlite.sensitivity(model, to=0.01)
    start = dict(zip(first.states, first.motion[0].tolist(), strict=True))
    free = next(info.path for info in first.trajectory.mechanism.coordinates if not info.locked)
    by = [f"{free}/value", f"{free}/speed"]
    choices = {"initial": start, "report_interval": to}
    mass = f"/bodyset/{model.body_set.objects[0].name}/mass"
    found = osimlite.sensitivity(model, [mass], to, states=by, accuracy=1e-10, **choices)
    for number in found.numbers:
        wanted = difference(model, found, number, 1e-3, to, **choices)
        own = found.derivatives[:, :, found.numbers.index(number)]
        assert np.abs(own - wanted).max() < 1e-7 * max(1.0, np.abs(wanted).max())


@pytest.mark.parametrize("held", [False, True])
def test_a_start_that_is_bound_goes_with_a_number(held):
    """The length of a rod determines the initial angle, unless that angle is prescribed."""
    model, number, angle = (
        MODELS["rod"](),
        "/constraintset/rod/constant_distance",
        "/jointset/j0/p0/value",
    )
    first = osimlite.sensitivity(model, to=0.01)
    start = dict(zip(first.states, first.motion[0].tolist(), strict=True))
    if held:
        start["p0"] = start.pop(angle)
    choices = {"initial": start, "report_interval": 0.1}
    found = osimlite.sensitivity(model, [number], 0.1, accuracy=1e-10, **choices)
    wanted = difference(model, found, number, 1e-4, 0.1, **choices)
    assert np.abs(found.derivatives[:, :, 0] - wanted).max() < 1e-7 * np.abs(wanted).max()
    assert (found.get_derivative(angle, number)[0] == 0.0) == held


def test_derivatives_that_are_no_numbers_are_told(monkeypatch):
    monkeypatch.setattr(
        "osimlite.derivatives.tangents.TangentSteps.step",
        lambda self, t0, t1, y: (y + np.nan, 0.0 * y),
    )
    with pytest.raises(
        SimulationError, match=r"the derivatives of '/jointset/hinge/angle/value' are not finite"
    ):
        osimlite.sensitivity(pendulum(), ["/bodyset/rod/mass"], 0.1)
