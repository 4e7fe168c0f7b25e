"""Studies that osimlite and Moco 4.6 both solve: each maker writes files that both read into a folder.

A folder has either ``study.omoco``, or ``track.xml`` or ``inverse.xml`` of a tool, and goals and
bounds that are added to what the tool makes in ``more.omoco``.
"""

from __future__ import annotations

import gzip
import math
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np

import osimlite
from osimlite.io.tables.writers import write_trc

MOCO = Path(__file__).resolve().parents[2] / "shared/oracle/moco"
CORE = Path(__file__).resolve().parents[2] / "pub-opensim-core"
WALKING_3D = "OpenSim/Examples/Moco/example3DWalking"
WALKING = "OpenSim/Examples/Moco/example2DWalking"
TESTS = "OpenSim/Moco/Test"
GAIT = ("subject_walk_armless_18musc.osim", "subject_walk_armless_coordinates.mot",
        "subject_walk_armless_external_loads.xml", "subject_walk_armless_grfs.mot")  # fmt: skip
TIGHT = {"optim_convergence_tolerance": 1e-4, "optim_constraint_tolerance": 1e-4}


def _unpacked(name: str, folder: Path, to: str) -> Path:
    path = folder / to
    path.write_bytes(gzip.decompress((MOCO / f"{name}.gz").read_bytes()))
    return path


def kept(name: str) -> Callable[[Path, Path], None]:
    """A study that is kept with what Moco said of it."""
    return lambda folder, _: (_unpacked(f"{name}.omoco", folder, "study.omoco"), None)[1]


def sources(core: Path, part: str, names: tuple[str, ...], folder: Path) -> None:
    """Copy files of opensim-core, which is a folder or a git directory."""
    if not core.is_dir():
        raise SystemExit(
            f"there is no folder {core}: name the sources of opensim-core by --core FOLDER"
        )
    for name in names:
        if (core / "objects").is_dir():
            command = ["git", f"--git-dir={core}", "show", f"HEAD:{part}/{name}"]
            (folder / name).write_bytes(
                subprocess.run(command, check=True, capture_output=True).stdout
            )
        else:
            shutil.copy(core / part / name, folder)


def _study(
    folder: Path, model: osimlite.Model, phase: osimlite.MocoPhase, **solver: object
) -> None:
    osimlite.write(model, folder / "model.osim")
    phase.model = osimlite.ModelProcessor(name="model", filepath="model.osim")
    problem = osimlite.MocoProblem(name="problem", phases=phase)
    study = osimlite.MocoStudy(
        name="study", problem=problem, solver=osimlite.MocoCasADiSolver(**solver)
    )
    osimlite.write(study, folder / "study.omoco")


def _between(start: float, end: float) -> osimlite.MocoPhase:
    return osimlite.MocoPhase(
        name="phases",
        time_initial_bounds=osimlite.MocoInitialBounds(bounds=(start,)),
        time_final_bounds=osimlite.MocoFinalBounds(bounds=(end,)),
    )


