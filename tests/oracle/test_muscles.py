"""Compare muscles with a live OpenSim 4.6.

The tests compare derivatives, records, energy, equilibrium, and the steps of motions.
"""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.errors import SimulationError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.millard_muscles import (
    Millard2012AccelerationMuscle,
    Millard2012EquilibriumMuscle,
)
from osimlite.schema.muscle_curves import (
    ActiveForceLengthCurve,
    FiberCompressiveForceCosPennationCurve,
    FiberCompressiveForceLengthCurve,
    FiberForceLengthCurve,
    ForceVelocityCurve,
    TendonForceLengthCurve,
)
from osimlite.schema.muscles import MuscleFirstOrderActivationDynamicModel, Thelen2003Muscle
from osimlite.simulation import Simulation
from osimlite.simulation.elements import force_elements
from osimlite.simulation.engines.compiled import CompiledEngine
from tests.simulation.elements.muscle_rows import hung, line

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

USUAL = {"max_isometric_force": 700.0, "optimal_fiber_length": 0.06, "tendon_slack_length": 0.2}
VELOCITY = ForceVelocityCurve(
    concentric_slope_at_vmax=0.1,
    concentric_slope_near_vmax=0.3,
    eccentric_slope_at_vmax=0.05,
    eccentric_curviness=0.5,
)
# Muscles with the parameters that make their classes differ.
MUSCLES = {
    "Thelen": Thelen2003Muscle(pennation_angle_at_optimal=0.3, Af=0.3),
    "damped": Millard2012EquilibriumMuscle(
        pennation_angle_at_optimal=0.2,
        force_velocity_curve=VELOCITY,
        fiber_force_length_curve=FiberForceLengthCurve(
            strain_at_zero_force=-0.1,
            stiffness_at_low_force=0.3,
            stiffness_at_one_norm_force=4.0,
            curviness=0.6,
        ),
        tendon_force_length_curve=TendonForceLengthCurve(strain_at_one_norm_force=0.08),
    ),
    "undamped": Millard2012EquilibriumMuscle(
        fiber_damping=0.0005,
        force_velocity_curve=VELOCITY,
        active_force_length_curve=ActiveForceLengthCurve(
            minimum_value=0.2, transition_norm_fiber_length=0.8
        ),
    ),
    "excited": Millard2012EquilibriumMuscle(
        ignore_activation_dynamics=True,
        minimum_activation=0.0,
        min_control=0.0,
        pennation_angle_at_optimal=0.1,
    ),
    "rigid": Millard2012EquilibriumMuscle(
        ignore_tendon_compliance=True, pennation_angle_at_optimal=0.1
    ),
    "mass": Millard2012AccelerationMuscle(),
    "pennate mass": Millard2012AccelerationMuscle(
        pennation_angle_at_optimal=0.4,
        mass=0.3,
        tendon_force_length_damping=0.2,
        fiber_force_length_damping=0.05,
        fiber_damping=0.05,
        muscle_first_order_activation_dynamic_model=MuscleFirstOrderActivationDynamicModel(
            activation_time_constant=0.02, minimum_activation=0.05
        ),
        fiber_compressive_force_length_curve=FiberCompressiveForceLengthCurve(
            norm_length_at_zero_force=0.8
        ),
        fiber_compressive_force_cos_pennation_curve=FiberCompressiveForceCosPennationCurve(
            engagement_angle_in_degrees=40.0
        ),
    ),
}


def made(name):
    opensim.Logger.setLevelString("off")
    force = MUSCLES[name].model_copy(deep=True)
    for what, value in {**USUAL, "name": "mu", "geometry_path": line()}.items():
        setattr(force, what, value)
    return force


@pytest.fixture(params=list(MUSCLES))
def both(request, tmp_path):
    """Return the compiled engine, OpenSim's model and its state, for one muscle with excitation 0.4."""
    osimlite.write(hung(made(request.param), [0.4, 0.4]), tmp_path / "model.osim")
    model = osimlite.read(tmp_path / "model.osim")
    mechanism = build_mechanism(model)
    theirs = opensim.Model(str(tmp_path / "model.osim"))
    return CompiledEngine(mechanism, force_elements(model, mechanism)), theirs, theirs.initSystem()


