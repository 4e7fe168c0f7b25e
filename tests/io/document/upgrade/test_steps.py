"""Check every step of the upgrade on a small document that needs it.

OpenSim's errors in these steps are not repeated.
"""

from __future__ import annotations

import inspect
import sys
from pathlib import Path
from typing import Any

import pytest

from osimlite.errors import VersionError
from osimlite.io.document.printer import to_text
from osimlite.io.document.reader import Document, read_document, read_text
from osimlite.io.document.source import Source
from osimlite.io.document.upgrade import list_steps
from osimlite.io.document.upgrade.version_3_appearance import compose_transforms
from osimlite.schema.base import Object
from osimlite.schema.model import CURRENT_VERSION, Model

STEPS = list_steps()

BODIES = """
<BodySet> <objects>
    <Body name="ground"> <Joint /> </Body>
    <Body name="thigh"> <mass>2</mass>
        <Joint> <PinJoint name="hip"> <parent_body>ground</parent_body>
            <CoordinateSet> <objects> <Coordinate name="flexion" /> </objects> </CoordinateSet>
        </PinJoint> </Joint>
    </Body>
</objects> </BodySet>
"""

FOUR_AXES = (
    "<TransformAxisSet> <objects>"
    + 4 * "\n<TransformAxis> <is_rotation>true</is_rotation> </TransformAxis>"
    + "</objects> </TransformAxisSet>"
)


def document(inside: str, version: int = 30000) -> Document:
    text = f'<OpenSimDocument Version="{version}"><Model name="old">\n{inside}\n</Model></OpenSimDocument>'
    return read_document(Source(text.encode()))


def unresolved(model: Model) -> list[str]:
    tree = model.tree()
    return [f"{use.spec.name} {use.value}" for use in tree.uses() if tree.resolve(use).failure]


@pytest.mark.parametrize("step", STEPS, ids=lambda step: step.name)
def test_a_step_does_what_its_example_shows(step, fixtures: Path) -> None:
    (example,) = (fixtures / "versions").glob(f"{step.name}.*")
    old = read_document(Source.from_file(example), expected_class=Object)
    assert old.version < step.below
    assert step.name in {change.step for change in old.changes}
    assert to_text(old.top) == (fixtures / "versions" / "upgraded" / example.name).read_text()
    assert not isinstance(old.top, Model) or unresolved(old.model) == []


@pytest.mark.parametrize("step", STEPS, ids=lambda step: step.name)
def test_what_is_upgraded_needs_no_upgrade(step, fixtures: Path) -> None:
    (path,) = (fixtures / "versions" / "upgraded").glob(f"{step.name}.*")
    new = read_document(Source.from_file(path), expected_class=Object)
    assert (new.version, new.changes, new.notes) == (CURRENT_VERSION, [], [])
    assert to_text(new.top) == path.read_text()


def test_steps_run_oldest_first_and_only_where_needed(fixtures: Path) -> None:
    old = read_document(Source.from_file(fixtures / "versions" / "path_names.osim"))
    assert {change.step for change in old.changes} == {"path_names"}
    assert all(step.below <= CURRENT_VERSION for step in STEPS)
    assert len({step.name for step in STEPS}) == len(STEPS)
    assert [step.name for step in list_steps(CURRENT_VERSION)] == []


def test_every_public_function_of_the_modules_of_steps_is_a_step() -> None:
    listed = {step.apply for step in STEPS}
    for name in {step.apply.__module__ for step in STEPS}:
        module = sys.modules[name]
        functions = [
            function
            for function in vars(module).values()
            if inspect.isfunction(function)
            and function.__module__ == name
            and not function.__name__.startswith("_")
            and next(iter(inspect.signature(function).parameters)) == "draft"
        ]
        assert set(functions) <= listed


def test_the_model_knows_its_old_version() -> None:
    model = document(BODIES).model
    assert model.document_version == 30000
    assert 'Version="40600"' in to_text(model)


