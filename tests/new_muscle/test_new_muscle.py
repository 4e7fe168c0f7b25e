"""Tests of a new muscle class: reader, linter, states, outputs, motion, columns and MJCF follow from one declaration."""

from __future__ import annotations

import math
from importlib import import_module

import pytest

import osimlite
from osimlite.schema import registry
from osimlite.schema.states import find_variables, list_outputs, list_states
from osimlite.simulation.elements.registry import FORCE_TYPES

TEXT = """<?xml version="1.0" encoding="UTF-8"?>
<OpenSimDocument Version="40600"><Model name="lift"><gravity>0 0 0</gravity>
<BodySet name="bodyset"><objects>
<Body name="load"><mass>2</mass><inertia>1 1 1 0 0 0</inertia></Body></objects></BodySet>
<JointSet name="jointset"><objects><SliderJoint name="rail">
<socket_parent_frame>/ground</socket_parent_frame><socket_child_frame>/bodyset/load</socket_child_frame>
<coordinates><Coordinate name="x"><default_value>0.32</default_value><range>0.24 0.36</range></Coordinate></coordinates>
</SliderJoint></objects></JointSet>
<ForceSet name="forceset"><objects><StraightMuscle name="biceps">
<GeometryPath name="path"><PathPointSet name="pathpointset"><objects>
<PathPoint name="a"><socket_parent_frame>/ground</socket_parent_frame><location>0 0 0</location></PathPoint>
<PathPoint name="b"><socket_parent_frame>/bodyset/load</socket_parent_frame><location>0 0 0</location></PathPoint>
</objects></PathPointSet></GeometryPath>
<max_isometric_force>100</max_isometric_force><optimal_fiber_length>0.1</optimal_fiber_length>
<tendon_slack_length>0.2</tendon_slack_length><default_activation>0.4</default_activation><grip>1.2</grip>
</StraightMuscle></objects></ForceSet></Model></OpenSimDocument>
"""


def forget_classes():
    for forget in registry.callbacks_of_changes:
        forget()


@pytest.fixture
def straight_muscle(monkeypatch):
    """Yield the class while it is registered in the tables of classes and of force types."""
    name = "tests.new_muscle.straight_muscle"
    with monkeypatch.context() as patched:
        patched.setitem(FORCE_TYPES.modules, "StraightMuscle", name)
        patched.setitem(registry.MODULES, "StraightMuscle", name)
        forget_classes()
        yield import_module(name).StraightMuscle
    forget_classes()


@pytest.fixture
def file(straight_muscle, tmp_path):
    path = tmp_path / "lift.osim"
    path.write_text(TEXT)
    return path


def findings(path, old, new):
    path.write_text(TEXT.replace(old, new))
    return [(result.code, result.message) for result in osimlite.validate(path).findings]


def test_it_is_read_and_written(file, straight_muscle):
    model = osimlite.read(file)
    muscle = model["/forceset/biceps"]
    assert (
        type(muscle) is straight_muscle
        and muscle.grip == 1.2
        and muscle.geometry_path.name == "path"
    )
    assert osimlite.to_text(model).count("<grip>1.2</grip>") == 1


def test_states_and_outputs_have_their_names(file, straight_muscle):
    model = osimlite.read(file)
    assert list_states(model["/forceset/biceps"]) == ["activation"]
    assert "/forceset/biceps/activation" in find_variables(model.tree(), "state variable")
    assert "spare_force" in list_outputs(straight_muscle) and "fiber_force" in list_outputs(
        straight_muscle
    )


def test_the_linter_knows_its_domains(file):
    assert findings(file, "", "") == []
    for new, code, words in (
        ("<width>-1</width>", "OSIM206", "more than 0: OpenSim rejects the model"),
        ("<rise_time>0</rise_time>", "OSIM206", "accelerations become NaN"),
        ("<rise_time>-1</rise_time>", "OSIM207", "expected more than 0"),
        (
            "<pennation_angle_at_optimal>0.1</pennation_angle_at_optimal>",
            "OSIM207",
            "expected 0 to 0",
        ),
        ("<width>0.1</width>", "OSIM209", "its grip is above 1 + width; OpenSim rejects the model"),
    ):
        every = findings(file, "<grip>1.2</grip>", f"<grip>1.2</grip>{new}")
        # OSIM531 also reports a time constant that is not positive, because osimlite cannot
        # simulate with it.
        [(result, message)] = [finding for finding in every if finding[0] != "OSIM531"]
        assert (len(every) == 2) == ("rise_time>-1<" in new)
        assert (result, words in message) == (code, True), message
    [(code, message)] = findings(file, "<grip>1.2</grip>", "<grip>0.5</grip>")
    assert code == "OSIM207" and "lengthening fibers bear less than at rest" in message


@pytest.mark.parametrize("engine", ["compiled"])
def test_it_moves_and_is_recorded(file, engine):
    trajectory = osimlite.simulate(
        osimlite.read(file), to=0.05, engine=engine, accuracy=1e-9, controls={"biceps": 1.0}
    )
    activation = trajectory.auxiliary["/forceset/biceps/activation"]
    assert activation[0] == 0.4
    assert activation[-1] == pytest.approx(1.0 - 0.6 * math.exp(-0.05 / 0.02), rel=1e-7)
    # Initial force: strength times activation times 1 - 0.2 / 0.5, for a strain of 0.2. It pulls
    # the load towards ground.
    force = 100.0 * 0.4 * (1.0 - 0.2 / 0.5)
    assert trajectory.forces["biceps"][0] == pytest.approx(force, rel=1e-12)
    assert trajectory.values[-1][0] < 0.32
    assert trajectory.to_frame().filter(like="activation").shape[1] == 1


def test_the_muscle_plot_tells_its_forces(file):
    from osimlite.simulation.muscle_curves import muscle_curves

    curves = muscle_curves(osimlite.read(file), {"x": (0.25, 0.3)}, activation=1.0)
    assert curves.columns["active_fiber_force"][:, 0] == pytest.approx([0.0, 100.0])


def test_mujoco_has_it(file):
    pytest.importorskip("mujoco")
    import mujoco

    mjcf = osimlite.to_mjcf(osimlite.read(file))
    compiled = mujoco.MjModel.from_xml_string(mjcf.text)
    actuator = compiled.actuator("biceps")
    # The curves of MuJoCo are fitted by least squares; strength, vmax and fvmax are those of the
    # model.
    assert (actuator.gainprm[2], actuator.gainprm[6], actuator.gainprm[8]) == pytest.approx(
        (100.0, 10.0, 1.2)
    )
    assert actuator.dynprm[:2].tolist() == [0.02, 0.02]
    assert mjcf.fidelity.translated["/forceset/biceps"] == "actuator biceps"


def test_without_its_declaration_nobody_knows_it(tmp_path):
    path = tmp_path / "lift.osim"
    path.write_text(TEXT)
    assert any("StraightMuscle" in result.message for result in osimlite.validate(path).findings)
    assert type(osimlite.read(path).force_set.objects[0]).__name__ == "Unknown"