def random_states(engine, seed):
    rng = np.random.default_rng(seed)
    parts = {"activation": (0.0, 1.1), "fiber_length": (0.02, 0.11), "fiber_velocity": (-0.4, 0.4)}
    while True:
        names = [path.rpartition("/")[2] for path in engine.state.paths]
        yield [
            rng.uniform(0.2, 0.32),
            rng.choice([0.0, rng.uniform(-1, 1)]),
            *(rng.uniform(*parts[x]) for x in names),
        ]


def put(engine, theirs, state, y):
    paths = [
        f"{engine.mechanism.coordinates[0].path}/{what}" for what in ("value", "speed")
    ] + engine.state.paths
    for path, value in zip(paths, y, strict=True):
        theirs.setStateVariableValue(state, path, float(value))
    return paths


def test_a_start_derivatives_records_and_energy(both):
    engine, theirs, start = both
    assert engine.state.pack_defaults()[2:] == [
        theirs.getStateVariableValue(start, path) for path in engine.state.paths
    ]
    for y, _ in zip(random_states(engine, 1), range(60), strict=False):
        state = opensim.State(start)
        paths = put(engine, theirs, state, y)
        try:
            theirs.realizeAcceleration(state)
        except RuntimeError:
            with pytest.raises(
                SimulationError, match="there is no solution for '/forceset/mu', whose path"
            ):
                engine.compute_derivative(0.0, y)
            continue
        expected = [theirs.getStateVariableDerivativeValue(state, path) for path in paths]
        assert engine.compute_derivative(0.0, y) == pytest.approx(expected, rel=1e-10, abs=1e-10)
        record = theirs.getForceSet().get(0).getRecordValues(state)
        assert engine.force_records(0.0, y) == pytest.approx([record.get(0)], rel=1e-10, abs=1e-9)
        # OpenSim approximates the integrals of curves by splines, therefore the larger tolerance.
        stored = theirs.calcPotentialEnergy(state)
        assert engine.compute_energies(0.0, y)[2] == pytest.approx(stored, rel=1e-4, abs=1e-5)


def test_equilibrium(both):
    engine, theirs, start = both
    for y, _ in zip(random_states(engine, 2), range(40), strict=False):
        state = opensim.State(start)
        put(engine, theirs, state, y)
        try:
            theirs.equilibrateMuscles(state)
        except RuntimeError:
            with pytest.raises(
                SimulationError, match="no equilibrium was found for '/forceset/mu'"
            ):
                engine.equilibrate_muscles(0.0, y)
            continue
        expected = [theirs.getStateVariableValue(state, path) for path in engine.state.paths]
        assert engine.equilibrate_muscles(0.0, y)[2:] == pytest.approx(
            expected, rel=1e-9, abs=1e-12
        )


@pytest.mark.parametrize("engine", ["bullet", "compiled"])
def test_the_steps_of_a_motion(both, engine, tmp_path):
    """Stiff muscles with mass amplify every rounding error within a few steps, therefore the short motion."""
    _, theirs, start = both
    to = 0.01 if "Acceleration" in theirs.getForceSet().get(0).getConcreteClassName() else 0.3
    theirs.setStateVariableValue(start, "/jointset/slide/x/value", 0.27)
    theirs.equilibrateMuscles(start)
    manager = opensim.Manager(theirs)
    manager.setIntegratorAccuracy(1e-5)
    manager.initialize(start)
    end = manager.integrate(to)
    trajectory = osimlite.simulate(
        osimlite.read(tmp_path / "model.osim"),
        to,
        engine,
        accuracy=1e-5,
        initial={"x": 0.27},
        equilibrate=True,
    )
    assert trajectory.summary["steps"] == manager.getStatesTable().getNumRows() - 1
    result = trajectory.auxiliary | {"/jointset/slide/x/value": trajectory.values[:, 0]}
    for path, values in result.items():
        assert values[-1] == pytest.approx(
            theirs.getStateVariableValue(end, path), rel=1e-9, abs=1e-9
        )


