"""Check the component tree and the rules of references."""

from __future__ import annotations

import pytest

from osimlite.errors import MissingNameError, ModelError
from osimlite.schema.contact_types import ContactSphere
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.fields import Reference
from osimlite.schema.forces import CoordinateLimitForce
from osimlite.schema.frames import Body
from osimlite.schema.geometry import Geometry
from osimlite.schema.joints import PinJoint
from osimlite.schema.model import Model
from osimlite.schema.resolution import normalize_path
from osimlite.schema.specs import get_field_specs
from osimlite.schema.tree import Use


def failure(model: Model, owner: str, tag: str, text: str) -> str | None:
    component = model.find(owner)
    spec = get_field_specs(type(component))[tag]
    return model.tree().resolve(Use(component, component, spec, text)).failure


def test_every_reference_of_the_walker_resolves(walker: Model) -> None:
    uses = list(walker.tree().uses())
    assert len(uses) > 60
    assert all(walker.tree().resolve(use).target is not None for use in uses if use.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("/bodyset/Platform", None),
        (" /bodyset/Platform ", None),
        ("//bodyset//./Platform/", None),
        ("../../bodyset/Platform", None),
        ("/bodyset/Platfrom", "missing"),
        ("/BodySet/Platform", "missing"),
        ("Platform", "missing"),
        ("bodyset/Platform", "missing"),
        ("/jointset/PlatformToGround", "wrong-type"),
        ("", "empty"),
        ("/../x", "illegal"),
        ("/bodyset/Plat form", "illegal"),
    ],
)
def test_sockets_walk_exactly(walker: Model, text: str, expected: str | None) -> None:
    assert failure(walker, "/jointset/PelvisToPlatform", "socket_parent_frame", text) == expected


def test_a_bare_name_in_a_socket_is_a_child(walker: Model) -> None:
    assert (
        failure(walker, "/jointset/RightThighToPelvis", "socket_child_frame", "RightThigh_offset")
        is None
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("RHip_rz", None),
        ("RHip_rx", "missing"),
        ("/jointset/RightThighToPelvis/RHip_rz", "missing"),
        ("UNASSIGNED", "missing"),
        ("Pelvis", "wrong-type"),
    ],
)
def test_coordinates_are_bare_names(walker: Model, text: str, expected: str | None) -> None:
    assert failure(walker, "/forceset/RHipLimitTorque", "coordinate", text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("RFootContact", None),
        ("/contactgeometryset/RFootContact", None),
        ("contactgeometryset/RFootContact", None),
        ("RFootContct", "missing"),
        ("rfootcontact", "missing"),
        ("RightShank", "missing"),
        ("RFootContact,", "missing"),
    ],
)
def test_contact_geometry_by_path_or_name(walker: Model, text: str, expected: str | None) -> None:
    force = walker.find("/forceset/RFootForce")
    reference = Reference("contactgeometry-path-or-name", "ContactGeometry", "list")
    assert walker.tree().lookup(reference, text, force).failure == expected


def test_spellings_are_what_would_be_right(walker: Model) -> None:
    use = next(use for use in walker.tree().uses() if use.spec.tag == "coordinate")
    assert walker.tree().list_spellings(use) == sorted(
        [
            "platform_rz",
            "Pelvis_rz",
            "Pelvis_tx",
            "Pelvis_ty",
            "RHip_rz",
            "LHip_rz",
            "RKnee_rz",
            "LKnee_rz",
        ]
    )
    for use in walker.tree().uses():
        assert all(
            walker.tree().lookup(use.reference, text, use.owner).target is not None
            for text in walker.tree().list_spellings(use)
        )


def test_duplicates_are_renamed_and_found_by_their_new_name() -> None:
    model = Model(name="m")
    first, second, third = (Body(name="b", mass=float(n)) for n in (1, 2, 3))
    model.body_set.objects.extend((first, second, third))
    model.tree()
    assert [b.path for b in (first, second, third)] == [
        "/bodyset/b",
        "/bodyset/b_0",
        "/bodyset/b_1",
    ]
    assert [(r.component, r.name, r.first) for r in model.tree().renamed] == [
        (second, "b_0", first),
        (third, "b_1", first),
    ]


def test_a_component_without_a_name_is_called_by_its_class() -> None:
    model = Model(name="m")
    assert model.add(Body(mass=1.0)).path == "/bodyset/body"


