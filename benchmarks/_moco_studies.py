"""Studies that osimlite and Moco 4.6 both solve.

Each writer puts files that both programs read into a folder: either ``study.omoco``, or the setup
``track.xml`` or ``inverse.xml`` of a tool. ``more.omoco`` has goals, bounds and solver settings
that are added to the study that the tool makes.

`STUDIES` and `LONG` have the writers by name. A writer is called with the folder and with the
sources of opensim-core, from which some studies take models and data.
"""

from __future__ import annotations

import math
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import osimlite
from _corpus import MOCO, ROOT, unpack_file
from osimlite.io.tables.writers import write_trc

CORE = ROOT.parent / "pub-opensim-core"
"""Default folder of the sources of opensim-core, or a git directory of them."""

WALKING_3D = "OpenSim/Examples/Moco/example3DWalking"

WALKING = "OpenSim/Examples/Moco/example2DWalking"

TESTS = "OpenSim/Moco/Test"

GAIT = (
    "subject_walk_armless_18musc.osim",
    "subject_walk_armless_coordinates.mot",
    "subject_walk_armless_external_loads.xml",
    "subject_walk_armless_grfs.mot",
)
"""Files of a measured gait in `TESTS`: model, coordinates, external loads and their forces."""

SOLVER_TOLERANCES = {"optim_convergence_tolerance": 1e-4, "optim_constraint_tolerance": 1e-4}
"""Solver settings of the tracking study."""

INVERSE_SETTINGS: dict[str, Any] = {
    # The tables have more columns than the models have coordinates.
    "kinematics_allow_extra_columns": True,
    "convergence_tolerance": 1e-4,
    "constraint_tolerance": 1e-4,
}
"""Settings of MocoInverse."""

STEP_DURATION_S = 0.470089
"""Duration of the measured step in 2-D walking (s)."""

FILTER_HZ = 6.0
"""Cutoff frequency of the low-pass filter of measured data (Hz)."""

RESIDUAL_FORCE_N = 50.0

RESIDUAL_TORQUE_N_M = 250.0

RESIDUAL_WEIGHT = 10.0
"""Weight of the residual actuators in the effort goal; that of muscles is 1."""

StudyWriter = Callable[[Path, Path], None]
"""Function that writes a study; its arguments are the folder and the sources of opensim-core."""


def _unpack(name: str, folder: Path, target_name: str) -> Path:
    """Unpack a file of `MOCO` under another name, and return its path."""
    return unpack_file(MOCO / f"{name}.gz", folder / target_name)


def get_saved_study(name: str) -> StudyWriter:
    """Return the writer of a study that is saved in `MOCO`."""

    def write_study(folder: Path, _: Path) -> None:
        _unpack(f"{name}.omoco", folder, "study.omoco")

    return write_study


def copy_sources(core: Path, subfolder: str, names: tuple[str, ...], folder: Path) -> None:
    """Copy files of opensim-core to a folder.

    Args:
        core: folder with the sources of opensim-core, or a git directory of them.
        subfolder: folder in the sources.
        names: names of the files.
        folder: folder for the copies.

    Raises:
        SystemExit: there are no sources.
    """
    if not core.is_dir():
        raise SystemExit(
            f"there is no folder {core}: name the sources of opensim-core by --core FOLDER"
        )
    for name in names:
        if (core / "objects").is_dir():
            # A git directory has no working files.
            command = ["git", f"--git-dir={core}", "show", f"HEAD:{subfolder}/{name}"]
            process = subprocess.run(command, check=True, capture_output=True)
            (folder / name).write_bytes(process.stdout)
        else:
            shutil.copy(core / subfolder / name, folder)


def _write_study(
    folder: Path, model: osimlite.Model, phase: osimlite.MocoPhase, **solver: object
) -> None:
    """Write ``model.osim`` and a study with one phase about it.

    Args:
        folder: folder for both files.
        model: model of the study.
        phase: phase, whose model is set.
        **solver: settings of the solver.
    """
    osimlite.write(model, folder / "model.osim")
    phase.model = osimlite.ModelProcessor(name="model", filepath="model.osim")
    problem = osimlite.MocoProblem(name="problem", phases=phase)
    study = osimlite.MocoStudy(
        name="study", problem=problem, solver=osimlite.MocoCasADiSolver(**solver)
    )
    osimlite.write(study, folder / "study.omoco")


def _make_phase(start: float, end: float) -> osimlite.MocoPhase:
    """Make a phase with a fixed initial and final time (s)."""
    return osimlite.MocoPhase(
        name="phases",
        time_initial_bounds=osimlite.MocoInitialBounds(bounds=(start,)),
        time_final_bounds=osimlite.MocoFinalBounds(bounds=(end,)),
    )


