"""Tests of states: every engine and every batch checks their length, and handles all states of the forces."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st

import osimlite
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.simulation import Simulation, read_sto, write_sto
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.states import StateLayout, StateVariable
from tests.oracle.random_models import RandomModel
from tests.simulation.damped import damped
from tests.suite import choose

pytest.importorskip("pybullet", reason="needs pybullet (extra 'sim')")

numbers = st.lists(st.floats(-2.0, 2.0), max_size=20)


@pytest.fixture(scope="module")
def simulations():
    made = {
        "bullet": Simulation(damped(), "bullet"),
        "compiled": Simulation(damped(), "compiled"),
    }
    yield made
    for simulation in made.values():
        simulation.close()


@pytest.mark.parametrize("engine", ["bullet", "compiled"])
@settings(max_examples=choose(25, 50), deadline=None)
@given(y=numbers)
def test_a_state_of_another_length_is_refused(simulations, engine, y):
    made = simulations[engine].engine
    size = made.state.size
    for ask in (
        made.compute_derivative,
        made.find_touching_contacts,
        made.force_records,
        made.compute_energies,
        lambda t, y: made.make_stepper(t, y, EngineSettings(), lambda t, y: None),
        lambda t, y: made.make_stepper(t, y, EngineSettings(fixed_step=1e-3), lambda t, y: None),
    ):
        if len(y) == size:
            ask(0.0, y)
        else:
            with pytest.raises(OsimliteError, match=f"has {size} numbers .*, not {len(y)}"):
                ask(0.0, y)


def test_nothing_of_the_call_before_is_left(simulations):
    """A state of the wrong length is rejected, whatever was computed before."""
    engine = simulations["compiled"].engine
    y = engine.state.pack_defaults()
    engine.compute_derivative(0.0, [*y[:-1], 5.0])
    with pytest.raises(OsimliteError, match="not 9"):
        engine.compute_derivative(0.0, y[:-1])


@settings(max_examples=30, deadline=None)
@given(rows=st.integers(0, 3), columns=st.integers(0, 20))
def test_a_batch_refuses_states_of_another_length(simulations, rows, columns):
    from osimlite.simulation.batches import run_many

    engine = simulations["compiled"].engine
    states = np.zeros((rows, columns))
    for ask in (lambda: run_many(engine, states, 1e-3), lambda: engine.locate_contacts(states)):
        if columns == engine.state.size:
            ask()
        else:
            with pytest.raises(
                OsimliteError, match=rf"{engine.state.size} numbers .* got \({rows}, {columns}\)"
            ):
                ask()


class Element:
    def __init__(self, *states):
        self.states = states


def test_states_have_the_order_and_the_starts_of_their_owners():
    """States that Simbody adds come last; the states of one element stay together."""
    mechanism = build_mechanism(damped())
    muscle = Element(
        StateVariable("/m/activation", 0.05),
        StateVariable("/m/fiber_length", lambda q, u: 0.1 + q[1] + u[3]),
    )
    spring, bushing = Element(), Element(StateVariable("/b/dissipated_energy", is_simbody=True))
    layout = StateLayout(mechanism, (3, 0, 1), [bushing, spring, muscle])
    assert layout.size == 9 and layout.paths == [
        "/m/activation",
        "/m/fiber_length",
        "/b/dissipated_energy",
    ]
    assert [layout.find_first_state(element) for element in (bushing, spring, muscle)] == [8, -1, 6]
    assert layout.names[2:4] == ["q1", "the speed of q3"] and layout.names[6:] == layout.paths
    y = layout.pack_defaults()
    assert y == pytest.approx([0.3] * 3 + [1.0] * 3 + [0.05, 0.1 + 0.3 + 1.0, 0.0])
    assert layout.pack(layout.values(y), layout.speeds(y), layout.auxiliary(y)) == y
    with pytest.raises(OsimliteError, match="not 7"):
        layout.pack(layout.values(y), layout.speeds(y), [1.0])
    moved = np.array([y, y])
    moved[1, 2], moved[:, 6:] = 0.5, 9.0
    assert layout.restart_auxiliary(moved).tolist() == [
        y,
        pytest.approx([*moved[1, :6], 0.05, 1.6, 0.0]),
    ]


def with_states(seed):
    """Return a random model, and a random initial value of each of its auxiliary states."""
    random = RandomModel(seed)
    random.model.add(random.bushing("bushing"))
    with Simulation(random.model, "compiled") as simulation:
        return random.model, {path: random.number(0.0, 2.0) for path in simulation.state.paths}


@settings(max_examples=10, deadline=None, derandomize=True, phases=[Phase.explicit, Phase.generate])
@example(seed=448690)
@example(seed=835180)
@given(seed=st.integers(0, 10**6))
def test_random_models_keep_their_states(seed, tmp_path_factory):
    """Run both engines with both kinds of steps, as a batch, and from a file."""
    from osimlite.simulation.batches import run_many

    model, z = with_states(seed)
    file = tmp_path_factory.mktemp("random") / "states.sto"
    ends = {}
    for engine in ("bullet", "compiled"):
        with Simulation(model, engine) as simulation:
            assert set(z) == set(simulation.state.paths) and set(z) < set(simulation.paths)
            for step in ({"accuracy": 1e-8}, {"fixed_step": 2e-4}):
                trajectory = simulation.run(0.02, initial=z, **step)
                assert {path: rows[0] for path, rows in trajectory.auxiliary.items()} == z
                ends[engine, *step] = [rows[-1] for rows in trajectory.auxiliary.values()]
                # Dissipated energies continue from their initial values.
                assert (
                    np.array(ends[engine, *step])
                    >= np.array([z[path] for path in trajectory.auxiliary])
                ).all()
            trajectory.to_sto(file)
            assert tuple(read_sto(file).columns) == tuple(simulation.paths)
            last = simulation.initial_state(simulation.read_state(file), {})
            history = simulation.state.pack_rows(
                trajectory.values, trajectory.speeds, trajectory.auxiliary
            )
            # The initial state of a run is projected, and fulfils constraints a little better.
            assert last == pytest.approx(
                history[-1].tolist(), abs=1e-7 if simulation.constraints else 0.0, rel=0.0
            )
            again = simulation.run(0.01, initial=str(file))
            assert [rows[0] for rows in again.auxiliary.values()] == ends[engine, "fixed_step"]
            middle = simulation.initial_state(simulation.read_state(file, 0.0101), {})
            assert middle == pytest.approx(
                history[1].tolist(), abs=1e-7 if simulation.constraints else 0.0, rel=0.0
            )
            if engine == "compiled":
                starts = np.array([simulation.initial_state(z, {}), last])
                runs = run_many(
                    simulation.engine, starts, 0.02, accuracy=1e-8, report_times=[0.0, 0.01]
                )
                assert np.allclose(
                    runs.reports[:, 0],
                    starts,
                    rtol=0.0,
                    atol=1e-8 if simulation.constraints else 0.0,
                )
                alone = simulation.run(0.02, accuracy=1e-8, initial=z)
                ending = simulation.state.pack_rows(alone.values, alone.speeds, alone.auxiliary)
                assert np.array_equal(runs.states[0], ending[-1])
    assert ends["bullet", "accuracy"] == pytest.approx(
        ends["compiled", "accuracy"], rel=1e-7, abs=1e-9
    )
    # Both engines take fixed steps of first order. Of 664 random models, 1 dissipates so much in 20
    # ms that steps of 1 ms err by 0.15 J, and five times shorter ones by 0.02 J. Bullet integrates
    # the rates of its joints, and some of these differ from the generalized speeds.
    for engine in ("bullet", "compiled"):
        assert ends[engine, "fixed_step"] == pytest.approx(
            ends["compiled", "accuracy"], rel=0.1, abs=0.1
        )


def test_what_a_file_says_gives_way_to_what_holds(tmp_path):
    """Locked coordinates keep their values; names in the call have priority over the file."""
    file = tmp_path / "states.sto"
    osimlite.simulate(damped(), 0.1).to_sto(file)
    with Simulation(damped(), "compiled") as simulation:
        state = simulation.read_state(file)
        state["/jointset/j2/q2/value"] = 7.0
        y = simulation.initial_state({**state, "q1": 0.25}, {})
        assert simulation.state.values(y)[2] == 0.3 and simulation.state.values(y)[1] == 0.25
        for state, error in (
            ({"/forceset/disc/dissipated_energy": np.nan}, "starts at nan"),
            ({"q9": 1.0}, "q9"),
        ):
            with pytest.raises(OsimliteError, match=error):
                simulation.initial_state(state, {})
        write_sto(tmp_path / "other.sto", "x", [0.0], ["/jointset/k/r/value"], [[1.0]])
        with pytest.raises(
            OsimliteError,
            match=r"no column is a state of 'damped', such as '/jointset/j0/q0/value'",
        ):
            simulation.run(0.1, initial=tmp_path / "other.sto")
        write_sto(
            tmp_path / "degrees.sto",
            "x",
            [0.0],
            ["/jointset/j1/q1/value"],
            [[90.0]],
            in_degrees=True,
        )
        assert simulation.read_state(tmp_path / "degrees.sto") == {
            "/jointset/j1/q1/value": np.pi / 2
        }
