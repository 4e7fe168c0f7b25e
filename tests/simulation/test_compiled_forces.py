"""Tests of all forces of the compiled engine against the PyBullet engine: accelerations, records, energies, loads."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite import HuntCrossleyForce
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.functions import ConstantValue as NumericConstant
from osimlite.mechanics.multibody.functions import Linear as NumericLinear
from osimlite.mechanics.multibody.mechanism import FramePlacement
from osimlite.mechanics.multibody.smoothing_spline import smoothing_spline
from osimlite.mechanics.multibody.spatial import make_offset
from osimlite.schema.contact_forces import SmoothSphereHalfSpaceForce
from osimlite.schema.muscles import Muscle
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.registry import FORCE_TYPES

pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")

from osimlite.mechanics.kernels.layout import OUTCOME, STAGE
from osimlite.simulation.elements.external_loads import make_external_load
from osimlite.simulation.elements.geometries.load import Load
from osimlite.simulation.engines.bullet.engine import BulletEngine
from osimlite.simulation.engines.compiled import CompiledEngine
from osimlite.simulation.engines.linking import PYTHON_CODE
from osimlite.simulation.system import System
from tests.simulation.force_cases import (
    FORCE_NAMES,
    FORCES,
    chain,
    contact,
    floor,
    stone,
    with_force,
)
from tests.simulation.support import assert_close, assert_same, engines, states

IDLE = {
    "limit of a locked coordinate",
    "spring on a locked coordinate",
    "actuator without controls",
    "idle",
}
"""Cases whose force is zero in all states."""


@pytest.fixture(scope="module")
def without_force():
    """Return the chain without a force as a compiled engine."""
    _, ours, theirs = engines(chain())
    theirs.close()
    return ours


@pytest.mark.parametrize("name", FORCE_NAMES)
def test_force(name, monkeypatch, without_force):
    mechanism, ours, theirs = engines(with_force(FORCES[name]))
    if name not in IDLE:
        # The force has an effect, so that the comparison below means something.
        assert any(
            ours.compute_accelerations(*state) != without_force.compute_accelerations(*state)
            for state in states(mechanism, 8)
        )
    with theirs:
        touched = assert_same(mechanism, ours, theirs)
        assert touched or not ours.contacts
    # As Python, the kernels give the same numbers, and access only their own vectors.
    python = System(mechanism, ours.forces, code=PYTHON_CODE)
    # Records remain from the last evaluation; another evaluation in Python would take long.
    monkeypatch.setattr(python, "compute_applied_forces", lambda t, y: None)
    for t, q, u in states(mechanism, 2):
        y = ours.state.pack(q, u)
        assert python.realize(t, y, STAGE.ACCELERATION) == OUTCOME.OK
        assert_close(python.get_derivative(), ours.compute_derivative(t, y), 1e-13)
        assert_close(python.force_records(t, y), ours.force_records(t, y), 1e-13)


def test_all_at_once():
    """All forces together are the sum of the forces, so that none uses numbers of another one."""
    model = chain()
    for index, (name, make) in enumerate(FORCES.items()):
        made = make()
        if "actuator" in name or name in ("station", "path over obstacles"):
            continue  # others refer to them by a path
        for item in made if isinstance(made, tuple | list) else (made,):
            item.name = f"{item.name}{index}"
            if isinstance(item, HuntCrossleyForce):
                (parameters,) = item.contact_parameters.objects
                parameters.geometry = tuple(f"{word}{index}" for word in parameters.geometry)
            if isinstance(item, SmoothSphereHalfSpaceForce):
                item.socket_half_space, item.socket_sphere = (
                    f"/contactgeometryset/floor{index}",
                    (f"/contactgeometryset/s2{index}"),
                )
            model.add(item)
    mechanism, ours, theirs = engines(model)
    with theirs:
        assert assert_same(mechanism, ours, theirs).bit_count() > 3


def test_every_class_of_force_is_here():
    """Classes that need files, and muscles and others with states, have tests of their own."""
    made = {"ElasticFoundationForce", "ExternalForce"}
    for make in FORCES.values():
        result = make()
        made |= {
            type(item).__name__
            for item in (result if isinstance(result, tuple | list) else (result,))
        }
    kinds = [
        kind for kind in FORCE_TYPES if not (getattr(kind, "states", ()) or kind.component.since)
    ]
    assert {
        kind.component.__name__ for kind in kinds if not issubclass(kind.component, Muscle)
    } <= made


def test_measured_load():
    """Apply a force and a torque along the axes of one body, at a point of another, to a third."""
    mechanism = build_mechanism(chain())
    cubic = smoothing_spline((0.0, 0.5, 1.0, 1.5, 2.0), (0.3, -1.0, 2.0, 0.5, 0.1), 2, 0.0)
    functions = cubic, NumericLinear(2.0, -0.3), NumericConstant(0.4)
    frames = [
        FramePlacement(body, make_offset((0.1, 0.2, -0.3), (0.3, -0.2, 0.5))) for body in (2, 0, 3)
    ]
    for given in ((1, 1, 1), (1, 0, 0), (0, 0, 1), (1, 1, 0)):
        kinds = [functions if wanted else () for wanted in given]
        forces = Forces(
            (make_external_load("/a", "a", Load(("b2_a_F", "b2_a_p", "b2_a_T"), *frames, *kinds)),)
        )
        with BulletEngine(mechanism, forces) as theirs:
            assert_same(mechanism, CompiledEngine(mechanism, forces), theirs)


def test_early_return():
    """Compare Simbody's defect in poses where the first contact separates faster than it pushes."""
    model = with_force(lambda: contact(floor(), *(stone(number, 0.6) for number in range(4))))
    plain, defect = engines(model), engines(model, simbody_early_return=True)
    changed = 0
    with plain[2], defect[2]:
        assert assert_same(*defect, count=40)
        for t, q, u in states(plain[0], 40):
            changed += plain[1].compute_accelerations(t, q, u) != defect[1].compute_accelerations(
                t, q, u
            )
    assert changed > 3


def test_motion_of_a_driven_chain():
    """Controls depend on time, so time must advance within steps."""
    model = with_force(FORCES["coordinate actuator"])
    ours, theirs = (
        osimlite.simulate(model, 0.5, engine, accuracy=1e-9) for engine in ("compiled", "bullet")
    )
    assert ours.summary["steps"] == theirs.summary["steps"]
    assert np.abs(ours.values - theirs.values).max() < 1e-9