def _make_lowpass() -> osimlite.TabOpLowPassFilter:
    """Make the filter of measured data."""
    return osimlite.TabOpLowPassFilter(cutoff_frequency=FILTER_HZ)


def write_parabola_study(folder: Path, _: Path) -> None:
    """Write a study of a point mass that slides down a parabola.

    A coupler is the only constraint of the model, and there is no goal.
    """
    model = osimlite.Model(name="planar_point_mass")
    parent = "/ground"
    # The first body has no mass: it only carries the second slider.
    for name, mass, rotation in (("tx", 0.0, 0.0), ("ty", 1.0, 0.5 * math.pi)):
        body = osimlite.Body(
            name=f"body_{name}", mass=mass, mass_center=(0.0, 0.0, 0.0), inertia=(0.0,) * 6
        )
        model.add(body)
        joint = osimlite.SliderJoint(
            name=name, socket_parent_frame="before", socket_child_frame="after"
        )
        # A slider moves along the x axis of its frames, which are rotated to y for the second.
        for frame, owner in (("before", parent), ("after", body.path)):
            joint.frames.append(
                osimlite.PhysicalOffsetFrame(
                    name=frame, socket_parent=owner, orientation=(0.0, 0.0, rotation)
                )
            )
        joint.coordinates[0].name = name
        model.add(joint)
        parent = body.path
    model.add(
        osimlite.CoordinateCouplerConstraint(
            name="parabola",
            independent_coordinate_names=("tx",),
            dependent_coordinate_name="ty",
            coupled_coordinates_function=osimlite.PolynomialFunction(coefficients=(1.0, 0.0, 0.0)),
        )
    )
    phase = _make_phase(0.0, 0.8)
    phase.default_speed_bounds = osimlite.MocoBounds(bounds=(-5.0, 5.0))
    for name, start in (("tx", -1.0), ("ty", 1.0)):
        path = f"/jointset/{name}/{name}/value"
        phase.state_infos.append(
            osimlite.MocoVariableInfo(name=path, bounds=(-2.0, 2.0), initial_bounds=(start,))
        )
    _write_study(folder, model, phase)


def make_double_pendulum() -> osimlite.Model:
    """Make a pendulum of two links of 1 m with motors, and a marker at the end of each link."""
    model = osimlite.Model(name="double_pendulum")
    parent = "/ground"
    for index in range(2):
        body = osimlite.Body(
            name=f"b{index}",
            mass=1.0,
            mass_center=(0.0,) * 3,
            inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0),
        )
        model.add(body)
        # The origin of a body is the far end of its link; the joint is at the near end.
        model.add(osimlite.Marker(name=f"m{index}", socket_parent_frame=body.path))
        joint = osimlite.PinJoint(
            name=f"j{index}", socket_parent_frame=parent, socket_child_frame="end"
        )
        joint.frames.append(
            osimlite.PhysicalOffsetFrame(
                name="end", socket_parent=body.path, translation=(-1.0, 0.0, 0.0)
            )
        )
        joint.coordinates[0].name = f"q{index}"
        joint.coordinates[0].range = (-10.0, 10.0)
        model.add(joint)
        motor = osimlite.CoordinateActuator(
            name=f"tau{index}", coordinate=f"q{index}", optimal_force=1.0
        )
        motor.min_control = -40.0
        motor.max_control = 40.0
        model.add(motor)
        parent = body.path
    return model


def write_marker_study(folder: Path, _: Path) -> None:
    """Write a study in which a double pendulum tracks the positions of two markers."""
    model = make_double_pendulum()
    times = np.arange(101) / 100
    # Angles of both links to the x axis (rad).
    first = 0.5 * np.pi * times
    second = 0.75 * np.pi * times
    near = np.stack([np.cos(first), np.sin(first), 0 * times], axis=1)
    far = near + np.stack([np.cos(second), np.sin(second), 0 * times], axis=1)
    write_trc(folder / "markers.trc", times.tolist(), ("m0", "m1"), np.hstack([near, far]))
    reference = osimlite.MarkersReference(marker_file="markers.trc")
    for name, weight in (("m0", 100.0), ("m1", 10.0)):
        reference.marker_weights.objects.append(osimlite.MarkerWeight(name=name, weight=weight))
    phase = _make_phase(0.0, 1.0)
    phase.goals = [osimlite.MocoMarkerTrackingGoal(name="markers", markers_reference=reference)]
    # Without exact second derivatives neither program converges. Moco computes them by differences,
    # and takes more than six minutes for the 50 intervals of opensim-core's example.
    _write_study(folder, model, phase, num_mesh_intervals=10, optim_hessian_approximation="exact")


