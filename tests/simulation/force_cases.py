"""Chain of bodies, and forces of all classes and variants on it."""

from __future__ import annotations

from typing import Any

import pytest

import osimlite
from osimlite import (
    Body,
    ContactHalfSpace,
    ContactSphere,
    Coordinate,
    CoordinateLimitForce,
    HuntCrossleyForce,
    Model,
)
from osimlite.schema.actuators import (
    BodyActuator,
    CoordinateActuator,
    PointActuator,
    PointToPointActuator,
    TorqueActuator,
)
from osimlite.schema.contact_forces import MeyerFregly2016Force, SmoothSphereHalfSpaceForce
from osimlite.schema.contact_types import ContactCylinder, ContactEllipsoid, ContactTorus
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.function_types import (
    ExpressionBasedFunction,
    MultivariatePolynomialFunction,
    PolynomialFunction,
    Sine,
    StepFunction,
)
from osimlite.schema.functions import Constant, LinearFunction, MultiplierFunction
from osimlite.schema.markers import Station
from osimlite.schema.muscles import PathActuator
from osimlite.schema.path_forces import (
    Blankevoort1991Ligament,
    ExpressionBasedPathForce,
    Ligament,
    McKibbenActuator,
    PathSpring,
)
from osimlite.schema.paths import (
    ConditionalPathPoint,
    FunctionBasedPath,
    GeometryPath,
    MovingPathPoint,
    PathPoint,
    PathWrap,
)
from osimlite.schema.prescribed import PrescribedForce
from osimlite.schema.scholz_paths import (
    Scholz2015GeometryPath,
    Scholz2015GeometryPathObstacle,
    Scholz2015GeometryPathPoint,
)
from osimlite.schema.splines import PiecewiseLinearFunction, SimmSpline
from osimlite.schema.springs import (
    BushingForce,
    ExpressionBasedBushingForce,
    ExpressionBasedCoordinateForce,
    ExpressionBasedPointToPointForce,
    FunctionBasedBushingForce,
    PointToPointSpring,
    SpringGeneralizedForce,
)
from osimlite.schema.wrap_types import WrapCylinder, WrapSphere


def chain() -> Model:
    """Return a chain with a free body, a ball joint, a pin, and a locked slide."""
    model = Model(name="chain")
    joints = (osimlite.FreeJoint, osimlite.BallJoint, osimlite.PinJoint, osimlite.SliderJoint)
    carrier = model.ground
    for number, kind in enumerate(joints):
        inertia = (0.2, 0.3, 0.25, 0.01, -0.02, 0.03)
        body = model.add(
            Body(name=f"b{number}", mass=1.0 + number, mass_center=(0, -0.1, 0.05), inertia=inertia)
        )
        joint = kind(name=f"j{number}")
        for index, coordinate in enumerate(joint.coordinates):
            coordinate.name = f"q{number}_{index}"
        model.add(
            joint.between(
                carrier, body, at=(0.1, 0.2, -0.05), turned=(0.3, -0.2, 0.1), child_at=(0, 0.1, 0)
            )
        )
        carrier = body
    b1 = next(item for item in model.components(Body) if item.name == "b1")
    b1.wrap_object_set.objects += (
        WrapCylinder(name="bar", radius=0.2, length=2.0, translation=(0.2, 0.0, 0.1)),
        WrapSphere(name="ball", radius=0.3, quadrant="x", translation=(0.1, 0.0, 0.1)),
    )
    still = next(item for item in model.components(Coordinate) if item.name == "q3_0")
    still.locked, still.default_value = True, 0.2
    return model


def straight(*more) -> GeometryPath:
    result = GeometryPath(name="path")
    result.path_point_set.objects += (
        PathPoint(name="start", socket_parent_frame="/ground", location=(0.5, 0.1, 0.0)),
        PathPoint(name="over", socket_parent_frame="/bodyset/b0", location=(0.1, 0.3, 0.2)),
        *more,
        PathPoint(name="end", socket_parent_frame="/bodyset/b2", location=(0.0, -0.3, 0.1)),
    )
    return result