def test_numbers_keep_their_digits() -> None:
    digits = "0.12345678901234"
    model = document(
        BODIES.replace(
            "<CoordinateSet>",
            f"<location_in_parent>{digits} 0 0</location_in_parent> <orientation>0 0 {digits}</orientation>"
            "<CoordinateSet>",
        ).replace("<mass>2</mass>", f"<mass>2</mass> <inertia_xy>{digits}</inertia_xy>")
    ).model
    assert model["/jointset/hip/ground_offset"].translation == (0.12345678901234, 0.0, 0.0)
    assert model["/jointset/hip/thigh_offset"].orientation == (0.0, 0.0, 0.12345678901234)
    assert model["/bodyset/thigh"].inertia == (1.0, 1.0, 1.0, 0.12345678901234, 0.0, 0.0)


def test_references_follow_a_name_that_loses_its_white_space() -> None:
    model = document(
        BODIES.replace("thigh", "left  thigh").replace("flexion", "left hip flexion")
        + """<ForceSet> <objects>
            <CoordinateActuator name="hip motor"> <coordinate>left hip flexion</coordinate> </CoordinateActuator>
        </objects> <groups> <ObjectGroup name="all motors"> <members>hip motor</members> </ObjectGroup> </groups>
        </ForceSet>
        <ControllerSet> <objects> <ControlSetController name="c"> <actuator_list>hip motor</actuator_list>
        </ControlSetController> </objects> </ControllerSet>
        <MarkerSet> <objects> <Marker name="m"> <body>left thigh</body> </Marker> </objects> </MarkerSet>"""
    ).model
    assert unresolved(model) == []
    assert model["/jointset/hip/leftthigh_offset"].socket_parent == "/bodyset/leftthigh"
    assert model["/controllerset/c"].socket_actuators == ("/forceset/hipmotor",)
    assert model["/markerset/m"].socket_parent_frame == "/bodyset/leftthigh"
    assert model.force_set.groups[0].members == ("hipmotor",)


def test_each_name_of_a_list_loses_its_white_space() -> None:
    motors = "".join(
        f'<CoordinateActuator name="{name}"> <coordinate>flexion</coordinate> </CoordinateActuator>'
        for name in ("hip motor", "motor", "left hip motor")
    )
    model = document(
        BODIES
        + f"""<ForceSet> <objects> {motors} </objects> </ForceSet>
        <ControllerSet> <objects> <ControlSetController name="c">
        <actuator_list>motor left hip motor hip motor</actuator_list>
        </ControlSetController> </objects> </ControllerSet>"""
    ).model
    assert model["/controllerset/c"].socket_actuators == (
        "/forceset/motor",
        "/forceset/lefthipmotor",
        "/forceset/hipmotor",
    )


def test_a_name_without_its_white_space_may_be_taken() -> None:
    second = '<Body name="thi gh"> <Joint> <PinJoint name="j"> <parent_body>thigh</parent_body> </PinJoint> </Joint> </Body>'
    model = document(
        BODIES.replace("</objects> </BodySet>", second + "</objects> </BodySet>")
        + "<MarkerSet> <objects> <Marker name='m'> <body>thi gh</body> </Marker> </objects> </MarkerSet>"
    ).model
    assert [body.name for body in model.body_set.objects] == ["thigh", "thigh_0"]
    assert model["/markerset/m"].socket_parent_frame == "/bodyset/thigh_0"


def test_both_frames_of_one_body_are_found() -> None:
    model = document(
        BODIES
        + """<ForceSet> <objects> <BushingForce name="b"> <body_1>thigh</body_1> <body_2>thigh</body_2>
        <location_body_1>1 0 0</location_body_1> <location_body_2>0 2 0</location_body_2> </BushingForce>
        </objects> </ForceSet>"""
    ).model
    bushing = model["/forceset/b"]
    assert (bushing.socket_frame1, bushing.socket_frame2) == ("thigh_offset", "thigh_offset_0")
    assert model["/forceset/b/thigh_offset"].translation == (1.0, 0.0, 0.0)
    assert model["/forceset/b/thigh_offset_0"].translation == (0.0, 2.0, 0.0)


