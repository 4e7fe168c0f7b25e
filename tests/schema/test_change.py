"""Check that the index of a model is rebuilt after any change of the model, and only then."""

from __future__ import annotations

import copy
import pickle

import pytest

from osimlite import Body, Coordinate, Model, PinJoint, PointToPointSpring, SimmSpline
from osimlite.models.dynamic_walker import dynamic_walker


def carrying():
    """Return a model with a body on a pin, and a spring."""
    model = Model(name="m")
    body = model.add(Body(name="b", mass=1.0))
    model.add(PinJoint(name="j", coordinates=[Coordinate(name="q")]).between(model.ground, body))
    model.add(PointToPointSpring(name="s", socket_body1="/ground", socket_body2="/bodyset/b"))
    return model


# Ways to change a model.
CHANGES = {
    "a field": lambda model: setattr(model["/bodyset/b"], "mass", 2.0),
    "a name": lambda model: setattr(model["/bodyset/b"], "name", "c"),
    "a list": lambda model: model.body_set.objects.append(Body(name="c")),
    "a list in an object": lambda model: model["/jointset/j"].coordinates.clear(),
    "another object": lambda model: setattr(model, "ground", type(model.ground)(name="ground")),
    "a default that is asked for later": lambda model: setattr(model.marker_set, "name", "other"),
    "a list that is asked for later": lambda model: model.marker_set.objects.append(_marker()),
    "a part of a default": lambda model: setattr(
        model.model_visual_preferences.ModelDisplayHints, "name", "x"
    ),
    "the model": lambda model: setattr(model, "credits", "me"),
}


def _marker():
    from osimlite import Marker

    return Marker(name="m")


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
@pytest.mark.parametrize("way", ["made", "copied", "pickled"])
def test_every_change_of_a_model_makes_its_own_index_anew(way, change):
    model, other = carrying(), dynamic_walker()
    if way == "copied":
        model = copy.deepcopy(model)
    elif way == "pickled":
        model = pickle.loads(pickle.dumps(model))
    tree, theirs = model.tree(), other.tree()
    assert model.tree() is tree
    change(model)
    assert model.tree() is not tree
    assert other.tree() is theirs


@pytest.mark.parametrize("shared_before", [False, True])
def test_a_number_changes_no_path_and_what_is_shared_stays_known(shared_before):
    model, other = carrying(), Model(name="other")
    body = model["/bodyset/b"]
    if shared_before:
        other.body_set.objects.append(body)
        other.tree()
    before = model.tree()
    body.mass = 2.0
    after = model.tree()
    assert not before.is_current and after is not before and after.is_current
    assert after.components == before.components and model["/bodyset/b"] is body
    if not shared_before:
        other.body_set.objects.append(body)
        other.tree()
        body.mass = 3.0
        model.tree()
    other.tree()
    body.name = "c"
    assert model["/bodyset/c"] is body and other["/bodyset/c"] is body
    body.mass, body.name = 4.0, "d"
    assert model["/bodyset/d"] is body and other["/bodyset/d"] is body


def test_what_came_later_belongs_to_the_model_too():
    model = carrying()
    body = Body(name="late")
    model.body_set.objects.append(body)
    assert model["/bodyset/late"] is body
    body.name = "later"
    assert model["/bodyset/later"] is body and body.path == "/bodyset/later"


def test_a_copy_is_another_model():
    model = carrying()
    tree = model.tree()
    clone = copy.deepcopy(model)
    clone["/bodyset/b"].name = "c"
    clone.body_set.objects.append(Body(name="d"))
    assert model.tree() is tree and clone["/bodyset/c"].name == "c"


@pytest.mark.parametrize("again", [False, True])
def test_an_object_that_two_models_have_concerns_both(again):
    body, first, second = Body(name="b"), Model(name="one"), Model(name="two")
    first.body_set.objects.append(body)
    second.body_set.objects.append(body)
    first.tree(), second.tree()
    if again:
        second.name = "three"
        second.tree()
    body.name = "c"
    assert first["/bodyset/c"] is body and second["/bodyset/c"] is body


def test_building_a_model_beside_another_leaves_that_alone():
    model = dynamic_walker()
    tree = model.tree()
    carrying()
    SimmSpline(x=(0.0, 1.0), y=(0.0, 1.0))
    assert model.tree() is tree
