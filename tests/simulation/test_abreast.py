"""Tests of muscles whose curves are evaluated in batches: bits equal those of single evaluations."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.errors import SimulationError
from osimlite.mechanics.kernels.layout import MODEL, RUN
from osimlite.models.jumper import jumper
from osimlite.schema.millard_muscles import Millard2012EquilibriumMuscle
from osimlite.simulation.run import Simulation


def changed(model):
    """Give neighbouring muscles of a model different options, some of them damping, and return the model."""
    for number, muscle in enumerate(model.components(Millard2012EquilibriumMuscle)):
        muscle.fiber_damping = (0.1, 0.0, 0.05, 0.1, 0.0)[number % 5]
        muscle.ignore_tendon_compliance = number % 5 in (3, 4)
        muscle.ignore_activation_dynamics = number % 7 == 2
        muscle.tendon_force_length_curve.strain_at_one_norm_force = 0.03 + 0.002 * number
    return model


def alone(engine):
    """Make an engine compute every item individually, and return it."""
    ints = engine.program.ints
    runs = range(ints[MODEL.RUN_AT], ints[MODEL.RUN_AT] + RUN.SIZE * ints[MODEL.RUNS], RUN.SIZE)
    assert any(ints[run + RUN.LAW] for run in runs)
    for run in runs:
        ints[run + RUN.LAW] = 0
    return engine


@pytest.mark.parametrize(
    "change", [lambda model: model, changed], ids=["as they are", "of all sorts"]
)
def test_muscles_abreast_are_those_by_themselves(change) -> None:
    together = Simulation(change(jumper(driven=False)), "compiled").engine
    single = alone(Simulation(change(jumper(driven=False)), "compiled").engine)
    start = np.array(together.equilibrate_muscles(0.0, together.state.pack_defaults()))
    rng, size = np.random.default_rng(0), len(together.order)
    found = 0
    for _ in range(200):
        y = start + np.concatenate(
            [
                0.4 * rng.normal(size=size),
                3.0 * rng.normal(size=size),
                np.zeros(len(start) - 2 * size),
            ]
        )
        y[2 * size :] *= rng.uniform(0.5, 1.6, len(start) - 2 * size)
        try:
            expected = single.compute_derivative(0.0, y.tolist())
        except SimulationError as error:
            with pytest.raises(type(error)):
                together.compute_derivative(0.0, y.tolist())
            continue
        found += 1
        assert np.array_equal(expected, together.compute_derivative(0.0, y.tolist()))
        assert together.force_records(0.0, y.tolist()) == single.force_records(0.0, y.tolist())
    assert found > 100


def test_a_muscle_without_a_solution_is_told_by_its_name() -> None:
    engines = [Simulation(jumper(driven=False), "compiled").engine for _ in range(2)]
    alone(engines[1])
    y = engines[0].equilibrate_muscles(0.0, engines[0].state.pack_defaults())
    place = 2 * len(engines[0].order) + engines[0].state.paths.index(
        "/forceset/vasti_l/fiber_length"
    )
    y[place] = float("nan")
    told = []
    for engine in engines:
        with pytest.raises(SimulationError) as error:
            engine.compute_derivative(0.0, y)
        told.append(str(error.value))
    assert told[0] == told[1]
