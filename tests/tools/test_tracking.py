"""Tests of setups of RRA and CMC without OpenSim: tracking, results and errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.io.tables.storage import write_sto

SETUP = """<OpenSimDocument Version="40600">
    <{tool} name="it">
        <model_file>model.osim</model_file>
        <force_set_files>motor.xml</force_set_files>
        <results_directory>results</results_directory>
        <final_time>{final}</final_time>
        <desired_kinematics_file>motion.mot</desired_kinematics_file>
        <task_set_file>tasks.xml</task_set_file>
        {more}
    </{tool}>
</OpenSimDocument>
"""
TASKS = """<OpenSimDocument Version="40600">
    <CMC_TaskSet><objects>
        <CMC_Joint name="{name}">
            <weight>10</weight><active>{active}</active><kp>400</kp><kv>40</kv><coordinate>{name}</coordinate>
        </CMC_Joint>
    </objects></CMC_TaskSet>
</OpenSimDocument>
"""


def pendulum(strength: float = 100.0, **bounds: float) -> osimlite.Model:
    """Return a rod on a pin joint with a motor."""
    model = osimlite.Model(name="pendulum")
    rod = osimlite.Body(
        name="rod", mass=1.0, mass_center=(0.0, -0.5, 0.0), inertia=(0.1, 0.01, 0.1, 0.0, 0.0, 0.0)
    )
    model.add(rod)
    pin = osimlite.PinJoint(name="pin", socket_parent_frame=model.ground, socket_child_frame=rod)
    pin.coordinates[0].name = "angle"
    model.add(pin)
    model.add(
        osimlite.CoordinateActuator(
            name="motor", coordinate="angle", optimal_force=strength, **bounds
        )
    )
    return model


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Write a setup of RRA for a swinging pendulum, and return the folder."""
    return written(tmp_path)


def written(
    folder: Path,
    model: osimlite.Model | None = None,
    tool: str = "RRATool",
    more: str = "",
    name: str = "angle",
    active: str = "true false false",
    final: float = 0.2,
) -> Path:
    model = pendulum() if model is None else model
    # In RRA, only the forces in files of the setup act.
    motor = osimlite.to_text(
        osimlite.schema.forces.ForceSet(objects=[model.force_set.objects[0].copy_deep()])
    )
    (folder / "motor.xml").write_text(motor)
    model.force_set.objects.clear()
    osimlite.write(model, folder / "model.osim")
    times = np.linspace(0.0, 1.0, 101)
    rows = np.column_stack([0.2 * np.sin(4.0 * times)])
    write_sto(folder / "motion.mot", "motion", times, ("angle",), rows.tolist())
    (folder / "tasks.xml").write_text(TASKS.format(name=name, active=active))
    (folder / "setup.xml").write_text(SETUP.format(tool=tool, more=more, final=final))
    return folder


@pytest.mark.parametrize("tool", ["RRATool", "CMCTool"])
def test_a_pendulum_follows(folder: Path, tool: str) -> None:
    written(folder, tool=tool)
    outcome = osimlite.run(folder / "setup.xml")
    assert outcome.done
    states = outcome.tables["it_states.sto"]
    assert states.times[-1] == pytest.approx(0.199 if tool == "RRATool" else 0.19, abs=1e-9)
    wanted = 0.2 * np.sin(4.0 * states.times)
    assert states["/jointset/pin/angle/value"] == pytest.approx(wanted, abs=2e-4)
    # The motion results from the forces of the motor.
    force = outcome.tables["it_Actuation_force.sto"]["motor"]
    assert outcome.tables["it_controls.sto"]["motor"] * 100.0 == pytest.approx(force, rel=1e-12)
    read = osimlite.read_document(folder / "results" / "it_controls.xml")
    (control,) = read.objects
    assert (
        control.name == "motor.excitation"
        and control.default_max == 10_000.0
        and len(control.x_nodes) > 15
    )
    for name in ("Kinematics_q", "Kinematics_u", "Kinematics_dudt", "pErr"):
        assert (folder / "results" / f"it_{name}.sto").exists()


