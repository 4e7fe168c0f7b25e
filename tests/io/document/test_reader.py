"""Check reading of models from XML text, and the reader's notes."""

from __future__ import annotations

import gc
import weakref
from pathlib import Path

import pytest

import osimlite
from osimlite.errors import DocumentError, MissingFileError, VersionError
from osimlite.io.document.reader import Document, read_document
from osimlite.io.document.source import Source
from osimlite.schema.base import Unknown
from osimlite.schema.forces import HuntCrossleyForce
from osimlite.schema.frames import BodySet
from osimlite.schema.model import Model


def document(inside: str, head: str = '<Model name="m">') -> Document:
    text = f'<?xml version="1.0"?>\n<OpenSimDocument Version="40600">\n{head}\n{inside}\n</Model>\n</OpenSimDocument>'
    return read_document(Source(text.encode()))


def body(inside: str) -> Document:
    return document(f'<BodySet><objects><Body name="b">\n{inside}\n</Body></objects></BodySet>')


def kinds(found: Document) -> list[tuple[str, str]]:
    return [(note.kind, note.word) for note in found.notes]


def test_the_walker(fixtures: Path) -> None:
    model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    assert isinstance(model, Model)
    assert model.name == "DynamicWalkerModel"
    assert [b.name for b in model.body_set.objects] == [
        "Platform", "Pelvis", "RightThigh", "LeftThigh", "RightShank", "LeftShank",
    ]  # fmt: skip
    force = model.find("/forceset/RFootForce")
    assert isinstance(force, HuntCrossleyForce)
    assert force.contact_parameters.objects[0].geometry == ("RFootContact", "PlatformContact")
    assert force.transition_velocity == 0.2
    assert model.document_version == 40600


def test_every_element_keeps_its_number(fixtures: Path) -> None:
    source = Source.from_file(fixtures / "walker" / "DynamicWalkerModel.osim")
    model = read_document(source).model
    for component in model.walk():
        assert (
            source.spans[component.source_index].tag == component.tag
            if component.source_index is not None
            else True
        )
    knee = model.find("/jointset/RightShankToThigh/RKnee_rz")
    assert source.text[source.spans[knee.source_index].start :].startswith(
        '<Coordinate name="RKnee_rz">'
    )


def test_properties_in_any_order_and_only_what_is_there() -> None:
    result = body("<inertia>1 1 1 0 0 0</inertia><mass> 2 </mass>").model.body_set.objects[0]
    assert result.mass == 2.0
    assert result.model_fields_set == {"name", "mass", "inertia"}


def test_unclean_values_are_read_as_opensim_reads_them_and_noted() -> None:
    result = body("<mass>1,5</mass><mass_center>0 1</mass_center>")
    assert result.model.body_set.objects[0].mass == 1.0
    assert kinds(result) == [("cut", "1,5"), ("too-few", "0 1")]
    assert "<mass>1,5</mass>" in osimlite.to_text(result.model)
    result.model.body_set.objects[0].mass = 3.0
    assert "<mass>3</mass>" in osimlite.to_text(result.model)


def test_unknown_elements_are_noted_kept_and_written_back() -> None:
    result = body("<mas>5</mas><mass>1</mass>")
    assert kinds(result) == [("unknown-tag", "mas")]
    text = osimlite.to_text(result.model)
    assert "<mas>5</mas>" in text
    assert osimlite.read_text(text) == result.model


def test_unknown_classes_in_a_set_keep_their_place_and_name() -> None:
    result = document(
        "<ForceSet><objects><CoordinateLimitForce name='a'/><PlugIn name='p'><x>1</x></PlugIn>"
        "<CoordinateLimitForce name='c'/></objects></ForceSet>"
    )
    assert kinds(result) == [("unknown-class", "PlugIn")]
    plug_in = result.model.find("/forceset/p")
    assert isinstance(plug_in, Unknown) and plug_in.class_name == "PlugIn"
    text = osimlite.to_text(result.model)
    assert text.index('name="a"') < text.index("<x>1</x>") < text.index('name="c"')
    assert osimlite.read_text(text) == result.model


