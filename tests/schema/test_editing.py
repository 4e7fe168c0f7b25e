"""Check that changes of a model keep its references right."""

from __future__ import annotations

import copy

import pytest

import osimlite
from osimlite.errors import ModelError
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import CoordinateLimitForce, HuntCrossleyForce
from osimlite.schema.frames import Body
from osimlite.schema.joints import Joint, PinJoint
from osimlite.schema.model import Model


def targets(model: Model) -> list[str]:
    """Return the target of every reference, as the index of the component in the tree."""
    place = {id(component): number for number, component in enumerate(model.components())}
    return [
        f"{use.spec.tag} {place[id(model.tree().resolve(use).target)]}"
        for use in model.tree().uses()
        if use.value
    ]


@pytest.mark.parametrize(
    "path",
    [
        "/bodyset/RightShank",
        "/bodyset/Pelvis",
        "/jointset/RightThighToPelvis/RHip_rz",
        "/jointset/RightThighToPelvis/Pelvis_offset",
        "/jointset/RightThighToPelvis",
        "/contactgeometryset/PlatformContact",
        "/forceset/RFootForce",
    ],
)
def test_references_follow_a_new_name(walker: Model, path: str) -> None:
    before = targets(walker)
    walker.rename(walker[path], "renamed")
    assert walker[path.rsplit("/", 1)[0] + "/renamed"].name == "renamed"
    assert targets(walker) == before
    again = osimlite.read_text(osimlite.to_text(walker))
    assert targets(again) == before


def test_names_that_cannot_be(walker: Model) -> None:
    body = walker["/bodyset/Pelvis"]
    for name, reason in (
        ("", "it is empty"),
        ("a b", "it has a blank"),
        ("a/b", "it has '/'"),
        ("a b/c d*", r"it has a blank, '/' and '\*'"),
    ):
        with pytest.raises(ModelError, match=f"not a legal name of a component: {reason}$"):
            walker.rename(body, name)
    with pytest.raises(ModelError, match="has a 'RightThigh' already"):
        walker.rename(body, "RightThigh")
    with pytest.raises(ModelError, match="not in the model"):
        walker.rename(Body(name="stranger"), "x")
    assert body.name == "Pelvis"


def test_what_others_name_is_not_removed(walker: Model) -> None:
    with pytest.raises(ModelError, match="/forceset/RFootForce names it"):
        walker.remove(walker["/contactgeometryset/RFootContact"])
    walker.remove(walker["/forceset/RFootForce"])
    walker.remove(walker["/contactgeometryset/RFootContact"])
    assert "RFoot" not in osimlite.to_text(walker)
    with pytest.raises(ModelError, match="every model has one"):
        walker.remove(walker["/probeset"])


def test_iteration_by_class_and_parents(walker: Model) -> None:
    assert [c.name for c in walker.components(Coordinate)][:2] == ["platform_rz", "Pelvis_rz"]
    assert all(isinstance(joint, Joint) for joint in walker.components(Joint))
    hip = walker["/jointset/RightThighToPelvis/RHip_rz"]
    assert hip.parent is walker["/jointset/RightThighToPelvis"]
    assert walker.parent is None


def test_a_copy_of_a_component_names_the_same_others() -> None:
    model = dynamic_walker()
    joint = model["/jointset/RightThighToPelvis"]
    twin = copy.deepcopy(joint)
    assert isinstance(twin, PinJoint) and isinstance(joint, PinJoint)
    assert twin.socket_child_frame is twin.frames[1] and twin.frames[1] is not joint.frames[1]
    assert twin.frames[0].socket_parent is model["/bodyset/Pelvis"]


