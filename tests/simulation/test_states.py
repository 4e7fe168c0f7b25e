"""What a state consists of: every engine and every batch takes states of its own length, and keeps all of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from osimlite.errors import OsimliteError
from osimlite.multibody import build_mechanism
from osimlite.simulation import Simulation
from osimlite.simulation.engines.protocol import Settings
from osimlite.simulation.states import StateLayout, StateVariable
from tests.simulation.damped import damped

pytest.importorskip("pybullet", reason="needs pybullet (extra 'sim')")
pytest.importorskip("numba", reason="needs numba (extra 'fast')")

numbers = st.lists(st.floats(-2.0, 2.0), max_size=20)


@pytest.fixture(scope="module")
def simulations():
    made = {
        "bullet": Simulation(damped(), "bullet"),
        "recursion": Simulation(damped(), "bullet", route="recursion"),
        "compiled": Simulation(damped(), "compiled"),
    }
    yield made
    for simulation in made.values():
        simulation.close()


@pytest.mark.parametrize("engine", ["bullet", "recursion", "compiled"])
@settings(max_examples=50, deadline=None)
@given(y=numbers)
def test_a_state_of_another_length_is_refused(simulations, engine, y):
    made = simulations[engine].engine
    size = made.state.size
    for ask in (
        made.derivative,
        made.touching,
        made.force_records,
        made.energies,
        lambda t, y: made.stepper(t, y, Settings(), lambda t, y: None),
        lambda t, y: made.stepper(t, y, Settings(fixed_step=1e-3), lambda t, y: None),
    ):
        if len(y) == size:
            ask(0.0, y)
        else:
            with pytest.raises(OsimliteError, match=f"has {size} numbers .*, not {len(y)}"):
                ask(0.0, y)


def test_nothing_of_the_call_before_is_left(simulations):
    """A vector without its tail is no state, whatever was computed before it."""
    engine = simulations["compiled"].engine
    y = engine.state.default()
    engine.derivative(0.0, [*y[:-1], 5.0])
    with pytest.raises(OsimliteError, match="not 9"):
        engine.derivative(0.0, y[:-1])


@settings(max_examples=30, deadline=None)
@given(rows=st.integers(0, 3), columns=st.integers(0, 20))
def test_a_batch_refuses_states_of_another_length(simulations, rows, columns):
    from osimlite.simulation.many import contact_places, run_many

    engine = simulations["compiled"].engine
    states = np.zeros((rows, columns))
    for ask in (lambda: run_many(engine, states, 1e-3), lambda: contact_places(engine, states)):
        if columns == engine.state.size:
            ask()
        else:
            with pytest.raises(OsimliteError, match=rf"{engine.state.size} numbers .* got \({rows}, {columns}\)"):
                ask()


class Element:
    def __init__(self, *states):
        self.states = states


def test_states_have_the_order_and_the_starts_of_their_owners():
    """Simbody's own come last; the states of one element stay together."""
    mechanism = build_mechanism(damped())
    muscle = Element(
        StateVariable("/m/activation", 0.05), StateVariable("/m/fiber_length", lambda q, u: 0.1 + q[1] + u[3])
    )
    spring, bushing = object(), Element(StateVariable("/b/dissipated_energy", is_simbody=True))
    layout = StateLayout(mechanism, (3, 0, 1), [bushing, spring, muscle])
    assert layout.size == 9 and layout.paths == ["/m/activation", "/m/fiber_length", "/b/dissipated_energy"]
    assert [layout.first_of(element) for element in (bushing, spring, muscle)] == [8, -1, 6]
    assert layout.names[2:4] == ["q1", "the speed of q3"] and layout.names[6:] == layout.paths
    y = layout.default()
    assert y == pytest.approx([0.3] * 3 + [1.0] * 3 + [0.05, 0.1 + 0.3 + 1.0, 0.0])
    assert layout.pack(layout.values(y), layout.speeds(y), layout.auxiliary(y)) == y
    with pytest.raises(OsimliteError, match="not 7"):
        layout.pack(layout.values(y), layout.speeds(y), [1.0])
    moved = np.array([y, y])
    moved[1, 2], moved[:, 6:] = 0.5, 9.0
    assert layout.started(moved).tolist() == [y, pytest.approx([*moved[1, :6], 0.05, 1.6, 0.0])]