def around(path, *surfaces) -> GeometryPath:
    wraps = path.path_wrap_set.objects
    wraps += (PathWrap(name=f"around_{surface}", wrap_object=surface) for surface in surfaces)
    return path


# Obstacles of the path over surfaces, on different bodies.
OBSTACLES = (
    ContactSphere(name="o0", socket_frame="/bodyset/b0", radius=0.05, location=(0.1, -0.1, 0.1)),
    ContactCylinder(name="o1", socket_frame="/bodyset/b1", radius=0.02, location=(0.3, 0.0, 0.1)),
    ContactTorus(
        name="o2",
        socket_frame="/bodyset/b1",
        torus_radius=0.05,
        tube_radius=0.02,
        location=(0, 0.1, -0.2),
    ),
    ContactEllipsoid(name="o3", socket_frame="/bodyset/b2", radii=(0.04, 0.03, 0.05)),
)


def over(path, surfaces) -> Scholz2015GeometryPath:
    """Return the path with surfaces between its last two points."""
    result = Scholz2015GeometryPath(name="path")
    for point in path.path_point_set.objects:
        result.path_elements.append(
            Scholz2015GeometryPathPoint(name=f"e_{point.name}", path_point=point)
        )
    for surface in surfaces:
        obstacle = Scholz2015GeometryPathObstacle(
            name=f"over_{surface.name}", contact_hint=(0.0, 0.2, 0.0)
        )
        obstacle.socket_contact_geometry = f"/contactgeometryset/{surface.name}"
        result.path_elements.insert(-1, obstacle)
    return result


def between(kind, one="/bodyset/b0", two="/bodyset/b3", **more):
    return kind(name="a", socket_frame1=one, socket_frame2=two, **more)


def material(*surfaces):
    names = tuple(item.name for item in surfaces)
    return HuntCrossleyForce.ContactParameters(
        geometry=names,
        stiffness=1e5,
        dissipation=1.5,
        static_friction=0.8,
        dynamic_friction=0.4,
        viscous_friction=0.1,
    )


def floor() -> ContactHalfSpace:
    return ContactHalfSpace(name="floor", socket_frame="/ground", orientation=(0.1, 0.2, -1.4))


def stone(number: int, radius: float = 0.4) -> ContactSphere:
    return ContactSphere(
        name=f"s{number}",
        socket_frame=f"/bodyset/b{number}",
        radius=radius,
        location=(0.1, -0.2, 0),
    )


def contact(*surfaces):
    force = HuntCrossleyForce(name="a", transition_velocity=0.1)
    force.contact_parameters.objects.append(material(*surfaces))
    return *surfaces, force


def driven(actuator, *functions):
    """Return a tuple of an actuator and one controller for each function."""
    result = [actuator]
    for number, function in enumerate(functions):
        controller = PrescribedController(name=f"c{number}", socket_actuators=("/forceset/a",))
        controller.ControlFunctions.objects.append(function)
        result.append(controller)
    return result


def pushed(**more):
    force = PrescribedForce(name="a", socket_frame="/bodyset/b2", **more)
    for what, size in (("forceFunctions", 5.0), ("pointFunctions", 0.1), ("torqueFunctions", 2.0)):
        functions = getattr(force, what)
        functions.objects += (
            Sine(amplitude=size, omega=3.0, phase=0.2, offset=0.1),
            LinearFunction(coefficients=(size, 0.2)),
            Constant(value=-size),
        )
    return force


