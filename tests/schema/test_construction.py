"""Check construction of every class: the reader's fast path equals validated construction.

The tests also cover copies, pickles and misspelt names.
"""

from __future__ import annotations

import copy
import inspect
import pickle
import pydoc
from importlib import import_module
from typing import Annotated

import numpy as np
import pytest
from pydantic import BaseModel, field_validator

import osimlite
from osimlite.errors import MissingNameError, ModelError
from osimlite.schema.base import Object, put_model
from osimlite.schema.fields import Integer, Number, ObjectField, Reference, Value, Vec3, vec3
from osimlite.schema.model import Model
from osimlite.schema.registry import MODULES
from osimlite.schema.specs import get_defaults, get_field_specs
from tests.cases import of_each

CLASSES = {name: getattr(import_module(module), name) for name, module in MODULES.items()}

every_class = of_each(CLASSES.values(), lambda cls: cls.__name__)


def filled(cls: type[Object]) -> Object:
    """Return an instance in which every property differs from its default."""
    values: dict[str, object] = {"name": "filled"}
    for spec in get_field_specs(cls).values():
        kind = spec.kind
        if isinstance(kind, Reference):
            values[spec.name] = ("one", "two") if kind.shape == "list" else "one"
        elif isinstance(kind, Value):
            word = {"double": 0.5, "int": 7, "bool": True, "string": "word"}[kind.scalar]
            size = kind.size or kind.most or max(kind.least, 2)
            values[spec.name] = word if kind.shape in ("single", "optional") else (word,) * size
        elif isinstance(kind, ObjectField) and kind.form == "list":
            values[spec.name] = []
    return cls(**values)


@every_class
def test_the_short_way_in_equals_the_validated_one(cls: type[Object]) -> None:
    assert cls.build({}, set()) == cls.model_construct() == cls()
    assert cls.build({}, set()).model_fields_set == cls().model_fields_set == set()
    full = filled(cls)
    values = {name: getattr(full, name) for name in full.model_fields_set}
    assert cls.build(values, set(values)) == full
    assert cls.model_construct(**values) == full
    for given in ({}, values):
        plainly = BaseModel.__dict__["model_construct"].__func__(cls, **given)
        built = cls.build(given, set(given))
        for name, value in plainly.__dict__.items():
            assert repr(getattr(built, name)) == repr(value), name
        assert built.__dict__.keys() == plainly.__dict__.keys()


@every_class
def test_defaults_pass_their_own_validation(cls: type[Object]) -> None:
    plain, _ = get_defaults(cls)
    again = cls(**plain)
    for name, value in plain.items():
        assert repr(getattr(again, name)) == repr(value), name
    for spec in get_field_specs(cls).values():
        value = getattr(cls(), spec.name)
        assert repr(spec.kind.check(value, spec.accepts)) == repr(value), spec.name


@every_class
def test_two_instances_share_no_part(cls: type[Object]) -> None:
    one, other = cls(), cls()
    for spec in get_field_specs(cls).values():
        value = getattr(one, spec.name)
        if isinstance(value, (list, Object)):
            assert value is not getattr(other, spec.name), spec.name


@every_class
def test_copies_and_pickles_are_equal_and_keep_what_was_set(cls: type[Object]) -> None:
    full = filled(cls)
    for clone in (
        copy.deepcopy(full),
        full.copy_deep(),
        pickle.loads(pickle.dumps(full)),
        copy.copy(full),
    ):
        assert clone == full
        assert clone is not full
        assert clone.model_fields_set == full.model_fields_set
    deep = copy.deepcopy(full)
    before = [id(item) for item in full.walk()]
    assert not set(before) & {id(item) for item in deep.walk()}


@every_class
def test_a_misspelt_property_is_told(cls: type[Object]) -> None:
    item = cls()
    with pytest.raises(
        MissingNameError, match=f"{cls.__name__} has no property 'nmae'; did you mean 'name'"
    ):
        item.nmae = "x"
    with pytest.raises(MissingNameError, match="no property 'nmae'"):
        cls(nmae="x")
    with pytest.raises(MissingNameError, match="no property 'nmae'"):
        _ = item.nmae
    assert not hasattr(item, "nmae")


@every_class
def test_a_value_of_the_wrong_kind_is_refused(cls: type[Object]) -> None:
    for spec in get_field_specs(cls).values():
        with pytest.raises(ModelError, match=spec.name):
            cls(**{spec.name: object()})


@every_class
def test_every_property_can_be_given_by_its_tag(cls: type[Object]) -> None:
    for spec in get_field_specs(cls).values():
        if spec.tag == spec.name or not spec.tag.isidentifier():
            continue
        value = getattr(cls(), spec.name)
        item = cls(**{spec.tag: value})
        assert spec.name in item.model_fields_set
        other, model = cls(), Model()
        tree = model.tree()
        put_model(other, model)
        setattr(other, spec.tag, value)
        assert spec.name in other.model_fields_set
        assert not tree.is_current
        if not hasattr(cls, spec.tag):
            assert getattr(other, spec.tag) is getattr(other, spec.name)


def test_no_validator_is_built_for_values_that_are_right() -> None:
    """Building pydantic's validator of a class takes milliseconds, and searches all its plug-ins."""

    class Lamp(Object):
        watts: Number = 40.0
        place: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)

    lamp = Lamp(name="lamp", watts=np.float64(60.0))
    lamp.place = [1, 2, 3]  # type: ignore[assignment]
    assert (lamp.watts, type(lamp.watts), lamp.place) == (60.0, float, (1.0, 2.0, 3.0))
    assert lamp.model_fields_set == {"name", "watts", "place"}
    assert not Lamp.__pydantic_complete__
    with pytest.raises(ModelError, match=r"^Lamp.watts: expected a number, got 'much'$"):
        lamp.watts = "much"  # type: ignore[assignment]
    assert lamp.watts == 60.0 and Lamp.__pydantic_complete__


