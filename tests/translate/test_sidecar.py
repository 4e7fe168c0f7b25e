"""Tests of the file of coordinates: together with the URDF it gives the pose of every body."""

from __future__ import annotations

import gzip
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.errors import UnsupportedError
from osimlite.io.document.reader import read_text
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.arc import ArcPoint
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.functions import Linear, ScaledFunction, SmoothFunction
from osimlite.mechanics.multibody.joints import JointAxis, make_custom_motions
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.motions import AccelerationErrorAngle, EllipsoidPoint
from osimlite.mechanics.multibody.smoothing_spline import smoothing_spline
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.constraint_types import CoordinateCouplerConstraint
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.custom_joint import CustomJoint, SpatialTransform
from osimlite.schema.custom_joint import TransformAxis as SchemaAxis
from osimlite.schema.frames import Body
from osimlite.schema.function_types import PolynomialFunction
from osimlite.schema.functions import Function as SchemaFunction
from osimlite.schema.functions import LinearFunction, MultiplierFunction
from osimlite.schema.joints import PinJoint
from osimlite.schema.model import Model
from osimlite.schema.splines import SimmSpline
from osimlite.simulation.robot.build import build_robot
from osimlite.simulation.robot.couplings import find_mimics
from osimlite.simulation.robot.merge_fixed import merge_fixed
from osimlite.simulation.robot.names import legal_names
from osimlite.simulation.robot.urdf import urdf_text
from osimlite.translate import to_urdf
from osimlite.translate.function_data import describe_function
from osimlite.translate.sidecar import format_coordinates
from tests.mechanics.multibody.strategies import Case, cases
from tests.simulation.robot.readers import mujoco_poses, worst_body, yourdfpy_poses
from tests.simulation.robot.support import one_body
from tests.translate.evaluator import Reader, evaluate


def worst(reader: Reader, mechanism: Mechanism, q) -> float:
    """Return the largest difference between poses of bodies in the mechanism and by the reader."""
    values = dict(zip((info.path for info in mechanism.coordinates), q.tolist(), strict=True))
    poses, state = reader.body_poses(values), mechanism.at(q)
    assert poses.keys() == {"/ground", *(body.path for body in mechanism.bodies)}
    differences = (
        np.abs(poses[body.path] - state.transform(k)).max()
        for k, body in enumerate(mechanism.bodies)
    )
    return max(differences, default=0.0)


def sidecar(robot) -> Reader:
    return Reader(urdf_text(robot), format_coordinates(robot, "robot.urdf"))


# ------------------------------------------------------------------------------------------------ complete models
@given(cases(), st.booleans())
def test_urdf_and_coordinates_say_where_bodies_are(case: Case, merge: bool):
    robot = build_robot(case.mechanism)
    robot = legal_names(merge_fixed(robot) if merge else robot)
    assert worst(sidecar(robot), case.mechanism, case.q) < 1e-9


def test_urdf_and_coordinates_of_real_models_say_where_bodies_are(corpus_model):
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    model = read_text(gzip.decompress(corpus_model.converted.read_bytes()).decode())
    urdf = to_urdf(model)
    reader, mechanism = Reader(urdf.text, urdf.coordinates), urdf.robot.mechanism
    coordinates = reader.data["coordinates"]
    generator = np.random.default_rng(5)
    for _ in range(5):
        random = generator.uniform(-1.5, 1.5, len(coordinates))
        free = {
            item["path"]: item["default_value"] if item["locked"] else value
            for item, value in zip(coordinates, random.tolist(), strict=True)
        }
        values = reader.coupled(free)
        locked = {item["path"]: item["default_value"] for item in coordinates if item["locked"]}
        values |= locked
        q = np.array([values[item["path"]] for item in coordinates])
        assert worst(reader, mechanism, q) < 1e-9
        # The linear function of a mimic joint gives the same value as its own function.
        joints = reader.joint_values(values)
        for name, value in reader.mimicked(joints).items():
            assert value == pytest.approx(joints[name], abs=1e-12)
        state = mechanism.at(q)
        for constraint in mechanism.constraints:
            if (
                isinstance(constraint, Coupler)
                and mechanism.coordinates[constraint.dependent].path not in locked
            ):
                assert np.abs(constraint.position_errors(state)).max() < 1e-9