def test_who_is_too_weak_is_told(folder: Path) -> None:
    """RRA continues with the largest controls; CMC, which must reach the accelerations, ends."""
    bounds = {"min_control": -0.001, "max_control": 0.001}
    written(folder, pendulum(1.0, **bounds))
    outcome = osimlite.run(folder / "setup.xml")
    assert outcome.done and np.abs(outcome.tables["it_controls.sto"].rows).max() == pytest.approx(
        0.001
    )
    written(folder, pendulum(1.0, **bounds), "CMCTool")
    outcome = osimlite.run(folder / "setup.xml")
    told = dict(outcome.messages)
    assert (
        not outcome.done
        and "missing: " in told["ended early"]
        and "at angle" in told["ended early"]
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"name": "angel"}, "names the coordinate 'angel', which the model does not have"),
        ({"active": "false true true"}, "no task of .* is active"),
        ({"active": ""}, "has an empty 'active'"),
        ({"final": 0.0005}, "set a later final_time"),
        (
            {"more": "<adjust_com_to_reduce_residuals>true</adjust_com_to_reduce_residuals>"},
            "adjusted_com_body",
        ),
        (
            {"tool": "CMCTool", "more": "<actuators_to_exclude>motor</actuators_to_exclude>"},
            "actuators_to_exclude",
        ),
        ({"model": 0.0}, "optimal force"),
    ],
)
def test_what_cannot_be_run_is_refused(folder: Path, change: dict[str, object], words: str) -> None:
    if "model" in change:
        change = {"model": pendulum(0.0)}
    written(folder, **change)  # type: ignore[arg-type]
    with pytest.raises(OsimliteError, match=words):
        osimlite.run(folder / "setup.xml")
    assert not (folder / "results").exists()


def test_a_point_is_refused_by_name(folder: Path) -> None:
    text = (folder / "tasks.xml").read_text()
    (folder / "tasks.xml").write_text(
        text.replace("CMC_Joint", "CMC_Point").replace("<coordinate>angle</coordinate>", "")
    )
    with pytest.raises(OsimliteError, match="CMC_Point, which osimlite cannot track yet"):
        osimlite.run(folder / "setup.xml")


def test_bounds_of_a_file_count(folder: Path) -> None:
    nodes = "<ControlLinearNode><t>0</t><value>{}</value></ControlLinearNode>"
    (folder / "bounds.xml").write_text(
        f"""<OpenSimDocument Version="40600"><ControlSet><objects><ControlLinear name="motor.excitation">
        <min_nodes>{nodes.format(-0.0005)}</min_nodes><max_nodes>{nodes.format(0.0005)}</max_nodes>
        </ControlLinear></objects></ControlSet></OpenSimDocument>"""
    )
    written(folder, more="<constraints_file>bounds.xml</constraints_file>")
    outcome = osimlite.run(folder / "setup.xml")
    assert np.abs(outcome.tables["it_controls.sto"].rows).max() == pytest.approx(0.0005)


def test_a_property_that_opensim_ignores_stops_no_run(folder: Path) -> None:
    written(folder, more="<optimizer_derivative_dx>0.1</optimizer_derivative_dx>")
    outcome = osimlite.run(folder / "setup.xml")
    assert outcome.done and "OSIM101" in [found.code for found in outcome.warnings]


@pytest.mark.parametrize("tool", ["RRATool", "CMCTool"])
def test_a_coordinate_may_have_no_actuator(tmp_path: Path, tool: str) -> None:
    """Only coordinates with tasks are tracked; another rod swings freely below."""
    model = pendulum()
    rod = next(body for body in model.components(osimlite.Body) if body.name == "rod")
    other = osimlite.Body(
        name="other",
        mass=0.1,
        mass_center=(0.0, -0.1, 0.0),
        inertia=(0.01, 0.01, 0.01, 0.0, 0.0, 0.0),
    )
    model.add(other)
    pin = osimlite.PinJoint(name="low", socket_parent_frame=rod, socket_child_frame=other)
    pin.coordinates[0].name = "free"
    model.add(pin)
    written(tmp_path, model, tool)
    outcome = osimlite.run(tmp_path / "setup.xml")
    assert outcome.done, outcome.messages
    states = outcome.tables["it_states.sto"]
    wanted = 0.2 * np.sin(4.0 * states.times)
    assert states["/jointset/pin/angle/value"] == pytest.approx(wanted, abs=1e-3)
