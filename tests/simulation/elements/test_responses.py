"""Tests of derivatives of forces for implicit integrators, against automatic differentiation."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from osimlite.mechanics.kernels import layout, pointers
from osimlite.mechanics.kernels.condensation import RESPONSE_WORK, WIDTH
from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE, WORK
from osimlite.mechanics.multibody import build_mechanism
from osimlite.simulation import Simulation
from osimlite.simulation.elements import force_elements
from osimlite.simulation.elements.force_type import DeclaredForce
from osimlite.simulation.elements.laws import RESPONSE
from osimlite.simulation.engines.linking import MACHINE_CODE
from osimlite.simulation.system import System
from tests.derivatives.jets import Jet, use_jets
from tests.simulation.checked import Checked
from tests.simulation.elements.muscle_rows import CONFIGURATIONS, hung, muscle
from tests.simulation.force_cases import FORCE_NAMES, FORCES, with_force

STATES = 2


def jets_of(kind: Any, given: tuple[Any, ...]) -> tuple[list[Any], list[int]]:
    """Replace arguments of a law by jets.

    Args:
        kind: the force type.
        given: arguments of a call of its law.

    Returns:
        Arguments with jets for the inputs and states with responses, and the columns of their
        derivatives.
    """
    changed, count = kind.text.changed_outputs, len(kind.text.changed_outputs)
    names = [
        *kind.text.input_names,
        "excitation",
        *(state.name for state in kind.states if state.is_argument),
    ]
    flat = [getattr(given[0], name) for name in names] if kind.inputs_type else [*given]
    none = np.zeros(count)
    for direction, place in enumerate(changed.values()):
        flat[place] = Jet(float(flat[place]), np.eye(count)[direction], 0.0, none)
    # Registers of formulas must hold jets as well.
    rest = [
        part.astype(object) if isinstance(part, np.ndarray) else part
        for part in given[1 if kind.inputs_type else 0 :]
    ]
    if kind.inputs_type:
        return [given[0]._replace(**dict(zip(names, flat, strict=True))), *rest], [*changed]
    return [flat[k] if isinstance(flat[k], Jet) else part for k, part in enumerate(rest)], [
        *changed
    ]


@pytest.mark.parametrize("case", [*FORCE_NAMES, *CONFIGURATIONS])
def test_they_are_derivatives_of_the_law(case, monkeypatch):
    """Compare machine code and Python; at a corner the side counts on which the law is evaluated."""
    is_muscle = case in CONFIGURATIONS
    model = hung(muscle(case), (0.4, 0.6)) if is_muscle else with_force(FORCES[case])
    if is_muscle:
        model["/jointset/slide/x"].default_value = 0.322
    mechanism = build_mechanism(model)
    forces = force_elements(model, mechanism)
    with Simulation(model, "compiled") as simulation:
        start = np.array(simulation.initial_state({}, {}))
    code, python = (
        System(mechanism, forces, code=each) for each in (MACHINE_CODE, Checked("Python"))
    )
    size, rng = int(code.structure[MODEL.DOFS]), np.random.default_rng(1)
    for system in (code, python):
        system.program.link_responses("bdf")
    given: dict[str, tuple[Any, ...]] = {}
    for kind in {force.force_type for force in forces.elements if isinstance(force, DeclaredForce)}:
        if kind.text.responds:
            noted = partial(_noted, given, kind)
            monkeypatch.setitem(kind.text.kernel.__globals__, "law", noted)
    for _ in range(STATES):
        y = start * rng.uniform(0.9, 1.1, len(start))
        y[start == 0.0] = rng.uniform(0.05, 0.3, np.count_nonzero(start == 0.0))
        y[:size] += (0.01 if is_muscle else 0.2) * rng.normal(size=size)
        y[size : 2 * size] += rng.normal(size=size)
        found = []
        for system in (python, code):
            assert system.realize(0.3, y.tolist(), STAGE.ACCELERATION) == OUTCOME.OK
            found.append(responses(system, y))
        for name, row in found[0].items():
            assert row == pytest.approx(found[1][name], rel=1e-12, abs=1e-12), name
        for kind, own in given.values():
            name = kind.name + RESPONSE
            slopes = found[0][name].reshape(-1, WIDTH)
            differentiate_by_jets, columns = jets_of(kind, own)
            with use_jets([kind.law]):
                results = kind.law(*differentiate_by_jets)
            results = dict(
                zip(
                    kind.outputs, results if isinstance(results, tuple) else (results,), strict=True
                )
            )
            for row, output in zip(
                slopes,
                (kind.geometry.displacement_output[0], *(s.rate for s in kind.states)),
                strict=False,
            ):
                result = results[output]
                wanted = np.zeros(WIDTH)
                if isinstance(result, Jet):
                    wanted[columns] = result.g
                assert row == pytest.approx(
                    wanted, rel=1e-9, abs=1e-9 * (1.0 + np.abs(wanted).max())
                ), output


def _noted(given: dict[str, Any], kind: Any, *own: Any) -> Any:
    given[kind.name] = kind, own
    return kind.law(*own)


def responses(system: System, y: np.ndarray) -> dict[str, np.ndarray]:
    """Compute the derivatives of all forces at a state.

    Args:
        system: the system, after the evaluation of the state.
        y: the state.

    Returns:
        Workspace of derivatives by the name of the kernel that computes them.
    """
    s, result = system.program.ints, {}
    for place, name in system.program.responses.items():
        kernel = system.program.code.bind_entry(
            name, s, system.numbers, system.work_vector, y, np.zeros(len(y))
        )
        if isinstance(system.program.code, Checked):
            kernel = partial(
                pointers.call,
                int(s[place]),
                s,
                system.numbers,
                system.work_vector,
                y,
                np.zeros(len(y)),
            )
        assert kernel(int(s[place + layout.RESPONSE.ITEM])) == OUTCOME.OK
        result[name] = np.array(
            system.work_vector[WORK.SCRATCH : WORK.SCRATCH + RESPONSE_WORK.INVERSE]
        )
    return result