def test_the_file_tells_what_the_model_says_of_coordinates():
    model = dynamic_walker()
    urdf = to_urdf(model, limits="range", collision=True)
    data = json.loads(urdf.coordinates)
    assert (data["format"], data["version"], data["file"]) == (
        "osimlite-coordinates",
        1,
        "DynamicWalkerModel.urdf",
    )
    by_name = {item["name"]: item for item in data["coordinates"]}
    knee = by_name["RKnee_rz"]
    assert knee["path"] == "/jointset/RightShankToThigh/RKnee_rz" and knee["joint"] == "RKnee_rz"
    assert (
        knee["range"] == [math.radians(-100.0), 0.0]
        and knee["unit"] == "rad"
        and not knee["locked"]
    )
    assert by_name["Pelvis_ty"]["unit"] == "m" and by_name["Pelvis_ty"]["default_value"] == 0.835
    lock = by_name["platform_rz"]
    assert lock["locked"] and lock["joint"] is None and lock["drives"] == []
    assert {item["path"]: item["link"] for item in data["bodies"]}[
        "/bodyset/RightShank"
    ] == "RightShank"
    kinds = [item["as"] for item in data["shapes"]]
    surfaces = [
        component for component in model.components() if isinstance(component, ContactGeometry)
    ]
    assert kinds.count("visual") == 6 and kinds.count("collision") == len(surfaces)


def test_what_is_endless_is_null():
    model = dynamic_walker()
    model.find("/jointset/RightShankToThigh/RKnee_rz").range = (-math.inf, math.inf)
    item = next(
        c for c in json.loads(to_urdf(model).coordinates)["coordinates"] if c["name"] == "RKnee_rz"
    )
    assert item["range"] == [None, None]


# ------------------------------------------------------------------------------------------------------- functions
X = (-1.0, -0.2, 0.0, 0.3, 1.1, 1.4, 2.0)
Y = (0.3, -0.1, 0.2, 0.25, 1.0, 0.8, -0.7)
FUNCTIONS: list[tuple[SmoothFunction, int]] = [
    (f.ConstantValue(0.7), 1),
    (Linear(2.0, -0.3), 1),
    (f.WeightedSum((1.0, -2.0), 0.5), 2),
    (f.Polynomial((0.5, -1.0, 0.25, 3.0)), 1),
    (f.SineWave(0.5, 2.0, 0.1, -0.2), 1),
    (f.QuinticStep(-0.5, 0.5, 1.0, 3.0), 1),
    (f.MultivariatePolynomial.complete((1.0, 2.0, 3.0, -4.0, 0.5, 0.1), 2, 2), 2),
    (ScaledFunction(-0.5, f.SimmCubicSpline(X, Y)), 1),
    (f.PiecewiseLinear(X, Y), 1),
    (f.PiecewiseConstant(X, Y), 1),
    (f.SimmCubicSpline(X, Y), 1),
    (f.SimmCubicSpline(X[:3], Y[:3]), 1),
    (f.SimmCubicSpline(X[:2], Y[:2]), 1),
    (f.SimmCubicSpline((0.0, 0.0, 0.5, 1.0, 1.0), (0.0, 0.1, 0.2, 0.4, 0.3)), 1),
    (smoothing_spline(X, Y, 2, 0.0), 1),
    (smoothing_spline(X, Y, 3, 0.01), 1),
    *((EllipsoidPoint(k, 0.2), 3) for k in range(3)),
    *((ArcPoint(k, 0.7, (0.1, -0.2)), 2) for k in range(3)),
]


@pytest.mark.parametrize(("function", "arguments"), FUNCTIONS, ids=lambda item: type(item).__name__)
def test_every_function_is_written_exactly(function, arguments):
    data = json.loads(json.dumps(describe_function(function)))
    for x in np.random.default_rng(2).uniform(-2.0, 3.0, (200, arguments)):
        assert evaluate(data, x.tolist()) == pytest.approx(
            function.evaluate(x)[0], abs=1e-12, rel=1e-12
        )


def test_no_function_is_forgotten():
    def below(cls) -> set[type]:
        result = {cls} if not getattr(cls, "__abstractmethods__", None) else set()
        return result.union(*(below(item) for item in cls.__subclasses__()))

    ours = {
        cls
        for cls in below(SmoothFunction)
        if cls.__module__.startswith("osimlite.mechanics.multibody")
    }
    # The error of Simbody's accelerations does not change poses.
    assert ours - {AccelerationErrorAngle} == {type(function) for function, _ in FUNCTIONS}

    class Other(SmoothFunction):
        def evaluate(self, arguments):
            return 0.0, arguments, np.zeros((1, 1))

    with pytest.raises(UnsupportedError, match="class Other"):
        describe_function(Other())


