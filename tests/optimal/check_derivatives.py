"""Tests of first and second derivatives of the nonlinear programs of all kinds of studies, by finite differences."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.moco import build_inverse_problem, build_problem, build_track_problem
from osimlite.optimal.goals import GOAL_BUILDERS
from osimlite.optimal.hessian import Hessian
from osimlite.optimal.path_constraints import PATH_CONSTRAINT_BUILDERS
from osimlite.optimal.problem import Problem
from osimlite.optimal.program import Program
from tests.optimal.small import BODIES, coupled, links, study_of, tables, tied
from tests.optimal.studies import study as moco_study

sparse = pytest.importorskip("scipy.sparse")
STEP = 2e-3
"""Step of Richardson's differences; their error is the sixth power of the step times the seventh derivative."""


def matrix(sparsity, numbers):
    return sparse.csc_array((numbers, sparsity.row(), sparsity.colind()), sparsity.shape)


def apart(entries):
    """Group columns so that no row has nonzero entries in two columns of a group (Curtis, Powell and Reid 1974).

    Args:
        entries: pattern (m, n) of nonzero entries.

    Returns:
        Sums of columns as 0 and 1 (n, groups), by a greedy search.
    """
    shared, sets = entries.T.astype(int) @ entries, []
    for column in range(len(shared)):
        other = next((each for each in sets if not shared[column, each].any()), None)
        if other is None:
            sets.append(other := [])
        other.append(column)
    return np.array([np.isin(np.arange(len(shared)), each) for each in sets]).T.astype(float)


def differences(function, w, ways):
    """Differentiate an array along directions by central differences that are extrapolated from three steps.

    Args:
        function: function of w that returns an array (m,).
        w: point (n,).
        ways: directions (n, k).

    Returns:
        Derivatives (m, k).
    """

    def extrapolated(way):
        one, two, four = (
            (function(w + k * way) - function(w - k * way)) / (2.0 * k * STEP)
            for k in (0.25, 0.5, 1.0)
        )
        return (64.0 * one - 20.0 * two + four) / 45.0

    return np.array([extrapolated(STEP * way) for way in ways.T]).T


def worst(found, wanted, name):
    """Compare matrices.

    Args:
        found: matrix to check.
        wanted: reference.
        name: function that names a row.

    Returns:
        Largest difference relative to the largest entry of its row or to one, and a text that says
        where it is.
    """
    off = np.abs(found - wanted) / np.maximum(1.0, np.abs(wanted).max(axis=1, keepdims=True))
    row, column = np.unravel_index(np.argmax(off), off.shape)
    return off[
        row, column
    ], f"{name(row)} by number {column}: {found[row, column]} and {wanted[row, column]}"


def check(study, folder, *, tolerance=1e-7, curved=True):
    program = Program(study if isinstance(study, Problem) else build_problem(study, folder))
    layout, rng = program.layout, np.random.default_rng(3)
    low, high = np.maximum(layout.lower, -1.0), np.minimum(layout.upper, 1.0)
    w = np.clip(low + (high - low) * rng.uniform(0.2, 0.8, len(low)), layout.lower, layout.upper)
    # Variables with equal bounds do not move: at fixed times a prescribed motion is known at these
    # times only.
    moving = np.eye(len(w))[:, layout.lower < layout.upper]
    push = rng.normal(size=len(program.labels))

    def parts(at):
        costs, rows = program.compute_values(at)
        return np.concatenate([[costs.sum()], rows])

    def combined(at):
        gradient, numbers = program.compute_slopes(at)
        return 0.7 * gradient + push @ matrix(program.jacobian_sparsity, numbers)

    assert np.isfinite(parts(w)).all()
    gradient, numbers = program.compute_slopes(w)
    slopes = np.vstack([gradient, matrix(program.jacobian_sparsity, numbers).toarray()])
    first = differences(parts, w, moving)
    off, where = worst(slopes @ moving, first, ["cost", *program.labels].__getitem__)
    assert off < tolerance, where
    assert np.abs(first[0]).max() > 0.0 or not program.costs
    if not curved:
        with pytest.raises(osimlite.OsimliteError, match="not linear in its integral"):
            Hessian(program)
        return
    hessian = Hessian(program)
    half = matrix(hessian.sparsity, hessian.compute_entries(w, 0.7, push)).toarray()
    # An entry that is missing in the declared pattern changes the sums of its group, and is found
    # too.
    curves = (half + np.triu(half, 1).T) @ moving
    ways = apart(curves != 0.0)
    off, where = worst(
        curves @ ways, differences(combined, w, moving @ ways), layout.describe_variable
    )
    assert off < tolerance, where


