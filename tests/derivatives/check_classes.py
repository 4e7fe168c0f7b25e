"""Tests of all classes of forces, joints and constraints as CasADi functions.

Values, Jacobians and Hessians are compared with those of the kernels on numbers that carry
derivatives (`jets.py`).
"""

from __future__ import annotations

from dataclasses import replace

import casadi
import numpy as np
import pytest

import osimlite
from osimlite.derivatives.constraints import find_independent_equations
from osimlite.derivatives.symbolic import make_symbolic
from osimlite.derivatives.symbolic_evaluator import SymbolicEvaluator
from osimlite.errors import SimulationError, UnsupportedError
from osimlite.mechanics.codegen.sources import collect_functions
from osimlite.mechanics.kernels.layout import CONSTRAINED, MODEL, STAGE
from osimlite.mechanics.kernels.table import LAW_MODULES
from osimlite.mechanics.laws import millard2012_equilibrium
from osimlite.mechanics.multibody import Mechanism
from osimlite.schema.actuators import ActivationCoordinateActuator, CoordinateActuator
from osimlite.schema.path_forces import ClutchedPathSpring
from osimlite.schema.probe_types import (
    ActuatorForceProbe,
    ActuatorPowerProbe,
    Bhargava2004MuscleMetabolicsProbe,
    Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter,
    SystemEnergyProbe,
    Umberger2010MuscleMetabolicsProbe,
    Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter,
)
from osimlite.schema.springs import (
    CoordinateLinearStopForce,
    ExponentialCoordinateLimitForce,
)
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.force_type import ForceType
from osimlite.simulation.elements.laws import find_function
from osimlite.simulation.elements.registry import FORCE_TYPES
from osimlite.simulation.pack import pack
from osimlite.simulation.run import Simulation
from osimlite.simulation.states import StateLayout
from tests.derivatives.jets import differentiate_by_jets
from tests.derivatives.machine import Beside, off, slope
from tests.mechanics.multibody.strategies import JOINT_TYPES, KINDS, constraint_of, make_random_body
from tests.simulation.elements.muscle_rows import CONFIGURATIONS, hung, muscle
from tests.simulation.force_cases import FORCES, straight, with_force

REFUSED = {
    "ellipsoid": "contact points of ellipsoids are found by a search; use spheres",
    "ellipsoids on each other and a sphere": "contact points of ellipsoids are found by a search",
}
SEARCHED = {"path around surfaces": 1e-8}
"""Cases whose Jacobian has a larger tolerance, because derivatives of their paths are finite differences."""
GEODESICS = "path over obstacles"
"""Case that is left out where kernels run as Python: the search for its geodesics would take half a minute."""
LEFT = {"ElasticFoundationForce", "ExternalForce"}
"""Classes without a case of their own.

Meshes (ElasticFoundationForce) are refused; an ExternalForce only adds functions of time, as a
PrescribedForce does.
"""
EXACT = 1e-11
CASES = FORCES | {
    "activation": lambda: ActivationCoordinateActuator(
        name="a", coordinate="q1_0", optimal_force=7.0
    ),
    "clutch": lambda: ClutchedPathSpring(
        name="a", stiffness=50.0, dissipation=0.3, initial_stretch=0.1, geometry_path=straight()
    ),
    "stop": lambda: CoordinateLinearStopForce(
        name="a",
        socket_coordinate="/jointset/j2/q2_0",
        stiffness=9.0,
        damping=0.2,
        upper_limit=-0.2,
        lower_limit=-0.3,
    ),
    "exponential limit": lambda: ExponentialCoordinateLimitForce(
        name="a",
        socket_coordinate="/jointset/j2/q2_0",
        lower_limit=-0.1,
        upper_limit=0.3,
        lower_shape_parameters=(2.0, 5.0),
        upper_shape_parameters=(1.5, 4.0),
    ),
}


@pytest.mark.parametrize("name", [name for name in CASES if name != GEODESICS])
def test_forces(name):
    model = with_force(CASES[name])
    if name in REFUSED:
        with pytest.raises(UnsupportedError, match=REFUSED[name]):
            Beside(model)
        return
    both = Beside(model)
    found = both.errors(both.state(1, 0.2))
    assert found["value"] < 1e-12 and found["jacobian"] < SEARCHED.get(name, EXACT)
    assert name in SEARCHED or found["hessian"] < 1e-9


@pytest.mark.parametrize("case", CONFIGURATIONS)
def test_muscles(case, monkeypatch):
    # OpenSim's tolerance of the velocity iteration, which the kernels have, would dominate the
    # difference.
    monkeypatch.setattr(millard2012_equilibrium, "VELOCITY_TOLERANCE", 1e-14)
    model = hung(muscle(case), (0.4, 0.6))
    model["/jointset/slide/x"].default_value = 0.322
    both = Beside(model)
    for seed in range(3):
        found = both.errors(both.state(seed, 0.01), seed)
        assert found["value"] < 1e-12 and found["jacobian"] < EXACT and found["hessian"] < 1e-9


def test_no_class_of_forces_is_left_out():
    models = [with_force(make) for make in CASES.values()] + [
        hung(muscle(case)) for case in CONFIGURATIONS
    ]
    seen = {type(component) for model in models for component in model.force_set.objects}
    rest = {kind.component.__name__ for kind in FORCE_TYPES} - {kind.__name__ for kind in seen}
    assert rest == LEFT