def test_the_guide_describes_the_file(repo):
    guide = (repo / "docs" / "urdf.md").read_text()
    types = {describe_function(function)["type"] for function, _ in FUNCTIONS}
    assert (
        set(re.findall(r"^\| `([a-z-]+)` \| .*", guide.split("| `type` |")[1], re.MULTILINE))
        == types
    )
    (example,) = re.findall(r"```json\n(.*?)```", guide, re.DOTALL)
    said, made = json.loads(example), json.loads(to_urdf(dynamic_walker()).coordinates)
    assert said.keys() == made.keys()
    for section in ("coordinates", "bodies", "shapes"):
        assert said[section][0].keys() == made[section][0].keys()
    assert said["joints"][0].keys() | {"identity"} == made["joints"][0].keys()
    piece = said["joints"][0]["function"]
    assert len(piece["pieces"]) == len(piece["x"]) + 1


def test_axes_along_straight_splines_are_joints_of_one_coordinate():
    """Spine models rotate the first vertebra by splines through two points."""
    z, x = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
    axes = [
        JointAxis((0,), z, f.SimmCubicSpline((-1.5, 1.5), (-1.5, 1.5))),
        JointAxis((0,), x, f.SimmCubicSpline((-1.0, 3.0), (-0.5, 2.5))),
    ]
    flat = [JointAxis((0,), x, f.SimmCubicSpline((0.0, 1.0, 2.0), (0.2, 0.2, 0.2)))]
    mechanism = one_body(make_custom_motions(axes, flat), 1)
    robot = build_robot(mechanism)
    assert [joint.name for joint in robot.moving] == ["q0", "q0_rx"]
    assert robot.joint_of.keys() == {0} and find_mimics(robot)["q0_rx"].leader == "q0"
    for q in ((0.4,), (-3.0,)):
        assert worst(sidecar(robot), mechanism, np.array(q)) < 1e-12
    assert (
        worst_body(
            robot, yourdfpy_poses(urdf_text(robot), robot.joint_values((0.4,))), np.array((0.4,))
        )
        < 1e-12
    )