def _file(name):
    return osimlite.TableProcessor(filepath=name)


GROUP = {"contact_force_paths": ("/forceset/contact0", "/forceset/contact1"), "external_force_name": "foot",
         "alternative_frame_paths": BODIES}  # fmt: skip
FOOT = [
    osimlite.MocoStepTimeAsymmetryGoalGroup(
        contact_force_paths=(f"/forceset/contact{k}",),
        foot_position_contact_force_path=f"/forceset/contact{k}",
    )
    for k in range(2)
]
PAIR = osimlite.MocoPeriodicityGoalPair
PARAMETER = osimlite.MocoParameter(
    name="mass",
    moco_bounds=osimlite.MocoBounds(bounds=(0.5, 2.0)),
    component_paths=(BODIES[1],),
    property_name="mass",
)
SWING = "/jointset/j0/q0/value"
FRAMES = {"frame_paths": BODIES}
GOALS = {
    "MocoFinalTimeGoal": {},
    "MocoAverageSpeedGoal": {"desired_average_speed": 0.3, "mode": "cost"},
    "MocoInitialActivationGoal": {"mode": "cost"},
    "MocoInitialForceEquilibriumDGFGoal": {"mode": "cost"},
    "MocoInitialVelocityEquilibriumDGFGoal": {"mode": "cost", "weight": 1e-4},
    "MocoControlGoal": {"exponent": 3, "divide_by_displacement": True},
    "MocoSumSquaredStateGoal": {"divide_by_duration": True, "divide_by_mass": True},
    "MocoExpressionBasedParameterGoal": {"expression": "m^2 + 1/m", "parameters": [PARAMETER], "variables": ("m",)},
    "MocoPeriodicityGoal": {
        "state_pairs": [PAIR(initial_variable=SWING, final_variable=SWING)],
        "control_pairs": [PAIR(initial_variable="/forceset/motor0", final_variable="/forceset/motor1", negate=True)],
        "mode": "cost",
    },
    "MocoMarkerFinalGoal": {"point_name": "/markerset/tip", "reference_location": (0.1, 0.2, 0.3)},
    "MocoJointReactionGoal": {"joint_path": "/jointset/j1", "loads_frame": "child"},
    "MocoOutputGoal": {"output_path": "/bodyset/b1|linear_acceleration"},
    "MocoInitialOutputGoal": {"output_path": "/|com_position", "output_index": 0, "exponent": 3},
    "MocoFinalOutputGoal": {
        "output_path": "/bodyset/b1|position",
        "second_output_path": "/markerset/tip|velocity",
        "operation": "addition",
    },
    "MocoStepTimeAsymmetryGoal": {
        "left_contact_group": FOOT[0], "right_contact_group": FOOT[1], "contact_force_threshold": 3.0,
        "contact_detection_smoothing": 0.01, "asymmetry_smoothing": 2.0,
    },
    "MocoStepLengthAsymmetryGoal": {
        "left_foot_frame": BODIES[0], "right_foot_frame": BODIES[1], "stride_length": 0.8, "asymmetry_smoothing": 0.01,
    },
    "MocoStateTrackingGoal": {"reference": _file("motion.sto"), "scale_weights_with_range": False},
    "MocoControlTrackingGoal": {"reference": _file("controls.sto")},
    "MocoMarkerTrackingGoal": {"markers_reference": osimlite.MarkersReference(marker_file="markers.trc")},
    "MocoTranslationTrackingGoal": FRAMES | {"translation_reference_file": "vectors.sto"},
    "MocoOrientationTrackingGoal": FRAMES | {"rotation_reference_file": "turns.sto"},
    "MocoAngularVelocityTrackingGoal": FRAMES | {"states_reference": _file("motion.sto")},
    "MocoAccelerationTrackingGoal": FRAMES | {
        "acceleration_reference_file": "vectors.sto",
        "gravity_offset": True,
        "express_accelerations_in_tracking_frames": True,
    },
    "MocoGeneralizedForceTrackingGoal": {"reference": _file("moments.sto"), "force_paths": ("/forceset/contact.",)},
    "MocoContactTrackingGoal": {
        "contact_groups": [osimlite.MocoContactTrackingGoalGroup(**GROUP)], "external_loads_file": "loads.xml",
        "projection": "plane", "projection_vector": (1.0, 0.2, 0.0),
    },
    "MocoContactImpulseTrackingGoal": {
        "contact_groups": [osimlite.MocoContactImpulseTrackingGoalGroup(**GROUP)], "external_loads_file": "loads.xml",
        "impulse_axis": 1,
    },
}  # fmt: skip
"""Required properties of goals, by class."""
PATHS = {
    "MocoControlBoundConstraint": {
        "control_paths": ("/forceset/motor0",),
        "lower_bound": osimlite.Sine(amplitude=0.3, omega=3.0, phase=0.2, offset=0.1),
        "upper_bound": osimlite.LinearFunction(coefficients=(0.5, 0.2)),
    },
    "MocoStateBoundConstraint": {
        "state_paths": (SWING,), "lower_bound": osimlite.Constant(value=0.1), "equality_with_lower": True,
    },
    "MocoOutputBoundConstraint": {
        "output_path": "/bodyset/b1|angular_acceleration", "upper_bound": osimlite.Constant(value=3.0),
    },
    "MocoFrameDistanceConstraint": {
        "frame_pairs": [
            osimlite.MocoFrameDistanceConstraintPair(
                frame1_path="/ground", frame2_path=BODIES[1], minimum_distance=0.1, maximum_distance=3.0
            )
        ],
    },
}  # fmt: skip
"""Required properties of path constraints, by class."""
OF_MUSCLES = (
    "MocoInitialActivationGoal",
    "MocoInitialForceEquilibriumDGFGoal",
    "MocoInitialVelocityEquilibriumDGFGoal",
)
NOT_LINEAR = "MocoStepTimeAsymmetryGoal", "MocoContactImpulseTrackingGoal"


