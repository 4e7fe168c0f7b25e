"""Tests of the other built-in walkers and of their model files."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.io.document.printer import to_text
from osimlite.io.document.reader import read
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.models.source import make_model
from osimlite.models.walkers import FURTHEST_START, furthest_walker
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.geometry_types import Brick
from osimlite.simulation import Simulation


@pytest.mark.parametrize("name", ["furthest-walker", "human-walker", "steady-walker"])
def test_the_file_is_the_model(fixtures, name):
    assert to_text(read(fixtures / "walkers" / f"{name}.osim")) == to_text(make_model(name))


def test_the_furthest_walker_is_the_exercise_but_for_its_start():
    model, exercise = furthest_walker(), dynamic_walker()
    model.name = exercise.name
    for one, other in zip(
        model.components(Coordinate), exercise.components(Coordinate), strict=True
    ):
        if other.name in FURTHEST_START:
            other.default_value, other.default_speed_value = FURTHEST_START[other.name]
            other.range = one.range
    for one, other in zip(model.components(Brick), exercise.components(Brick), strict=True):
        one.half_lengths = other.half_lengths
    assert to_text(model) == to_text(exercise)


@pytest.mark.parametrize("accuracy", [1e-5, 1e-6, 1e-9])
def test_the_furthest_walker_makes_four_steps(accuracy):
    from osimlite.studies.gait.steps import measure_along_slope, walk_many

    with Simulation(furthest_walker(), "compiled") as simulation:
        engine = simulation.engine
        start = np.array(simulation.initial_state({}, {}))
        (walk,) = walk_many(engine, start[None], 5.0, accuracy=accuracy)
        _, depths = measure_along_slope(engine, start[None])
    assert [step.foot for step in walk.steps] == [1, 0, 1, 0] and walk.scuffs == []
    assert (walk.ending, walk.fell_on) == ("fell", "RKneeForce")
    assert walk.distance == pytest.approx(0.5136, abs=1e-3) and walk.end == pytest.approx(
        1.7175, abs=1e-3
    )
    standing = {
        engine.contacts[index]: depth for index, depth in enumerate(depths[0]) if depth > 0.0
    }
    assert standing == {"RFootForce": pytest.approx(8e-4, abs=1e-5)}