def track_walking(intervals: int) -> StudyWriter:
    """Return the writer of a study of 2-D walking that tracks a measured gait.

    The model has contact forces, and the step is symmetric.

    Args:
        intervals: number of mesh intervals.
    """

    def write_study(folder: Path, core: Path) -> None:
        names = ("2D_gait.osim", "referenceCoordinates.sto", "referenceGRF.sto", "referenceGRF.xml")
        copy_sources(core, WALKING, names, folder)
        tool = osimlite.MocoTrack(
            name="gait",
            model=osimlite.ModelProcessor(filepath="2D_gait.osim"),
            states_reference=osimlite.TableProcessor(
                filepath="referenceCoordinates.sto", operators=[_make_lowpass()]
            ),
            allow_unused_references=True,
            track_reference_position_derivatives=True,
            # The measured motion is a better guess than the middle of the bounds.
            apply_tracked_states_to_guess=True,
            initial_time=0.0,
            final_time=STEP_DURATION_S,
            mesh_interval=STEP_DURATION_S / intervals,
            control_effort_weight=10.0,
        )
        osimlite.write(tool, folder / "track.xml")
        study = osimlite.read_document(_unpack("track.omoco", folder, "more.omoco"))
        phase = study.problem.phases
        # The tool has the model; the study only adds to it.
        phase.model = osimlite.ModelProcessor(name="model")
        # The first two goals are those that the tool makes.
        phase.goals = phase.goals[2:4]
        for name, value in (SOLVER_TOLERANCES | {"optim_max_iterations": 1000}).items():
            setattr(study.solver, name, value)
        osimlite.write(study, folder / "more.omoco")

    return write_study


def write_walking_3d_study(folder: Path, core: Path) -> None:
    """Write a study of periodic 3-D walking with 80 muscles that tracks measured angles.

    It is exampleMocoTrack of opensim-core.

    Args:
        folder: folder for the files.
        core: sources of opensim-core.
    """
    paths_file = "subject_walk_scaled_FunctionBasedPathSet.xml"
    model_file = "subject_walk_scaled.osim"
    names = (model_file, paths_file, "coordinates.sto", "grf_walk.xml", "grf_walk.mot")
    copy_sources(core, WALKING_3D, names, folder)
    model = osimlite.modify(
        osimlite.read(folder / model_file),
        osimlite.ModOpReplaceJointsWithWelds(joint_paths=("mtp_r", "mtp_l")),
        # A path is absolute where no setup file gives the folder.
        osimlite.ModOpAddExternalLoads(filepath=str(folder / "grf_walk.xml")),
    )
    weights = add_residual_actuators(model)
    model = osimlite.modify(
        model,
        osimlite.ModOpIgnoreTendonCompliance(),
        osimlite.ModOpReplaceMusclesWithDeGrooteFregly2016(),
        osimlite.ModOpIgnorePassiveFiberForcesDGF(),
        osimlite.ModOpScaleActiveFiberForceCurveWidthDGF(scale_factor=1.5),
        osimlite.ModOpReplacePathsWithFunctionBasedPaths(paths_file=str(folder / paths_file)),
    )
    osimlite.write(model, folder / "model.osim")
    tool = osimlite.MocoTrack(
        name="walk",
        model=osimlite.ModelProcessor(filepath="model.osim"),
        states_reference=osimlite.TableProcessor(filepath="coordinates.sto"),
        allow_unused_references=True,
        track_reference_position_derivatives=True,
        initial_time=0.48,
        final_time=1.61,
        mesh_interval=0.02,
        control_effort_weight=0.1,
        controls_weight_set=osimlite.MocoWeightSet(name="controls_weight_set", objects=weights),
    )
    osimlite.write(tool, folder / "track.xml")
    problem = osimlite.MocoProblem(
        name="problem",
        phases=osimlite.MocoPhase(name="phases", goals=[make_periodicity_goal(model, folder)]),
    )
    solver = osimlite.MocoCasADiSolver(
        optim_convergence_tolerance=1e-3, optim_constraint_tolerance=1e-4, optim_max_iterations=1000
    )
    study = osimlite.MocoStudy(name="more", problem=problem, solver=solver)
    osimlite.write(study, folder / "more.omoco")


def add_residual_actuators(model: osimlite.Model) -> list[osimlite.MocoWeight]:
    """Add an actuator to each coordinate of the pelvis, and return their weights in the effort.

    OpenSim's ModOpAddResiduals does the same, but OpenSim 4.6 cannot read it from a file.
    """
    pelvis: osimlite.CustomJoint = model.find("/jointset/ground_pelvis")
    weights = []
    for coordinate in pelvis.coordinates:
        name = f"residual_jointset_ground_pelvis_{coordinate.name}"
        is_translation = coordinate.name[-3:] in ("_tx", "_ty", "_tz")
        actuator = osimlite.CoordinateActuator(
            name=name,
            coordinate=coordinate.name,
            optimal_force=RESIDUAL_FORCE_N if is_translation else RESIDUAL_TORQUE_N_M,
        )
        actuator.min_control = -1.0
        actuator.max_control = 1.0
        model.force_set.objects.append(actuator)
        weights.append(osimlite.MocoWeight(name=f"/forceset/{name}", weight=RESIDUAL_WEIGHT))
    return weights