def test_a_coordinate_is_found_though_something_else_has_its_name() -> None:
    model = document(
        BODIES.replace('name="thigh"', 'name="flexion"')
        + """<ForceSet> <objects> <PathSpring name="s"> <GeometryPath> <PathPointSet> <objects>
        <ConditionalPathPoint name="p"> <body>ground</body> <coordinate>flexion</coordinate> </ConditionalPathPoint>
        </objects> </PathPointSet> </GeometryPath> </PathSpring> </objects> </ForceSet>"""
    ).model
    assert model["/forceset/s/path/p"].socket_coordinate == "/jointset/hip/flexion"


def test_a_coordinate_of_a_joint_whose_name_is_there_twice() -> None:
    shank = '<Body name="shank"> <Joint> <PinJoint name="hip"> <parent_body>thigh</parent_body> <CoordinateSet> <objects>'
    shank += ' <Coordinate name="knee" /> </objects> </CoordinateSet> </PinJoint> </Joint> </Body>'
    model = document(
        BODIES.replace("</objects> </BodySet>", shank + "</objects> </BodySet>")
        + """<ForceSet> <objects> <PathSpring name="s"> <GeometryPath> <PathPointSet> <objects>
        <ConditionalPathPoint name="p"> <body>ground</body> <coordinate>knee</coordinate> </ConditionalPathPoint>
        </objects> </PathPointSet> </GeometryPath> </PathSpring> </objects> </ForceSet>"""
    ).model
    assert model["/forceset/s/path/p"].socket_coordinate == "/jointset/hip_0/knee"
    assert unresolved(model) == []


def test_an_actuator_that_is_not_there_stays_named() -> None:
    model = document(
        "<ControllerSet> <objects> <ControlSetController name='c'> <actuator_list>lost</actuator_list> "
        "</ControlSetController> </objects> </ControllerSet>",
        40000,
    ).model
    assert unresolved(model) == ["socket_actuators /forceset/lost"]


def test_plug_in_forces_are_upgraded_by_where_they_stand() -> None:
    model = document(
        BODIES
        + """<ForceSet> <objects> <PistonActuator name="p"> <isDisabled>true</isDisabled> <GeometryPath />
        </PistonActuator> </objects> </ForceSet> <ControllerSet> <objects> <ControlSetController name="c">
        <actuator_list>p</actuator_list> </ControlSetController> </objects> </ControllerSet>"""
    ).model
    piston = model["/forceset/p"]
    assert "<appliesForce>false</appliesForce>" in piston.content
    assert '<GeometryPath name="path">' in piston.content
    assert model["/controllerset/c"].socket_actuators == ("/forceset/p",)


def test_comments_survive() -> None:
    text = to_text(
        document(
            BODIES.replace("<Joint> <PinJoint", "<!--by hand--><Joint> <!--mine--> <PinJoint")
        ).model
    )
    assert "<!--by hand-->" in text


def test_positions_are_those_of_the_old_text(fixtures: Path) -> None:
    old = read_document(Source.from_file(fixtures / "versions" / "joint_frames.osim"))
    source, model = old.source, old.model

    def line_of(path: str, tag: str) -> str:
        number = source.child(model[path].source_index, tag)
        assert number is not None
        return source.lines[source.locate_tag(number).line - 1].strip()

    hip = model["/jointset/hip"]
    assert (
        source.lines[source.locate_tag(hip.source_index).line - 1].strip()
        == '<PinJoint name="hip">'
    )
    assert line_of("/jointset/hip", "socket_parent_frame") == "<parent_body>ground</parent_body>"
    assert line_of("/jointset/hip/ground_offset", "translation") == (
        "<location_in_parent>0.1234567891 0 0</location_in_parent>"
    )
    assert line_of("/bodyset/thigh", "inertia").startswith("<inertia_xx>")
    assert all(
        source.spans[item.source_index].tag
        for item in model.walk()
        if item.source_index is not None
    )


