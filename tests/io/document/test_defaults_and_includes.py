"""Check ``<defaults>`` blocks and ``file`` attributes.

They apply to one document only, and are written again.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import osimlite
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from osimlite.schema.frames import Body
from osimlite.schema.markers import Marker
from osimlite.schema.model import Model

BODIES = """<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40600">
	<Model name="m">
		<defaults>
			<Body name="default">
				<mass>7</mass>
			</Body>
			<PlugInForce name="default">
				<strength>1</strength>
			</PlugInForce>
			<Appearance name="default">
				<opacity>0.25</opacity>
			</Appearance>
		</defaults>
		<BodySet name="bodyset">
			<objects>
				<Body name="b1">
					<mass_center>1 2 3</mass_center>
				</Body>
				<Body name="b2">
					<attached_geometry>
						<Brick name="k">
							<Appearance>
								<color>1 0 0</color>
							</Appearance>
						</Brick>
						<Brick name="l">
						</Brick>
					</attached_geometry>
					<mass>7</mass>
					<inertia>1 1 1 0 0 0</inertia>
				</Body>
			</objects>
		</BodySet>
	</Model>
</OpenSimDocument>
"""

MARKERS = """<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40600">
	<MarkerSet name="mine">
		<objects>
			<Marker name="mk">
				<socket_parent_frame>/bodyset/b1</socket_parent_frame>
				<location>1 2 3</location>
				<fixd>true</fixd>
			</Marker>
		</objects>
	</MarkerSet>
</OpenSimDocument>
"""

INCLUDING = """<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40600">
	<Model name="m">
		<MarkerSet file="markers.xml" />
	</Model>
</OpenSimDocument>
"""


def bodies(model: Model) -> list[Body]:
    return model.body_set.objects


def test_objects_take_what_their_class_has_in_the_block_as_opensim_does() -> None:
    model = osimlite.read_text(BODIES)
    assert [body.mass for body in bodies(model)] == [7.0, 7.0]
    # An Appearance in the file starts from the defaults; one that its owner creates does not.
    assert [geometry.appearance.opacity for geometry in bodies(model)[1].attached_geometry] == [
        0.25,
        1.0,
    ]


def test_the_block_is_printed_back_and_its_values_only_there() -> None:
    assert osimlite.to_text(osimlite.read_text(BODIES)) == BODIES
    assert osimlite.to_text(osimlite.read_text(BODIES).copy_deep()) == BODIES


def test_defaults_of_a_class_under_its_old_name_count_for_nothing() -> None:
    # OpenSim looks for the present name of the class in the block, and does not find it.
    text = """<OpenSimDocument Version="20302">
	<CMC_TaskSet>
		<defaults>
			<rdCMC_Joint name="default"> <kp>7 7 7</kp> </rdCMC_Joint>
			<CMC_Point name="default"> <kp>5 5 5</kp> </CMC_Point>
		</defaults>
		<objects> <rdCMC_Joint name="knee"/> <rdCMC_Point name="hand"/> </objects>
	</CMC_TaskSet>
