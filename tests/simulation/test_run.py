"""Tests of simulations: initial states, settings, failures and result files."""

from __future__ import annotations

import json
import pickle
import signal
from importlib.util import find_spec

import numpy as np
import pytest

import osimlite
from osimlite import (
    Body,
    Coordinate,
    CoordinateLimitForce,
    HuntCrossleyForce,
    Model,
    PinJoint,
    WeldJoint,
)
from osimlite.errors import (
    DoubtfulWarning,
    ModelError,
    OsimliteError,
    SettingError,
    SimulationError,
    UnsupportedError,
)
from osimlite.models.arm import arm
from osimlite.schema.contact_forces import ExponentialContactForce
from osimlite.simulation import Interrupted, Simulation, read_sto
from osimlite.simulation.engines.batch import BatchWorkspace
from osimlite.simulation.options import compute_report_times
from tests.simple_models import make_single_body, make_slide


@pytest.fixture
def pendulum():
    joint = PinJoint(name="hinge", coordinates=[Coordinate(name="swing", default_value=0.4)])
    inertia = (0.1, 0.1, 0.1, 0.0, 0.0, 0.0)
    return make_single_body(
        joint, name="pendulum", body="bob", mass=2.0, inertia=inertia, child_at=(0.0, 1.0, 0.0)
    )


# ----------------------------------------------------------------------------------------- initial states
def test_defaults_and_what_is_set(walker):
    trajectory = osimlite.simulate(
        walker, to=0.01, initial={"RHip_rz": 0.1}, initial_speeds={"LKnee_rz": -2.0}
    )
    start = dict(zip(trajectory.coordinates, trajectory.values[0], strict=True))
    assert start["RHip_rz"] == 0.1 and start["Pelvis_ty"] == 0.835
    speeds = dict(zip(trajectory.coordinates, trajectory.speeds[0], strict=True))
    assert speeds.pop("LKnee_rz") == -2.0 and not any(speeds.values())


def test_what_is_set_may_carry_a_unit(walker):
    trajectory = osimlite.simulate(
        walker, to=0.01, initial={"RHip_rz": "40deg", "Pelvis_ty": "90 cm"}
    )
    start = dict(zip(trajectory.coordinates, trajectory.values[0], strict=True))
    assert start["RHip_rz"] == np.radians(40) and start["Pelvis_ty"] == 0.9
    assert trajectory.summary["settings"]["initial"] == {
        "RHip_rz": np.radians(40),
        "Pelvis_ty": 0.9,
    }
    for given, words in (
        ({"RHip_rz": "4 cm"}, "give '4 cm' in deg or rad"),
        ({"RHip_rz": "far"}, "such as 0.5 or 30deg"),
        ({"RHip_rz": None}, "such as 0.5 or 30deg, not 'None'"),
    ):
        with pytest.raises(SettingError, match=words):
            osimlite.simulate(walker, to=0.01, initial=given)


def test_degrees_taken_for_radians_are_warned_of(walker):
    for given, asked in ((40, "40deg"), ("-40", "-40deg")):
        with pytest.warns(
            DoubtfulWarning, match=rf"RHip_rz = {given} is in rad, .* did you mean {asked}\?"
        ) as told:
            osimlite.simulate(walker, to=0.01, initial={"RHip_rz": given})
        assert [each.filename for each in told] == [__file__]
    osimlite.simulate(
        walker,
        to=0.01,
        initial={"RHip_rz": "500deg", "Pelvis_tx": 9},
        initial_speeds={"RHip_rz": 40},
    )


def test_activations_that_no_muscle_has_are_warned_of():
    model = arm()
    path = "/forceset/flexor/activation"
    for value, words in ((3, "= 3"), ("-0.5", "= -0.5")):
        with pytest.warns(DoubtfulWarning, match=rf"are 0 to 1, .*'{path}' {words}$"):
            osimlite.simulate(model, to=0.001, initial={path: value})
    osimlite.simulate(model, to=0.001, initial={path: 1.0})
    with pytest.raises(SettingError, match=f"the state '{path}' takes a number, not 'high'"):
        osimlite.simulate(model, to=0.001, initial={path: "high"})


def test_locked_coordinate_keeps_its_value(walker):
    trajectory = osimlite.simulate(walker, to=0.2)
    place = trajectory.coordinates.index("platform_rz")
    assert (
        set(trajectory.values[:, place]) == {np.radians(-10)}
        and not trajectory.speeds[:, place].any()
    )


