"""Tests of models with extreme numbers: MuJoCo accepts the export, or a one-line error refuses it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

import osimlite
from osimlite import CoordinateCouplerConstraint, CustomJoint, Model, PinJoint, WeldJoint
from osimlite.errors import ModelError, OsimliteError
from osimlite.schema.base import Object
from osimlite.schema.geometry import Geometry
from osimlite.schema.geometry_types import Brick, Cylinder, Ellipsoid, Sphere
from osimlite.schema.millard_muscles import Millard2012EquilibriumMuscle
from osimlite.schema.splines import SimmSpline
from tests.simple_models import make_pendulum, make_single_body
from tests.translate.mjcf.support import HOSTILE, hostile

FIXTURES = Path(__file__).resolve().parents[3] / "fixtures"
FILES = ("lint/skeleton.osim", "lint/limb.osim", "walker/DynamicWalkerModel.osim")
NUMBERS = st.one_of(
    st.sampled_from(
        (
            1e-320,
            1e308,
            -1e308,
            -0.0,
            0.0,
            float("inf"),
            float("-inf"),
            float("nan"),
            1e-16,
            1e30,
            -1.0,
        )
    ),
    st.floats(),
)
OPTIONS = st.sampled_from(
    ({}, {}, {"mujoco": 3}, {"driver": True}, {"contact": "none"}, {"spline": "quartic"})
)


def numbers(model: Model) -> list[tuple[Object, str, int | None]]:
    """Return all numbers of a model as object, property, and index in a list."""

    def held(thing: Object) -> Iterator[tuple[Object, str, int | None]]:
        for name in type(thing).model_fields:
            value = getattr(thing, name)
            items = value if isinstance(value, list | tuple) else [value]
            if isinstance(value, float):
                yield thing, name, None
            elif items and all(isinstance(item, float) for item in items):
                yield from ((thing, name, index) for index in range(len(items)))
            for item in items:
                if isinstance(item, Object) and id(item) not in seen:
                    seen.add(id(item))
                    yield from held(item)

    seen: set[int] = {id(model)}
    return list(held(model))


def taken(model: Model, **options: Any) -> bool:
    """Return whether the model can be exported; MuJoCo must accept the export."""
    try:
        mjcf = osimlite.to_mjcf(model, **options)
    except OsimliteError as refusal:
        assert "\n" not in str(refusal)
        return False
    mujoco.MjModel.from_xml_string(mjcf.text, mjcf.files)
    return True


def with_shape(shape: Geometry) -> Model:
    model = make_pendulum()
    model["/bodyset/bob"].attach(shape)
    return model


@settings(
    max_examples=15,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
    deadline=None,
)
@given(st.sampled_from((None, *FILES)), st.data(), OPTIONS)
def test_mujoco_takes_models_with_any_numbers(
    file: str | None, data: st.DataObject, options: dict[str, Any]
) -> None:
    if file is None:
        names = st.one_of(st.sampled_from(HOSTILE), st.text(max_size=6))
        model = hostile(data.draw(st.lists(names, min_size=50, max_size=50)))
    else:
        model = osimlite.read(FIXTURES / file)
    places = numbers(model)
    for place in data.draw(
        st.lists(st.sampled_from(range(len(places))), min_size=1, max_size=3, unique=True)
    ):
        thing, name, which = places[place]
        value, new = getattr(thing, name), data.draw(NUMBERS)
        try:
            setattr(
                thing, name, new if which is None else (*value[:which], new, *value[which + 1 :])
            )
        except ValidationError:
            assume(False)
    taken(model, **options)


@given(st.lists(NUMBERS, min_size=3, max_size=6), NUMBERS)
@example([-1e308, -1e308, 0.05], 11.0)
@example([-2.0, -1.0, 0.05], 1.0)
@example([-2.0, -1.0, -1.0], 1.0)
@example([1e308, 1e308, 1e308], 1.0)
@example([1e308, 0.0, -1e308], 1.0)
@example([1.0, 1.0, 1.0, 1e308, 1e308, 1e308], 1.0)
@example([0.1, 0.3, 0.4], 1e-320)
def test_mujoco_takes_bodies_of_any_inertia(inertia: list[float], mass: float) -> None:
    for joint in (PinJoint(name="joint"), WeldJoint(name="joint")):
        model = make_single_body(joint, body="bob")
        body = model["/bodyset/bob"]
        body.inertia = (*inertia, *[0.0] * (6 - len(inertia)))
        body.mass = mass
        taken(model)


@given(st.sampled_from(("radius", "flat", "brick", "thin", "low", "scale", "color")), NUMBERS)
@example("radius", 0.0)
@example("brick", -1.0)
@example("scale", float("nan"))
@example("low", 1e308)
@example("color", 1e39)
def test_shapes_of_any_size(what: str, number: float) -> None:
    shapes = {
        "radius": Sphere(radius=number),
        "flat": Ellipsoid(radii=(number, 0.1, 0.2)),
        "brick": Brick(half_lengths=(0.1, number, 0.1)),
        "thin": Cylinder(radius=number, half_height=0.1),
        "low": Cylinder(radius=0.1, half_height=number),
        "scale": Cylinder(radius=0.1, half_height=0.1, scale_factors=(number, 1.0, 1.0)),
    }
    shape = shapes.get(what, Sphere(radius=0.1))
    if what == "color":
        shape.appearance.color = (number, 0.5, 0.5)
    assert taken(with_shape(shape)) or what == "color"


def test_a_shape_without_a_size_is_left_out_with_a_word() -> None:
    model = with_shape(Brick(half_lengths=(0.1, 0.0, 0.1)))
    for translated in (osimlite.to_mjcf(model), osimlite.to_urdf(model)):
        (record,) = [record for record in translated.fidelity.records if record.kind == "visual"]
        assert record.cannot_say == "a shape whose size is not a positive number"
        assert record.detail == "0.2 0 0.2 m"


@pytest.mark.parametrize("gravity", [1e308, 1e-320, -1e200])
def test_a_camera_stands_upright_in_any_gravity(gravity: float) -> None:
    model = with_shape(Sphere(radius=0.1))
    model.gravity = (gravity, gravity, 0.0)
    assert taken(model)


@pytest.mark.parametrize("size", [1e308, 1e200])
def test_an_axis_whose_length_is_no_number_is_refused(size: float) -> None:
    model = hostile(f"n{k}" for k in range(50))
    joint = next(iter(model.components(CustomJoint)))
    joint.spatial_transform.rotation1.axis = (0.0, 0.0, size)
    with pytest.raises(ModelError, match="has no direction"):
        osimlite.to_mjcf(model)


@pytest.mark.parametrize(
    ("name", "number"),
    [
        *(("max_contraction_velocity", number) for number in (1e-320, 0.0, -1.0)),
        ("optimal_fiber_length", 1e-30),
    ],
)
def test_a_muscle_that_cannot_shorten_is_left_out_with_a_word(name: str, number: float) -> None:
    model = hostile(f"n{k}" for k in range(50))
    muscle = next(iter(model.components(Millard2012EquilibriumMuscle)))
    setattr(muscle, name, number)
    mjcf = osimlite.to_mjcf(model)
    mujoco.MjModel.from_xml_string(mjcf.text, mjcf.files)
    own = [item for item in mjcf.fidelity.records if item.component == f"/forceset/{muscle.name}"]
    (record,) = [item for item in own if item.kind == "force"]
    assert record.done.startswith("left out: ")


@pytest.mark.parametrize("factor", [1e308, -1e308, float("inf"), float("nan")])
@pytest.mark.parametrize("spline", ["series", "quartic"])
def test_a_function_that_cannot_be_fitted_is_refused_with_its_number(
    factor: float, spline: Any
) -> None:
    model = hostile(f"n{k}" for k in range(50))
    coupler = next(iter(model.components(CoordinateCouplerConstraint)))
    coupler.coupled_coordinates_function = SimmSpline(
        x=(-1.0, 0.0, 0.5, 1.0), y=(0.0, 0.1, 0.4, 0.5)
    )
    coupler.scale_factor = factor
    with pytest.raises(
        OsimliteError,
        match=r"^scale_factor of '/constraintset/n18', \S+, is too large or too small",
    ):
        osimlite.to_mjcf(model, spline=spline)