def test_paths_over_obstacles():
    both = Beside(with_force(FORCES[GEODESICS]))
    x = both.state(1, 0.2)
    assert off(both.xdot(x), both.derivative(x)) < 1e-12
    way = np.random.default_rng(1).normal(size=len(x)) / len(x)
    t, f = both.t, both.functions
    slopes = np.array(f.linear(t, x, both.controls(x), f.p)[1].full())
    found = slope(lambda h: both.derivative(x + h * way), 1e-3)
    assert off(slopes @ way, found, np.abs(slopes) @ np.abs(way)) < 1e-8


def test_every_kernel_is_written_for_symbols():
    names = [*LAW_MODULES, *(kind.name for kind in FORCE_TYPES if isinstance(kind, ForceType))]
    parts = {part for name in names for part in collect_functions(find_function(name))}
    assert len(parts) > 500 and all(map(make_symbolic, parts))


def test_probes():
    """Compare all probes that the kernels compute, on a muscle and a motor that move a block."""
    model = hung(muscle("millard_damped"), (0.4, 0.6))
    model["/jointset/slide/x"].default_value = 0.322
    model.add(CoordinateActuator(name="motor", coordinate="x", optimal_force=3.0))
    model.add(
        *(
            kind(name=kind.__name__, actuator_names=("all",))
            for kind in (ActuatorForceProbe, ActuatorPowerProbe)
        )
    )
    model.add(SystemEnergyProbe(name="of more than kernels know"))
    of_muscles = (
        (
            Umberger2010MuscleMetabolicsProbe,
            Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter,
        ),
        (
            Bhargava2004MuscleMetabolicsProbe,
            Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter,
        ),
    )
    for kind, parameter in of_muscles:
        probe = kind(
            name=kind.__name__,
            report_total_metabolics_only=False,
            probe_operation="integrate",
            gain=2.0,
        )
        probe.metabolic_muscle_parameter_set.objects.append(parameter(name="mu"))
        model.add(probe)
    functions = osimlite.casadi(model)
    engine = Simulation(model, "compiled").engine
    place = functions.outputs.index_out("probes")
    for seed in range(4):
        rng = np.random.default_rng(seed)
        x = functions.x + 0.01 * rng.normal(size=len(functions.x))
        # Integrals of probes are states of the engine, after the states of the functions.
        y = [*x, *[0.0] * (len(engine.get_derivative()) - len(x))]
        engine.compute_derivative(0.3, y)
        found = functions.outputs(0.3, x, engine.read_controls(), functions.p)[place]
        results = zip(engine.probes, engine.evaluate_probes(0.3, y), strict=True)
        wanted = [
            probe.gain * value for probe, row in results if probe.probe_type.law for value in row
        ]
        assert len(wanted) == len(functions.output_names["probes"]) >= 10
        assert off(np.array(found.full())[:, 0], np.array(wanted)) < 1e-9


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("held", ["none", *KINDS])
def test_trees_of_joints(held, seed):
    rng, bodies, infos = (
        np.random.default_rng([seed, KINDS.index(held) if held in KINDS else 99]),
        [],
        [],
    )
    for index in range(3):
        kind = (
            JOINT_TYPES[rng.integers(len(JOINT_TYPES))]
            if index
            else JOINT_TYPES[seed % len(JOINT_TYPES)]
        )
        body, own = make_random_body(
            index, int(rng.integers(-1, index)), kind, bool(rng.integers(2)), len(infos), rng
        )
        bodies.append(body)
        infos += own
    mechanism = Mechanism("random", tuple(bodies), tuple(infos), np.array((0.3, -9.5, 0.7)))
    if not infos:
        return
    q, u = rng.uniform(-1.0, 1.0, len(infos)), rng.uniform(-2.0, 2.0, len(infos))
    if held != "none":
        mechanism = replace(mechanism, constraints=(constraint_of(held, mechanism, rng),))
    forces = Forces(())
    packed = pack(mechanism, forces)
    layout = StateLayout(mechanism, packed.order, ())
    try:
        q = mechanism.assemble(q, 0.3)
        u = mechanism.project_speeds(q, u, 0.3)
        equations = find_independent_equations(mechanism, packed, layout) if held != "none" else ()
    except SimulationError:
        return
    at = packed.structure[MODEL.CONSTRAINED]
    count = int(packed.structure[at + CONSTRAINED.EQUATIONS]) if at else 0
    y = layout.pack(q.tolist(), u.tolist())
    way = rng.normal(size=len(y))
    value, jacobian, bends = differentiate_by_jets(packed, 0.3, y, [], way)
    x, d = casadi.SX.sym("x", len(y)), casadi.SX.sym("d", len(y))
    traced = SymbolicEvaluator(
        packed, forces, packed.numbers.tolist(), 0.3, casadi.vertsplit(x), (), equations
    )
    found = traced.evaluate(STAGE.ACCELERATION)
    xdot = found.mask_failures(found.f.cells)
    slopes = casadi.jacobian(xdot, x)
    turned = casadi.jtimes(slopes @ d, x, d)
    got = [
        np.array(part.full())
        for part in casadi.Function("f", [x, d], [xdot, slopes, turned])(y, way)
    ]
    scale = 1.0 + np.abs(value).max()
    assert off(got[0][:, 0], value, scale) < 1e-9
    assert off(got[1], jacobian, scale) < 1e-9
    # Dependent equations hold on the constraint manifold only, and second derivatives across it are
    # not unique.
    assert len(equations) < count or off(got[2][:, 0], bends @ way, scale) < 1e-8
