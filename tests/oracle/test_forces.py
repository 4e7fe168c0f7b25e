"""Accelerations, force records and energies of every force element against a live OpenSim 4.6."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite import Body, ContactHalfSpace, ContactSphere, Coordinate, HuntCrossleyForce, Model
from osimlite.multibody import build_mechanism
from osimlite.schema.actuators import (
    BodyActuator,
    CoordinateActuator,
    PointActuator,
    PointToPointActuator,
    TorqueActuator,
)
from osimlite.schema.contact import ContactEllipsoid
from osimlite.schema.contact_forces import SmoothSphereHalfSpaceForce
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.frames import PhysicalOffsetFrame
from osimlite.schema.functions import Constant, LinearFunction, PolynomialFunction, SimmSpline, Sine
from osimlite.schema.path_forces import Blankevoort1991Ligament, ExpressionBasedPathForce, Ligament, PathSpring
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.schema.prescribed import PrescribedForce
from osimlite.schema.springs import (
    BushingForce,
    ExpressionBasedBushingForce,
    ExpressionBasedCoordinateForce,
    ExpressionBasedPointToPointForce,
    FunctionBasedBushingForce,
    PointToPointSpring,
    SpringGeneralizedForce,
)
from osimlite.simulation.elements import force_elements

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytest.importorskip("pybullet", reason="needs pybullet (extra 'sim')")
pytestmark = pytest.mark.oracle

TIME = 0.37
STATES = 4
JOINTS = {
    "free, ball, pin": ("FreeJoint", "BallJoint", "PinJoint"),
    "pin, slider, universal": ("PinJoint", "SliderJoint", "UniversalJoint"),
}


def carrier(kinds) -> Model:
    """Three bodies in a row, each on a joint of another kind and with a frame of its own."""
    model = Model(name="carrier")
    below = model.ground
    for number, kind in enumerate(kinds):
        body = model.add(
            Body(
                name=f"b{number}",
                mass=1.0 + number,
                mass_center=(0.05, -0.1, 0.02),
                inertia=(0.2, 0.3, 0.25, 0.01, -0.02, 0.03),
            )
        )
        body.subcomponents.append(
            PhysicalOffsetFrame(
                name=f"f{number}",
                socket_parent="..",
                translation=(0.1, -0.05, 0.2),
                orientation=(0.3, -0.4, 0.2 + number),
            )
        )
        joint = getattr(osimlite, kind)(name=f"j{number}")
        for place, coordinate in enumerate(joint.coordinates):
            coordinate.name = f"q{number}_{place}"
        at, turned = (0.1, 0.2 * number, -0.05), (0.3, -0.2, 0.1)
        model.add(joint.between(below, body, at=at, turned=turned, child_at=(0, 0.1, 0.03), child_turned=(0.1, 0, 1)))
        below = body
    return model


def compare(model, tmp_path, *, counted=1, tolerance=1e-9):
    """Accelerations, records with their labels, and energy at some states.

    `counted` says how often OpenSim counts the energy of the forces; None if it has an energy of its own. Returns how
    many numbers of the records differ from zero.
    """
    busy = 0
    from osimlite.simulation.engines.bullet import BulletEngine

    opensim.Logger.setLevelString("off")
    osimlite.write(model, tmp_path / "model.osim")
    theirs = opensim.Model(str(tmp_path / "model.osim"))
    state = theirs.initSystem()
    mechanism = build_mechanism(model)
    names = mechanism.coordinate_names
    rng = np.random.default_rng(7)
    with BulletEngine(mechanism, force_elements(model, mechanism)) as engine:
        for _ in range(STATES):
            q, u = rng.uniform(-0.9, 0.9, len(names)), rng.uniform(-2.0, 2.0, len(names))
            for place, info in enumerate(mechanism.coordinates):
                if info.locked:
                    q[place], u[place] = info.default_value, 0.0
            for name, value, speed in zip(names, q, u, strict=True):
                coordinate = theirs.updCoordinateSet().get(name)
                if not coordinate.getLocked(state):
                    coordinate.setValue(state, value, False)
                    coordinate.setSpeedValue(state, speed)
            state.setTime(TIME)
            theirs.realizeAcceleration(state)
            expected = [theirs.getCoordinateSet().get(name).getAccelerationValue(state) for name in names]
            ours = engine.acceleration(TIME, q.tolist(), u.tolist())
            scale = max(1.0, np.abs(expected).max())
            assert np.abs(np.subtract(ours, expected)).max() <= tolerance * scale
            labels, values = [], []
            forces = theirs.getForceSet()
            for number in range(forces.getSize()):
                found, row = forces.get(number).getRecordLabels(), forces.get(number).getRecordValues(state)
                labels += [found.get(place) for place in range(found.getSize())]
                values += [row.get(place) for place in range(found.getSize())]
            busy += np.count_nonzero(values)
            y = engine.state.pack(q, u)
            assert list(engine.columns) == labels
            recorded = engine.force_records(TIME, y)
            assert recorded == pytest.approx(values, rel=tolerance, abs=tolerance * max(1.0, *map(abs, [0, *values])))
            if counted is not None:
                kinetic, gravity, stored = engine.energies(TIME, y)
                assert kinetic == pytest.approx(theirs.calcKineticEnergy(state), rel=1e-10)
                total = theirs.calcPotentialEnergy(state)
                assert gravity + counted * stored == pytest.approx(total, rel=1e-9, abs=1e-9)
    return busy


@pytest.fixture(params=list(JOINTS.values()), ids=list(JOINTS))
def model(request):
    return carrier(request.param)


def test_spring_on_a_coordinate(model, tmp_path):
    for name, k in (("q0_0", 30.0), ("q1_0", 20.0), ("q2_0", 10.0)):
        model.add(SpringGeneralizedForce(name=f"on_{name}", coordinate=name, stiffness=k, rest_length=0.2, viscosity=3))
    # OpenSim counts no energy for this spring.
    compare(model, tmp_path, counted=0)


def test_spring_between_points(model, tmp_path):
    b0, b2 = (body for body in model.components(Body) if body.name in ("b0", "b2"))
    model.add(
        PointToPointSpring(
            name="far", socket_body1=model.ground, socket_body2=b2, point1=(1, 2, 3), stiffness=40.0, rest_length=0.5
        ),
        PointToPointSpring(
            name="near", socket_body1=b0, socket_body2=b2, point1=(0.1, 0.2, 0.3), point2=(0, -0.3, 0), stiffness=90.0
        ),
    )
    compare(model, tmp_path)


def test_spring_between_points_of_frames(model, tmp_path):
    model.add(
        PointToPointSpring(
            name="framed",
            socket_body1="/bodyset/b0/f0",
            socket_body2="/bodyset/b2/f2",
            point1=(0.1, 0.2, 0.3),
            point2=(0, -0.3, 0),
            stiffness=90.0,
        )
    )
    compare(model, tmp_path)


@pytest.mark.parametrize(
    "expression",
    [
        "-3*q - 0.5*qdot^3",
        "10*exp(-2*q)*(1 - tanh(qdot))/(1+q^2)",
        "-q^2 + 2^-q - (-1)^3*qdot/-2*3 - 2^3^0.5",
        "a*b; a = step(q)*min(q, qdot) + abs(q); b = square(qdot)+cube(q)+recip(3+q)+c; c = max(q,0.1)+delta(q)",
        "sin(q)+cos(q)+tan(q)+sec(q)+csc(q)+cot(q)+asin(q)+acos(q)+atan(q)+sinh(q)+cosh(q)+erf(q)+erfc(q)",
        "sqrt(abs(q))*log(2+q)*1.5e-1 + 1E1 + .5 + 2.",
    ],
)
def test_formula_on_a_coordinate(expression, tmp_path):
    model = carrier(JOINTS["pin, slider, universal"])
    for name in ("q0_0", "q1_0", "q2_1"):
        model.add(ExpressionBasedCoordinateForce(name=f"on_{name}", coordinate=name, expression=expression))
    compare(model, tmp_path)


def test_formula_between_points(model, tmp_path):
    for one, two in (("ground", "b2"), ("b0", "b1"), ("/bodyset/b0/f0", "/bodyset/b2/f2")):
        model.add(
            ExpressionBasedPointToPointForce(
                name=f"from_{two[-1]}_{one[-1]}",
                body1=one,
                body2=two,
                point1=(0.3, 0.2, 0.1),
                point2=(0.1, -0.2, 0.3),
                expression="3*d^2 - 0.7*ddot*d + 1",
            )
        )
    compare(model, tmp_path)


def test_forces_across_a_locked_coordinate(tmp_path):
    model = carrier(JOINTS["pin, slider, universal"])
    locked = next(item for item in model.components(Coordinate) if item.name == "q1_0")
    locked.default_value, locked.locked = 0.4, True
    model.add(
        SpringGeneralizedForce(name="held", coordinate="q1_0", stiffness=3.0, viscosity=2.0),
        ExpressionBasedCoordinateForce(name="formula", coordinate="q1_0", expression="3*q + qdot/q"),
        CoordinateActuator(name="motor", coordinate="q1_0"),
        PointToPointSpring(
            name="within", socket_body1="/bodyset/b0", socket_body2="/bodyset/b1", point1=(1, 0, 0), stiffness=5.0
        ),
        *between(BushingForce, rotational_stiffness=(1.0, 2.0, 3.0), **DAMPING),
        *along(PathSpring, resting_length=0.1, stiffness=40.0, dissipation=0.3),
    )
    drive(model, "motor")
    compare(model, tmp_path, counted=None)


PAIRS = (("/ground", "/bodyset/b2/f2"), ("/bodyset/b1/f1", "/bodyset/b0"), ("/bodyset/b0/f0", "/bodyset/b1/f1"))
DAMPING = {"rotational_damping": (0.3, 0.2, 0.1), "translational_damping": (2.0, 1.0, 3.0)}


def between(kind, **more):
    return [
        kind(name=f"bushing{number}", socket_frame1=one, socket_frame2=two, **more)
        for number, (one, two) in enumerate(PAIRS)
    ]


@pytest.mark.parametrize("damping", [DAMPING, {}], ids=["damped", "not damped"])
def test_bushing(model, damping, tmp_path):
    stiffness = {"rotational_stiffness": (5.0, 7.0, 9.0), "translational_stiffness": (50.0, 30.0, 20.0)}
    model.add(*between(BushingForce, **stiffness, **damping))
    # Both OpenSim's component and Simbody's force behind it report the energy, and OpenSim adds them up.
    compare(model, tmp_path, counted=2)


def test_bushing_by_formulas(model, tmp_path):
    formulas = {
        "Mx_expression": "3*theta_x + delta_y",
        "My_expression": "theta_y^3",
        "Mz_expression": "sin(theta_z)",
        "Fx_expression": "10*delta_x*exp(theta_x)",
        "Fy_expression": "20*delta_y",
        "Fz_expression": "5*delta_z + delta_x^2",
    }
    model.add(*between(ExpressionBasedBushingForce, **formulas, **DAMPING))
    compare(model, tmp_path)


def test_bushing_by_functions(model, tmp_path):
    functions = {
        "m_x_theta_x_function": LinearFunction(coefficients=(4.0, 0.5)),
        "m_y_theta_y_function": PolynomialFunction(coefficients=(1.0, 0.0, 3.0, 0.0)),
        "f_x_delta_x_function": SimmSpline(x=(-1.0, -0.3, 0.1, 0.4, 1.0), y=(-30.0, -3.0, 0.0, 6.0, 50.0)),
    }
    model.add(*between(FunctionBasedBushingForce, **functions, **DAMPING))
    # OpenSim counts no energy for this bushing.
    compare(model, tmp_path, counted=0)


def drive(model, *names):
    """Controls by functions of time: one for each actuator, and one more for the first."""
    functions = [Sine(amplitude=0.5, omega=3.0, phase=0.1, offset=1.0), Constant(value=-2.0)]
    paths = [f"/forceset/{name}" for name in names]
    for number, function in enumerate(functions):
        controller = PrescribedController(name=f"c{number}", socket_actuators=tuple(paths))
        controller.ControlFunctions.objects += [function.model_copy() for _ in paths]
        model.add(controller)
        paths = paths[:1]
    off = PrescribedController(name="off", socket_actuators=tuple(paths), enabled=False)
    off.ControlFunctions.objects.append(Constant(value=100.0))
    model.add(off)


def test_actuators_of_coordinates(model, tmp_path):
    for name in ("q0_0", "q1_0", "q2_0"):
        model.add(CoordinateActuator(name=f"on_{name}", coordinate=name, optimal_force=7.0, max_control=0.1))
    drive(model, "on_q0_0", "on_q1_0")
    compare(model, tmp_path)


def test_actuators_by_torque(model, tmp_path):
    axis = (1.0, 2.0, -0.5)
    model.add(
        TorqueActuator(name="a", bodyA="b2", bodyB="b0", axis=axis, optimal_force=3.0),
        TorqueActuator(name="b", bodyA="b1", bodyB="ground", axis=axis, torque_is_global=False, optimal_force=2.0),
        TorqueActuator(name="c", bodyA="/bodyset/b2/f2", bodyB="/bodyset/b1", axis=axis, torque_is_global=False),
        TorqueActuator(name="idle", bodyA="b1", bodyB="b0", axis=axis),
    )
    drive(model, "a", "b", "c")
    compare(model, tmp_path)


def test_actuators_at_points(model, tmp_path):
    places = [(there, along) for there in (False, True) for along in (False, True)]
    for number, (there, along) in enumerate(places):
        model.add(
            PointActuator(
                name=f"p{number}",
                body=f"b{number % 3}",
                point=(0.1, 0.2, 0.3),
                direction=(1.0, 2.0, 2.0),
                point_is_global=there,
                force_is_global=along,
                optimal_force=2.0,
            )
        )
    drive(model, "p0", "p1", "p2", "p3")
    compare(model, tmp_path)


@pytest.mark.parametrize("there", [False, True])
def test_actuators_between_points(model, there, tmp_path):
    model.add(
        PointToPointActuator(
            name="p", bodyA="b0", bodyB="b2", pointA=(0.1, 0.2, 0.3), pointB=(1, 2, 3), points_are_global=there
        )
    )
    drive(model, "p")
    compare(model, tmp_path)


def test_actuator_of_a_body_without_controls(model, tmp_path):
    model.add(BodyActuator(name="idle", socket_body="/bodyset/b1"))
    compare(model, tmp_path)


def test_prescribed_forces(model, tmp_path):
    wave = Sine(amplitude=2.0, omega=5.0, phase=0.2, offset=0.1)
    line, spline = LinearFunction(coefficients=(3.0, -1.0)), SimmSpline(x=(0.0, 0.2, 0.5, 1.0), y=(0.0, 3.0, -2.0, 1.0))
    number = 0
    for frame in ("/bodyset/b2", "/bodyset/b1/f1"):
        for point_there in (False, True):
            for force_there in (False, True):
                for parts in ("f", "fp", "t", "fpt"):
                    number += 1
                    force = PrescribedForce(
                        name=f"push{number}", socket_frame=frame, pointIsGlobal=point_there, forceIsGlobal=force_there
                    )
                    if "f" in parts:
                        force.forceFunctions.objects += [wave.model_copy(), line.model_copy(), Constant(value=2.0)]
                    if "p" in parts:
                        force.pointFunctions.objects += [spline.model_copy(), wave.model_copy(), line.model_copy()]
                    if "t" in parts:
                        force.torqueFunctions.objects += [line.model_copy(), spline.model_copy(), wave.model_copy()]
                    model.add(force)
    compare(model, tmp_path)


ROUTES = (
    (("/ground", (1.0, 0.5, 0.2)), ("/bodyset/b2", (0.1, 0.2, 0.3))),
    (
        ("/bodyset/b1/f1", (0.1, 0.0, 0.2)),
        ("/bodyset/b1", (0.3, 0.2, 0.0)),
        ("/bodyset/b0", (0.0, 0.4, 0.1)),
        ("/ground", (-0.5, 0.1, 0.0)),
        ("/bodyset/b2/f2", (0.2, 0.1, 0.0)),
    ),
)


def along(kind, **more):
    found = []
    for number, route in enumerate(ROUTES):
        force = kind(name=f"along{number}", **more)
        path = GeometryPath(name="path")
        for place, (frame, at) in enumerate(route):
            path.path_point_set.objects.append(PathPoint(name=f"p{place}", socket_parent_frame=frame, location=at))
        force.geometry_path = path
        found.append(force)
    return found


@pytest.mark.parametrize("rest", [0.1, 2.0, 20.0])
def test_springs_along_paths(model, rest, tmp_path):
    model.add(*along(PathSpring, resting_length=rest, stiffness=40.0, dissipation=0.3))
    # OpenSim counts no energy for this spring, nor for the ligament.
    compare(model, tmp_path, counted=0)


@pytest.mark.parametrize("clamped", [True, False])
@pytest.mark.parametrize("rest", [0.1, 2.0, 20.0])
def test_formulas_along_paths(model, rest, clamped, tmp_path):
    expression = "3*s + s^2 + 0.1*ldot*(1+s)"
    model.add(*along(ExpressionBasedPathForce, resting_length=rest, expression=expression, clamp_stretch=clamped))
    compare(model, tmp_path)


@pytest.mark.parametrize("rest", [0.8, 1.5, 20.0])
def test_ligaments(model, rest, tmp_path):
    model.add(*along(Ligament, resting_length=rest, pcsa_force=50.0))
    compare(model, tmp_path, counted=0)


@pytest.mark.parametrize("slack", [0.5, 1.5, 3.0, 20.0])
def test_ligaments_of_blankevoort(model, slack, tmp_path):
    constants = {"linear_stiffness": 30.0, "transition_strain": 0.5, "damping_coefficient": 2.0}
    model.add(*along(Blankevoort1991Ligament, slack_length=slack, **constants))
    compare(model, tmp_path)


@pytest.mark.parametrize("dissipation", [0.0, 0.4])
@pytest.mark.parametrize("carried", ["/ground", "/bodyset/b0/f0"])
def test_smooth_contact(model, dissipation, carried, tmp_path):
    plane = ContactHalfSpace(name="plane", socket_frame=carried, location=(0, -0.1, 0.2), orientation=(0.1, 0.2, -1.4))
    model.add(plane)
    for number, frame in enumerate(("/bodyset/b1/f1", "/bodyset/b2", "/bodyset/b2/f2")):
        ball = ContactSphere(name=f"ball{number}", socket_frame=frame, location=(0.1, 0.0, -0.1), radius=0.3)
        model.add(ball)
        model.add(
            SmoothSphereHalfSpaceForce(
                name=f"contact{number}",
                socket_sphere=ball,
                socket_half_space=plane,
                stiffness=1e4,
                dissipation=dissipation,
                static_friction=0.8,
                dynamic_friction=0.5,
                viscous_friction=0.1,
                transition_velocity=0.2 + number,
                hertz_smoothing=3.0,
                hunt_crossley_smoothing=0.5,
            )
        )
    compare(model, tmp_path)


@pytest.mark.parametrize("carried", ["/ground", "/bodyset/b0/f0"])
def test_ellipsoids_on_a_plane(model, carried, tmp_path):
    plane = ContactHalfSpace(name="plane", socket_frame=carried, location=(0, -0.6, 0), orientation=(0.1, 0.2, -1.4))
    model.add(plane)
    for number, (frame, hardness) in enumerate(
        (("/bodyset/b1/f1", 1e4), ("/bodyset/b2", 1e5), ("/bodyset/b2/f2", 1e3))
    ):
        egg = ContactEllipsoid(
            name=f"egg{number}",
            socket_frame=frame,
            location=(0.1, 0.0, -0.1),
            orientation=(0.5, -0.3, 0.7 * number),
            radii=(0.2, 0.5 + 0.2 * number, 0.9),
        )
        model.add(egg)
        force = HuntCrossleyForce(name=f"contact{number}", transition_velocity=0.1)
        for surface, stiffness in ((egg, hardness), (plane, 1e4)):
            force.contact_parameters.objects.append(
                HuntCrossleyForce.ContactParameters(
                    geometry=(surface,),
                    stiffness=stiffness,
                    dissipation=0.3,
                    static_friction=0.8,
                    dynamic_friction=0.4,
                    viscous_friction=0.2,
                )
            )
        model.add(force)
    # Some of them touch, some do not.
    assert 0 < compare(model, tmp_path) < STATES * 3 * 12
