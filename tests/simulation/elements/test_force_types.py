"""Tests of the declarations of force types: kernel, states, outputs and the page of the manual."""

from __future__ import annotations

import ast
import inspect
import re

import pytest

import osimlite
from osimlite.base.load import make_module_name
from osimlite.schema.states import list_states
from osimlite.simulation.elements.force_type import ForceType
from osimlite.simulation.elements.registry import FORCE_TYPES

ALL_THREE = ["activation", "fiber_length", "fiber_velocity"]
DECLARED = [force_type for force_type in FORCE_TYPES if isinstance(force_type, ForceType)]


@pytest.mark.parametrize(
    "force_type", [*FORCE_TYPES], ids=lambda force_type: force_type.component.__name__
)
def test_a_force_type_is_found_by_its_class_and_is_in_the_manual(force_type, repo):
    assert FORCE_TYPES.find(force_type.component) is force_type
    assert f"`{force_type.component.__name__}`" in (repo / "docs" / "forces.md").read_text()


@pytest.mark.parametrize("force_type", DECLARED, ids=lambda force_type: force_type.name)
def test_the_kernel_follows_from_the_declaration(force_type):
    source = inspect.getsource(force_type.text.kernel)
    assert source.startswith(f"def {force_type.name}(") and source.endswith("return OUTCOME.OK\n")
    assert force_type.law is None or " law(" in source
    # The geometry applies outputs of the law.
    applied = set(re.findall(r"\w+", " ".join(force_type.geometry.apply_code)))
    assert applied & {"force", "torque", "tension", "fx", "fy", "fz"} <= set(
        force_type.outputs
    ) | applied & {"work"}
    for state in force_type.states:
        assert state.rate in force_type.outputs
        assert f"= {state.rate}\n" in source
    for output in (force_type.labels or {}).values():
        assert output in force_type.record_offsets


@pytest.mark.parametrize("force_type", DECLARED, ids=lambda force_type: force_type.name)
def test_the_states_are_those_that_the_class_declares(force_type):
    component = force_type.component()
    if "compute_dissipation_energy" in force_type.component.model_fields:
        component.compute_dissipation_energy = True
    assert [state.name for state in force_type.states] == list_states(component)


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
    """Compare with the states that OpenSim 4.6 has."""
    for flag, left in (
        ("ignore_activation_dynamics", without_activation),
        ("ignore_tendon_compliance", without_tendon),
    ):
        assert list_states(getattr(osimlite, cls)(**{flag: True})) == left


def test_a_law_takes_what_the_kernel_gives():
    """The call of a law in the kernel has one argument for each input, state and parameter."""
    for force_type in DECLARED:
        if force_type.law is not None:
            calls = [
                node
                for node in ast.walk(ast.parse(inspect.getsource(force_type.text.kernel)))
                if isinstance(node, ast.Call)
            ]
            (given,) = (len(call.args) for call in calls if call.func.id == "law")
            assert given == len(inspect.signature(force_type.law).parameters), force_type.name


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
    assert make_module_name(name) == module