@pytest.mark.parametrize("kind", GOALS)
def test_goals(kind, tmp_path):
    tables(tmp_path)
    model = links("implicit", "elastic") if kind in OF_MUSCLES else links()
    study = study_of(
        model,
        getattr(osimlite, kind)(name="goal", **GOALS[kind]),
        transcription_scheme="trapezoidal",
    )
    if kind == "MocoExpressionBasedParameterGoal":
        study.problem.phases.parameters = [PARAMETER.copy_deep()]
    check(study, tmp_path, curved=kind not in NOT_LINEAR)


def test_every_class_is_checked():
    """MocoTrack and MocoInverse add goals and constraints of these classes as well."""
    assert {kind.__name__ for kind in GOAL_BUILDERS} == {*GOALS}
    assert {kind.__name__ for kind in PATH_CONSTRAINT_BUILDERS} == {*PATHS}


@pytest.mark.parametrize("everywhere", [False, True])
@pytest.mark.parametrize("kind", PATHS)
def test_path_constraints(kind, everywhere, tmp_path):
    constraint = getattr(osimlite, kind)(name="path", **PATHS[kind])
    effort = osimlite.MocoControlGoal(name="effort")
    check(
        study_of(
            links(),
            effort,
            constraints=[constraint],
            enforce_path_constraint_mesh_interior_points=everywhere,
        ),
        tmp_path,
    )


SCHEMES = "trapezoidal", "hermite-simpson", "legendre-gauss-3", "legendre-gauss-radau-3"
IMPLICIT = {
    "multibody_dynamics_mode": "implicit",
    "minimize_implicit_multibody_accelerations": True,
    "minimize_implicit_auxiliary_derivatives": True,
}


