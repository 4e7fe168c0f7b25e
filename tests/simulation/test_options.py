"""Tests of the options of simulations, which are the same for single calls and for a `Simulation`."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, fields

import pytest

import osimlite
from osimlite.errors import DoubtfulWarning, SettingError
from osimlite.simulation import Options, Simulation
from osimlite.simulation.batches import BatchOptions
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.options import INTEGRATION_OPTIONS, RUN_OPTIONS, IntegrationOptions
from osimlite.studies.gym.tasks import Task
from osimlite.studies.sweep.plan import Plan
from tests.simulation.damped import damped


def test_what_does_not_exist_is_named():
    for ask in (osimlite.simulate, Simulation):
        with pytest.raises(SettingError, match=r"no option 'acuracy' .*did you mean 'accuracy'"):
            ask(damped(), engine="compiled", acuracy=1e-3)
    with Simulation(damped(), "compiled") as simulation:
        with pytest.raises(SettingError, match="there is no option 'to_time'"):
            simulation.run(0.1, to_time=3)
        with pytest.raises(
            SettingError, match=r"'rolling' belongs to the prepared model; .*rolling="
        ):
            simulation.run(0.1, rolling=True)


def test_what_was_chosen_first_holds_for_every_run():
    with Simulation(damped(), "compiled", accuracy=1e-5, initial={"q1": 0.2}) as simulation:
        one, two = simulation.run(0.05), simulation.run(0.05, accuracy=1e-7, initial=None)
    assert one.summary["settings"]["accuracy"] == 1e-5 and one.values[0, 1] == 0.2
    assert two.summary["settings"]["accuracy"] == 1e-7 and two.values[0, 1] == 0.3
    assert simulation.options.accuracy == 1e-5


def test_every_option_is_described():
    names = [item.name for item in fields(Options)]
    assert set(RUN_OPTIONS) < set(names)
    assert all(f"        {name}: " in (Options.__doc__ or "") for name in names)
    with pytest.raises(FrozenInstanceError):
        Options().accuracy = 1.0


@pytest.mark.parametrize("integrator", ["merson", "rosenbrock"])
def test_an_accuracy_that_promises_nothing_is_told(integrator):
    simulation = Simulation(damped(), "compiled")
    with pytest.warns(
        DoubtfulWarning, match=r"an accuracy of 0\.1 is so loose .* use 0\.01 or less"
    ):
        simulation.run(0.1, accuracy=0.1, integrator=integrator)
    simulation.run(0.1, accuracy=0.01, integrator=integrator)


def test_options_of_integration_are_declared_once_and_handed_on():
    chosen = {"accuracy": 1e-4, "integrator": "adams", "step_bounds": (1e-6, 0.1)}
    assert list(INTEGRATION_OPTIONS) == list(chosen)
    for record in (Options, EngineSettings, BatchOptions):
        assert record(**chosen).integration_choices() == chosen
    for record in (Options, EngineSettings, BatchOptions, Plan, Task):
        assert {*INTEGRATION_OPTIONS} < {item.name for item in fields(record)}
    assert IntegrationOptions().summarize_choices() == {"accuracy": 1e-3, "integrator": "merson"}
    assert IntegrationOptions(**chosen).summarize_choices() == chosen


def test_steps_keep_their_bounds():
    with Simulation(damped(), "compiled") as simulation:
        free = simulation.run(0.1, accuracy=0.01)
        short = simulation.run(0.1, accuracy=0.01, step_bounds=(0.0, 1e-3))
        with pytest.raises(SettingError, match=r"steps cannot last from 0.1 s to 0.01 s"):
            simulation.run(0.1, step_bounds=(0.1, 0.01))
        with pytest.raises(
            SettingError, match="`step_bounds` cannot be combined with `fixed_step`"
        ):
            simulation.run(0.1, step_bounds=(0.0, 0.01), fixed_step=1e-3)
        with pytest.raises(SettingError, match=r"no effect on the steps of 'adams'; .*merson or"):
            simulation.run(0.1, step_bounds=(0.0, 0.01), integrator="adams")
        # The first step of a batch also respects them: without bounds it is 0.01 s.
        (start,) = simulation.engine.run_many(
            [simulation.initial_state({}, {})],
            BatchOptions(to=0.01, accuracy=0.01, step_bounds=(0.0, 1e-3)),
        ).counts[:, 0]
    assert start >= 10, "the first step is longer than allowed"
    assert short.summary["steps"] >= 100 > free.summary["steps"]
    assert short.summary["settings"]["step_bounds"] == (0.0, 1e-3)