def test_a_class_with_validators_of_its_own_has_them_run() -> None:
    class Even(Object):
        count: Integer = 0

        @field_validator("count")
        @classmethod
        def expect_even(cls, value: int) -> int:
            if value % 2:
                raise ValueError("expected an even number")
            return value

    even = Even(count=2)
    with pytest.raises(ModelError, match="expected an even number"):
        even.count = 3
    with pytest.raises(ModelError, match="expected an even number"):
        Even(count=1)


def test_where_a_component_stands_and_the_path_of_a_muscle_are_two_things() -> None:
    muscle = CLASSES["Thelen2003Muscle"](name="biceps")
    line = CLASSES["GeometryPath"](name="path")
    muscle.path = line
    assert muscle.path == "biceps"
    assert muscle.geometry_path is line


def test_a_property_without_a_name_takes_exactly_its_class() -> None:
    point = CLASSES["ConditionalPathPoint"](name="p")
    with pytest.raises(ModelError, match="expected a PathPoint and no class derived from it"):
        CLASSES["Scholz2015GeometryPathPoint"](path_point=point)


def test_coordinates_that_were_named_keep_their_names_in_a_model():
    from osimlite import Body, Model, UniversalJoint

    model = Model(name="m")
    joint = UniversalJoint(name="hip")
    joint.coordinates[1].name = "swing"
    model.add(joint.between(model.ground, model.add(Body(name="thigh", mass=1.0))))
    assert [coordinate.name for coordinate in joint.coordinates] == ["hip_coord_0", "swing"]


@pytest.mark.parametrize(
    ("cls", "given", "meant"),
    [
        ("ContactSphere", "frame", "socket_frame"),
        ("PinJoint", "parent", "socket_parent_frame"),
        ("Body", "mas", "mass"),
    ],
)
def test_a_socket_is_known_by_the_middle_of_its_name(cls, given, meant):
    with pytest.raises(MissingNameError, match=f"did you mean '{meant}'"):
        CLASSES[cls](**{given: "/ground"})


def test_nearest_names_are_looked_for_only_if_the_message_is_read(monkeypatch):
    """`hasattr`, and `getattr` with a default, drop the error without reading its message."""
    asked = []
    monkeypatch.setattr(
        "osimlite.schema.base.describe_unknown_property",
        lambda cls, name: asked.append(name) or f"no '{name}'",
    )
    body = CLASSES["Body"](name="b")
    assert not hasattr(body, "geometry_path") and getattr(body, "masss", None) is None
    assert not asked
    with pytest.raises(MissingNameError, match="no 'masss'"):
        body.masss  # noqa: B018
    assert asked == ["masss"]


def test_a_missing_name_passes_to_other_processes():
    with pytest.raises(MissingNameError) as caught:
        CLASSES["Body"](name="b").masss  # noqa: B018
    caught.value.file, caught.value.line = "a.osim", 3
    other = pickle.loads(pickle.dumps(caught.value))
    assert (
        str(other)
        == str(caught.value)
        == "a.osim:3: Body has no property 'masss'; did you mean 'mass'?"
    )


def test_a_list_where_a_set_belongs_is_told_how_to_make_the_set():
    with pytest.raises(
        ModelError, match=r"write HuntCrossleyForce\.ContactParametersSet\(objects=\[\.\.\.\]\)"
    ):
        CLASSES["HuntCrossleyForce"](
            contact_parameters=[CLASSES["HuntCrossleyContactParameters"]()]
        )


@every_class
def test_the_docstring_has_every_property(cls):
    own = cls.__dict__["__doc__"]
    if own is None:
        return
    assert own.splitlines()[0] in cls.__doc__
    # `help` shows the properties too; formatting them takes a hundred times as long.
    text = inspect.getdoc(cls)
    assert text is not None
    section = text.split("Properties, in the order of a file:")[1]
    for spec in get_field_specs(cls).values():
        assert f" {spec.name}: " in section


@pytest.mark.parametrize("name", ["Body", "Thelen2003Muscle"])
def test_help_shows_the_docstring_with_the_properties(name):
    shown = pydoc.render_doc(CLASSES[name], renderer=pydoc.plaintext)
    section = shown.split("Properties, in the order of a file:")[1]
    for spec in get_field_specs(CLASSES[name]).values():
        assert f" {spec.name}: " in section


def test_the_docstring_says_units_and_defaults():
    assert "    mass_center: 3 numbers in m; 0 0 0 by default" in CLASSES["Body"].__doc__
    assert (
        "socket_frame: the name of a PhysicalFrame; nothing by default"
        in CLASSES["ContactSphere"].__doc__
    )


def test_a_star_brings_the_component_classes():
    names: dict[str, object] = {}
    exec("from osimlite import *", names)
    assert names["PinJoint"] is osimlite.PinJoint and names["simulate"] is osimlite.simulate


def test_values_of_the_stored_form_are_assigned_without_validation() -> None:
    body = osimlite.Body(name="b")
    body.assign("mass", 2.5)
    assert body.mass == 2.5 and "mass" in body.model_fields_set
    assert "<mass>2.5</mass>" in osimlite.to_text(
        osimlite.Model(name="m", body_set=osimlite.BodySet(objects=[body]))
    )