@pytest.mark.parametrize("what", ["initial", "initial_speeds"])
def test_locked_coordinate_cannot_be_set(walker, what):
    with pytest.raises(SimulationError, match="'platform_rz' is locked"):
        osimlite.simulate(walker, **{what: {"platform_rz": 0.0}})


def test_unknown_coordinate_names_the_nearest(walker):
    with pytest.raises(ModelError, match="did you mean 'RHip_rz'"):
        osimlite.simulate(walker, initial={"RHip_z": 0.0})


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ({"to": 0.0}, "must be positive"),
        ({"to": float("nan")}, "must be positive"),
        ({"report_interval": 0.0}, "must be positive"),
        ({"report_interval": 1e-9}, "ten million rows"),
        ({"accuracy": 0.0}, "between 0 and 1"),
        ({"fixed_step": -1e-3}, "positive and finite"),
        ({"fixed_step": 5.0}, "5 s is too long"),
        (
            {"fixed_step": 1e-3, "integrator": "merson"},
            "`integrator` cannot be combined with `fixed_step`",
        ),
        ({"fixed_step": 1e-3, "accuracy": 1e-3}, "`accuracy` cannot be combined with `fixed_step`"),
        (
            {"initial": {"swing": 0.1, "/jointset/hinge/swing": 0.2}},
            "set twice, by its name and by its path",
        ),
        ({"to": "2"}, "number of seconds, not '2'"),
        ({"initial": {"swing": float("inf")}}, "give a number"),
        ({"engine": "bulet"}, r"did you mean 'bullet'\?$"),
        ({"engine": "xyz"}, "expected bullet or compiled$"),
        ({"route": "quick"}, "no route"),
    ],
)
def test_settings_without_meaning(pendulum, setting, words):
    with pytest.raises(OsimliteError, match=words):
        osimlite.simulate(pendulum, **setting)


@pytest.mark.parametrize(
    ("to", "interval", "times"),
    [
        (0.3, 0.1, [0, 0.1, 0.2, 0.3]),
        (0.25, 0.1, [0, 0.1, 0.2, 0.25]),
        (0.05, 0.1, [0, 0.05]),
        (2.0, 2.0, [0, 2]),
    ],
)
def test_report_times(to, interval, times):
    assert compute_report_times(to, interval) == pytest.approx(times, abs=1e-15)
    assert compute_report_times(to, interval)[-1] == to


@pytest.mark.parametrize("engine", ["bullet", "compiled"])
@pytest.mark.parametrize("fixed_step", [None, 1e-3])
def test_progress_needs_no_recorded_row(pendulum, engine, fixed_step):
    seen = []
    choices = {} if fixed_step is None else {"fixed_step": fixed_step}
    # The steps of PyBullet are taken in Python and are slow, and each one reports progress.
    duration = 30.0 if engine == "compiled" or fixed_step is None else 1.0
    motion = osimlite.simulate(
        pendulum,
        duration,
        engine,
        report_interval=duration,
        progress=lambda *told: seen.append(told),
        **choices,
    )
    times, steps = zip(*seen, strict=True)
    assert len(motion.times) == 2 and len(times) > 2
    assert list(times) == sorted(set(times)) and times[-1] == duration
    assert min(steps) > 0.0 and (
        fixed_step is None or steps == pytest.approx([fixed_step] * len(steps))
    )


def interrupting(after: int):
    """Return a progress function that raises SIGINT when it is called for the `after`-th time."""
    left = [after]

    def progress(t: float, step: float) -> None:
        left[0] -= 1
        if left[0] == 0:
            signal.raise_signal(signal.SIGINT)

    return progress


@pytest.mark.parametrize("engine", ["bullet", "compiled"])
@pytest.mark.parametrize("choices", [{"accuracy": 1e-9}, {"fixed_step": 7e-3}])
@pytest.mark.parametrize("after", [1, 2, 5])
def test_what_was_recorded_before_ctrl_c_is_kept(pendulum, engine, choices, after):
    duration = 30.0 if engine == "compiled" or "accuracy" in choices else 3.0
    with Simulation(pendulum, engine) as simulation:
        whole = simulation.run(duration, **choices)
        with pytest.raises(KeyboardInterrupt) as stopped:
            simulation.run(duration, progress=interrupting(after), **choices)
        assert isinstance(stopped.value, Interrupted)
        part = stopped.value.trajectory
        end = part.times[-1]
        assert 0.0 < end < duration
        # The rows are the same up to the interruption, plus one row for its time.
        rows = int(np.searchsorted(whole.times, end))
        assert len(part.times) == rows + 1
        assert np.array_equal(part.values[:rows], whole.values[:rows])
        assert np.array_equal(part.speeds[:rows], whole.speeds[:rows])
        assert part.summary["interrupted"] is True and part.summary["time_reached_s"] == end
        assert (
            part.summary["settings"]["to"] == duration
            and 0 < part.summary["steps"] < whole.summary["steps"]
        )
        assert whole.summary["interrupted"] is False and whole.summary["time_reached_s"] == duration
        assert part.summary["energy_J"]["end"]["total"] == part.energy["total"][-1]


