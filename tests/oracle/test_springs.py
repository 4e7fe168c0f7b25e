"""Compare springs, expression-based forces and bushings with a live OpenSim 4.6."""

from __future__ import annotations

import pytest

from osimlite import Body, Coordinate
from osimlite.schema.actuators import (
    CoordinateActuator,
)
from osimlite.schema.function_types import PolynomialFunction
from osimlite.schema.functions import LinearFunction
from osimlite.schema.path_forces import (
    Blankevoort1991Ligament,
    ExpressionBasedPathForce,
    Ligament,
    PathSpring,
)
from osimlite.schema.splines import SimmSpline
from osimlite.schema.springs import (
    BushingForce,
    ExpressionBasedBushingForce,
    ExpressionBasedCoordinateForce,
    ExpressionBasedPointToPointForce,
    FunctionBasedBushingForce,
    PointToPointSpring,
    SpringGeneralizedForce,
)

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.force_carrier import DAMPING, JOINTS, along, between, carrier, compare, drive  # noqa: E402


@pytest.fixture(params=list(JOINTS.values()), ids=list(JOINTS))
def model(request):
    return carrier(request.param)


def test_spring_on_a_coordinate(model, tmp_path):
    for name, k in (("q0_0", 30.0), ("q1_0", 20.0), ("q2_0", 10.0)):
        model.add(
            SpringGeneralizedForce(
                name=f"on_{name}", coordinate=name, stiffness=k, rest_length=0.2, viscosity=3
            )
        )
    # OpenSim computes no potential energy of this spring.
    compare(model, tmp_path, counted=0)


def test_spring_between_points(model, tmp_path):
    b0, b2 = (body for body in model.components(Body) if body.name in ("b0", "b2"))
    model.add(
        PointToPointSpring(
            name="far",
            socket_body1=model.ground,
            socket_body2=b2,
            point1=(1, 2, 3),
            stiffness=40.0,
            rest_length=0.5,
        ),
        PointToPointSpring(
            name="near",
            socket_body1=b0,
            socket_body2=b2,
            point1=(0.1, 0.2, 0.3),
            point2=(0, -0.3, 0),
            stiffness=90.0,
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
        model.add(
            ExpressionBasedCoordinateForce(
                name=f"on_{name}", coordinate=name, expression=expression
            )
        )
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
        ExpressionBasedCoordinateForce(
            name="formula", coordinate="q1_0", expression="3*q + qdot/q"
        ),
        # Set the value explicitly: OpenSim applies the defaults of a document to everything that it
        # reads later.
        CoordinateActuator(name="motor", coordinate="q1_0", optimal_force=1.0),
        PointToPointSpring(
            name="within",
            socket_body1="/bodyset/b0",
            socket_body2="/bodyset/b1",
            point1=(1, 0, 0),
            stiffness=5.0,
        ),
        *between(BushingForce, rotational_stiffness=(1.0, 2.0, 3.0), **DAMPING),
        *along(PathSpring, resting_length=0.1, stiffness=40.0, dissipation=0.3),
    )
    drive(model, "motor")
    compare(model, tmp_path, counted=None)


@pytest.mark.parametrize("damping", [DAMPING, {}], ids=["damped", "not damped"])
def test_bushing(model, damping, tmp_path):
    stiffness = {
        "rotational_stiffness": (5.0, 7.0, 9.0),
        "translational_stiffness": (50.0, 30.0, 20.0),
    }
    model.add(*between(BushingForce, **stiffness, **damping))
    # OpenSim's component and Simbody's force behind it both report the energy, and OpenSim adds
    # them up.
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
        "f_x_delta_x_function": SimmSpline(
            x=(-1.0, -0.3, 0.1, 0.4, 1.0), y=(-30.0, -3.0, 0.0, 6.0, 50.0)
        ),
    }
    model.add(*between(FunctionBasedBushingForce, **functions, **DAMPING))
    # OpenSim computes no potential energy of this bushing.
    compare(model, tmp_path, counted=0)


@pytest.mark.parametrize("rest", [0.1, 2.0, 20.0])
def test_springs_along_paths(model, rest, tmp_path):
    model.add(*along(PathSpring, resting_length=rest, stiffness=40.0, dissipation=0.3))
    # OpenSim computes no potential energy of this spring, nor of the ligament.
    compare(model, tmp_path, counted=0)


@pytest.mark.parametrize("clamped", [True, False])
@pytest.mark.parametrize("rest", [0.1, 2.0, 20.0])
def test_formulas_along_paths(model, rest, clamped, tmp_path):
    expression = "3*s + s^2 + 0.1*ldot*(1+s)"
    model.add(
        *along(
            ExpressionBasedPathForce,
            resting_length=rest,
            expression=expression,
            clamp_stretch=clamped,
        )
    )
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