# -------------------------------------------------------------------------------------------------------- couplers
def chain(*laws: tuple[int, int, SchemaFunction], count: int = 4) -> Model:
    """Return pins a, b, c, d in a chain; each law makes the first coordinate a function of the second."""
    model, carrier = Model(name="chain"), None
    for name in "abcd"[:count]:
        body = model.add(
            Body(name=f"body_{name}", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
        )
        joint = PinJoint(name=f"pin_{name}", coordinates=[Coordinate(name=name)])
        model.add(joint.between(carrier or model.ground, body, at=(0.1, 0.2, 0.0)))
        carrier = body
    for k, (dependent, independent, function) in enumerate(laws):
        model.add(
            CoordinateCouplerConstraint(
                name=f"law_{k}",
                dependent_coordinate_name="abcd"[dependent],
                independent_coordinate_names=("abcd"[independent],),
                coupled_coordinates_function=function,
            )
        )
    return model


def mimic_lines(text: str) -> list[str]:
    return re.findall(r"<mimic .*/>", text)


def test_coupled_coordinates_mimic_the_first_of_their_chain():
    straight = LinearFunction(coefficients=(2.0, 0.1))
    half = MultiplierFunction(scale=-0.5, function=LinearFunction(coefficients=(1.0, 0.0)))
    urdf = to_urdf(chain((1, 0, straight), (2, 1, half)))
    assert mimic_lines(urdf.text) == [
        '<mimic joint="a" multiplier="2" offset="0.1"/>',
        '<mimic joint="a" multiplier="-1" offset="-0.05"/>',
    ]
    records = [(r.component, r.done, r.detail) for r in urdf.fidelity if r.kind == "coupler"]
    assert records == [
        ("/constraintset/law_0", "a joint that mimics another", "coordinate b follows joint a"),
        ("/constraintset/law_1", "a joint that mimics another", "coordinate c follows joint a"),
    ]
    q = np.array([0.3, 0.7, -0.35, -0.2])
    values = urdf.robot.joint_values(q)
    assert worst_body(urdf.robot, yourdfpy_poses(urdf.text, values), q) < 1e-12
    assert worst_body(urdf.robot, mujoco_poses(urdf.text, values)[0], q) < 1e-9
    reader = Reader(urdf.text, urdf.coordinates)
    assert list(
        reader.coupled(
            dict(
                zip(
                    (i.path for i in urdf.robot.mechanism.coordinates),
                    (0.3, 0, 0, -0.2),
                    strict=True,
                )
            )
        ).values()
    ) == pytest.approx(q.tolist())


def test_curved_couplers_circles_and_locks_are_left_to_the_file():
    curve = PolynomialFunction(coefficients=(1.0, 0.0, 0.0))
    urdf = to_urdf(chain((1, 0, curve), (3, 1, LinearFunction(coefficients=(3.0, 0.0)))))
    assert mimic_lines(urdf.text) == ['<mimic joint="b" multiplier="3"/>']
    done = [r.done for r in urdf.fidelity if r.kind == "coupler"]
    assert ".coordinates.json" in done[0] and "mimics" in done[1]
    line = LinearFunction(coefficients=(1.0, 0.0))
    circle = to_urdf(chain((0, 1, line), (1, 0, line), count=2))
    assert len(mimic_lines(circle.text)) == 1
    held = chain((1, 0, line))
    held.find("/jointset/pin_a/a").locked = True
    urdf = to_urdf(held)
    assert mimic_lines(urdf.text) == []
    assert json.loads(urdf.coordinates)["couplers"][0]["dependent"] == "/jointset/pin_b/b"


def test_a_joint_that_is_a_multiple_of_its_coordinate_may_lead():
    """In spine models, each vertebra rotates by a fraction of a coordinate."""
    model = Model(name="spine")
    shares, carrier = (0.2, 0.3), None
    for k, share in enumerate(shares):
        body = model.add(Body(name=f"v{k}", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
        turn = SchemaAxis(
            name="rotation1",
            coordinates=(f"q{k}",),
            function=SimmSpline(x=(-1.0, 1.0), y=(-share, share)),
        )
        joint = CustomJoint(
            name=f"j{k}",
            coordinates=[Coordinate(name=f"q{k}")],
            spatial_transform=SpatialTransform(rotation1=turn),
        )
        model.add(joint.between(carrier or model.ground, body, at=(0.0, 0.1, 0.0)))
        carrier = body
    model.add(
        CoordinateCouplerConstraint(
            name="law",
            dependent_coordinate_name="q1",
            independent_coordinate_names=("q0",),
            coupled_coordinates_function=SimmSpline(x=(-1.0, 1.0), y=(-0.5, 0.5)),
        )
    )
    urdf = to_urdf(model)
    (mimic,) = find_mimics(urdf.robot).values()
    assert mimic.leader == urdf.robot.moving[0].name
    assert mimic.line == pytest.approx((0.3 * 0.5 / 0.2, 0.0))
    assert [r.done for r in urdf.fidelity if r.kind == "coupler"] == ["a joint that mimics another"]
    q = np.array([0.8, 0.4])
    assert worst_body(urdf.robot, yourdfpy_poses(urdf.text, urdf.robot.joint_values(q)), q) < 1e-12


def test_couplers_in_a_circle_keep_their_ratios():
    mechanism = build_mechanism(chain())

    def find_lines(*couplers: tuple[int, int, float]) -> dict[str, tuple[str, float]]:
        constraints = tuple(
            Coupler(dependent, (independent,), Linear(slope, 0.0))
            for dependent, independent, slope in couplers
        )
        mimics = find_mimics(build_robot(replace(mechanism, constraints=constraints)))
        return {name: (mimic.leader, mimic.line.slope) for name, mimic in mimics.items()}

    assert find_lines((1, 0, 2.0), (0, 1, 0.5)) == {"b": ("a", 2.0)}
    # The first coordinate depends on the circle of couplers, but is not part of it.
    assert find_lines((0, 2, 3.0), (2, 1, 2.0), (1, 2, 0.5)) == {"a": ("b", 6.0), "c": ("b", 2.0)}


def test_leaders_follow_nobody():
    mechanism = build_mechanism(chain())
    generator = np.random.default_rng(1)
    for _ in range(60):
        laws = tuple(
            Coupler(int(a), (int(b),), Linear(*generator.uniform(-2.0, 2.0, 2)))
            for a, b in generator.integers(0, 4, (int(generator.integers(1, 5)), 2))
        )
        robot = build_robot(replace(mechanism, constraints=laws))
        following = find_mimics(robot)
        assert not {mimic.leader for mimic in following.values()} & following.keys()