@pytest.mark.parametrize("engine", ["bullet", "compiled"])
@pytest.mark.parametrize("choices", [{"accuracy": 1e-6}, {"fixed_step": 7e-3}])
def test_what_was_recorded_before_a_failure_is_kept(pendulum, engine, choices):
    """The force is NaN beyond half a radian."""
    (angle,) = pendulum.components(Coordinate)
    pendulum.add(
        osimlite.ExpressionBasedCoordinateForce(coordinate=angle.name, expression="sqrt(0.5-q)")
    )
    with Simulation(pendulum, engine) as simulation:
        with pytest.raises(SimulationError) as failed:
            simulation.run(
                2.0, initial={angle.name: 0.0}, initial_speeds={angle.name: 3.0}, **choices
            )
        part = failed.value.trajectory
        assert 0.0 < part.times[-1] < 2.0 and len(part.times) == len(part.values) > 3
        assert 0.4 < part.values[-1, 0] < 0.52
        assert (
            part.summary["interrupted"] is True and part.summary["time_reached_s"] == part.times[-1]
        )
        with pytest.raises(SimulationError) as failed:
            simulation.run(2.0, initial={angle.name: 0.6}, **choices)
        assert failed.value.trajectory is None


def test_ctrl_c_before_the_first_step(pendulum, monkeypatch):
    """The signal arrives in machine code, and is handled when that ends."""
    with Simulation(pendulum, "compiled") as simulation:
        monkeypatch.setattr(
            BatchWorkspace, "run", lambda batch, room: signal.raise_signal(signal.SIGINT)
        )
        with pytest.raises(Interrupted) as stopped:
            simulation.run(1.0)
        part = stopped.value.trajectory
        assert (
            part.times.tolist() == [0.0]
            and np.isfinite(part.values).all()
            and part.summary["steps"] == 0
        )


def test_one_simulation_runs_many_times(pendulum):
    with Simulation(pendulum) as simulation:
        first = simulation.run(0.5)
        simulation.run(0.5, initial={"swing": -1.0})
        assert np.array_equal(simulation.run(0.5).values, first.values)


# ----------------------------------------------------------------------------- motions with known solutions
def test_energy_of_a_pendulum_is_kept(pendulum):
    energy = osimlite.simulate(pendulum, to=5.0, accuracy=1e-9).energy
    assert energy["total"] == pytest.approx(np.full(501, energy["total"][0]), abs=1e-6)
    assert not energy["stored"].any()