# Functions of a FunctionBasedBushingForce, of different classes.
SHAPES = {
    "m_x_theta_x_function": SimmSpline(
        x=(-2.0, -0.5, 0.1, 0.6, 2.0), y=(-30.0, -3.0, 0.0, 6.0, 50.0)
    ),
    "m_y_theta_y_function": PiecewiseLinearFunction(x=(-1.0, 0.0, 1.0), y=(-4.0, 0.0, 9.0)),
    "m_z_theta_z_function": MultiplierFunction(scale=2.0, function=Sine(amplitude=3.0, omega=2.0)),
    "f_x_delta_x_function": PolynomialFunction(coefficients=(20.0, 0.0, 5.0, 1.0)),
    "f_y_delta_y_function": LinearFunction(coefficients=(10.0, 1.0)),
    "f_z_delta_z_function": StepFunction(
        transition_start_time=-0.2, transition_end_time=0.3, start_value=-3.0, end_value=4.0
    ),
}
DAMPED = {"rotational_damping": (0.1, 0.2, 0.3), "translational_damping": (0.4, 0.5, 0.6)}
SPRING: dict[str, Any] = {"resting_length": 0.4, "stiffness": 50.0, "dissipation": 0.2}
# Formulas of expression-based forces, with the functions of their grammar.
FORMULA = "3*q^2 - w*exp(-q/2) + max(qdot, -1)*step(q); w = sin(v)*abs(qdot); v = 1 + q*q"
ALL = "sqrt(abs(d)) + log(1+d*d) - sin(d)*cos(d)/sec(d) + csc(1+d*d) + tan(d/3) - cot(1+d*d) + asin(d/9) + acos(d/9)"
MORE = "atan(d) + sinh(d/4) + cosh(d/4) - tanh(d) + erf(d) + erfc(d) + delta(d) + square(d) - cube(d) + recip(2+d*d)"

