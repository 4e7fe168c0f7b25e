"""Predicted walk: the jumper's body with smooth forces, and a Moco study that finds its gait.

Only the speed, the range of the trunk angle, and the symmetry of two steps are prescribed; the rest
follows from the least effort.
"""

from __future__ import annotations

from math import pi, radians
from pathlib import Path

import numpy as np

from osimlite.fitting.modifying.words import modify
from osimlite.io.document.printer import write
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.models.walking import human
from osimlite.optimal.trajectory import MocoTrajectory
from osimlite.schema.contact_forces import SmoothSphereHalfSpaceForce
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.moco.goals import (
    MocoAverageSpeedGoal,
    MocoControlGoal,
    MocoOutputGoal,
    MocoPeriodicityGoal,
    MocoPeriodicityGoalPair,
)
from osimlite.schema.moco.parts import (
    MocoFinalBounds,
    MocoInitialBounds,
    MocoVariableInfo,
    MocoWeight,
    MocoWeightSet,
)
from osimlite.schema.moco.studies import MocoCasADiSolver, MocoPhase, MocoProblem, MocoStudy
from osimlite.schema.model import Model
from osimlite.schema.probe_types import (
    Bhargava2004MuscleMetabolicsProbe,
    Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter,
)
from osimlite.schema.smooth_muscles import DeGrooteFregly2016Muscle
from osimlite.schema.tools.processors import ModelProcessor

NAME = "human-walks"
"""Name of the model and of the study."""
SPEED_M_S = 1.2
"""Mean speed of the mass centre (m/s), a comfortable walking speed."""
RANGES_DEG = {
    "hip_flexion": (-30.0, 50.0),
    "knee_angle": (-80.0, 0.0),
    "ankle_angle": (-30.0, 25.0),
}
"""Ranges of the coordinates of each leg (deg): those of a gait, in which the polynomials of the
paths are accurate.
"""
PELVIS = "/jointset/ground_pelvis/"
"""Beginning of the paths of the coordinates of the pelvis."""
GUESS_STEP_S = 0.55
"""Duration of the step of the initial guess (s)."""


def human_walks() -> Model:
    """Build a human model for a predicted walk; its Moco study and guess are written with it.

    Returns:
        The model, whose functions are smooth enough for direct collocation.
    """
    model = human()
    model.name = NAME
    for coordinate in model.components(Coordinate):
        if (limits := RANGES_DEG.get(coordinate.name[:-2])) is not None:
            coordinate.range = (radians(limits[0]), radians(limits[1]))
    # Direct collocation needs smooth forces: no equilibrium of tendons, no wrapping, no contact
    # with kinks.
    model = modify(model, muscles="degroote", tendon="rigid", paths="polynomial", contact="smooth")
    for contact in model.components(SmoothSphereHalfSpaceForce):
        # The stiffness of a shoe and a heel pad. The jumper's stiffer contact bounces within a
        # millisecond, which the mesh of the study cannot resolve.
        contact.stiffness, contact.dissipation = 1e6, 2.0
        contact.static_friction = contact.dynamic_friction = 0.8
        contact.transition_velocity = 0.2
    probe = Bhargava2004MuscleMetabolicsProbe(name="metabolics")
    muscle_parameters = probe.metabolic_muscle_parameter_set.objects
    for muscle in model.components(DeGrooteFregly2016Muscle):
        muscle_parameters.append(
            Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter(name=muscle.name)
        )
    model.add(probe)
    return model