def test_a_step_to_where_there_is_no_solution_is_tried_smaller(tmp_path):
    """The integrator reduces steps that end where the muscle has no solution.

    The fibers shorten so fast that the first steps would leave them shorter than the width of the
    muscle.
    """
    force = made("pennate mass")
    force.default_fiber_length, force.default_fiber_velocity = 0.028, -3.0
    model = hung(force, [0.4, 0.4])
    model.find("/jointset/slide/x").default_value = 0.27
    osimlite.write(model, tmp_path / "model.osim")
    theirs = opensim.Model(str(tmp_path / "model.osim"))
    start = theirs.initSystem()
    manager = opensim.Manager(theirs)
    manager.setIntegratorAccuracy(1e-3)
    manager.initialize(start)
    end = manager.integrate(0.01)
    for engine in ("bullet", "compiled"):
        trajectory = osimlite.simulate(model, 0.01, engine, accuracy=1e-3)
        steps = trajectory.summary["steps"]
        assert (
            steps
            == manager.getStatesTable().getNumRows() - 1
            < trajectory.summary["attempted_steps"] - 5
        )
        for path, values in trajectory.auxiliary.items():
            assert values[-1] == pytest.approx(theirs.getStateVariableValue(end, path), rel=1e-9)


# Corpus models that are compared completely.
WHOLE = (
    "gait10dof18musc.osim",
    "gait2392_thelen2003muscle.osim",
    "gait2392_millard2012muscle.osim",
    "testControllers_TugOfWar.osim",
)


@pytest.mark.parametrize("name", WHOLE)
def test_whole_models(name, corpus):
    """Compare equilibrium, derivatives at random states, and the steps of a motion with both engines."""
    opensim.Logger.setLevelString("off")
    file = next(item.path for item in corpus if item.path.name == name)
    theirs = opensim.Model(str(file))
    start = theirs.initSystem()
    theirs.equilibrateMuscles(start)
    rng = np.random.default_rng(3)
    trajectories = []
    for engine in ("bullet", "compiled"):
        with Simulation(osimlite.read(file), engine, folder=file.parent) as simulation:
            trajectories.append(simulation.run(0.05, accuracy=1e-5, equilibrate=True))
            layout, mechanism = simulation.state, simulation.mechanism
            coordinates = [mechanism.coordinates[place].path for place in layout.order]
            paths = [
                f"{path}/{what}" for what in ("value", "speed") for path in coordinates
            ] + layout.paths
            rest = simulation.initial_state({}, {}, equilibrate=True)
            assert rest == pytest.approx(
                [theirs.getStateVariableValue(start, path) for path in paths], abs=1e-14
            )
            for _ in range(3):
                n = len(coordinates)
                y = [
                    *(x + rng.uniform(-0.1, 0.1) for x in rest[:n]),
                    *rng.uniform(-1.0, 1.0, n).tolist(),
                ]
                y += [x * rng.uniform(0.9, 1.1) for x in rest[2 * n :]]
                state = opensim.State(start)
                for path, value in zip(paths, y, strict=True):
                    theirs.setStateVariableValue(state, path, value)
                theirs.realizeAcceleration(state)
                expected = np.array(
                    [theirs.getStateVariableDerivativeValue(state, path) for path in paths]
                )
                scale = np.maximum(1.0, np.abs(expected[n : 2 * n]).max(initial=0.0))
                assert (
                    np.abs(simulation.engine.compute_derivative(0.0, y) - expected).max()
                    < 1e-9 * scale
                )
    manager = opensim.Manager(theirs)
    manager.setIntegratorAccuracy(1e-5)
    manager.initialize(start)
    end = manager.integrate(0.05)
    for trajectory in trajectories:
        assert trajectory.summary["steps"] == manager.getStatesTable().getNumRows() - 1
        result = {path: values[-1] for path, values in trajectory.auxiliary.items()}
        for info, value, speed in zip(
            mechanism.coordinates, trajectory.values[-1], trajectory.speeds[-1], strict=True
        ):
            result |= {f"{info.path}/value": value, f"{info.path}/speed": speed}
        expected = {path: theirs.getStateVariableValue(end, path) for path in result}
        scale = max(1.0, *map(abs, expected.values()))
        assert max(abs(result[path] - expected[path]) for path in result) < 1e-9 * scale