def test_the_index_follows_every_change() -> None:
    model = Model(name="m")
    body = model.add(Body(name="b"))
    assert body.path == "/bodyset/b"
    body.name = "c"
    assert body.path == "/bodyset/c"
    model.body_set.objects.insert(0, Body(name="c"))
    assert body.path == "/bodyset/c_0"
    model.body_set.objects.remove(body)
    assert body.path == "c"


def test_add_puts_a_component_in_its_set() -> None:
    model = Model(name="m")
    body = Body(name="b", mass=1.0)
    knee = Coordinate(name="knee")
    model.add(body)
    model.add(
        PinJoint(
            name="j", socket_parent_frame=model.ground, socket_child_frame=body, coordinates=[knee]
        )
    )
    model.add(ContactSphere(name="s", socket_frame=body, radius=0.1))
    model.add(CoordinateLimitForce(name="f", coordinate=knee))
    paths = {component.path for component in model.components()}
    assert {"/bodyset/b", "/jointset/j/knee", "/contactgeometryset/s", "/forceset/f"} <= paths
    assert model.tree().target(model.force_set.objects[0], "coordinate", knee) is knee


def test_misspelt_properties_are_refused_with_the_right_one() -> None:
    for attempt in (
        lambda: Body(mas=1.0),  # type: ignore[call-arg]
        lambda: setattr(Body(), "mas", 1.0),
        lambda: Body().mas,
    ):
        with pytest.raises(MissingNameError, match="did you mean 'mass'"):
            attempt()


def test_references_are_typed() -> None:
    with pytest.raises(ModelError, match="expected a PhysicalFrame"):
        PinJoint(name="j", socket_parent_frame=Coordinate(name="c"))
    with pytest.raises(ModelError, match="expected a Coordinate"):
        CoordinateLimitForce(coordinate=Body(name="b"))


def test_find_names_the_nearest_path(walker: Model) -> None:
    with pytest.raises(ModelError, match="/bodyset/Pelvis"):
        walker.find("/bodyset/Pelvs")


@pytest.mark.parametrize(
    ("path", "expected"), [("/a/../b", "/b"), ("/a/./b//c/", "/a/b/c"), ("/..", None), ("/", "/")]
)
def test_paths_are_normalised(path: str, expected: str | None) -> None:
    assert normalize_path(path) == expected


def test_a_frame_takes_over_only_the_geometry_it_draws():
    from osimlite import Brick, Ground, Model

    drawn, held = (
        Brick(name="drawn", socket_frame="/nowhere"),
        Brick(name="held", socket_frame="/nowhere"),
    )
    model = Model(
        name="m", ground=Ground(name="ground", attached_geometry=[drawn], subcomponents=[held])
    )
    tree = model.tree()
    failures = {
        use.owner.name: tree.resolve(use).failure for use in tree.uses() if use.value == "/nowhere"
    }
    assert failures == {"drawn": None, "held": "missing"}


def test_an_object_that_is_made_when_someone_asks_for_it_has_an_owner(walker: Model) -> None:
    tree = walker.tree()
    mesh = next(item for item in walker.components(Geometry) if "appearance" not in item.__dict__)
    appearance = mesh.appearance
    assert not any(item is appearance for item in tree.by_class.get(type(appearance), ()))
    assert tree.owner_of(appearance) is mesh
    assert tree.owner_of(appearance.surface_properties) is mesh


def test_every_object_of_the_file_is_found_by_its_class(walker: Model) -> None:
    by_class = walker.tree().by_class
    result = [id(item) for items in by_class.values() for item in items]
    assert len(result) == len(set(result))
    assert all(type(item) is cls for cls, items in by_class.items() for item in items)
    assert {id(item) for item in walker.walk() if item.source_index is not None} <= set(result)
    assert [id(item) for item in walker.components(Body)] == [id(item) for item in by_class[Body]]


def test_a_path_with_a_blank_is_refused_with_advice() -> None:
    model = Model(name="blank")
    model.add(Body(name="left leg"))
    joint = PinJoint(
        name="j", socket_parent_frame="/ground", socket_child_frame="/bodyset/left leg"
    )
    model.joint_set.objects.append(joint)
    with pytest.raises(
        ModelError, match=r"'/bodyset/left leg', .*white space.*: rename the component"
    ):
        model.tree().target(joint, "socket_child_frame", joint.socket_child_frame)
