"""Tests of the walker's motion against OpenSim's converged one."""

from __future__ import annotations

import csv
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from osimlite.simulation import Simulation


def largest_error(trajectory, reference):
    table = reference("trajectory")
    assert trajectory.times == pytest.approx(table["time"], abs=1e-12)
    return max(
        np.abs(trajectory.values[:, index] - table[name]).max()
        for index, name in enumerate(trajectory.coordinates)
    )


@pytest.mark.parametrize(("accuracy", "tolerance"), [(1e-3, 5e-3), (1e-6, 5e-6)])
def test_motion_at_the_accuracy_asked_for(simulation, reference, accuracy, tolerance):
    trajectory = simulation.run(2.0, accuracy=accuracy, report_interval=1e-3)
    assert largest_error(trajectory, reference) < tolerance


def test_motion_at_high_accuracy(precise, reference):
    assert largest_error(precise, reference) < 5e-8


def test_articulated_body_route_moves_alike(walker, reference):
    pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
    with Simulation(walker, "bullet", route="articulated-body") as simulation:
        trajectory = simulation.run(2.0, accuracy=1e-6, report_interval=1e-3)
    assert trajectory.summary["route"] == "articulated-body"
    assert largest_error(trajectory, reference) < 5e-6


def test_fixed_steps_converge_at_first_order(simulation, reference):
    errors = [
        largest_error(simulation.run(2.0, fixed_step=h, report_interval=1e-3), reference)
        for h in (1e-3, 5e-4, 2.5e-4)
    ]
    assert errors[0] < 2e-2
    for whole, half in pairwise(errors):
        assert half / whole == pytest.approx(0.5, abs=0.02)


def test_contact_forces(precise, reference):
    """Every component differs by at most 1e-5 of the largest force (or torque) of its contact."""
    table, checked = reference("contact_forces"), 0
    for label, expected in table.items():
        if label == "time":
            continue
        element, kind, axis = label.split(".")
        (ours,) = (
            column[::10]
            for name, column in precise.forces.items()
            if name.startswith(f"{element}.")
            and name.endswith(f"{kind}.{axis}")
            and ".Platform." not in name
        )
        size = max(np.abs(table[f"{element}.{kind}.{other}"]).max() for other in "XYZ")
        assert np.abs(ours - expected).max() <= 1e-5 * size
        checked += size > 0.0
    # Four contacts have three components of force and of torque each.
    assert checked == 4 * 6


def test_platform_gets_the_opposite_forces(precise):
    for axis in "XYZ":
        ours = precise.forces[f"RFootForce.RightShank.force.{axis}"]
        assert np.array_equal(precise.forces[f"RFootForce.Platform.force.{axis}"], -ours)


def test_limit_forces(precise, reference):
    table = reference("limit_forces")
    for label, expected in table.items():
        if label == "time":
            continue
        element, what = label.split(".")
        ours = precise.forces[element if what == "torque_Nm" else f"{element}.PotentialEnergy"][
            ::10
        ]
        assert ours == pytest.approx(expected, abs=1e-5 * max(1.0, np.abs(expected).max()))


def test_energy(precise, reference):
    table = reference("energy")
    assert precise.energy["kinetic"][::10] == pytest.approx(table["kinetic_J"], abs=1e-5)
    potential = precise.energy["gravity"] + precise.energy["stored"]
    assert potential[::10] == pytest.approx(table["potential_J"], abs=1e-6)
    assert precise.energy["total"][::10] == pytest.approx(table["total_J"], abs=1e-5)
    ends = precise.summary["energy_J"]
    assert ends["start"]["total"] == pytest.approx(28.671843473550357, rel=1e-12)
    assert ends["end"]["total"] == pytest.approx(table["total_J"][-1], abs=1e-6)


def test_contact_events(precise, fixtures: Path):
    text = (fixtures / "walker" / "contact_events_reference.csv").read_text()
    rows = [row for row in csv.reader(line for line in text.splitlines() if line[0] != "#")][1:]
    expected = sorted(
        (float(before), float(after), f"{sphere}Force", event == "start")
        for sphere, event, before, after in rows
        if event in ("start", "end")
    )
    first, *events = precise.summary["contact_events"]
    assert (first["time_s"], first["contact"], first["event"]) == (0.0, "RFootForce", "begin")
    assert len(events) == len(expected) > 6
    for event, (before, after, contact, begins) in zip(events, expected, strict=True):
        assert before - 1e-6 <= event["time_s"] <= after + 1e-6
        assert (event["contact"], event["event"] == "begin") == (contact, begins)


def test_events_do_not_depend_on_accuracy_more_than_the_motion_does(precise, simulation):
    coarse = simulation.run(2.0, accuracy=1e-6).summary["contact_events"]
    fine = precise.summary["contact_events"]
    assert [event["contact"] for event in coarse] == [event["contact"] for event in fine]
    assert [event["time_s"] for event in coarse] == pytest.approx(
        [event["time_s"] for event in fine], abs=2e-5
    )


def test_largest_forces(precise):
    result = {
        name: entry["force_N"] for name, entry in precise.summary["largest_contact_forces"].items()
    }
    # The largest forces of OpenSim at full milliseconds; between these they may be larger.
    sampled = {
        "RFootForce": 333.916,
        "LFootForce": 180.838,
        "LKneeForce": 508.834,
        "RKneeForce": 443.186,
    }
    assert result.keys() == sampled.keys()
    for name, size in sampled.items():
        assert size - 0.1 < result[name] < size + 4.0
    assert result["RFootForce"] == pytest.approx(333.916, abs=1e-3)
