"""A human who walks because a step is cheap: the jumper's body made smooth, and the study of Moco that finds its gait.

Nothing of a walk is given but its speed, how far the trunk may lean, and that the second step
mirrors the first.
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
from osimlite.schema.muscles import DeGrooteFregly2016Muscle
from osimlite.schema.probe_types import (
    Bhargava2004MuscleMetabolicsProbe,
    Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter,
)
from osimlite.schema.tools.processors import ModelProcessor

NAME = "human-walks"
SPEED = 1.2
"""Of the mass center, m/s."""
RANGES = {"hip_flexion": (-30.0, 50.0), "knee_angle": (-80.0, 0.0), "ankle_angle": (-30.0, 25.0)}
"""Of a gait, deg: in these the polynomials of the paths are good."""
PELVIS = "/jointset/ground_pelvis/"
STEP = 0.55
"""How long the step of the guess takes, s."""


def human_walks() -> Model:
    """Build a human model for a predicted walk; its Moco study and guess are written with it."""
    model = human()
    model.name = NAME
    for coordinate in model.components(Coordinate):
        if (limits := RANGES.get(coordinate.name[:-2])) is not None:
            coordinate.range = (radians(limits[0]), radians(limits[1]))
    model = modify(model, muscles="degroote", tendon="rigid", paths="polynomial", contact="smooth")
    for contact in model.components(SmoothSphereHalfSpaceForce):
        # A shoe and the fat under the heel: softer than what bounces off the ground for a
        # thousandth of a second.
        contact.stiffness, contact.dissipation = 1e6, 2.0
        contact.static_friction = contact.dynamic_friction = 0.8
        contact.transition_velocity = 0.2
    probe = Bhargava2004MuscleMetabolicsProbe(name="metabolics")
    known = probe.metabolic_muscle_parameter_set.objects
    for muscle in model.components(DeGrooteFregly2016Muscle):
        known.append(Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter(name=muscle.name))
    model.add(probe)
    return model


def walking_study(model: Model, file: str, guess: str) -> MocoStudy:
    """Half a stride at a given speed, over the distance cheap for the muscles and not rough.

    Args:
        model: as of :func:`human_walks`.
        file: that it is in.
        guess: the file to start from.
    """
    states, controls = _names(model)
    pairs = {
        kind: [
            MocoPeriodicityGoalPair(initial_variable=name, final_variable=_mirror_path(name))
            for name in names
        ]
        for kind, names in (("state", states), ("control", controls))
    }
    forward = f"{PELVIS}pelvis_tx/value"
    # A muscle that is twice as large takes twice as much energy.
    sizes = {
        f"/forceset/{m.name}": m.max_isometric_force * m.optimal_fiber_length
        for m in _muscles(model)
    }
    mean = sum(sizes.values()) / len(sizes)
    weights = [MocoWeight(name=name, weight=round(size / mean, 3)) for name, size in sizes.items()]
    goals = [
        MocoPeriodicityGoal(
            name="mirrored",
            state_pairs=[pair for pair in pairs["state"] if pair.initial_variable != forward],
            control_pairs=pairs["control"],
        ),
        MocoAverageSpeedGoal(name="speed", desired_average_speed=SPEED),
        MocoControlGoal(
            name="effort",
            weight=10.0,
            control_weights=MocoWeightSet(name="control_weights", objects=weights),
            divide_by_displacement=True,
        ),
        # Without it the feet stamp: what a muscle does not do, the ground does.
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
        time_final_bounds=MocoFinalBounds(name="time_final_bounds", bounds=(0.35, 0.7)),
        state_infos=[
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


def stepping(model: Model) -> MocoTrajectory:
    """A rough step: one leg goes back straight, the other swings forward with a bent knee, and no muscle does much."""
    states, controls = _names(model)
    part = np.linspace(0.0, 1.0, 21)
    bump = np.sin(pi * part)
    angles: dict[str, Array] = {
        "pelvis_tilt": np.full(21, -0.05),
        "pelvis_tx": SPEED * STEP * part,
        "pelvis_ty": np.full(21, 0.93),
        "hip_flexion_r": np.radians(25.0 - 40.0 * part),
        "hip_flexion_l": np.radians(40.0 * part - 15.0),
        "knee_angle_r": np.radians(-8.0 - 8.0 * bump),
        "knee_angle_l": np.radians(-8.0 - 52.0 * bump),
        "ankle_angle_r": np.radians(5.0 * bump),
        "ankle_angle_l": np.zeros(21),
    }
    columns = {}
    for name in (*states, *controls):
        owner, _, what = name.rpartition("/")
        values = angles.get(owner.rpartition("/")[2], np.full(21, 0.05))
        columns[name] = np.gradient(values, STEP * part) if what == "speed" else values
    return MocoTrajectory(
        STEP * part, columns, {"states": tuple(states), "controls": tuple(controls)}
    )


def write_study(model: Model, file: Path) -> list[Path]:
    """Write the study and its guess beside the file of the model.

    Raises:
        OsimliteError: they cannot be written.
    """
    study, guess = file.with_suffix(".omoco"), file.with_name(f"{file.stem}_guess.sto")
    stepping(model).write(guess)
    write(walking_study(model, file.name, guess.name), study)
    return [study, guess]


def _muscles(model: Model) -> list[DeGrooteFregly2016Muscle]:
    return [
        force for force in model.force_set.objects if isinstance(force, DeGrooteFregly2016Muscle)
    ]


def _names(model: Model) -> tuple[list[str], list[str]]:
    """Paths of the states and of the controls."""
    paths = [info.path for info in build_mechanism(model).coordinates]
    controls = [f"/forceset/{muscle.name}" for muscle in _muscles(model)]
    kinematic = [f"{path}/{what}" for what in ("value", "speed") for path in paths]
    return [*kinematic, *(f"{name}/activation" for name in controls)], controls


def _mirror_path(name: str) -> str:
    """The path of the same on the other side."""
    swap = str.maketrans("rl", "lr")
    return "/".join(
        part[:-1] + part[-1].translate(swap) if part[-2:] in ("_r", "_l") else part
        for part in name.split("/")
    )