# Functions that return the components of each case: a force named "a", with its controllers and
# surfaces.
FORCES = {
    "limit": lambda: CoordinateLimitForce(
        name="a",
        coordinate="q1_1",
        upper_limit=10.0,
        lower_limit=-10.0,
        transition=15.0,
        damping=0.1,
    ),
    "limit of a locked coordinate": lambda: CoordinateLimitForce(
        name="a", coordinate="q3_0", upper_limit=0.1
    ),
    "spring": lambda: SpringGeneralizedForce(
        name="a", coordinate="q2_0", stiffness=30.0, rest_length=-0.4, viscosity=0.3
    ),
    "spring on a ball": lambda: SpringGeneralizedForce(name="a", coordinate="q1_2", stiffness=30.0),
    "spring on a locked coordinate": lambda: SpringGeneralizedForce(
        name="a", coordinate="q3_0", stiffness=30.0
    ),
    "formula": lambda: ExpressionBasedCoordinateForce(
        name="a", coordinate="q2_0", expression=FORMULA
    ),
    "formula of a variable": lambda: ExpressionBasedCoordinateForce(
        name="a", coordinate="q2_0", expression="qdot"
    ),
    "line": lambda: PointToPointSpring(
        name="a",
        socket_body1="/ground",
        socket_body2="/bodyset/b2",
        point1=(1, 0, 0),
        point2=(0, 0.2, 0.1),
        stiffness=30.0,
        rest_length=0.3,
    ),
    "line by a formula": lambda: ExpressionBasedPointToPointForce(
        name="a",
        body1="b0",
        body2="b3",
        point1=(0.1, 0, 0),
        point2=(0, 0.2, 0.1),
        expression=f"{ALL} + ddot",
    ),
    "line by another formula": lambda: ExpressionBasedPointToPointForce(
        name="a",
        body1="ground",
        body2="b3",
        point1=(0.1, 0, 0),
        expression=f"{MORE} - min(d, ddot)^2 + 2^-d",
    ),
    "bushing": lambda: between(
        BushingForce, rotational_stiffness=(1, 2, 9), translational_stiffness=(50, 30, 10), **DAMPED
    ),
    "bushing without damping": lambda: between(
        BushingForce, one="/ground", translational_stiffness=(50, 30, 10)
    ),
    "bushing by functions": lambda: between(
        FunctionBasedBushingForce, one="/ground", **SHAPES, **DAMPED
    ),
    "bushing by formulas": lambda: between(
        ExpressionBasedBushingForce,
        Mx_expression="2*theta_x + theta_y",
        Mz_expression="theta_z^3",
        Fx_expression="10*delta_x*delta_y",
        Fz_expression="delta_z",
        **DAMPED,
    ),
    "path": lambda: PathSpring(name="a", **SPRING, geometry_path=straight()),
    "path through points that move or come and go": lambda: PathSpring(
        name="a",
        **SPRING,
        geometry_path=straight(
            ConditionalPathPoint(
                name="sometimes",
                socket_parent_frame="/bodyset/b0",
                location=(0.3, 0.0, 0.1),
                socket_coordinate="/jointset/j2/q2_0",
                range=(-0.2, 0.4),
            ),
            MovingPathPoint(
                name="mover",
                socket_parent_frame="/bodyset/b2",
                socket_x_coordinate="/jointset/j2/q2_0",
                socket_y_coordinate="/jointset/j2/q2_0",
                socket_z_coordinate="/jointset/j2/q2_0",
                x_location=SimmSpline(x=(-1.0, -0.3, 0.1, 0.6, 1.0), y=(0.1, 0.2, 0.1, -0.1, 0.3)),
                y_location=Sine(amplitude=0.2, omega=2.0, phase=0.3, offset=0.1),
            ),
        ),
    ),
    "path around surfaces": lambda: PathSpring(
        name="a", **SPRING, geometry_path=around(straight(), "bar", "ball")
    ),
    "path of functions": lambda: (
        PathSpring(
            name="a",
            **SPRING,
            geometry_path=FunctionBasedPath(
                coordinate_paths=("/jointset/j2/q2_0", "/jointset/j3/q3_0", "/jointset/j0/q0_3"),
                length_function=MultivariatePolynomialFunction(
                    dimension=3,
                    order=2,
                    coefficients=(0.3, 0.2, -0.1, 0.4, 0.1, 0.2, 0.3, -0.2, 0.1, 0.5),
                ),
            ),
        ),
        PathSpring(
            name="b",
            **SPRING,
            geometry_path=FunctionBasedPath(
                coordinate_paths=("/jointset/j2/q2_0",),
                length_function=Sine(amplitude=0.2, omega=2.0, phase=0.3, offset=0.6),
                lengthening_speed_function=ExpressionBasedFunction(
                    expression="q*v+1", variables=("q", "v")
                ),
            ),
        ),
    ),
    "path over obstacles": lambda: (
        *OBSTACLES,
        PathSpring(name="a", **SPRING, geometry_path=over(straight(), OBSTACLES)),
    ),
    "path by a formula": lambda: ExpressionBasedPathForce(
        name="a",
        resting_length=0.4,
        clamp_stretch=True,
        expression="30*s^2 + ldot*s",
        geometry_path=straight(),
    ),
    "ligament": lambda: Ligament(
        name="a", resting_length=0.4, pcsa_force=100.0, geometry_path=straight()
    ),
    "another ligament": lambda: Blankevoort1991Ligament(
        name="a",
        slack_length=0.4,
        linear_stiffness=90.0,
        damping_coefficient=0.3,
        geometry_path=straight(),
    ),
    "smooth contact": lambda: (
        floor(),
        stone(2),
        SmoothSphereHalfSpaceForce(
            name="a",
            socket_half_space="/contactgeometryset/floor",
            socket_sphere="/contactgeometryset/s2",
        ),
    ),
    "station": lambda: (
        Station(name="toe", socket_parent_frame="/bodyset/b2", location=(0.1, -0.2, 0.0)),
        MeyerFregly2016Force(name="a", socket_station="/componentset/toe"),
    ),
    "contact": lambda: contact(floor(), *(stone(number) for number in range(4))),
    "ellipsoid": lambda: contact(
        floor(),
        ContactEllipsoid(
            name="e", socket_frame="/bodyset/b1", radii=(0.5, 0.3, 0.4), orientation=(0.2, 0.4, 0.1)
        ),
        ContactHalfSpace(
            name="wall", socket_frame="/bodyset/b3", location=(0, -0.4, 0), orientation=(0, 0, 0.7)
        ),
    ),
    "ellipsoids on each other and a sphere": lambda: contact(
        ContactEllipsoid(
            name="e", socket_frame="/bodyset/b1", radii=(0.5, 0.7, 0.4), orientation=(0.2, 0.4, 0.1)
        ),
        ContactEllipsoid(
            name="g", socket_frame="/bodyset/b3", radii=(0.8, 0.6, 0.4), orientation=(0.1, 0.9, 0.3)
        ),
        ContactSphere(name="s", socket_frame="/ground", location=(0.1, 0.2, 0.0), radius=0.6),
    ),
    "coordinate actuator": lambda: driven(
        CoordinateActuator(name="a", coordinate="q1_0", optimal_force=7.0),
        Sine(amplitude=1.0, omega=4.0, phase=0.0, offset=0.0),
        SimmSpline(x=(0.0, 0.4, 0.8, 1.2, 2.0), y=(0.0, 1.0, 0.5, 0.2, 1.0)),
    ),
    "actuator without controls": lambda: CoordinateActuator(name="a", coordinate="q1_0"),
    "torque actuator": lambda: driven(
        TorqueActuator(name="a", bodyA="b2", bodyB="b0", axis=(1, 2, 3), torque_is_global=False),
        Constant(value=3.0),
    ),
    "torque actuator along ground": lambda: driven(
        TorqueActuator(name="a", bodyA="b2", bodyB="ground", axis=(1, 2, 3), torque_is_global=True),
        Constant(value=3.0),
    ),
    "point actuator": lambda: driven(
        PointActuator(
            name="a", body="b2", point=(0.1, 0.2, 0.3), direction=(1, -1, 0.5), force_is_global=True
        ),
        Constant(value=3.0),
    ),
    "point actuator in ground": lambda: driven(
        PointActuator(
            name="a", body="b2", point=(0.1, 0.2, 0.3), direction=(1, -1, 0.5), point_is_global=True
        ),
        Constant(value=3.0),
    ),
    "points actuator": lambda: driven(
        PointToPointActuator(
            name="a", bodyA="b3", bodyB="b0", pointA=(0.1, 0.2, 0.3), pointB=(0, 0.1, 0)
        ),
        Constant(value=3.0),
    ),
    "points actuator in ground": lambda: driven(
        PointToPointActuator(
            name="a",
            bodyA="b3",
            bodyB="b0",
            pointA=(0.1, 0.2, 0.3),
            pointB=(0, 0.1, 0),
            points_are_global=True,
        ),
        Constant(value=3.0),
    ),
    "path actuator": lambda: driven(
        PathActuator(name="a", optimal_force=20.0, geometry_path=straight()), Constant(value=0.7)
    ),
    "pneumatic actuator": lambda: driven(
        McKibbenActuator(
            name="a",
            thread_length=0.9,
            number_of_turns=3.0,
            cord_length=0.1,
            geometry_path=straight(),
        ),
        Constant(value=5000.0),
    ),
    "idle": lambda: BodyActuator(name="a", socket_body="/bodyset/b0"),
    "prescribed": lambda: pushed(),
    "prescribed in ground": lambda: pushed(forceIsGlobal=True, pointIsGlobal=True),
    "prescribed in the body": lambda: pushed(forceIsGlobal=False, pointIsGlobal=False),
}

# The path over three surfaces takes half as long as all other forces together.
FORCE_NAMES = [
    pytest.param(name, marks=pytest.mark.full) if name == "path over obstacles" else name
    for name in FORCES
]
"""Names of all forces as parameters of a test."""


def with_force(make) -> Model:
    model, made = chain(), make()
    model.add(*(made if isinstance(made, tuple | list) else (made,)))
    return model
