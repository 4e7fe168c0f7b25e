"""Small study on a chain of links with everything that goals can require, which is built quickly."""

from __future__ import annotations

import numpy as np

import osimlite
from osimlite.io.tables.storage import write_sto
from osimlite.io.tables.writers import write_trc

BODIES = "/bodyset/b0", "/bodyset/b1"
TIMES = np.linspace(0.0, 1.0, 12)


def links(*muscles, count=2):
    """Return a model of links on hinges with motors, markers, spheres above a floor, and muscles.

    Args:
        muscles: tendon mode of each muscle.
        count: number of links.
    """
    model = osimlite.Model(name="links")
    inertia, parent = (0.1, 0.2, 0.3, 0.0, 0.0, 0.0), "/ground"
    floor = osimlite.ContactHalfSpace(
        name="floor",
        socket_frame="/ground",
        location=(0.0, -0.6, 0.0),
        orientation=(0.0, 0.0, -np.pi / 2),
    )
    model.add(floor)
    for k in range(count):
        body = osimlite.Body(
            name=f"b{k}", mass=1.0 + k, mass_center=(-0.5, 0.02 * k, 0.01), inertia=inertia
        )
        model.add(body)
        joint = osimlite.PinJoint(
            name=f"j{k}", socket_child_frame="offset", socket_parent_frame=parent
        )
        joint.frames.append(
            osimlite.PhysicalOffsetFrame(
                name="offset", socket_parent=f"/bodyset/b{k}", translation=(-1.0, 0.0, 0.1)
            )
        )
        joint.coordinates[0].name = f"q{k}"
        model.add(joint)
        ball = osimlite.ContactSphere(name=f"ball{k}", socket_frame=f"/bodyset/b{k}", radius=0.1)
        model.add(ball)
        model.add(
            osimlite.CoordinateActuator(name=f"motor{k}", coordinate=f"q{k}", optimal_force=10.0)
        )
        contact = osimlite.SmoothSphereHalfSpaceForce(
            name=f"contact{k}",
            socket_sphere=ball.path,
            socket_half_space=floor.path,
            stiffness=1e4,
            dissipation=0.5,
            static_friction=0.8,
            dynamic_friction=0.6,
            viscous_friction=0.1,
            transition_velocity=0.5,
            hertz_smoothing=5.0,
            hunt_crossley_smoothing=5.0,
        )
        model.add(contact)
        parent = f"/bodyset/b{k}"
    for frame, name in zip(BODIES, ("elbow", "tip"), strict=True):
        model.add(osimlite.Marker(name=name, socket_parent_frame=frame, location=(0.1, 0.05, 0.02)))
    for k, mode in enumerate(muscles):
        muscle = osimlite.DeGrooteFregly2016Muscle(
            name=f"muscle{k}",
            max_isometric_force=30.0,
            optimal_fiber_length=0.4,
            tendon_slack_length=0.3,
            pennation_angle_at_optimal=0.2,
            fiber_damping=0.1,
            ignore_tendon_compliance=mode == "rigid",
            tendon_compliance_dynamics_mode="implicit" if mode == "implicit" else "explicit",
        )
        path = osimlite.GeometryPath(name="path")
        ends = ("/ground", (0.0, 0.7, 0.0)), (BODIES[0], (-0.8 + 0.1 * k, 0.05, 0.0))
        for frame, place in ends:
            path.path_point_set.objects.append(
                osimlite.PathPoint(
                    name=f"p{len(path.path_point_set.objects)}",
                    socket_parent_frame=frame,
                    location=place,
                )
            )
        muscle.geometry_path = path
        model.add(muscle)
    return model


def coupled(model, *coordinates):
    """Add couplers to the model, by which the named angles depend on the first one; return the model."""
    for number, name in enumerate(coordinates):
        function = osimlite.PolynomialFunction(coefficients=(0.3, 0.5 - number, 0.1))
        model.add(
            osimlite.CoordinateCouplerConstraint(
                name=f"coupler{number}",
                independent_coordinate_names=("q0",),
                dependent_coordinate_name=name,
                coupled_coordinates_function=function,
            )
        )
    return model


