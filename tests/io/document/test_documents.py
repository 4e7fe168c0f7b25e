"""Check documents that are not models: typed objects, OpenSim's print, and no loss of content."""

from __future__ import annotations

from pathlib import Path

import pytest

import osimlite
from osimlite.errors import DocumentError, OsimliteError
from osimlite.io.document.printer import format_document
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from osimlite.schema.difference import Difference, find_differences
from osimlite.schema.registry import find_class, list_tags
from osimlite.schema.resolution import RULES
from osimlite.schema.specs import get_reference_specs
from tests.conftest import ROOT

DOCUMENTS = sorted((ROOT / "fixtures" / "documents").iterdir())


def document(inside: str, version: int = 40600) -> str:
    return f'<OpenSimDocument Version="{version}">{inside}</OpenSimDocument>'


def read(text: str) -> Object:
    return read_document(Source(text.encode()), expected_class=Object).top


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_what_is_read_is_written_again(path: Path, tmp_path: Path) -> None:
    read = read_document(Source.from_file(path), expected_class=Object)
    osimlite.write(read.top, tmp_path / path.name)
    again = read_document(Source.from_file(tmp_path / path.name), expected_class=Object)
    assert again.top == read.top and type(again.top) is type(read.top)
    assert osimlite.to_text(again.top) == osimlite.to_text(read.top)
    assert (again.version, again.changes) == (40600, [])
    if read.version == 40600:
        assert osimlite.to_text(read.top) == path.read_text() == format_document(read.source)


def test_the_object_is_of_the_class_at_the_top(fixtures: Path) -> None:
    tool = osimlite.read_document(fixtures / "documents" / "ik.xml")
    assert isinstance(tool, osimlite.InverseKinematicsTool)
    assert tool.time_range == (0.2, 1.4)
    assert [task.name for task in tool.ik_task_set.objects] == ["r.knee", "l.knee", "pelvis_tilt"]
    study = osimlite.read_document(fixtures / "documents" / "study.omoco")
    assert isinstance(study, osimlite.MocoStudy)
    assert study.problem.phases.goals[1].reference.operators[0].cutoff_frequency == 6
    assert isinstance(
        osimlite.read_document(fixtures / "walker" / "DynamicWalkerModel.osim"), osimlite.Model
    )


def test_a_model_inside_a_study() -> None:
    joint = "<PinJoint name='hip'><coordinates><Coordinate name='q'/></coordinates></PinJoint>"
    model = f"<Model name='m'><JointSet><objects>{joint}</objects></JointSet></Model>"
    top = read(document(f"<ModelProcessor><model>{model}</model></ModelProcessor>"))
    assert isinstance(top, osimlite.ModelProcessor) and top.model is not None
    (coordinate,) = top.model.joint_set.objects[0].coordinates
    assert coordinate.path == "/jointset/hip/q"
    top.model.add(osimlite.CoordinateActuator(name="motor", coordinate=coordinate))
    assert "<coordinate>q</coordinate>" in osimlite.to_text(top)


def test_a_tool_made_in_python(tmp_path: Path) -> None:
    body = osimlite.Body(name="foot")
    model = osimlite.Model(name="m")
    model.add(body)
    loads = osimlite.ExternalLoads(
        name="plates", objects=[osimlite.ExternalForce(name="r", applied_to_body=body)]
    )
    osimlite.write(loads, tmp_path / "loads.xml")
    assert (
        "<applied_to_body>/bodyset/foot</applied_to_body>" in (tmp_path / "loads.xml").read_text()
    )
    tool = osimlite.ScaleTool(mass=70.0)
    tool.model_scaler.scaling_order = ("measurements",)
    assert osimlite.to_text(tool).count("<ModelScaler>") == 1


def test_an_unknown_tag_is_kept_and_told(fixtures: Path) -> None:
    result = read_document(
        Source.from_file(fixtures / "documents" / "forward.xml"), expected_class=Object
    )
    (note,) = result.notes
    assert (note.kind, note.word, result.source.locate_tag(note.number).line) == (
        "unknown-tag",
        "use_specified_dt",
        6,
    )
    assert "<use_specified_dt>true</use_specified_dt>" in osimlite.to_text(result.top)


def test_old_names_at_the_top() -> None:
    assert isinstance(read(document("<rdCMC_TaskSet/>", 20302)), osimlite.CMC_TaskSet)
    assert isinstance(read(document("<ActuatorSet/>")), osimlite.ForceSet)
    assert isinstance(read("<IKTool name='old'/>"), osimlite.InverseKinematicsTool)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            document("<InverseKinemtaticsTool/>"),
            "an <InverseKinemtaticsTool>, which is not a class of OpenSim 4.6; did",
        ),
        (document(""), "the document holds no object"),
        ("<project/>", "this is not an OpenSim document$"),
        ("<mujoco><worldbody/></mujoco>", "convert it with 'osimlite convert'"),
        (document("<Tool/>"), "a <Tool>, which is not a class"),
    ],
)
def test_what_is_no_document_is_refused(text: str, message: str) -> None:
    with pytest.raises(DocumentError, match=message) as caught:
        read(text)
    assert caught.value.line == 1


def test_a_model_is_wanted(fixtures: Path) -> None:
    with pytest.raises(DocumentError, match="holds a <ScaleTool>, not a <Model>"):
        osimlite.read(fixtures / "documents" / "scale.xml")
    with pytest.raises(OsimliteError, match="expected a Model"):
        osimlite.to_text("scale.xml")  # type: ignore[arg-type]


def test_members_are_compared_by_name() -> None:
    def tasks(*names: str) -> Object:
        return osimlite.IKTaskSet(
            name="set",
            objects=[osimlite.IKMarkerTask(name=name, weight=float(len(name))) for name in names],
        )

    assert find_differences(tasks("a", "b"), tasks("b", "a")) == []
    assert find_differences(tasks("a", "b"), tasks("c", "b")) == [
        Difference("set", "objects[a]", "IKMarkerTask", None),
        Difference("set", "objects[c]", None, "IKMarkerTask"),
    ]
    old, new = tasks("a"), tasks("a")
    new.objects[0].weight = 5.0
    assert find_differences(old, new) == [Difference("set", "objects[a].weight", 1.0, 5.0)]


def test_every_rule_of_a_reference_is_known() -> None:
    used = {
        spec.kind.rule  # type: ignore[attr-defined]
        for tag in list_tags()
        for spec in get_reference_specs(find_class(tag) or Object)
    }
    named = {
        cls.name_reference.rule
        for tag in list_tags()
        if (cls := find_class(tag)) and cls.name_reference
    }
    assert used | named <= RULES.keys()