</OpenSimDocument>
"""
    tasks: Any = read_document(Source(text.encode()), expected_class=Object).top
    assert [task.kp for task in tasks.objects] == [(1.0, 1.0, 1.0), (5.0, 5.0, 5.0)]
    assert "<rdCMC_Joint name" in osimlite.to_text(tasks)


def test_the_next_document_knows_nothing_of_it() -> None:
    osimlite.read_text(BODIES)
    plain = BODIES.replace("<mass>7</mass>", "", 1).replace("<opacity>0.25</opacity>", "")
    assert bodies(osimlite.read_text(plain))[0].mass != 7.0
    assert Body().mass != 7.0


def test_a_value_unlike_the_block_is_printed() -> None:
    model = osimlite.read_text(BODIES)
    bodies(model)[0].mass = 8.0
    model.add(Body(name="new"))
    again = osimlite.read_text(osimlite.to_text(model))
    assert again == model
    assert [str(body.mass) for body in bodies(again)] == ["8.0", "7.0", "nan"]


def test_an_object_that_moves_to_another_model_takes_its_values_along() -> None:
    other = Model(name="other")
    other.add(bodies(osimlite.read_text(BODIES))[0].copy_deep())
    assert bodies(osimlite.read_text(osimlite.to_text(other)))[0].mass == 7.0


def test_numbers_of_elements_are_those_of_the_text() -> None:
    document = read_document(Source(BODIES.encode()))
    layout = document.model.layout
    assert layout is not None
    for body in (*bodies(document.model), layout.defaults[0]):
        assert document.source.spans[body.source_index].tag == "Body"
    wrong = read_document(Source(BODIES.replace("<mass>7<", "<mass>x<", 1).encode()))
    assert [(note.kind, wrong.source.spans[note.number].tag) for note in wrong.notes] == [
        ("unreadable", "mass")
    ]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "markers.xml").write_text(MARKERS)
    (tmp_path / "model.osim").write_text(INCLUDING)
    return tmp_path


def marker(model: Model) -> Marker:
    (result,) = model.marker_set.objects
    return result


def test_an_object_may_stand_in_a_file_of_its_own(folder: Path) -> None:
    document = read_document(Source.from_file(folder / "model.osim"))
    assert marker(document.model).location == (1.0, 2.0, 3.0)
    assert marker(document.model).path == "/markerset/mk"
    # Problems in the included file are reported at the element that names the file.
    assert [(note.kind, document.source.spans[note.number].tag) for note in document.notes] == [
        ("include", "MarkerSet"),
        ("unknown-tag", "MarkerSet"),
    ]
    assert document.source.spans[marker(document.model).source_index].tag == "MarkerSet"


def test_what_is_unchanged_stays_in_its_file(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    model = osimlite.read(folder / "model.osim")
    assert osimlite.to_text(model) == INCLUDING
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "model.osim"
    osimlite.write(model, elsewhere)
    assert osimlite.read(elsewhere) == model
    assert '<MarkerSet file="../' in elsewhere.read_text()


def test_what_is_changed_is_written_where_it_is_used(folder: Path) -> None:
    model = osimlite.read(folder / "model.osim")
    marker(model).fixed = True
    osimlite.write(model, folder / "changed.osim")
    assert marker(osimlite.read(folder / "changed.osim")).fixed
    assert (folder / "markers.xml").read_text() == MARKERS
    assert "file=" not in (folder / "changed.osim").read_text()


@pytest.mark.parametrize(
    "content", [None, "no xml", INCLUDING, MARKERS.replace("MarkerSet", "ProbeSet")]
)
def test_a_file_that_does_not_hold_it_leaves_the_object_as_it_is(
    folder: Path, content: str | None
) -> None:
    if content is None:
        (folder / "markers.xml").unlink()
    else:
        (folder / "markers.xml").write_text(content)
    document = read_document(Source.from_file(folder / "model.osim"))
    assert document.model.marker_set.objects == []
    assert [(note.kind, note.word, note.value) for note in document.notes] == [
        ("include", "file", "markers.xml")
    ]
    assert osimlite.to_text(document.model) == INCLUDING.replace(" />\n", ">\n\t\t</MarkerSet>\n")


def test_files_that_include_each_other_end(folder: Path) -> None:
    ring = MARKERS.replace('<MarkerSet name="mine">', '<MarkerSet name="mine" file="markers.xml">')
    (folder / "markers.xml").write_text(ring)
    assert marker(osimlite.read(folder / "model.osim")).name == "mk"


@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-32", "latin-1"]
)
@pytest.mark.parametrize(
    "attribute",
    ['file="markers.xml"', "file='markers.xml'", 'file = "markers.xml"', 'file\n\t=\r\n"markers.xml"',
     "file=markers.xml", 'file="m&#97;rkers.xml"', 'name="a" file="./markers.xml"'],
)  # fmt: skip
def test_an_attribute_in_any_spelling_and_encoding(
    folder: Path, attribute: str, encoding: str
) -> None:
    text = INCLUDING.replace('file="markers.xml"', attribute)
    mark = "\ufeff" if encoding.endswith("-le") else ""
    data = (mark + text.replace("UTF-8", encoding.removesuffix("-sig").removesuffix("-le"))).encode(
        encoding
    )
    document = read_document(Source(data, str(folder / "model.osim")))
    assert marker(document.model).name == "mk"
    assert [
        (note.word, note.value.removeprefix("./"))
        for note in document.notes
        if note.kind == "include"
    ] == [("file", "markers.xml")]


def test_what_only_looks_like_an_attribute(folder: Path) -> None:
    for odd in (
        'name="file="',
        "name='file=\"markers.xml\"'",
        'File="markers.xml"',
        'x:file="markers.xml"',
    ):
        text = INCLUDING.replace('file="markers.xml"', odd)
        assert (
            read_document(
                Source(text.encode(), str(folder / "model.osim"))
            ).model.marker_set.objects
            == []
        )
    hidden = INCLUDING.replace(
        '<MarkerSet file="markers.xml" />', '<!-- <MarkerSet file="markers.xml" /> -->'
    )
    assert (
        read_document(Source(hidden.encode(), str(folder / "model.osim"))).model.marker_set.objects
        == []
    )


def test_what_another_system_would_include_is_not_included(folder: Path) -> None:
    """OpenSim does not support XInclude."""
    other = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="markers.xml" />'
    text = INCLUDING.replace('<MarkerSet file="markers.xml" />', other)
    document = read_document(Source(text.encode(), str(folder / "model.osim")))
    assert document.model.marker_set.objects == []
    assert [note.kind for note in document.notes] == ["unknown-tag"]


def test_a_text_without_a_file_has_none_beside_it() -> None:
    assert osimlite.read_text(INCLUDING).marker_set.objects == []