def parabola(folder: Path, _: Path) -> None:
    """A point mass slides down a parabola: the only constraint of the model, and nothing is made small."""
    model = osimlite.Model(name="planar_point_mass")
    parent = "/ground"
    for name, mass, turn in (("tx", 0.0, 0.0), ("ty", 1.0, 0.5 * math.pi)):
        body = osimlite.Body(
            name=f"body_{name}", mass=mass, mass_center=(0.0, 0.0, 0.0), inertia=(0.0,) * 6
        )
        model.add(body)
        joint = osimlite.SliderJoint(
            name=name, socket_parent_frame="before", socket_child_frame="after"
        )
        for frame, owner in (("before", parent), ("after", body.path)):
            joint.frames.append(
                osimlite.PhysicalOffsetFrame(
                    name=frame, socket_parent=owner, orientation=(0.0, 0.0, turn)
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
    phase = _between(0.0, 0.8)
    phase.default_speed_bounds = osimlite.MocoBounds(bounds=(-5.0, 5.0))
    for name, start in (("tx", -1.0), ("ty", 1.0)):
        path = f"/jointset/{name}/{name}/value"
        phase.state_infos.append(
            osimlite.MocoVariableInfo(name=path, bounds=(-2.0, 2.0), initial_bounds=(start,))
        )
    _study(folder, model, phase)


def markers(folder: Path, _: Path) -> None:
    """Two links whose markers are followed."""
    model, parent = osimlite.Model(name="double_pendulum"), "/ground"
    for k in range(2):
        body = osimlite.Body(
            name=f"b{k}", mass=1.0, mass_center=(0.0,) * 3, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
        )
        model.add(body)
        model.add(osimlite.Marker(name=f"m{k}", socket_parent_frame=body.path))
        joint = osimlite.PinJoint(
            name=f"j{k}", socket_parent_frame=parent, socket_child_frame="end"
        )
        joint.frames.append(
            osimlite.PhysicalOffsetFrame(
                name="end", socket_parent=body.path, translation=(-1.0, 0.0, 0.0)
            )
        )
        joint.coordinates[0].name, joint.coordinates[0].range = f"q{k}", (-10.0, 10.0)
        model.add(joint)
        motor = osimlite.CoordinateActuator(name=f"tau{k}", coordinate=f"q{k}", optimal_force=1.0)
        motor.min_control, motor.max_control = -40.0, 40.0
        model.add(motor)
        parent = body.path
    times = np.arange(101) / 100
    first, second = 0.5 * np.pi * times, 0.75 * np.pi * times
    near = np.stack([np.cos(first), np.sin(first), 0 * times], axis=1)
    far = near + np.stack([np.cos(second), np.sin(second), 0 * times], axis=1)
    write_trc(folder / "markers.trc", times.tolist(), ("m0", "m1"), np.hstack([near, far]))
    reference = osimlite.MarkersReference(marker_file="markers.trc")
    for name, weight in (("m0", 100.0), ("m1", 10.0)):
        reference.marker_weights.objects.append(osimlite.MarkerWeight(name=name, weight=weight))
    phase = _between(0.0, 1.0)
    phase.goals = [osimlite.MocoMarkerTrackingGoal(name="markers", markers_reference=reference)]
    # Without the second derivatives neither ends; Moco takes them by differences, and more than six
    # minutes for the 50 intervals of opensim-core's example.
    _study(folder, model, phase, num_mesh_intervals=10, optim_hessian_approximation="exact")


def track(intervals: int) -> Callable[[Path, Path], None]:
    """2-D walking after a measured gait, with contact forces and symmetry."""

    def make(folder: Path, core: Path) -> None:
        names = "2D_gait.osim", "referenceCoordinates.sto", "referenceGRF.sto", "referenceGRF.xml"
        sources(core, WALKING, names, folder)
        lowpass = osimlite.TabOpLowPassFilter(cutoff_frequency=6.0)
        tool = osimlite.MocoTrack(
            name="gait",
            model=osimlite.ModelProcessor(filepath="2D_gait.osim"),
            states_reference=osimlite.TableProcessor(
                filepath="referenceCoordinates.sto", operators=[lowpass]
            ),
            allow_unused_references=True,
            track_reference_position_derivatives=True,
            apply_tracked_states_to_guess=True,
            initial_time=0.0,
            final_time=0.470089,
            mesh_interval=0.470089 / intervals,
            control_effort_weight=10.0,
        )
        osimlite.write(tool, folder / "track.xml")
        study = osimlite.read_document(_unpacked("track.omoco", folder, "more.omoco"))
        phase = study.problem.phases
        phase.model, phase.goals = osimlite.ModelProcessor(name="model"), phase.goals[2:4]
        for name, value in (TIGHT | {"optim_max_iterations": 1000}).items():
            setattr(study.solver, name, value)
        osimlite.write(study, folder / "more.omoco")

    return make


def walk3d(folder: Path, core: Path) -> None:
    """3-D walking with 80 muscles that follows measured angles and repeats itself: opensim-core's exampleMocoTrack."""
    paths = "subject_walk_scaled_FunctionBasedPathSet.xml"
    names = "subject_walk_scaled.osim", paths, "coordinates.sto", "grf_walk.xml", "grf_walk.mot"
    sources(core, WALKING_3D, names, folder)
    model = osimlite.modify(
        osimlite.read(folder / names[0]),
        osimlite.ModOpReplaceJointsWithWelds(joint_paths=("mtp_r", "mtp_l")),
        osimlite.ModOpAddExternalLoads(filepath=str(folder / "grf_walk.xml")),
    )
    # What ModOpAddResiduals does, which OpenSim 4.6 reads from no file.
    pelvis: osimlite.CustomJoint = model.find("/jointset/ground_pelvis")
    weights = []
    for coordinate in pelvis.coordinates:
        name = f"residual_jointset_ground_pelvis_{coordinate.name}"
        force = 50.0 if coordinate.name[-3:] in ("_tx", "_ty", "_tz") else 250.0
        actuator = osimlite.CoordinateActuator(
            name=name, coordinate=coordinate.name, optimal_force=force
        )
        actuator.min_control, actuator.max_control = -1.0, 1.0
        model.force_set.objects.append(actuator)
        weights.append(osimlite.MocoWeight(name=f"/forceset/{name}", weight=10.0))
    model = osimlite.modify(
        model,
        osimlite.ModOpIgnoreTendonCompliance(),
        osimlite.ModOpReplaceMusclesWithDeGrooteFregly2016(),
        osimlite.ModOpIgnorePassiveFiberForcesDGF(),
        osimlite.ModOpScaleActiveFiberForceCurveWidthDGF(scale_factor=1.5),
        osimlite.ModOpReplacePathsWithFunctionBasedPaths(paths_file=str(folder / paths)),
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
    functions = osimlite.casadi(model, folder=folder)
    repeats = osimlite.MocoPeriodicityGoal(name="periodicity")
    for pairs, known in (
        (repeats.state_pairs, functions.states),
        (repeats.control_pairs, functions.controls),
    ):
        repeated = (name for name in known if "_tx/value" not in name)
        pairs += [
            osimlite.MocoPeriodicityGoalPair(initial_variable=name, final_variable=name)
            for name in repeated
        ]
    more = osimlite.MocoProblem(
        name="problem", phases=osimlite.MocoPhase(name="phases", goals=[repeats])
    )
    solver = osimlite.MocoCasADiSolver(
        optim_convergence_tolerance=1e-3, optim_constraint_tolerance=1e-4, optim_max_iterations=1000
    )
    osimlite.write(
        osimlite.MocoStudy(name="more", problem=more, solver=solver), folder / "more.omoco"
    )


def predict(intervals: int) -> Callable[[Path, Path], None]:
    """2-D walking with little effort, from Moco's solution of the one above."""

    def make(folder: Path, core: Path) -> None:
        sources(core, WALKING, ("2D_gait.osim",), folder)
        _unpacked("track_25.sto", folder, "guess.sto")
        study = osimlite.read_document(MOCO / "predict.omoco")
        study.solver.num_mesh_intervals, study.solver.guess_file = intervals, "guess.sto"
        osimlite.write(study, folder / "study.omoco")

    return make


def squat_inverse(folder: Path, _: Path) -> None:
    """What nine muscles with implicit tendons do in a squat; the study that is kept has six digits of the motion."""
    model = osimlite.read_document(
        _unpacked("squat_inverse-20.omoco", folder, "kept.omoco")
    ).problem.phases.model.model
    for motion in list(model.components(osimlite.PositionMotion)):
        model.remove(motion)
    osimlite.write(model, folder / "model.osim")
    _unpacked("squat-25.sto", folder, "squat.sto")
    lowpass = osimlite.TabOpLowPassFilter(cutoff_frequency=6.0)
    tool = osimlite.MocoInverse(
        model=osimlite.ModelProcessor(filepath="model.osim"),
        kinematics=osimlite.TableProcessor(filepath="squat.sto", operators=[lowpass]),
        initial_time=0.0,
        final_time=1.0,
        mesh_interval=0.05,
        minimize_sum_squared_activations=True,
        **_LOOSE,
    )
    osimlite.write(tool, folder / "inverse.xml")


def gait_inverse(folder: Path, core: Path) -> None:
    """What 18 muscles with implicit tendons do in a measured gait."""
    sources(core, TESTS, GAIT, folder)
    osimlite.write(gait_tool(), folder / "inverse.xml")


def gait_tool() -> osimlite.MocoInverse:
    """MocoInverse of a measured gait with 18 muscles, in the folder of `GAIT`."""
    model, coordinates, loads, _ = GAIT
    operators = [
        osimlite.ModOpReplaceJointsWithWelds(
            joint_paths=("subtalar_r", "subtalar_l", "mtp_r", "mtp_l")
        ),
        osimlite.ModOpReplaceMusclesWithDeGrooteFregly2016(),
        osimlite.ModOpIgnorePassiveFiberForcesDGF(),
        osimlite.ModOpTendonComplianceDynamicsModeDGF(mode="implicit"),
        osimlite.ModOpAddExternalLoads(filepath=loads),
    ]
    lowpass = osimlite.TabOpLowPassFilter(cutoff_frequency=6.0)
    return osimlite.MocoInverse(
        name="gait",
        model=osimlite.ModelProcessor(filepath=model, operators=operators),
        kinematics=osimlite.TableProcessor(filepath=coordinates, operators=[lowpass]),
        initial_time=0.45,
        final_time=1.0,
        mesh_interval=0.025,
        **_LOOSE,
    )


_LOOSE = {
    "kinematics_allow_extra_columns": True,
    "convergence_tolerance": 1e-4,
    "constraint_tolerance": 1e-4,
}
STUDIES: dict[str, Callable[[Path, Path], None]] = {
    "sliding mass": kept("sliding-100"),
    "hanging muscle": kept("hanging-25"),
    "pendulum": kept("pendulum-50"),
    "constraints": parabola,
    "markers": markers,
    "squat": kept("squat-25"),
    "squat inverse": squat_inverse,
    "gait inverse": gait_inverse,
    "walking": track(25),
    "predicted": predict(10),
}
LONG = {"walking 3d": walk3d}
"""Those that Moco takes most of an hour for."""