def test_a_property_of_an_unknown_class_is_refused_by_class_and_name(fixtures: Path) -> None:
    # The misspelt element stands where code expects a coordinate, so that no earlier check rejects
    # it.
    text = (fixtures / "lint" / "skeleton.osim").read_text(encoding="utf-8")
    wrong = text.replace("<Coordinate name", "<Cordinate name").replace(
        "</Coordinate>", "</Cordinate>"
    )
    with pytest.raises(
        osimlite.OsimliteError, match=r"'\w+' is a Cordinate, a class that osimlite does not know"
    ):
        osimlite.mechanism(osimlite.read_text(wrong))


def test_wrong_class_duplicates_attributes() -> None:
    result = document(
        '<ForceSet><objects><Body name="b"/></objects></ForceSet><gravity>0 -1 0</gravity><gravity>0 -2 0</gravity>'
        '<BodySet colour="red"/>'
    )
    assert kinds(result) == [
        ("wrong-class", "Body"),
        ("unknown-attribute", "colour"),
        ("duplicate-tag", "gravity"),
    ]
    assert result.model.gravity == (0.0, -1.0, 0.0)


def test_named_objects_in_all_three_spellings() -> None:
    short = (
        '<FrameGeometry name="frame_geometry"><display_radius>1</display_radius></FrameGeometry>'
    )
    long = "<frame_geometry><FrameGeometry><display_radius>1</display_radius></FrameGeometry></frame_geometry>"
    bare = "<FrameGeometry><display_radius>1</display_radius></FrameGeometry>"
    for spelling in (short, long, bare):
        result = body(spelling)
        assert result.model.body_set.objects[0].frame_geometry.display_radius == 1.0, spelling
        assert not result.notes


def test_comments_of_people_stay_where_they_were() -> None:
    inside = """<!--Measured by Ada.-->
<BodySet><objects><!-- heavy --><Body name="b"><!--The mass of the body (kg)--><mass>1</mass><!-- checked -->
<inertia>1 1 1 0 0 0</inertia><!-- last --></Body></objects></BodySet>"""
    text = osimlite.to_text(document(inside).model)
    order = [
        "Measured by Ada.",
        "<BodySet>",
        " heavy ",
        '<Body name="b">',
        "<mass>",
        " checked ",
        "<inertia>",
        " last ",
    ]
    places = [text.index(word) for word in order]
    assert places == sorted(places)
    assert "The mass of the body" not in text
    assert osimlite.to_text(osimlite.read_text(text)) == text


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", 1, "empty"),
        ("hello", 1, "not well-formed"),
        ("<Foo/>", 1, "<Foo>"),
        ("<OpenSimDocument/>", 1, "no Version"),
        ('<OpenSimDocument Version="abc"/>', 1, "abc"),
        ('<OpenSimDocument Version="40600">\n<BodySet/></OpenSimDocument>', 2, "<BodySet>"),
        ('<OpenSimDocument Version="40600"/>', 1, "no <Model>"),
        (
            '<OpenSimDocument Version="40600">\n<Model>\n<mass></Model></OpenSimDocument>',
            3,
            "not well-formed",
        ),
        ('<!DOCTYPE a [\n<!ENTITY x "y">]>\n<OpenSimDocument Version="40600"/>', 1, "DOCTYPE"),
    ],
)
def test_what_is_no_document_is_refused_with_its_place(text: str, line: int, words: str) -> None:
    with pytest.raises(DocumentError, match=words) as caught:
        osimlite.read_text(text)
    assert caught.value.line == line
    assert caught.value.column is not None and caught.value.column >= 1


@pytest.mark.parametrize(
    ("text", "version"),
    [
        *(
            (text, 40600)
            for text in ("+40600", " 40600\t", "\n40600 ", "0040600", "+000000000040600", "&#52;0600")
        ),
        ("2147483647", 2**31 - 1),
        *(
            (text, None)
            for text in ("", "+", "++40600", "+ 40600", "-40600", "40600.0", "4.06e4", "40600 1", "0x9E98", "40_600",
                         "2147483648", "\u00a040600", "\uff14\uff10\uff16\uff10\uff10")
        ),
    ],
)  # fmt: skip
def test_a_version_is_read_as_opensim_reads_it(text: str, version: int | None) -> None:
    """The expected versions were verified with OpenSim 4.6."""
    document = f'<OpenSimDocument Version="{text}"><Model/></OpenSimDocument>'
    if version is not None:
        assert read_document(Source(document.encode())).version == version
    else:
        with pytest.raises(VersionError, match="not a whole number"):
            osimlite.read_text(document)