def make_periodicity_goal(model: osimlite.Model, folder: Path) -> osimlite.MocoPeriodicityGoal:
    """Make a goal by which all states and controls are equal at both ends.

    Args:
        model: model of the study.
        folder: folder of the model's files.
    """
    functions = osimlite.casadi(model, folder=folder)
    goal = osimlite.MocoPeriodicityGoal(name="periodicity")
    for pairs, names in (
        (goal.state_pairs, functions.states),
        (goal.control_pairs, functions.controls),
    ):
        pairs += [
            osimlite.MocoPeriodicityGoalPair(initial_variable=name, final_variable=name)
            for name in names
            # The walker moves forward.
            if "_tx/value" not in name
        ]
    return goal


def predict_walking(intervals: int) -> StudyWriter:
    """Return the writer of a study that predicts 2-D walking with little effort.

    The initial guess is Moco's solution of the tracking study.

    Args:
        intervals: number of mesh intervals.
    """

    def write_study(folder: Path, core: Path) -> None:
        copy_sources(core, WALKING, ("2D_gait.osim",), folder)
        _unpack("track_25.sto", folder, "guess.sto")
        study = osimlite.read_document(MOCO / "predict.omoco")
        study.solver.num_mesh_intervals = intervals
        # Both programs start from the same guess.
        study.solver.guess_file = "guess.sto"
        osimlite.write(study, folder / "study.omoco")

    return write_study


def write_squat_inverse(folder: Path, _: Path) -> None:
    """Write MocoInverse of a squat with nine muscles with implicit tendon dynamics."""
    saved_study = osimlite.read_document(_unpack("squat_inverse-20.omoco", folder, "kept.omoco"))
    model = saved_study.problem.phases.model.model
    # The saved study has only six digits of the motion; the tool reads the motion from a table.
    for motion in list(model.components(osimlite.PositionMotion)):
        model.remove(motion)
    osimlite.write(model, folder / "model.osim")
    _unpack("squat-25.sto", folder, "squat.sto")
    tool = osimlite.MocoInverse(
        model=osimlite.ModelProcessor(filepath="model.osim"),
        kinematics=osimlite.TableProcessor(filepath="squat.sto", operators=[_make_lowpass()]),
        initial_time=0.0,
        final_time=1.0,
        mesh_interval=0.05,
        minimize_sum_squared_activations=True,
        **INVERSE_SETTINGS,
    )
    osimlite.write(tool, folder / "inverse.xml")


def write_gait_inverse(folder: Path, core: Path) -> None:
    """Write MocoInverse of a measured gait with 18 muscles with implicit tendon dynamics."""
    copy_sources(core, TESTS, GAIT, folder)
    osimlite.write(make_gait_inverse(), folder / "inverse.xml")


def make_gait_inverse() -> osimlite.MocoInverse:
    """Make MocoInverse of a measured gait with 18 muscles, for the folder of the files `GAIT`."""
    model_file, coordinates_file, loads_file, _ = GAIT
    operators = [
        osimlite.ModOpReplaceJointsWithWelds(
            joint_paths=("subtalar_r", "subtalar_l", "mtp_r", "mtp_l")
        ),
        osimlite.ModOpReplaceMusclesWithDeGrooteFregly2016(),
        osimlite.ModOpIgnorePassiveFiberForcesDGF(),
        osimlite.ModOpTendonComplianceDynamicsModeDGF(mode="implicit"),
        osimlite.ModOpAddExternalLoads(filepath=loads_file),
    ]
    return osimlite.MocoInverse(
        name="gait",
        model=osimlite.ModelProcessor(filepath=model_file, operators=operators),
        kinematics=osimlite.TableProcessor(filepath=coordinates_file, operators=[_make_lowpass()]),
        initial_time=0.45,
        final_time=1.0,
        mesh_interval=0.025,
        **INVERSE_SETTINGS,
    )


STUDIES: dict[str, StudyWriter] = {
    "sliding mass": get_saved_study("sliding-100"),
    "hanging muscle": get_saved_study("hanging-25"),
    "pendulum": get_saved_study("pendulum-50"),
    "constraints": write_parabola_study,
    "markers": write_marker_study,
    "squat": get_saved_study("squat-25"),
    "squat inverse": write_squat_inverse,
    "gait inverse": write_gait_inverse,
    "walking": track_walking(25),
    "predicted": predict_walking(10),
}
"""Writers of the studies that both programs solve in minutes, by name."""

LONG = {"walking 3d": write_walking_3d_study}
"""Writers of the studies that take Moco most of an hour, by name."""
