"""The declarations of forces: what follows from each."""

from __future__ import annotations

import ast
import inspect
import re

import pytest

import osimlite
from osimlite.base.load import module_name
from osimlite.schema.states import states_of
from osimlite.simulation.elements.kind import Kind, kind_of_class, kinds

ALL_THREE = ["activation", "fiber_length", "fiber_velocity"]
DECLARED = [kind for kind in kinds() if isinstance(kind, Kind)]


@pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.component.__name__)
def test_a_kind_is_found_by_its_class_and_is_in_the_manual(kind, repo):
    assert kind_of_class(kind.component) is kind
    assert f"`{kind.component.__name__}`" in (repo / "docs" / "forces.md").read_text()


@pytest.mark.parametrize("kind", DECLARED, ids=lambda kind: kind.name)
def test_the_kernel_follows_from_the_declaration(kind):
    source = inspect.getsource(kind.text.kernel)
    assert source.startswith(f"def {kind.name}(") and source.endswith("return OUTCOME.OK\n")
    assert kind.law is None or " law(" in source
    # What the geometry applies is given by the law.
    applied = set(re.findall(r"\w+", " ".join(kind.geometry.after)))
    assert applied & {"force", "torque", "tension", "fx", "fy", "fz"} <= set(
        kind.outputs
    ) | applied & {"room"}
    for state in kind.states:
        assert state.rate in kind.outputs
        assert f"= {state.rate}\n" in source
    for output in (kind.labels or {}).values():
        assert output in kind.recorded


@pytest.mark.parametrize("kind", DECLARED, ids=lambda kind: kind.name)
def test_the_states_are_those_that_the_class_declares(kind):
    component = kind.component()
    if "compute_dissipation_energy" in kind.component.model_fields:
        component.compute_dissipation_energy = True
    assert [state.name for state in kind.states] == states_of(component)


@pytest.mark.parametrize(
    ("cls", "without_activation", "without_tendon"),
    [
        ("Millard2012AccelerationMuscle", ALL_THREE, ALL_THREE),
        ("Millard2012EquilibriumMuscle", ["fiber_length"], ["activation"]),
        ("DeGrooteFregly2016Muscle", ["normalized_tendon_force"], ["activation"]),
        ("MeyerFregly2016Muscle", [], ["activation"]),
        ("RigidTendonMuscle", [], []),
    ],
)
def test_the_states_that_are_left_are_opensims(cls, without_activation, without_tendon):
    """As OpenSim 4.6 names them."""
    for flag, left in (
        ("ignore_activation_dynamics", without_activation),
        ("ignore_tendon_compliance", without_tendon),
    ):
        assert states_of(getattr(osimlite, cls)(**{flag: True})) == left


def test_a_law_takes_what_the_kernel_gives():
    """One argument for each input, state and parameter."""
    for kind in DECLARED:
        if kind.law is not None:
            calls = [
                node
                for node in ast.walk(ast.parse(inspect.getsource(kind.text.kernel)))
                if isinstance(node, ast.Call)
            ]
            (given,) = (len(call.args) for call in calls if call.func.id == "law")
            assert given == len(inspect.signature(kind.law).parameters), kind.name


@pytest.mark.parametrize(
    ("name", "module"),
    [
        ("PathSpring", "path_spring"),
        ("Blankevoort1991Ligament", "blankevoort1991_ligament"),
        ("MeyerFregly2016Force", "meyer_fregly2016_force"),
        ("McKibbenActuator", "mc_kibben_actuator"),
    ],
)
def test_names_of_modules(name, module):
    assert module_name(name) == module
