"""List all facts that a class inherits from its base, with what OpenSim does for the class (measured)."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from operator import attrgetter

import pytest

from osimlite.io.document.source import Source
from osimlite.lint import validate
from osimlite.schema.base import Object
from osimlite.schema.facts import Facts
from osimlite.schema.muscles import Muscle
from osimlite.schema.registry import MODULES
from tests.lint.verdict_cases import path_of, small_model

# How a fact of the base class applies to a derived class.
UNUSED, HOLDS = "the class never uses the property", "the fact holds for the class"

MUSCLES = (
    "DeGrooteFregly2016Muscle",
    "Delp1990Muscle_Deprecated",
    "MeyerFregly2016Muscle",
    "Millard2012AccelerationMuscle",
    "Millard2012EquilibriumMuscle",
    "RigidTendonMuscle",
    "Schutte1993Muscle_Deprecated",
    "Thelen2003Muscle",
    "Thelen2003Muscle_Deprecated",
)
SOLVER = (
    "num_mesh_intervals",
    "optim_constraint_tolerance",
    "optim_convergence_tolerance",
    "optim_max_iterations",
)

INHERITED = {
    **{("MocoCasADiSolver", name): HOLDS for name in SOLVER},
    # OpenSim computes the same accelerations with an optimal_force of 1, 0 and -1, or rejects all
    # three.
    **{
        (name, "optimal_force"): UNUSED
        for name in (*MUSCLES, "ClutchedPathSpring", "McKibbenActuator")
    },
}
"""Inherited facts about numbers outside of their domain, by class and property."""

# Parameters of MuJoCo's muscle: largest velocity, eccentric force, and time constants of
# activation.
NUMBERS = {"vmax", "fvmax", "rise", "fall"}
NOT_THERE = {
    "DeGrooteFregly2016Muscle": {"fvmax"},
    # The translator reads these two classes by their own laws.
    "Delp1990Muscle_Deprecated": NUMBERS,
    "Schutte1993Muscle_Deprecated": NUMBERS,
    "MeyerFregly2016Muscle": {"fvmax"},
    # The muscle has no activation dynamics, as the report of the translator says.
    "RigidTendonMuscle": {"fvmax", "rise", "fall"},
}
"""Parameters of MuJoCo's muscle without a property of the class; the translator uses a default."""


def find_classes() -> Iterator[type[Object]]:
    """Yield every class that may stand in a file."""
    for name, module in MODULES.items():
        cls = getattr(import_module(module), name)
        if not cls.abstract:
            yield cls


def find_named(facts: Facts) -> set[str]:
    """Return the properties for which facts state the consequence of a number outside of its domain."""
    texts = [*facts.outside.values(), *facts.zero.values(), *facts.missing.values(), facts.refused]
    return {name for text in texts for name in text.split()} | {*facts.doubtful}


def test_every_inherited_fact_is_listed() -> None:
    inherited = set()
    for cls in find_classes():
        known = find_named(cls.__dict__.get("facts", Facts()))
        for base in cls.__mro__[1:]:
            facts = base.__dict__.get("facts", Facts())
            inherited |= {(cls.__name__, name) for name in find_named(facts) - known}
    assert inherited == {*INHERITED}


def actuator_of(name: str, force: int) -> str:
    """Return the text of a model with an actuator that states its optimal force."""
    if "Coordinate" in name:
        inside = "<coordinate>q</coordinate>"
    else:
        inside = path_of(("/ground", "0 0.5 0"), ("/bodyset/a", "0.1 0 0"))
    if name == "ClutchedPathSpring":
        inside += "<stiffness>100</stiffness><dissipation>0.1</dissipation>"
    return small_model(
        forces=f'<{name} name="f"><optimal_force>{force}</optimal_force>{inside}</{name}>'
    )


@pytest.mark.parametrize("name", [name for name, tag in INHERITED if tag == "optimal_force"])
def test_the_linter_reports_an_inherited_fact_only_where_it_holds(name: str) -> None:
    report = validate(Source(actuator_of(name, 0).encode(), "m.osim"), ignore="OSIM63")
    reported = [
        item for item in report if item.code == "OSIM207" and "optimal_force" in item.message
    ]
    assert bool(reported) == (INHERITED[name, "optimal_force"] == HOLDS)


def find_missing_numbers(cls: type[Muscle]) -> set[str]:
    """Return the parameters of MuJoCo's muscle whose property does not exist in the class."""
    named: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        named.update(base.__dict__.get("facts", Facts()).mujoco)
    muscle, missing = cls(name="m"), set()
    for number, path in named.items():
        try:
            attrgetter(path)(muscle)
        except AttributeError:
            missing.add(number)
    return missing


@pytest.mark.parametrize("name", MUSCLES)
def test_a_number_of_mujoco_comes_from_a_property_that_the_class_has(name: str) -> None:
    cls = next(cls for cls in find_classes() if cls.__name__ == name)
    assert issubclass(cls, Muscle)
    assert find_missing_numbers(cls) == NOT_THERE.get(name, set())