def test_a_copy_of_a_model_stands_alone() -> None:
    model = dynamic_walker()
    twin = copy.deepcopy(model)
    assert twin == model
    originals = {id(item) for item in model.walk()}
    assert not originals & {id(item) for item in twin.walk()}
    force = twin["/forceset/RHipLimitTorque"]
    assert isinstance(force, CoordinateLimitForce)
    assert force.coordinate is twin["/jointset/RightThighToPelvis/RHip_rz"]
    contact = twin["/forceset/RFootForce"]
    assert isinstance(contact, HuntCrossleyForce)
    twin.rename(twin["/bodyset/Pelvis"], "hips")
    assert model["/bodyset/Pelvis"].name == "Pelvis"
    assert twin != model


def test_a_part_that_opensim_makes_for_itself_keeps_its_owner() -> None:
    model = Model(name="m")
    body = model.add(Body(name="b", mass=1.0))
    point = osimlite.PathPoint(name="p", socket_parent_frame=body)
    path = osimlite.GeometryPath(path_point_set=osimlite.PathPointSet(objects=[point]))
    spring = model.add(osimlite.PathSpring(name="s", geometry_path=path))
    model.add(osimlite.MeyerFregly2016Force(name="f", socket_station="/forceset/s/path/p/station"))
    with pytest.raises(ModelError, match="/forceset/f names it"):
        model.remove(spring)


def test_inputs_follow_a_name() -> None:
    model = dynamic_walker()
    knee = "/jointset/RightShankToThigh/RKnee_rz"
    assert isinstance(model[knee], Coordinate)
    table = osimlite.TableReporter__double_(
        name="table", input_inputs=(f"{knee}|speed(flexion)", "/none|value")
    )
    model.subcomponents.append(table)
    model.rename(model["/jointset/RightShankToThigh"], "knee")
    assert table.input_inputs == ("/jointset/knee/RKnee_rz|speed(flexion)", "/none|value")
    with pytest.raises(ModelError, match="RKneeLimitTorque and /table name it"):
        osimlite.schema.editing.remove_component(model, model["/jointset/knee"])


def test_a_model_takes_no_second_component_of_a_name(walker: Model) -> None:
    with pytest.raises(ModelError, match="there is a Body 'Pelvis' in the model already"):
        walker.add(Body(name="Pelvis", mass=1))
    body = Body(name="Head", mass=1)
    walker.add(body)
    with pytest.raises(ModelError, match="Body 'Head' is in the model already"):
        walker.add(body)
    # A joint may have the same name, because its path differs.
    walker.add(PinJoint(name="Pelvis"))
    assert walker["/jointset/Pelvis"].path == "/jointset/Pelvis"


def test_a_name_alone_is_answered_with_its_path(walker: Model) -> None:
    with pytest.raises(
        ModelError,
        match="no component at 'RHip_rz'; did you mean '/jointset/RightThighToPelvis/RHip_rz'",
    ):
        walker["RHip_rz"]


def test_a_wrong_path_is_answered_with_one_of_the_same_side() -> None:
    model = Model()
    for side in "lr":
        model.add(PinJoint(name=f"knee_{side}", coordinates=[Coordinate(name="flexion")]))
    with pytest.raises(ModelError, match="did you mean '/jointset/knee_r/flexion'"):
        model["/jointset/kne_r/flexion"]


@pytest.mark.parametrize("function", ["mechanism", "to_urdf", "to_text", "simulate"])
def test_a_path_in_place_of_a_model_is_told_to_be_read(function: str) -> None:
    with pytest.raises(
        osimlite.OsimliteError,
        match=r"expected a Model, found a path; .* osimlite.read\('x.osim'\)",
    ):
        getattr(osimlite, function)("x.osim")
    with pytest.raises(osimlite.OsimliteError, match="expected a Model, found a NoneType"):
        getattr(osimlite, function)(None)


def test_a_class_that_is_not_there_is_answered_with_the_nearest() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'PinJont'; did you mean 'PinJoint'"):
        osimlite.PinJont  # noqa: B018
    assert not hasattr(osimlite, "joints.PinJoint")


def test_parts_of_the_package_are_there_without_being_imported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delattr(osimlite, "studies", raising=False)
    assert osimlite.studies.__name__ == "osimlite.studies"
