"""Tests of measures that are expressions, against the trajectories of simulations."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.errors import SettingError
from osimlite.schema.probe_types import ActuatorPowerProbe
from osimlite.simulation import Simulation
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.runner import Runner
from tests.studies.sweep.support import pulled


def measured(model, *measures, vary=None, row=(0.345,), **choices):
    block = Runner(plan(model, vary or {"x": (0.0, 1.0)}, measures=measures, **choices)).run(
        np.array([row])
    )
    assert block.status == ["done"], block.reasons
    return [float(block.measures[name][0]) for name in measures]


def test_they_are_of_the_columns_of_a_simulation():
    model = pulled()
    model.add(ActuatorPowerProbe(name="power", actuator_names=("mu",)))
    model.add(
        ActuatorPowerProbe(
            name="work", actuator_names=("all",), probe_operation="integrate", gain=2.0
        )
    )
    names = {
        "x": lambda run: run.values[:, 0],
        "/jointset/slide/x/value": lambda run: run.values[:, 0],
        "x/speed": lambda run: run.speeds[:, 0],
        "mu/fiber_length": lambda run: run.auxiliary["/forceset/mu/fiber_length"],
        "/forceset/mu/activation": lambda run: run.auxiliary["/forceset/mu/activation"],
        "mu": lambda run: run.forces["mu"],
        "power_mu": lambda run: run.probes["power_mu"],
        "work_mu": lambda run: run.probes["work_mu"],
        "mu/control": lambda run: np.full(len(run.times), 0.3),
        "time": lambda run: run.times,
    }
    result = measured(
        model, *(f"{what}({name})" for name in names for what in ("max", "min", "end")), to=0.055
    )
    with Simulation(model, "compiled") as simulation:
        run = simulation.run(0.055, initial={"x": 0.345}, report_interval=0.01)
    wanted = [
        number for of in names.values() for number in (of(run).max(), of(run).min(), of(run)[-1])
    ]
    assert result == pytest.approx(wanted, rel=1e-12, abs=1e-300)


@pytest.mark.parametrize("engine", ["compiled", "bullet"])
def test_places_of_bodies_and_the_mass_center(walker, engine):
    """The result depends on the variables that are properties of the model."""
    names = [
        "center_of_mass_X",
        "center_of_mass_Y/speed",
        "LeftShank_Y",
        "Pelvis_X/speed",
        "platform_rz",
    ]
    vary = {
        "Pelvis_ty/speed": (0.0, 1.0),
        "LHip_rz": (0.0, 1.0),
        "LHip_rz/speed": (0.0, 3.0),
        "Pelvis/mass": (1, 5),
    }
    vary |= {"LeftShank/mass_center/1": (-0.2, 0.2), "platform_rz": (-0.1, 0.0)}
    row = (0.5, 0.3, 2.0, 4.0, 0.15, -0.05)
    made = plan(
        walker, vary, measures=tuple(f"end({name})" for name in names), to=0.1, engine=engine
    )
    result = [value[0] for value in Runner(made).run(np.array([row])).measures.values()]
    walker.tree().by_path["/bodyset/Pelvis"].mass = 4.0
    walker.tree().by_path["/bodyset/LeftShank"].mass_center = shank = (0.0, 0.15, 0.0)
    walker.tree().by_path["/jointset/PlatformToGround/platform_rz"].default_value = -0.05
    with Simulation(walker, "compiled") as simulation:
        speeds = {"Pelvis_ty": 0.5, "LHip_rz": 2.0}
        run = simulation.run(0.1, initial={"LHip_rz": 0.3}, initial_speeds=speeds)
    mechanism, q, u = run.mechanism, run.values[-1], run.speeds[-1]
    wanted = [
        mechanism.center_of_mass(q)[0],
        mechanism.center_of_mass_velocity(q, u)[1],
        (mechanism.body_transforms(q)["LeftShank"] @ [*shank, 1.0])[1],
        mechanism.station_velocity(
            "Pelvis", walker.tree().by_path["/bodyset/Pelvis"].mass_center, q, u
        )[0],
        -0.05,
    ]
    assert result == pytest.approx(wanted, rel=1e-12 if engine == "compiled" else 1e-7)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("start(x)", 0.345),
        ("integral(2*time)", 0.25),
        ("mean(time)", 0.25),
        ("integral(1)/max(time)", 1.0),
        ("-start(x)^2 + (3 - 2.5e0)*4", 2.0 - 0.345**2),
        ("max(abs(time - 0.5)) / sqrt(4)", 0.25),
        ("end(x/speed/x) - end(x/speed)/end(x)", 0.0),
    ],
)
def test_arithmetic(text, value):
    assert measured(pulled(), text, to=0.5, accuracy=1e-2) == [pytest.approx(value, abs=1e-12)]


def effort(run):
    """Compute a measure from a run, and check which histories a run has."""
    assert len(run.times) == 6
    with pytest.raises(
        SettingError, match="a run has no 'mu/activatio'; did you mean 'mu/activation'"
    ):
        run.history("mu/activatio")
    return float((run.history("mu/activation") * run.history("mu")).sum())


def test_functions_look_at_the_same():
    (result,) = (
        Runner(plan(pulled(), {"x": (0.0, 1.0)}, measures=(effort,), to=0.05, report_interval=0.01))
        .run(np.array([[0.345]]))
        .measures.values()
    )
    with Simulation(pulled(), "compiled") as simulation:
        run = simulation.run(0.05, initial={"x": 0.345}, report_interval=0.01)
    wanted = (run.auxiliary["/forceset/mu/activation"] * run.forces["mu"]).sum()
    assert wanted > 0.0 and result[0] == pytest.approx(wanted, rel=1e-12)


def test_a_run_that_is_stopped_is_looked_at_up_to_its_end(walker):
    made = plan(
        walker,
        {"RHip_rz": (0.0, 1.0)},
        measures=("end(Pelvis_ty)", "max(time)"),
        below={"Pelvis_ty": 0.7},
    )
    block = Runner(made).run(np.array([[0.5]]))
    assert block.status == ["stopped"]
    assert [block.measures[name][0] for name in made.measures] == pytest.approx(
        [0.7, block.times[0]], abs=1e-6
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("max(y)", "the unknown quantity 'y'"),
        ("max(mu/activaton)", "the unknown quantity 'activaton'"),
        ("max(center_of_mas_Y)", "did you mean 'center_of_mass_Y'"),
        ("max(x) + (x)", "changes during a run; reduce it to one number, for example with max"),
        ("max(x", "is not an expression; an example"),
        ("max(x" + "+x" * 20000 + ")", "is not an expression; an example"),
        ("max(x" + "+x" * 300 + ")", "nests more than 200 levels deep; write it shorter"),
        ("max(x, 1)", "is not a valid expression; it may contain"),
        ("(1, 2)", "is not a valid expression; it may contain"),
        ("open(1)", "the unknown function 'open'; expected start, end, max"),
        ("maxx (x)", "calls the unknown function 'maxx'; did you mean 'max'?"),
        ("max(x)[0]", "is not a valid expression; it may contain"),
    ],
)
def test_what_is_none_is_told(text, words):
    with pytest.raises(SettingError, match=words):
        Runner(plan(pulled(), {"x": (0.0, 1.0)}, measures=(text,)))