def test_notes_stand_where_they_stood_in_the_old_text() -> None:
    old = document(
        BODIES
        + "\n<MarkerSet> <objects> <Marker> <body>thigh</body>\n<colour>red</colour> </Marker> </objects> </MarkerSet>"
    )
    [note] = old.notes
    assert (note.kind, note.word) == ("unknown-tag", "colour")
    assert old.source.spans[note.number].tag == "colour"


def test_what_is_lost_is_said(fixtures: Path) -> None:
    old = read_document(Source.from_file(fixtures / "versions" / "meaningless.osim"))
    [lost] = [change for change in old.changes if change.lost]
    assert (lost.lost, lost.where) == ("Vmax 12", "Thelen2003Muscle 'vastus'")
    assert old.source.spans[lost.number].tag == "Vmax"


def test_a_model_without_a_document_around_it() -> None:
    old = read_document(
        Source(
            f'<?xml version="1.0"?>\n<!--from 2005-->\n<Model name="old">{BODIES}</Model>'.encode()
        )
    )
    assert old.version == 10500
    assert old.model["/jointset/hip/flexion"].name == "flexion"
    assert old.source.spans[old.model.source_index].tag == "Model"


@pytest.mark.parametrize(
    ("version", "inside", "said"),
    [
        (10500, "<DynamicsEngine>\n<SdfastEngine> <model_file>a.sd</model_file> </SdfastEngine> </DynamicsEngine>",
         ["SdfastEngine", "<model_file>", "would be lost"]),
        (10900, "<angle_units>radians</angle_units>\n<SimmMotion />", ["<SimmMotion>", "lost"]),
        (10900, "\n<angle_units>degrees</angle_units>", ["<angle_units>", "lost"]),
        (10900, BODIES.replace("PinJoint", "CustomJoint").replace("<CoordinateSet>", FOUR_AXES + "<CoordinateSet>"),
         ["hip", "4 axes of rotation", "lost"]),
        (9, "", ["version 9", "oldest is 10500"]),
    ],
)  # fmt: skip
def test_a_document_too_old_is_refused_with_what_would_be_lost(
    version: int, inside: str, said: list[str]
) -> None:
    with pytest.raises(VersionError) as caught:
        document(inside, version)
    assert caught.value.version == version
    assert caught.value.line is not None
    assert caught.value.column is not None
    for words in said:
        assert words in caught.value.message


def test_the_defaults_of_a_document_are_upgraded_too() -> None:
    old = document(
        """<defaults> <Thelen2003Muscle name="default"> <isDisabled>true</isDisabled>
        <pennation_angle>0.3</pennation_angle> <GeometryPath> <VisibleObject /> </GeometryPath>
        <Vmax>10</Vmax> </Thelen2003Muscle>
        <Body name="default"> <mass>3</mass> <Joint /> </Body> </defaults>
        <ForceSet> <objects> <Thelen2003Muscle name="m" /> </objects> </ForceSet>""",
        20301,
    )
    muscle = old.model["/forceset/m"]
    assert (muscle.appliesForce, muscle.pennation_angle_at_optimal) == (False, 0.3)
    assert old.notes == []


@pytest.mark.parametrize("version", [30000, 40000, CURRENT_VERSION])
def test_old_names_of_classes_are_read_in_every_version(version: int) -> None:
    old = document(
        """<ForceSet> <objects> <GeneralizedForce name="motor"> <coordinate>q</coordinate> </GeneralizedForce>
        <Torque name="turn" />\n<Nonsense /> </objects> </ForceSet>""",
        version,
    )
    assert [type(force).__name__ for force in old.model.force_set.objects] == [
        "CoordinateActuator",
        "TorqueActuator",
        "Unknown",
    ]
    [note] = old.notes
    assert (note.word, old.source.locate_tag(note.number).line) == ("Nonsense", 4)
    assert {change.what for change in old.changes if change.step == "class_names"} == {
        "Rename classes that have an old name"
    }