def tied(model):
    """Add a constraint that keeps a point at a distance; return the model."""
    model.add(
        osimlite.ConstantDistanceConstraint(
            name="rope",
            socket_body_1="/ground",
            socket_body_2=BODIES[1],
            location_body_1=(0.0, 2.0, 0.5),
            location_body_2=(0.1, 0.0, 0.0),
            constant_distance=2.5,
        )
    )
    return model


def study_of(model, *goals, constraints=(), **solver):
    """Return a study of the model over about a second, on a mesh of two intervals.

    Args:
        model: the model.
        goals: goals of the study.
        constraints: path constraints.
        solver: properties of the solver.
    """
    phase = osimlite.MocoPhase(
        name="phases", model=osimlite.ModelProcessor(name="model", model=model)
    )
    phase.time_initial_bounds = osimlite.MocoInitialBounds(bounds=(0.0, 0.2))
    phase.time_final_bounds = osimlite.MocoFinalBounds(bounds=(0.6, 0.9))
    endings = ("activation", 0.3, 0.7), ("normalized_tendon_force", 0.2, 0.6)
    for ending, low, high in (
        endings if any(model.components(osimlite.DeGrooteFregly2016Muscle)) else ()
    ):
        info = osimlite.MocoVariableInfo(name=f".*/{ending}", bounds=(low, high))
        phase.state_infos_pattern.append(info)
    phase.control_infos_pattern.append(osimlite.MocoVariableInfo(name=".*", bounds=(0.1, 0.9)))
    phase.goals, phase.path_constraints = [*goals], [*constraints]
    choices = {"num_mesh_intervals": 2, "optim_hessian_approximation": "exact"} | solver
    problem = osimlite.MocoProblem(name="problem", phases=phase)
    return osimlite.MocoStudy(
        name="small", problem=problem, solver=osimlite.MocoCasADiSolver(**choices)
    )


def tables(folder):
    """Write tables of references that goals can track into a folder."""
    t = TIMES
    motion = {
        "/jointset/j0/q0/value": 0.5 * np.sin(2 * t),
        "/jointset/j0/q0/speed": np.cos(2 * t),
        "/jointset/j1/q1/value": 0.3 * t,
        "/jointset/j1/q1/speed": np.full(len(t), 0.3),
    }
    swing = np.stack([np.sin(2 * t), 0.5 * t, 0.1 * t * t, np.cos(3 * t), t, 0.2 * t], axis=1)
    write_sto(folder / "motion.sto", "", t, tuple(motion), np.column_stack([*motion.values()]))
    write_sto(
        folder / "controls.sto", "", t, ("/forceset/motor0", "/forceset/motor1"), 0.2 + swing[:, :2]
    )
    write_sto(folder / "vectors.sto", "", t, BODIES, swing, kind="Vec3")
    half = np.stack([np.cos(t), 0 * t, 0.3 * t, np.sin(t)], axis=1)
    write_sto(
        folder / "turns.sto",
        "",
        t,
        BODIES,
        np.hstack([half, half[:, [0, 2, 1, 3]]]),
        kind="Quaternion",
    )
    write_sto(folder / "moments.sto", "", t, ("q0_moment", "q1_moment"), swing[:, :2])
    columns = [f"{what}_{axis}" for what in "fp" for axis in "xyz"]
    write_sto(
        folder / "loads.sto", "", t, columns, np.hstack([20.0 * swing[:, 1:4], 0.1 * swing[:, :3]])
    )
    force = osimlite.ExternalForce(
        name="foot", applied_to_body="b1", force_identifier="f_", point_identifier="p_"
    )
    loads = osimlite.ExternalLoads(name="loads", datafile="loads.sto")
    loads.objects.append(force)
    osimlite.write(loads, folder / "loads.xml")
    write_trc(folder / "markers.trc", t.tolist(), ("tip", "elbow"), (0.1 + swing).tolist())
