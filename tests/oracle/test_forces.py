"""Accelerations, force records and energies of every force element against a live OpenSim 4.6."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite import Body, Model
from osimlite.multibody import build_mechanism
from osimlite.schema.frames import PhysicalOffsetFrame
from osimlite.schema.functions import LinearFunction, PolynomialFunction, SimmSpline
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

    `counted` says how often OpenSim counts the energy of the forces; None if it has an energy of its own.
    """
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
            for name, value, speed in zip(names, q, u, strict=True):
                coordinate = theirs.updCoordinateSet().get(name)
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
            y = engine.state.pack(q, u)
            assert list(engine.columns) == labels
            recorded = engine.force_records(TIME, y)
            assert recorded == pytest.approx(values, rel=tolerance, abs=tolerance * max(1.0, *map(abs, [0, *values])))
            if counted is not None:
                kinetic, gravity, stored = engine.energies(TIME, y)
                assert kinetic == pytest.approx(theirs.calcKineticEnergy(state), rel=1e-10)
                total = theirs.calcPotentialEnergy(state)
                assert gravity + counted * stored == pytest.approx(total, rel=1e-9, abs=1e-9)


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
