"""Tests of variables that are controls: each run equals a simulation with these controls."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.errors import SettingError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.examples import ToyReflexController
from osimlite.schema.paths import PathWrap
from osimlite.schema.splines import GCVSpline, PiecewiseConstantFunction
from osimlite.schema.wrap_types import WrapEllipsoid
from osimlite.simulation import Simulation
from osimlite.studies.sweep.controls import Control
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.run import sweep
from osimlite.studies.sweep.runner import Runner
from osimlite.studies.sweep.sampling import choose_samples
from osimlite.studies.sweep.variables import resolve_variables
from osimlite.studies.sweep.variants import Variants
from tests.studies.sweep.support import pulled

TO = 0.03
ENDS = ("x/value", "x/speed", "/forceset/mu/activation")


def ends(model, initial=None, **controls):
    with Simulation(model, "compiled") as simulation:
        run = simulation.run(TO, accuracy=1e-7, controls=controls or None, initial=initial)
    return [run.values[-1, 0], run.speeds[-1, 0], run.auxiliary["/forceset/mu/activation"][-1]]


def runs(model, vary, *rows, **choices):
    """Run samples that differ from the compiled model in numbers only.

    Args:
        model: the model.
        vary: variables and their ranges.
        rows: samples.
        choices: options of the plan.

    Returns:
        Final values ENDS of each run.
    """
    made = plan(model, vary, measures=ENDS, to=TO, accuracy=1e-7, **choices)
    runner = Runner(made)
    assert runner.variants.make_variant(rows[0]).simulation is None
    block = runner.run(np.array(rows))
    assert block.status == ["done"] * len(rows), block.reasons
    return [list(row) for row in zip(*(block.measures[name] for name in ENDS), strict=True)]


TIMES = (0.0, 0.01, 0.02, 0.03)
CURVES = {
    "linear": lambda y: (TIMES, y),
    "steps": lambda y: PiecewiseConstantFunction(x=TIMES, y=y),
    "cubic": lambda y: GCVSpline(half_order=2, x=TIMES, y=y),
}


@pytest.mark.parametrize("interpolation", CURVES)
def test_nodes_make_a_curve(interpolation):
    rows = [(0.1, 0.9, 0.2, 0.7), (0.0, 0.3, 1.0, 0.4)]
    result = runs(pulled(), {"mu/control@0:0.03:4": (0.0, 1.0)}, *rows, interpolation=interpolation)
    for ours, row in zip(result, rows, strict=True):
        assert ours == pytest.approx(ends(pulled(), mu=CURVES[interpolation](row)), rel=1e-9)
    assert abs(result[0][1] - result[1][1]) > 1e-3


def test_nodes_hold_their_values_outside():
    (result,) = runs(pulled(), {"mu/control@0.02,0.01": (0.0, 1.0)}, (0.1, 0.9))
    assert result == pytest.approx(
        ends(pulled(), mu=((0.0, 0.01, 0.02, 0.03), (0.9, 0.9, 0.1, 0.1))), rel=1e-9
    )


def test_switches_may_pass_each_other():
    vary = {
        "motor/control@switch1": (0.0, TO),
        "motor/control@switch2": (0.0, TO),
        "motor/control": (-1.0, 1.0),
    }
    result = runs(pulled(), vary, (0.01, 0.02, 0.5), (0.02, 0.01, 0.5), (0.01, 0.01, 0.5))
    on = PiecewiseConstantFunction(x=(0.0, 0.01, 0.02), y=(0.5, 1.5, 0.5))
    assert result[0] == result[1] == pytest.approx(ends(pulled(), motor=on), rel=1e-9)
    assert result[2] == pytest.approx(ends(pulled(), motor=0.5), rel=1e-9)


def test_what_drives_an_actuator_is_scaled_and_moved():
    """The factor applies to the controls of the model and to those that all runs have."""
    table = (np.array(TIMES), np.array([0.0, 0.4, 0.1, 0.2]))
    vary = {"mu/control@scale": (0.0, 2.0), "mu/control": (-1.0, 1.0)}
    (result,) = runs(pulled(), vary, (1.5, 0.1), controls={"mu": table, "motor": 0.2})
    given = 1.5 * table[1] + 0.1
    wanted = ends(hung_with_motor(excitation=0.45), mu=(TIMES, given), motor=0.2)
    assert result == pytest.approx(wanted, rel=1e-9)


def hung_with_motor(excitation):
    model = pulled()
    brain = model.tree().by_path["/controllerset/brain"].ControlFunctions.objects[0]
    brain.y = (excitation, excitation, 0.0)
    return model


def test_several_names_are_one_variable():
    for name in (
        "m*/control@0:0.03:2",
        "mu,motor/control@0,0.03",
        "/forceset/m?,/forceset/motor/control@0:0.03:2",
    ):
        (result,) = runs(pulled(), {name: (0.0, 1.0)}, (0.5, 0.3))
        both = {name: ((0.0, 0.03), (0.5, 0.3)) for name in ("mu", "motor")}
        assert result == pytest.approx(ends(pulled(), **both), rel=1e-9)


def test_muscles_and_reflexes_have_numbers_too():
    model = pulled()
    model.add(ToyReflexController(name="reflex", gain=0.0, socket_actuators=("/forceset/mu",)))
    vary = {
        "mu/max_isometric_force@scale": (0.5, 2.0),
        "reflex/gain": (0.0, 5.0),
        "x/speed": (0.0, 1.0),
    }
    result = runs(model, vary, (1.5, 3.0, 0.5), (1.0, 0.0, 0.5))
    for (scale, gain, speed), ours in zip([(1.5, 3.0, 0.5), (1.0, 0.0, 0.5)], result, strict=True):
        own = pulled()
        own.add(ToyReflexController(name="reflex", gain=gain, socket_actuators=("/forceset/mu",)))
        own.tree().by_path["/forceset/mu"].max_isometric_force *= scale
        own.tree().by_path["/jointset/slide/x"].default_speed_value = speed
        assert ours == ends(own)
    assert result[0][2] > 1.01 * result[1][2]


def test_files_of_other_controllers_are_read_once(tmp_path):
    table = tmp_path / "given.sto"
    table.write_text("given\nendheader\ntime\tmotor\n0\t0.1\n1\t0.5\n")
    model = pulled()
    model.add(PrescribedController(name="file", controls_file="given.sto"))
    made = plan(
        model,
        {"motor/control@0:0.03:2": (0.0, 1.0)},
        measures=ENDS,
        to=TO,
        accuracy=1e-7,
        folder=str(tmp_path),
    )
    runner = Runner(made)
    runner.run(np.array([[0.1, 0.2]]))
    table.unlink()
    result = runner.run(np.array([[0.3, 0.6]]))
    assert result.status == ["done"], result.reasons
    wanted = ends(pulled(), motor=((0.0, 0.03), (0.4, 0.712)))
    assert [result.measures[name][0] for name in ENDS] == pytest.approx(wanted, rel=1e-9)


def test_the_model_that_is_written_does_the_same(tmp_path):
    vary = {
        "m*/control@0:0.03:3": (0.0, 1.0),
        "motor/control@switch1": (0.0, TO),
        "mu/control@scale": (0.5, 2.0),
    }
    row, given = (0.2, 0.9, 0.4, 0.01, 1.7), {"motor": 0.1}
    (result,) = runs(pulled(), vary, row, controls=given)
    variants = Variants(plan(pulled(), vary, to=TO, controls=given))
    variants.apply_sample(row)
    osimlite.write(variants.model, tmp_path / "best.osim")
    best = osimlite.read(tmp_path / "best.osim")
    assert ends(best) == pytest.approx(result, rel=1e-12)
    # The written model can be varied again.
    Variants(plan(best, vary, controls=given))


def test_the_results_are_the_same_for_any_number_of_workers(tmp_path):
    vary = {
        "m*/control@0:0.03:3": (0.0, 1.0),
        "motor/control@switch1": (0.0, TO),
        "mu/max_isometric_force": (100, 500),
    }
    made = plan(pulled(), vary, measures=(*ENDS, "max(mu)", "mean(x/speed)"), to=TO)
    chosen = choose_samples(made.variables, "sobol", 40)
    one, three = (
        sweep(made, chosen, tmp_path / f"{n}.parquet", workers=n).path.read_bytes() for n in (1, 3)
    )
    assert one == three


def test_names():
    model = pulled()

    def targets(name):
        return [
            item.target for item in resolve_variables({name: "0:1"}, model, build_mechanism(model))
        ]

    mu, motor = "/forceset/mu", "/forceset/motor"
    assert targets("mu/control") == [Control((mu,))]
    assert targets("/forceset/*/control@0.5") == [Control((mu, motor), "node", 0.5)]
    assert targets("mu/control@0:0.5:2") == [
        Control((mu,), "node", 0.0),
        Control((mu,), "node", 0.5),
    ]
    assert targets("mu/control@switch2") == [Control((mu,), "switch", 2.0)]
    assert targets("{m*}/control@1") == [
        Control((mu,), "node", 1.0),
        Control((motor,), "node", 1.0),
    ]
    assert targets("/forceset/m{?}/control") == [Control((mu,))]
    assert [len(target.paths) for target in targets("{*}/max_control@scale")] == [1, 1]
    assert targets("mu/control@scale") == [Control((mu,), "scale")]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("mu/control@soon", "expected a time in s, 'switch1', 'switch2' ... or 'scale' after"),
        ("mu/control@-1", "expected a time in s"),
        ("mu/control@", "expected a time in s"),
        ("mu/control@0:1", "@FIRST:LAST:COUNT, with a COUNT of at least 2"),
        ("mo/control@0.1", "did you mean 'mu/control'"),
        ("{n*}/control", r"control or numeric property '\{n\*\}/control' to vary"),
        (
            "mu,mo/control",
            "has no coordinate, parameter, control or numeric property 'mu,mo/control'",
        ),
        ("mu@0.1", "'mu@0.1' is an actuator: vary 'mu/control'"),
        ("mu/max_isometric_forc", "did you mean 'mu/max_isometric_force'"),
    ],
)
def test_names_that_mean_nothing(name, words):
    with pytest.raises(SettingError, match=words):
        plan(pulled(), {name: (0.0, 1.0)})


def test_what_cannot_be_is_said():
    with pytest.raises(SettingError, match="the same quantity"):
        plan(pulled(), {"mu/control@0.1": (0.0, 1.0), "m*/control@0.1": (0.0, 1.0)})
    with pytest.raises(
        SettingError, match="there is no interpolation 'cubed'; did you mean 'cubic'"
    ):
        plan(pulled(), {"mu/control@0.1": (0.0, 1.0)}, interpolation="cubed")
    with pytest.raises(
        SettingError, match=r"needs at least 4 nodes, .* '/forceset/mu' are at 0, 0.1, 0.2, 0.3 s"
    ):
        plan(pulled(), {"mu/control@0:0.3:4": (0.0, 1.0)}, interpolation="cubic", to=0.5)
    with pytest.raises(
        SettingError,
        match="'/forceset/motor' by a function, so there is no control to scale; give one with",
    ):
        Variants(plan(pulled(), {"motor/control@scale": (0.0, 1.0)}))
    with pytest.raises(SettingError, match="no actuator 'moter' to control; did you mean 'motor'"):
        plan(pulled(), {"x": (0.0, 1.0)}, controls={"moter": 1.0})


@pytest.mark.parametrize("choice", [{"integrator": "bdf"}, {"wrapping": "geodesic"}])
def test_what_is_chosen_for_a_simulation_is_of_each_run(choice):
    """The muscle wraps around an ellipsoid; its numbers are updated for the selected wrapping."""
    model = pulled()
    egg = WrapEllipsoid(name="egg", dimensions=(0.05, 0.08, 0.06), translation=(0.15, 0.05, 0.01))
    model.ground.wrap_object_set.objects.append(egg)
    model.tree().by_path["/forceset/mu"].geometry_path.path_wrap_set.objects.append(
        PathWrap(wrap_object="egg")
    )
    vary = {"mu/control@0:0.03:2": (0.0, 1.0), "mu/max_isometric_force": (300.0, 600.0)}
    (result,) = runs(model, vary, (0.2, 0.6, 500.0), **choice)
    model.tree().by_path["/forceset/mu"].max_isometric_force = 500.0
    with Simulation(model, "compiled", **choice) as simulation:
        run = simulation.run(TO, accuracy=1e-7, controls={"mu": ((0.0, 0.03), (0.2, 0.6))})
    assert result[:2] == pytest.approx([run.values[-1, 0], run.speeds[-1, 0]], rel=1e-9)
    (usual,) = runs(model, vary, (0.2, 0.6, 500.0))
    assert result[:2] != usual[:2]