def make_walking_study(model: Model, file: str, guess: str) -> MocoStudy:
    """Return a study of half a stride at a given speed with minimal effort and roughness.

    Both goals are divided by the distance.

    Args:
        model: model of :func:`human_walks`.
        file: name of the model's file.
        guess: name of the file of the initial guess.
    """
    states, controls = _list_variables(model)
    pairs = {
        variable_type: [
            MocoPeriodicityGoalPair(initial_variable=name, final_variable=_mirror_path(name))
            for name in names
        ]
        for variable_type, names in (("state", states), ("control", controls))
    }
    forward = f"{PELVIS}pelvis_tx/value"
    # Weights are proportional to volume: a muscle twice as large consumes twice the energy.
    sizes = {
        f"/forceset/{muscle.name}": muscle.max_isometric_force * muscle.optimal_fiber_length
        for muscle in _list_muscles(model)
    }
    mean = sum(sizes.values()) / len(sizes)
    weights = [MocoWeight(name=name, weight=round(size / mean, 3)) for name, size in sizes.items()]
    goals = [
        # Half a stride: the end mirrors the start, except for the distance walked.
        MocoPeriodicityGoal(
            name="mirrored",
            state_pairs=[pair for pair in pairs["state"] if pair.initial_variable != forward],
            control_pairs=pairs["control"],
        ),
        MocoAverageSpeedGoal(name="speed", desired_average_speed=SPEED_M_S),
        MocoControlGoal(
            name="effort",
            weight=10.0,
            control_weights=MocoWeightSet(name="control_weights", objects=weights),
            divide_by_displacement=True,
        ),
        # Without this goal the feet stamp: braking by an impact costs no muscle effort.
        MocoOutputGoal(
            name="roughness",
            weight=0.1,
            output_path="/|com_acceleration",
            exponent=2,
            divide_by_displacement=True,
        ),
    ]
    phase = MocoPhase(
        model=ModelProcessor(name="model", filepath=file),
        time_initial_bounds=MocoInitialBounds(name="time_initial_bounds", bounds=(0.0,)),
        # Durations of a step of people who walk at this speed.
        time_final_bounds=MocoFinalBounds(name="time_final_bounds", bounds=(0.35, 0.7)),
        state_infos=[
            # People hold the trunk nearly upright.
            MocoVariableInfo(name=f"{PELVIS}pelvis_tilt/value", bounds=(-0.1, 0.05)),
            MocoVariableInfo(name=forward, bounds=(0.0, 2.0), initial_bounds=(0.0,)),
            MocoVariableInfo(name=f"{PELVIS}pelvis_ty/value", bounds=(0.75, 1.1)),
            MocoVariableInfo(name=f"{PELVIS}pelvis_tx/speed", bounds=(0.3, 2.5)),
        ],
        state_infos_pattern=[
            MocoVariableInfo(name=".*(flexion|angle)_[rl]/speed", bounds=(-15.0, 15.0))
        ],
        control_infos_pattern=[MocoVariableInfo(name=".*", bounds=(0.01, 1.0))],
        goals=goals,
    )
    solver = MocoCasADiSolver(
        name="solver",
        num_mesh_intervals=25,
        optim_max_iterations=1000,
        optim_convergence_tolerance=1e-4,
        optim_constraint_tolerance=1e-4,
        guess_file=guess,
    )
    return MocoStudy(name=NAME, problem=MocoProblem(name="problem", phases=phase), solver=solver)


def make_guess(model: Model) -> MocoTrajectory:
    """Return a rough step as initial guess.

    One leg moves back straight, the other swings forward with a bent knee.

    All muscles have the same small activation.
    """
    states, controls = _list_variables(model)
    fraction = np.linspace(0.0, 1.0, 21)
    bump = np.sin(pi * fraction)
    angles: dict[str, Array] = {
        "pelvis_tilt": np.full(21, -0.05),
        "pelvis_tx": SPEED_M_S * GUESS_STEP_S * fraction,
        "pelvis_ty": np.full(21, 0.93),
        "hip_flexion_r": np.radians(25.0 - 40.0 * fraction),
        "hip_flexion_l": np.radians(40.0 * fraction - 15.0),
        "knee_angle_r": np.radians(-8.0 - 8.0 * bump),
        "knee_angle_l": np.radians(-8.0 - 52.0 * bump),
        "ankle_angle_r": np.radians(5.0 * bump),
        "ankle_angle_l": np.zeros(21),
    }
    columns = {}
    for name in (*states, *controls):
        owner, _, quantity = name.rpartition("/")
        values = angles.get(owner.rpartition("/")[2], np.full(21, 0.05))
        columns[name] = (
            np.gradient(values, GUESS_STEP_S * fraction) if quantity == "speed" else values
        )
    return MocoTrajectory(
        GUESS_STEP_S * fraction, columns, {"states": tuple(states), "controls": tuple(controls)}
    )


def write_study(model: Model, file: Path) -> list[Path]:
    """Write the study and its initial guess beside the file of the model.

    Args:
        model: model of :func:`human_walks`.
        file: path of the model's file.

    Returns:
        Paths of the study and of the guess.

    Raises:
        OsimliteError: a file cannot be written.
    """
    study = file.with_suffix(".omoco")
    guess = file.with_name(f"{file.stem}_guess.sto")
    make_guess(model).write(guess)
    write(make_walking_study(model, file.name, guess.name), study)
    return [study, guess]


def _list_muscles(model: Model) -> list[DeGrooteFregly2016Muscle]:
    """Return the muscles of a model that have the class DeGrooteFregly2016Muscle."""
    return [
        force for force in model.force_set.objects if isinstance(force, DeGrooteFregly2016Muscle)
    ]


def _list_variables(model: Model) -> tuple[list[str], list[str]]:
    """Return the paths of the states and of the controls."""
    paths = [coordinate.path for coordinate in build_mechanism(model).coordinates]
    controls = [f"/forceset/{muscle.name}" for muscle in _list_muscles(model)]
    kinematic = [f"{path}/{quantity}" for quantity in ("value", "speed") for path in paths]
    return [*kinematic, *(f"{name}/activation" for name in controls)], controls


def _mirror_path(name: str) -> str:
    """Return the path of the same variable on the other side."""
    # Names end in _r or _l.
    side_table = str.maketrans("rl", "lr")
    return "/".join(
        path_part[:-1] + path_part[-1].translate(side_table)
        if path_part[-2:] in ("_r", "_l")
        else path_part
        for path_part in name.split("/")
    )