def test_entities_and_files_of_others_are_not_followed(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("do not read")
    bomb = '<!DOCTYPE a [<!ENTITY a "x"><!ENTITY b "&a;&a;&a;&a;">]><a>&b;</a>'
    outside = (
        f'<!DOCTYPE a SYSTEM "{secret}"><OpenSimDocument Version="40600"><Model/></OpenSimDocument>'
    )
    with pytest.raises(DocumentError):
        osimlite.read_text(bomb)
    for before in ("", "<!-- <OpenSimDocument> -->", "<?note <OpenSimDocument?>", "\n"):
        assert "do not read" not in osimlite.to_text(osimlite.read_text(before + outside))


def test_deep_nesting_is_an_error_not_a_crash() -> None:
    text = '<OpenSimDocument Version="40600"><Model>' + "<a>" * 100_000
    with pytest.raises(DocumentError):
        osimlite.read_text(text)


def test_a_missing_file() -> None:
    with pytest.raises(MissingFileError, match="no such file") as caught:
        osimlite.read("nowhere.osim")
    assert caught.value.file == "nowhere.osim"


def test_positions_survive_the_double_colon() -> None:
    text = '<OpenSimDocument Version="40600"><Model><HuntCrossleyForce::ContactParameters></Model></OpenSimDocument>'
    with pytest.raises(DocumentError, match="HuntCrossleyForce::ContactParameters") as caught:
        osimlite.read_text(text)
    assert caught.value.line == 1


def test_what_was_just_read_knows_its_place() -> None:
    text = '<OpenSimDocument Version="40600"><Model name="m"><BodySet><objects><Body name="b"/></objects></BodySet>'
    model = osimlite.read_text(text + "</Model></OpenSimDocument>")
    (body,) = model.body_set.objects
    assert (body.path, body.model, body.parent) == ("/bodyset/b", model, model.body_set)
    assert body.copy_deep().model is None


def test_parts_of_a_text_belong_to_its_model_or_to_none() -> None:
    bodies = '<BodySet><objects><Body name="b"/></objects></BodySet>'
    text = f'<OpenSimDocument Version="40600"><Model name="m">{bodies}</Model></OpenSimDocument>'
    model = osimlite.read_text(text)
    # `model` must work as the first access, before a component tree exists.
    assert model.body_set.objects[0].model is model
    alone = Source(f'<OpenSimDocument Version="40600">{bodies}</OpenSimDocument>'.encode())
    body_set = read_document(alone, expected_class=BodySet).top
    assert body_set.objects[0].model is None


def test_an_optional_number_may_be_empty_and_an_optional_text_is_then_empty() -> None:
    """Verified with OpenSim 4.6: the number has no value, the text has an empty one."""
    text = (
        '<OpenSimDocument Version="40600"><Model name="m"><ForceSet><objects>'
        '<ExpressionBasedBushingForce name="b"><moment_visual_scale> </moment_visual_scale>'
        "</ExpressionBasedBushingForce>"
        '<CoordinateActuator name="a"><coordinate></coordinate></CoordinateActuator>'
        "</objects></ForceSet></Model></OpenSimDocument>"
    )
    document = read_document(Source(text.encode()))
    bushing, actuator = document.model.force_set.objects
    assert (bushing.moment_visual_scale, bushing.force_visual_scale) == (None, 1.0)
    assert actuator.coordinate == ""
    assert document.notes == []
    assert "<moment_visual_scale></moment_visual_scale>" in osimlite.to_text(document.model)


def test_a_model_that_nobody_needs_is_gone_without_the_garbage_collector(fixtures: Path) -> None:
    model = osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim")
    body = model.body_set.objects[0]
    watched = weakref.ref(model)
    gc.disable()
    try:
        del model
        assert watched() is None
    finally:
        gc.enable()
    assert body.model is None