def test_free_fall():
    model = Model(name="stone")
    stone = model.add(Body(name="stone", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    joint = osimlite.FreeJoint(name="free")
    for name, coordinate in zip(("rx", "ry", "rz", "x", "y", "z"), joint.coordinates, strict=True):
        coordinate.name = name
    model.add(joint.between(model.ground, stone))
    for setting in ({}, {"fixed_step": 1e-4}):
        end = osimlite.simulate(
            model, to=1.0, initial_speeds={"x": 1.0, "y": 2.0, "rx": 0.5}, **setting
        )
        expected = (0.5, 0.0, 0.0, 1.0, 2.0 - 9.80665 / 2, 0.0)
        assert end.values[-1] == pytest.approx(expected, abs=1e-3 if setting else 1e-9)


def test_spinning_top_keeps_its_momentum():
    """A body with three different moments of inertia rotates freely; speeds are not rates of angles."""
    model = Model(name="top", gravity=(0.0, 0.0, 0.0))
    top = model.add(Body(name="top", mass=1.0, inertia=(1.0, 2.0, 2.5, 0.0, 0.0, 0.0)))
    joint = osimlite.BallJoint(name="ball")
    for index, coordinate in enumerate(joint.coordinates):
        coordinate.name = f"q{index}"
    model.add(joint.between(model.ground, top))
    trajectory = osimlite.simulate(
        model, to=1.0, accuracy=1e-9, initial_speeds={"q0": 1.0, "q1": 0.1, "q2": 0.2}
    )
    momenta = [
        trajectory.mechanism.momentum(q, u)[1]
        for q, u in zip(trajectory.values, trajectory.speeds, strict=True)
    ]
    assert np.array(momenta) == pytest.approx(np.tile(momenta[0], (101, 1)), abs=1e-7)
    assert np.ptp(trajectory.speeds[:, 1]) > 0.1


# ------------------------------------------------------------------------------------------------ failures
def test_unsupported_force_is_named(walker, fixtures):
    model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    model.add(
        ExponentialContactForce(
            name="sole", station=osimlite.Station(socket_parent_frame="/ground")
        )
    )
    with pytest.raises(UnsupportedError, match=r"'/forceset/sole' \(ExponentialContactForce\)"):
        osimlite.simulate(model)
    without = osimlite.simulate(model, to=0.1, skip_unsupported=True)
    assert without.summary["skipped_forces"] == ["'/forceset/sole' (ExponentialContactForce)"]
    assert np.array_equal(without.values, osimlite.simulate(walker, to=0.1).values)
    model.find("/forceset/sole").appliesForce = False
    assert osimlite.simulate(model, to=0.1).summary["skipped_forces"] == []


def test_force_that_is_switched_off_does_nothing(fixtures):
    model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    for force in model.components(HuntCrossleyForce):
        force.appliesForce = False
    trajectory = osimlite.simulate(model, to=0.1)
    assert not any(label.startswith("RFoot") for label in trajectory.forces)
    assert trajectory.summary["contact_events"] == []


def test_contact_on_a_mesh_is_refused(fixtures):
    model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    mesh = model.add(osimlite.ContactMesh(name="foot", socket_frame="/bodyset/RightShank"))
    parameters = HuntCrossleyForce.ContactParameters(
        geometry=(mesh, "PlatformContact"), stiffness=1.0
    )
    force = HuntCrossleyForce(name="meshy")
    force.contact_parameters.objects.append(parameters)
    model.add(force)
    with pytest.raises(UnsupportedError, match=r"meshy.*ContactMesh '/contactgeometryset/foot'"):
        osimlite.simulate(model)


def test_missing_contact_geometry_is_named(fixtures):
    model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    force = next(iter(model.components(HuntCrossleyForce)))
    force.contact_parameters.objects[0].geometry = ("RHipContct", "PlatformContact")
    with pytest.raises(ModelError, match="RHipContct"):
        osimlite.simulate(model)


def test_a_parameter_that_is_no_number(fixtures):
    model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    next(iter(model.components(CoordinateLimitForce))).damping = float("nan")
    with pytest.raises(ModelError, match=r"'/forceset/RHipLimitTorque' has a parameter"):
        osimlite.simulate(model)


@pytest.mark.parametrize(
    ("field", "what"), [("default_value", "value"), ("default_speed_value", "speed")]
)
def test_a_start_that_is_no_number(pendulum, field, what):
    coordinate = next(
        item for item in pendulum.components(osimlite.Coordinate) if item.name == "swing"
    )
    setattr(coordinate, field, float("nan"))
    with pytest.raises(
        SimulationError,
        match=f"default {what} of coordinate '/jointset/.*/swing' is nan; give a number",
    ):
        osimlite.simulate(pendulum)


def test_constraint_is_refused(pendulum):
    pendulum.add(osimlite.CoordinateCouplerConstraint(name="coupler"))
    with pytest.raises(OsimliteError, match="coupler"):
        osimlite.simulate(pendulum)


def test_first_steps_are_as_short_as_it_takes(pendulum):
    """A stiff limit throws the pendulum away, in as many steps as in OpenSim."""
    pendulum.add(
        CoordinateLimitForce(
            name="steel",
            coordinate="swing",
            upper_limit=0.0,
            lower_limit=-180.0,
            upper_stiffness=1e100,
            transition=1e-9,
        )
    )
    assert osimlite.simulate(pendulum, to=0.1).speeds[-1, 0] < -1e40


@pytest.mark.parametrize("engine", ["bullet", "compiled"])
def test_a_step_that_is_too_long(walker, engine):
    with pytest.raises(SimulationError, match="shorter fixed step"):
        osimlite.simulate(walker, engine=engine, fixed_step=0.1)


def test_a_window_needs_a_screen(pendulum, monkeypatch):
    pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(SimulationError, match="no screen"):
        osimlite.simulate(pendulum, show=True, fixed_step=1e-3)


# ---------------------------------------------------------------------------------------------------- files
def test_files(walker, tmp_path):
    trajectory = osimlite.simulate(walker, to=0.05)
    written = trajectory.write(tmp_path / "results")
    assert sorted(path.name for path in written) == ["forces.sto", "states.sto", "summary.json"]
    states = read_sto(tmp_path / "results" / "states.sto")
    assert states.columns[:4] == (
        "/jointset/PlatformToGround/platform_rz/value",
        "/jointset/PlatformToGround/platform_rz/speed",
        "/jointset/PelvisToPlatform/Pelvis_rz/value",
        "/jointset/PelvisToPlatform/Pelvis_rz/speed",
    )
    assert np.array_equal(states.times, trajectory.times)
    assert np.array_equal(states.rows[:, 0::2], trajectory.values)
    assert np.array_equal(states.rows[:, 1::2], trajectory.speeds)
    forces = read_sto(tmp_path / "results" / "forces.sto")
    assert forces.columns[-2:] == ("LKneeLimitTorque", "PotentialEnergy")
    assert len(forces.columns) == len(trajectory.forces) == 80
    column = "RFootForce.RightShank.force.Y"
    assert np.array_equal(forces[column], trajectory.forces[column]) and forces[column][0] > 300.0
    summary = json.loads((tmp_path / "results" / "summary.json").read_text())
    assert summary == trajectory.summary
    assert (
        summary["settings"]["accuracy"] == 1e-3
        and summary["versions"]["osimlite"] == osimlite.__version__
    )


def test_an_actuator_with_the_name_of_its_coordinate_has_a_column():
    model = make_slide(osimlite.CoordinateActuator(name="x", coordinate="x", optimal_force=3.0))
    columns = osimlite.simulate(model, to=0.02, controls={"x": 0.5}).columns
    assert columns["x"][0] == 0.0 and columns["x"][-1] > 0.0
    np.testing.assert_array_equal(columns["x/force"], 1.5)


def test_states_alone(walker, tmp_path):
    trajectory = osimlite.simulate(walker, to=0.02)
    trajectory.to_sto(tmp_path / "s.sto")
    assert (tmp_path / "s.sto").read_text() == trajectory.states_text()
    with pytest.raises(OsimliteError):
        trajectory.to_sto(tmp_path / "missing" / "s.sto")


def test_trajectory_goes_to_another_process(walker):
    trajectory = osimlite.simulate(walker, to=0.05)
    again = pickle.loads(pickle.dumps(trajectory))
    assert again.summary == trajectory.summary and again.forces.keys() == trajectory.forces.keys()
    assert np.array_equal(again.values, trajectory.values)
    assert "6 times" in repr(again)


def test_what_becomes_of_the_model_changes_no_run_and_no_trajectory(walker):
    walker = walker.copy_deep()
    with Simulation(walker, "compiled") as simulation:
        before = simulation.run(0.02)
        text = osimlite.to_text(walker)
        walker.find("/bodyset/Pelvis").mass = 1000.0
        after = simulation.run(0.02)
    assert np.array_equal(before.values, after.values)
    assert osimlite.to_text(before.model) == osimlite.to_text(after.model) == text


def test_frame_says_what_to_install(walker):
    trajectory = osimlite.simulate(walker, to=0.02)
    if find_spec("pandas") is None:
        with pytest.raises(OsimliteError, match="pandas"):
            trajectory.to_frame()
    else:
        frame = trajectory.to_frame()
        assert frame["RHip_rz"].iloc[0] == trajectory.values[0, 4]
        assert frame["RFootForce.RightShank.force.Y"].iloc[0] > 300.0


def test_arrow_and_xarray_hold_what_the_trajectory_does(walker):
    for package in ("pyarrow", "xarray"):
        pytest.importorskip(package, reason=f"needs {package} (extra 'frame')")
    trajectory = osimlite.simulate(walker, to=0.02)
    table, data = trajectory.to_arrow(), trajectory.to_xarray()
    assert table.column_names == ["time", *trajectory.columns]
    assert np.array_equal(table["RHip_rz"].to_numpy(), trajectory.values[:, 4])
    assert np.array_equal(data.speed.sel(coordinate="RHip_rz"), trajectory.speeds[:, 4])
    label = "RFootForce.RightShank.force.Y"
    assert np.array_equal(data.force.sel(force_name=label), trajectory.forces[label])
    assert np.array_equal(data.energy.sel(energy_name="total"), trajectory.energy["total"])
    # The walker has no muscles and no probes.
    assert {*data.data_vars} == {"value", "speed", "force", "energy"}


def test_a_model_without_coordinates_stands_still():
    model = Model(name="block")
    model.add(WeldJoint(name="w").between(model.ground, model.add(Body(name="b", mass=1.0))))
    trajectory = osimlite.simulate(model, 0.1)
    assert trajectory.values.shape == (11, 0)
    assert "time" in trajectory.states_text()