@pytest.mark.parametrize("mode", ["explicit", "implicit"])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_schemes_and_dynamics(scheme, mode, tmp_path):
    """The model has muscles of all modes, a mass as parameter, and controls that are free between mesh points."""
    choices = {"interpolate_control_mesh_interior_points": False} | (
        IMPLICIT if mode == "implicit" else {}
    )
    model = links("implicit", "elastic", "rigid")
    study = study_of(
        model, osimlite.MocoControlGoal(name="effort"), transcription_scheme=scheme, **choices
    )
    study.problem.phases.parameters = [PARAMETER.copy_deep()]
    check(study, tmp_path)


@pytest.mark.parametrize("mode", ["explicit", "implicit"])
@pytest.mark.parametrize(
    ("scheme", "method", "derived"),
    [
        *((scheme, "Posa2016", False) for scheme in SCHEMES),
        ("hermite-simpson", "Posa2016", True),
        *((scheme, "Bordalba2023", True) for scheme in SCHEMES),
    ],
)
def test_models_with_constraints(scheme, method, derived, mode, tmp_path):
    choices = {
        "transcription_scheme": scheme,
        "kinematic_constraint_method": method,
        "enforce_constraint_derivatives": derived,
        "minimize_lagrange_multipliers": True,
        "multibody_dynamics_mode": mode,
    }
    load = osimlite.MocoJointReactionGoal(name="load", joint_path="/jointset/j1", weight=1e-3)
    model = links("implicit") if scheme == "trapezoidal" else links()
    check(study_of(tied(coupled(model, "q1")), load, **choices), tmp_path)


@pytest.mark.parametrize("mode", ["explicit", "implicit"])
def test_loads_over_time(mode, tmp_path):
    """Loads are parameters that are set for each time, and act as they do where time is a symbol."""
    tables(tmp_path)
    model = osimlite.modify(
        links(), osimlite.ModOpAddExternalLoads(filepath=str(tmp_path / "loads.xml"))
    )
    sine = osimlite.Sine(amplitude=30.0, omega=4.0, phase=0.2, offset=3.0)
    push = osimlite.PrescribedForce(name="push", socket_frame=BODIES[0])
    push.torqueFunctions.objects = [sine.copy_deep() for _ in range(3)]
    model.add(push)
    problem = build_problem(
        study_of(model, osimlite.MocoControlGoal(name="effort"), multibody_dynamics_mode=mode)
    )
    check(problem, tmp_path)
    assert len(problem.loads) == 9
    program = Program(problem)
    w = np.random.default_rng(0).uniform(0.1, 0.9, len(program.layout.lower))
    points, count = program.groups[0], len(problem.functions.states)
    found = points.evaluate(program, w, problem.grid.fractions, w[points.columns])
    f = osimlite.casadi(model)
    for place, z, values in zip(problem.grid.fractions, w[points.columns], found, strict=True):
        t, x, u = w[0] + place * (w[1] - w[0]), z[:count], z[count : count + len(f.controls)]
        rates = values[:count] / (w[1] - w[0])
        wanted = np.array(f.dynamics(t, x, u, [])).ravel()
        if mode == "implicit":
            wanted, rates = (
                np.array(f.residual(t, x, rates, u, [], []))[2:4].ravel(),
                values[count:][:2],
            )
        assert rates == pytest.approx(wanted, rel=1e-11, abs=1e-11)


def test_motions_that_are_given(tmp_path):
    tables(tmp_path)
    tool = osimlite.MocoInverse(
        name="inverse",
        model=osimlite.ModelProcessor(model=links("implicit", "elastic", "rigid")),
        kinematics=_file("motion.sto"),
        initial_time=0.1,
        final_time=0.9,
        mesh_interval=0.4,
    )
    check(build_inverse_problem(tool, folder=tmp_path), tmp_path)


def test_motions_that_are_followed(tmp_path):
    tables(tmp_path)
    tool = osimlite.MocoTrack(
        name="track",
        model=osimlite.ModelProcessor(model=links()),
        states_reference=_file("motion.sto"),
        markers_reference=_file("markers.trc"),
        allow_unused_references=True,
        track_reference_position_derivatives=True,
        initial_time=0.1,
        final_time=0.9,
        mesh_interval=0.4,
    )
    check(build_track_problem(tool, folder=tmp_path)[0], tmp_path)


def test_a_knee_of_splines_with_muscles(tmp_path):
    check(moco_study(tmp_path, "squat-25", num_mesh_intervals=1), tmp_path, tolerance=1e-6)
