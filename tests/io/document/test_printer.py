"""Check printing of models as XML text."""

from __future__ import annotations

import copy
import pickle
import re
from pathlib import Path

import pytest

import osimlite
from osimlite.errors import ModelError, OsimliteError
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from osimlite.schema.contact_types import ContactSphere
from osimlite.schema.frames import Body
from osimlite.schema.joints import PinJoint
from osimlite.schema.model import Model


def without_comments(text: str) -> str:
    return re.sub(r"[ \t]*<!--.*?-->\n", "", text, flags=re.DOTALL)


def test_the_reference_file_comes_back_byte_for_byte(fixtures: Path, tmp_path: Path) -> None:
    reference = fixtures / "walker" / "DynamicWalkerModel.osim"
    osimlite.write(osimlite.read(reference), tmp_path / "out.osim", numbers="opensim")
    assert (tmp_path / "out.osim").read_bytes().decode() == without_comments(reference.read_text())


def test_shortest_numbers_read_back_equal(fixtures: Path) -> None:
    model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    text = osimlite.to_text(model)
    assert "<radius>0.05</radius>" in text
    assert osimlite.read_text(text) == model
    assert osimlite.to_text(osimlite.read_text(text)) == text


def test_copies_print_the_same(fixtures: Path) -> None:
    model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    text = osimlite.to_text(model)
    assert osimlite.to_text(copy.deepcopy(model)) == text
    assert osimlite.to_text(pickle.loads(pickle.dumps(model))) == text


def test_components_given_as_references_become_the_right_text() -> None:
    model = Model(name="m")
    a, b = model.add(Body(name="a", mass=1.0), Body(name="b", mass=1.0)), model.find("/bodyset/b")
    assert isinstance(b, Body)
    model.add(PinJoint(name="j").between(a, b, at=(1.0, 0.0, 0.0)))
    model.add(PinJoint(name="root", socket_parent_frame=model.ground, socket_child_frame=a))
    text = osimlite.to_text(model)
    assert "<socket_parent_frame>a_offset</socket_parent_frame>" in text
    assert "<socket_parent>/bodyset/a</socket_parent>" in text
    assert "<socket_parent_frame>/ground</socket_parent_frame>" in text


def test_a_reference_out_of_the_model_is_refused() -> None:
    model = Model(name="m")
    stranger = Body(name="stranger", mass=1.0)
    model.add(ContactSphere(name="s", socket_frame=stranger))
    with pytest.raises(ModelError, match=r"stranger.*not in the model"):
        osimlite.to_text(model)


def test_markup_in_texts_is_escaped() -> None:
    model = Model(name='a"<&>', credits="Tom & <Jerry>")
    assert osimlite.read_text(osimlite.to_text(model)) == model


def test_an_unknown_object_called_like_a_property_keeps_its_wrapper() -> None:
    axis = "<function> <function> <scale>2</scale> </function> </function>"
    text = (
        '<OpenSimDocument Version="40600"><Model> <JointSet> <objects> <CustomJoint name="j"> <SpatialTransform> '
        f'<TransformAxis name="rotation1"> {axis} </TransformAxis> </SpatialTransform> </CustomJoint> </objects> '
        "</JointSet> </Model></OpenSimDocument>"
    )
    printed = osimlite.to_text(osimlite.read_text(text))
    assert "<scale>2</scale>" in printed
    assert osimlite.to_text(osimlite.read_text(printed)) == printed


def test_comments_of_opensim_in_unknown_content_are_dropped_like_all_others() -> None:
    generated = "<!--Maximum isometric force that the fibers can generate-->"
    force = f"<PlugIn name='p'> {generated} <a>{generated}</a> <!--by hand--> <b>1</b> </PlugIn>"
    inside = f"<ForceSet> <objects> {force} </objects> </ForceSet>"
    printed = osimlite.to_text(
        osimlite.read_text(
            f'<OpenSimDocument Version="40600"><Model> {inside} </Model></OpenSimDocument>'
        )
    )
    assert "by hand" in printed and "fibers" not in printed
    assert osimlite.to_text(osimlite.read_text(printed)) == printed


def test_what_was_never_set_is_not_printed() -> None:
    model = Model(name="m")
    model.add(Body(name="b"))
    text = osimlite.to_text(model)
    assert "mass" not in text and "FrameGeometry" not in text and "gravity" not in text
    model.body_set.objects[0].frame_geometry.display_radius = 0.01
    assert "<display_radius>0.01</display_radius>" in osimlite.to_text(model)


def test_writing_is_whole_or_not_at_all(tmp_path: Path) -> None:
    target = tmp_path / "m.osim"
    target.write_text("before")
    model = Model(name="m")
    model.add(ContactSphere(name="s", socket_frame=Body(name="x")))
    with pytest.raises(ModelError):
        osimlite.write(model, target)
    assert target.read_text() == "before"
    assert [path.name for path in tmp_path.iterdir()] == ["m.osim"]
    with pytest.raises(OsimliteError, match="cannot write here: the folder does not exist"):
        osimlite.write(Model(name="m"), tmp_path / "no" / "m.osim")


def test_members_with_nothing_but_defaults_are_members_all_the_same() -> None:
    model = Model(name="m")
    model.add(osimlite.Marker(name="a"), osimlite.HuntCrossleyForce(name="f"))
    again = osimlite.read_text(osimlite.to_text(model))
    assert [c.path for c in again.components()] == [c.path for c in model.components()]
    assert "Joint" not in osimlite.to_text(Model(name="m"))


def test_coordinates_that_a_joint_makes_itself_have_names_of_their_own() -> None:
    model = Model(name="m")
    a = model.add(Body(name="a", mass=1.0))
    model.add(PinJoint(name="hinge").between(model.ground, a))
    assert [
        c.name for c in osimlite.read_text(osimlite.to_text(model)).components(osimlite.Coordinate)
    ] == ["hinge_coord_0"]


@pytest.mark.parametrize("odd", ["\0", "\x1b", "\ud800", "\uffff"])
def test_what_no_file_can_hold_is_refused(odd: str, tmp_path: Path) -> None:
    for model in (Model(name=f"m{odd}"), Model(name="m", credits=f"by {odd}")):
        with pytest.raises(ModelError, match="no file can hold the last character of") as caught:
            osimlite.write(model, tmp_path / "m.osim")
        assert str(caught.value).isprintable() and not list(tmp_path.iterdir())


def test_an_object_that_is_there_by_itself_is_printed_where_it_may_be_missing() -> None:
    phase = osimlite.MocoPhase(name="phase")
    text = osimlite.to_text(phase)
    assert phase.model.model is not None and '<Model name="model">' in text
    assert (
        read_document(Source(text.encode()), expected_class=Object).top.model.model
        == phase.model.model
    )
