"""Tests of analyses that report states, actuators, probes and muscles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("scipy", reason="needs scipy (extra 'sim')")

import numpy as np

import osimlite
from osimlite.models.jumper import jumper
from osimlite.schema.actuators import BodyActuator, CoordinateActuator
from osimlite.schema.millard_muscles import RigidTendonMuscle
from osimlite.schema.muscles import Muscle
from osimlite.schema.old_muscles import Delp1990Muscle_Deprecated
from osimlite.schema.probe_types import ActuatorPowerProbe
from osimlite.tools.job import NotRunnable
from tests.tools.support import tables


def test_powers_are_forces_times_speeds(tmp_path: Path) -> None:
    model = jumper()
    turn = next(
        info for info in osimlite.mechanism(model).coordinates if info.motion_type == "rotational"
    )
    model.add(
        CoordinateActuator(name="motor", coordinate=turn.name),
        CoordinateActuator(name="off", coordinate=turn.name, appliesForce=False),
        ActuatorPowerProbe(name="all", actuator_names=("all",), sum_powers_together=True),
    )
    made = tables(
        tmp_path, model, '<Actuation name="A"/><ProbeReporter name="P"/><StatesReporter name="S"/>'
    )
    force, speed, power = (made[f"it_A_{what}.sto"] for what in ("force", "speed", "power"))
    muscles = [muscle.name for muscle in model.components(Muscle)]
    assert force.columns == speed.columns == power.columns == (*muscles, "motor")
    sense = np.array([-1.0] * len(muscles) + [1.0])
    assert np.abs(force.rows).max() > 1.0 and np.abs(speed.rows).max() > 0.01
    assert power.rows == pytest.approx(sense * force.rows * speed.rows, rel=1e-14)
    assert made["it_P_probes.sto"]["all_Summed"] == pytest.approx(power.rows.sum(axis=1), rel=1e-12)
    states = made["it_S_states.sto"]
    assert states[f"{turn.path}/value"] == pytest.approx(
        turn.default_value + 0.1 * np.sin(states.times), abs=1e-9
    )
    assert {path.rpartition("/")[2] for path in states.columns} >= {
        "value",
        "speed",
        "activation",
        "fiber_length",
    }


def test_muscles_of_several_classes_stand_in_their_order(tmp_path: Path) -> None:
    model = jumper()
    forces = model.force_set.objects
    place = next(place for place, force in enumerate(forces) if isinstance(force, Muscle))
    numbers = {
        name: getattr(forces[place], name)
        for name in ("name", "max_isometric_force", "optimal_fiber_length")
    }
    rigid = RigidTendonMuscle(**numbers, tendon_slack_length=forces[place].tendon_slack_length)
    rigid.geometry_path = forces[place].geometry_path.copy_deep()
    forces[place] = rigid
    coordinate = osimlite.mechanism(model).coordinates[-1].name
    asked = f"<moment_arm_coordinate_list>{coordinate}</moment_arm_coordinate_list>"
    no = '<MuscleAnalysis name="No"><compute_moments>false</compute_moments></MuscleAnalysis>'
    made = tables(
        tmp_path,
        model,
        f'<MuscleAnalysis name="M">{asked}</MuscleAnalysis>{no}<ForceReporter name="F"/>',
    )
    names = tuple(muscle.name for muscle in model.components(Muscle))
    assert {table.columns for name, table in made.items() if "_F_" not in name} == {names}
    assert (made["it_M_TendonLength.sto"][rigid.name] == rigid.tendon_slack_length).all()
    assert np.isfinite(made["it_M_PennationAngularVelocity.sto"].rows).all(axis=0).tolist() == [
        name != rigid.name for name in names
    ]
    tension = made["it_M_TendonForce.sto"]
    assert all((tension[name] == made["it_F_forces.sto"][name]).all() for name in names)
    moments = made[f"it_M_MomentArm_{coordinate}.sto"].rows * tension.rows
    assert (
        made[f"it_M_Moment_{coordinate}.sto"].rows.tolist() == moments.tolist()
        and np.abs(moments).max() > 1.0
    )
    assert {name for name in made if "Moment" in name} == {
        f"it_M_{x}_{coordinate}.sto" for x in ("Moment", "MomentArm")
    }


@pytest.mark.parametrize(
    ("cls", "more"),
    [
        # For this muscle, OpenSim writes no numbers in most of the tables.
        (Delp1990Muscle_Deprecated, {}),
        (RigidTendonMuscle, {"appliesForce": False}),
    ],
)
def test_muscles_that_cannot_be_analysed_are_refused(
    tmp_path: Path, cls: Any, more: dict[str, Any]
) -> None:
    model = jumper()
    old = next(force for force in model.force_set.objects if isinstance(force, Muscle))
    new = cls(name="new", geometry_path=old.geometry_path.copy_deep(), **more)
    model.add(new)
    told = "whose appliesForce is false" if more else "which osimlite cannot analyse yet"
    with pytest.raises(NotRunnable, match=f"'M' requests 'new', a {cls.__name__}, {told}"):
        tables(tmp_path, model, '<MuscleAnalysis name="M"/>')


def test_an_actuator_with_several_forces_is_refused(tmp_path: Path) -> None:
    model = jumper()
    model.add(BodyActuator(name="push", socket_body=model.body_set.objects[0]))
    with pytest.raises(
        NotRunnable,
        match="'A' needs actuators with one force each, but 'push', a BodyActuator, has several",
    ):
        tables(tmp_path, model, '<Actuation name="A"/>')
