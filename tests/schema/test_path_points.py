from __future__ import annotations

import osimlite


def make_arm():
    model = osimlite.Model(name="arm")
    arm = model.add(osimlite.Body(name="arm", mass=1.0, inertia=(1, 1, 1, 0, 0, 0)))
    model.add(osimlite.PinJoint(name="elbow").between(model.ground, arm))
    cylinder = osimlite.WrapCylinder(name="cylinder", radius=0.03, length=0.1)
    model.ground.wrap_object_set.objects.append(cylinder)
    return model, arm, cylinder


def test_points_and_wraps_are_added_by_objects_or_names():
    model, arm, cylinder = make_arm()
    muscle = model.add(osimlite.Thelen2003Muscle(name="triceps"))
    first = muscle.geometry_path.add_point(model.ground, (0.0, 0.3, 0.0))
    second = muscle.geometry_path.add_point("/bodyset/arm", (0.0, -0.1, 0.0), name="end")
    wrap = muscle.geometry_path.add_wrap(cylinder)
    assert (first.name, second.name, wrap.wrap_object) == ("path-P1", "end", "cylinder")
    assert muscle.geometry_path.add_wrap("cylinder", method="axial").method == "axial"
    again = osimlite.read_text(osimlite.to_text(model))
    path = again["/forceset/triceps"].geometry_path
    assert [point.name for point in path.path_point_set.objects] == ["path-P1", "end"]
    assert arm.path == "/bodyset/arm"


def test_a_path_of_added_points_has_its_length():
    model, arm, _ = make_arm()
    muscle = osimlite.Thelen2003Muscle(name="triceps")
    muscle.geometry_path.add_point(model.ground, (0.0, 0.3, 0.0))
    muscle.geometry_path.add_point(arm, (0.0, -0.1, 0.0))
    model.add(muscle)
    assert osimlite.paths(model).lengths({}) == {"/forceset/triceps": 0.4}
