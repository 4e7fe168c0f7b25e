"""Tests of the built-in jumper: it squats in balance, and jumps to the height that the documentation states."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.lint import validate
from osimlite.models.jumper import MUSCLES, jumper
from osimlite.simulation import Simulation

HEIGHT, AT = 1.2796091, 0.48
"""Largest height of the mass centre (m) and its time (s), which is rounded to 0.01 s."""


@pytest.fixture(scope="module")
def jump():
    """Yield the simulation of the jumper and a trajectory that ends after the landing."""
    with Simulation(jumper(), "compiled") as simulation:
        yield simulation, simulation.run(0.8, accuracy=1e-7)


def test_nothing_is_said_of_it():
    # OSIM636 reports slack muscles, and some are slack in the squat.
    assert validate(jumper(), ignore="OSIM636").findings == []


def test_it_squats_in_balance():
    with Simulation(jumper(driven=False), "compiled") as simulation:
        start, count = simulation.initial_state({}, {}), len(simulation.engine.order)
        rates = simulation.engine.compute_derivative(0.0, start)
        rest = simulation.engine.equilibrate_muscles(0.0, start)
    # Accelerations are not exactly zero: rounded fiber lengths leave forces that accelerate the
    # feet of 1 kg.
    assert np.abs(rates[count : 2 * count]).max() < 0.5
    assert start == pytest.approx(rest, abs=1e-6)


def test_its_excitations_are_those_of_both_legs():
    (controller,) = jumper().controller_set.objects
    assert sorted(controller.socket_actuators) == sorted(
        f"/forceset/{name}_{side}" for name in MUSCLES for side in "rl"
    )
    lines = {line.name: line for line in controller.ControlFunctions.objects}
    for name in MUSCLES:
        assert lines[f"{name}_r"].y == lines[f"{name}_l"].y
        assert all(0.01 <= value <= 1.0 for value in lines[f"{name}_r"].y)


def test_it_jumps(jump):
    simulation, motion = jump
    heights = [simulation.mechanism.center_of_mass(q)[1] for q in motion.values]
    assert max(heights) == pytest.approx(HEIGHT, abs=1e-6)
    assert motion.times[int(np.argmax(heights))] == pytest.approx(AT)


def test_it_flies_and_lands_on_its_feet(jump):
    simulation, motion = jump
    events = motion.summary["contact_events"]
    left = max(event["time_s"] for event in events if event["event"] == "end")
    back = [
        event["contact"] for event in events if event["event"] == "begin" and event["time_s"] > left
    ]
    assert sorted(back) == sorted(simulation.engine.contacts)
    assert min(event["time_s"] for event in events if event["time_s"] > left) - left > 0.4
    bent = dict(zip(motion.coordinates, motion.values[-1], strict=True))
    assert bent["pelvis_ty"] > 0.7 and abs(bent["pelvis_tilt"]) < 0.6