def test_an_included_file_is_upgraded_by_its_own_version(tmp_path: Path) -> None:
    (tmp_path / "markers.osim").write_text(
        '<OpenSimDocument Version="30000"><MarkerSet> <objects> <Marker name="m"> <body>ground</body> </Marker> '
        "</objects> </MarkerSet></OpenSimDocument>"
    )
    (tmp_path / "model.osim").write_text(
        '<OpenSimDocument Version="40600"><Model> <MarkerSet file="markers.osim" /> </Model></OpenSimDocument>'
    )
    model = read_document(Source.from_file(tmp_path / "model.osim")).model
    assert model["/markerset/m"].socket_parent_frame == "/ground"


def test_a_connector_whose_name_makes_no_tag_stays_as_it_is() -> None:
    connectors = '<connectors><C name="a b"><connectee_name>x</connectee_name></C></connectors>'
    old = document(f'<Ground name="ground">{connectors}</Ground>', 30507)
    assert [note.word for note in old.notes] == ["connectors"]
    assert '<C name="a b">' in to_text(old.model)


def test_an_empty_old_model() -> None:
    assert (
        read_text('<OpenSimDocument Version="20000"><Model name="a b"/></OpenSimDocument>').name
        == "ab"
    )


def test_a_tool_cannot_name_all_actuators_of_its_model() -> None:
    controller = (
        "<PrescribedController name='c'><actuator_list>ALL</actuator_list></PrescribedController>"
    )
    tool = (
        f"<ForwardTool><ControllerSet><objects>{controller}</objects></ControllerSet></ForwardTool>"
    )
    text = f'<OpenSimDocument Version="40500">{tool}</OpenSimDocument>'
    (change,) = read_document(Source(text.encode()), expected_class=Object).changes
    assert change.lost is not None and "all actuators" in change.lost


def test_actuators_without_a_version_push_backwards_as_in_opensim() -> None:
    text = """<ForceSet> <objects>
<PointActuator name="given"> <direction>0 2 0</direction> <force_is_global>false</force_is_global> </PointActuator>
<PointActuator name="bare" />
<TorqueActuator name="torque"> <axis>1 0 0</axis> </TorqueActuator>
<TorqueActuator name="about" />
</objects> </ForceSet>"""
    top: Any = read_document(Source(text.encode()), expected_class=Object).top
    given, bare, torque, about = top.objects
    assert (given.direction, given.force_is_global) == ((0.0, -2.0, 0.0), False)
    assert (bare.direction, torque.axis, about.axis) == (
        (-1.0, 0.0, 0.0),
        (-1.0, 0.0, 0.0),
        (0.0, 0.0, -1.0),
    )


@pytest.mark.parametrize(
    ("outer", "inner", "angles"),
    [
        ("0.3 1.5707963 0", "0 0 0.25", (0.3, 1.5707963, 0.25)),
        ("0.3 -1.5707963 0", "0 0 0.25", (0.3, -1.5707963, 0.25)),
        ("0.3 1.5707963267948966 0", "0 0 0.25", (0.55, 1.5707963267948966, 0.0)),
        ("0 1.5707963 0", "0.3 0 0.25", (1.57079624017428, 1.2707963267948954, -1.320796236124628)),
    ],
)
def test_transforms_near_a_right_angle_are_composed_as_in_opensim(
    outer: str, inner: str, angles: tuple[float, ...]
) -> None:
    """The angles are those of OpenSim 4.6."""
    composed = compose_transforms(f"{outer} 0 0 0", f"{inner} 0 0 0")
    assert composed is not None
    # An entry of the product has a rounding error of 1e-16 beside a cosine of 2.7e-8.
    assert [float(word) for word in composed[0].split()] == pytest.approx(angles, abs=1e-8)


def test_the_steps_of_version_4_need_one_module_only() -> None:
    assert {step.apply.__module__ for step in list_steps(40000)} == {
        "osimlite.io.document.upgrade.class_names",
        "osimlite.io.document.upgrade.version_4",
    }
