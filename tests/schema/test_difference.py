"""Check the differences of meaning between two models."""

from __future__ import annotations

import copy

import osimlite
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.difference import Difference, find_differences
from osimlite.schema.model import Model


def test_a_model_does_not_differ_from_its_copies(walker: Model) -> None:
    assert find_differences(walker, copy.deepcopy(walker)) == []
    assert find_differences(walker, osimlite.read_text(osimlite.to_text(walker))) == []


def test_writing_defaults_down_and_spelling_paths_differently_change_nothing(walker: Model) -> None:
    """The file states the axes of every frame, the model made in Python leaves them at their defaults."""
    assert find_differences(walker, dynamic_walker()) == []


def test_every_kind_of_change(walker: Model) -> None:
    new = copy.deepcopy(walker)
    new["/bodyset/Pelvis"].mass = 2.0
    new["/forceset/RFootForce"].contact_parameters.objects[0].stiffness = 2e6
    new["/contactgeometryset/RFootContact"].socket_frame = "/bodyset/RightThigh"
    new.remove(new["/forceset/LFootForce"])
    new.rename(new["/forceset/RHipLimitTorque"], "stop")
    assert find_differences(walker, new) == [
        Difference("/forceset/LFootForce", "", "HuntCrossleyForce", None),
        Difference("/forceset/RHipLimitTorque", "", "CoordinateLimitForce", None),
        Difference("/bodyset/Pelvis", "mass", 1.0, 2.0),
        Difference("/forceset/RFootForce", "contact_parameters.objects.stiffness", 1e6, 2e6),
        Difference(
            "/contactgeometryset/RFootContact",
            "socket_frame",
            "/bodyset/RightShank",
            "/bodyset/RightThigh",
        ),
        Difference("/forceset/stop", "", None, "CoordinateLimitForce"),
    ]


def test_another_class_and_what_both_have() -> None:
    """Properties with their default values and parts that a class creates itself are ignored."""
    old, new = Model(name="m"), Model(name="m")
    old.add(osimlite.Thelen2003Muscle(name="soleus", max_isometric_force=100.0))
    new.add(osimlite.RigidTendonMuscle(name="soleus", max_isometric_force=200.0, min_control=0.01))
    assert find_differences(old, new) == [
        Difference("/forceset/soleus", "class", "Thelen2003Muscle", "RigidTendonMuscle"),
        Difference("/forceset/soleus", "max_isometric_force", 100.0, 200.0),
    ]


def test_another_class_and_what_only_one_has() -> None:
    """Numbers, references and objects of one class are added or removed."""
    transform = osimlite.SpatialTransform()
    transform.rotation1.axis = (1.0, 1.0, 0.0)
    old, new = Model(name="m"), Model(name="m")
    for model in (old, new):
        model.add(osimlite.Body(name="bone", mass=1.0))
    old.add(osimlite.CoordinateActuator(name="motor", coordinate="knee", optimal_force=2.0))
    new.add(osimlite.PointActuator(name="motor", body="bone", point=(1.0, 0.0, 0.0)))
    old.add(osimlite.WeldJoint(name="hip"))
    new.add(osimlite.CustomJoint(name="hip", spatial_transform=transform))
    motor, hip = "/forceset/motor", "/jointset/hip"
    assert find_differences(old, new) == [
        Difference(hip, "class", "WeldJoint", "CustomJoint"),
        Difference(hip, "SpatialTransform", None, "SpatialTransform"),
        Difference(motor, "class", "CoordinateActuator", "PointActuator"),
        Difference(motor, "coordinate", "knee", None),
        Difference(motor, "optimal_force", 2.0, 1.0),
        Difference(motor, "body", None, "/bodyset/bone"),
        Difference(motor, "point", None, (1.0, 0.0, 0.0)),
    ]


def test_differences_are_symmetric(walker: Model) -> None:
    other = dynamic_walker(thigh_length=0.42)
    there, back = find_differences(walker, other), find_differences(other, walker)
    assert there and {(d.path, d.what, d.old, d.new) for d in there} == {
        (d.path, d.what, d.new, d.old) for d in back
    }
