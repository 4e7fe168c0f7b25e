"""Check text that is almost XML.

It is read with a note where its meaning is certain; otherwise it is rejected with line and column.
"""

from __future__ import annotations

import time

import pytest

from osimlite.errors import DocumentError
from osimlite.io.document.printer import to_text
from osimlite.io.document.reader import Document, read_document, read_text
from osimlite.io.document.source import Source
from osimlite.io.document.survey import survey_source

HEAD = '<?xml version="1.0" encoding="UTF-8" ?>\n'
TEXT = HEAD + (
    '<OpenSimDocument Version="40600">\n<Model name="walker">\n<credits>Anna</credits>\n<BodySet>\n<objects>\n'
    '<Body name="thigh">\n<mass>8</mass>\n</Body>\n</objects>\n</BodySet>\n</Model>\n</OpenSimDocument>\n'
)


def document(text: str | bytes) -> Document:
    return read_document(Source(text if isinstance(text, bytes) else text.encode()))


@pytest.mark.parametrize(
    ("old", "new", "kind", "line"),
    [
        (HEAD, "// saved by hand\n\n" + HEAD, "text-outside-root", 1),
        (HEAD, "<!-- saved by hand -->\n" + HEAD, "late-declaration", 2),
        (HEAD, "\ufeff\ufeff" + HEAD, "byte-order-mark", 1),
        ("</OpenSimDocument>\n", "</OpenSimDocument>\n~\n", "text-outside-root", 14),
        ("<mass>", "<!-- heavy -- too heavy? -->\n<mass>", "hyphens-in-comment", 8),
        ("<mass>", "<!----- heavy ----->\n<mass>", "hyphens-in-comment", 8),
        ("Anna", "Anna & Bert", "bare-ampersand", 4),
        ("Anna", "Anna\fBert", "control-character", 4),
        ("Anna", "Anna&nbsp;Berg", "bare-ampersand", 4),
        ('<Body name="thigh">', '<Body name="femur"  name="thigh">', "duplicate-attribute", 7),
        ('<Body name="thigh">', "<Body name=thigh>", "overlooked", 7),
        ('<Body name="thigh">', '<Body side="x=y z=1" name = thigh\n>', "overlooked", 7),
        ('<Body name="thigh">', '<Body name="thigh" side= >', "overlooked", 7),
        ('<Body name="thigh">', "<Body side='left'name=\"thigh\">", "overlooked", 7),
        ("Anna", "Anna ]]> Bert", "overlooked", 4),
        ("Anna", "Anna\x01Bert", "overlooked", 4),
        ("Anna", "Anna\ufffeBert", "overlooked", 4),
        ("Anna", "Anna&#1;Bert", "overlooked", 4),
        ("Anna", "Anna&#xD800;Bert", "overlooked", 4),
        ("Anna", "Anna&#x110000;Bert", "overlooked", 4),
        ("Anna", "Anna<? x ?>Bert", "overlooked", 4),
        (HEAD, "<??>\n" + HEAD.replace("xml ", "xml-note "), "overlooked", 1),
        (HEAD, "<?xml version=1.0?>\n", "overlooked", 1),
        (HEAD, "<?XML version='1.0'?>\n", "overlooked", 1),
        (HEAD, "<?xml version='2.0'?>\n", "overlooked", 1),
        ("</OpenSimDocument>\n", "</OpenSimDocument>\n\0\0\0", "overlooked", 14),
        ("</OpenSimDocument>\n", "</OpenSimDocument>\n</Body>\n", "overlooked", 14),
        (HEAD, "</Body>\n" + HEAD.replace("<?xml ", "<?xml-note "), "overlooked", 1),
    ],
)
def test_read_with_a_note(old: str, new: str, kind: str, line: int) -> None:
    result = document(TEXT.replace(old, new, 1))
    assert [(note.kind, note.line) for note in result.notes if note.word != "side"] == [
        (kind, line)
    ]
    assert result.fault is not None
    thigh = result.model["/bodyset/thigh"]
    assert thigh.mass == 8
    # Positions refer to the original text, not to the repaired one.
    source = result.source
    assert source.lines[source.locate_tag(thigh.source_index).line - 1].startswith("<Body")
    mass = source.child(thigh.source_index, "mass")
    assert mass is not None
    assert source.lines[source.locate_tag(mass).line - 1].endswith("<mass>8</mass>")
    # The printed text is valid XML.
    assert not [
        note
        for note in read_document(Source(to_text(result.model).encode())).notes
        if note.word != "side"
    ]


def test_well_formed_text_has_no_fault() -> None:
    result = document(TEXT)
    assert (result.notes, result.fault) == ([], None)


def test_everything_at_once() -> None:
    text = TEXT.replace("Anna", "A & B &copy; C &amp; D").replace(
        "<mass>", "<!-- a -- b -- c --><mass>"
    )
    result = document(
        "notes:\n" + text.replace('name="thigh"', "name='a' name = \"thigh\"") + "bye"
    )
    kinds = [note.kind for note in result.notes]
    assert kinds == [
        "text-outside-root",
        "bare-ampersand",
        "bare-ampersand",
        "duplicate-attribute",
        "hyphens-in-comment",
        "text-outside-root",
    ]
    assert result.model.credits == "A & B \u00a9 C & D"
    assert [result.source.spans[note.number].tag for note in result.notes[1:5]] == [
        "credits",
        "credits",
        "Body",
        "Body",
    ]


def test_the_last_of_two_attributes_counts_as_for_opensim() -> None:
    result = document(TEXT.replace('<Body name="thigh">', '<Body name="a" name="b" name="thigh">'))
    assert result.model["/bodyset/thigh"].mass == 8
    assert [note.word for note in result.notes] == ["name", "name"]


def test_a_comment_with_hyphens_looks_the_same() -> None:
    result = document(TEXT.replace("<mass>", "<!---- hand-made ---->\n<mass>"))
    assert "<!--\u2013\u2013 hand-made \u2013\u2013-->" in to_text(result.model)


@pytest.mark.parametrize("reference", ["&lt;", "&#65;", "&#x42;", "&amp;", "&quot;"])
def test_references_of_xml_are_left_alone(reference: str) -> None:
    result = document(TEXT.replace("Anna", f"Anna {reference} & Bert"))
    assert [note.word for note in result.notes] == ["&"]


def test_references_of_html_make_no_markup() -> None:
    assert (
        document(TEXT.replace("Anna", "&LT;mass&GT; &NewLine; &AMP; &bad; &#;")).model.credits
        == "<mass> & &bad; &#;"
    )


def test_a_conflict_is_refused_where_it_begins() -> None:
    text = TEXT.replace(
        "<mass>8</mass>", "<<<<<<< HEAD\n<mass>8</mass>\n=======\n<mass>9</mass>\n>>>>>>> faster"
    )
    with pytest.raises(DocumentError) as caught:
        document(text)
    assert (caught.value.line, caught.value.column) == (8, 1)
    assert "<<<<<<< HEAD" in caught.value.message
    assert "merge" in caught.value.message


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("</mass>", "", 9),
        ("</Body>", "</Boddy>", 9),
        ("<mass>8</mass>", "<mass>8 < 9</mass>", 8),
        ('name="thigh"', 'name= side="left"', 7),
        ('name="thigh"', 'name="a<b"', 7),
        ("Anna", "Anna &#49 Bert", 4),
        ("</OpenSimDocument>", "", 14),
        ("</OpenSimDocument>", "</OpenSimDocument><More/>", 13),
        ("<mass>8</mass>", "<mass>8</mass><!-- no end", 8),
        ("<mass>8</mass>", "<mass>8 & 9</mas>", 8),
    ],
)
def test_what_may_mean_two_things_is_refused(old: str, new: str, line: int) -> None:
    with pytest.raises(DocumentError) as caught:
        document(TEXT.replace(old, new, 1))
    assert caught.value.line == line
    assert caught.value.column is not None


def test_control_characters_that_are_white_space() -> None:
    assert (
        document(TEXT.replace("Anna", "Anna\fand\vBert & Co")).model.credits == "Anna and Bert & Co"
    )


# Encodings


@pytest.mark.parametrize(
    ("data", "encoding"),
    [
        (TEXT.replace("Anna", "Ren\u00e9").encode("utf-8-sig"), "utf-8-sig"),
        (TEXT.replace("Anna", "Ren\u00e9").encode("utf-16"), "utf-16"),
        (TEXT.replace("Anna", "Ren\u00e9").encode("utf-32"), "utf-32"),
        (TEXT.replace("Anna", "Ren\u00e9").encode("cp1252"), "cp1252"),
        (
            TEXT.replace("Anna", "Ren\u00e9").replace("UTF-8", "ISO-8859-1").encode("latin-1"),
            "iso-8859-1",
        ),
        (
            TEXT.replace("Anna", "Ren\u00e9").replace("UTF-8", "windows-1252").encode("cp1252"),
            "windows-1252",
        ),
        (TEXT.replace("Anna", "Ren\u00e9").replace("UTF-8", "UTF-16").encode(), "utf-8"),
        (TEXT.replace("Anna", "Ren\u00e9").replace("UTF-8", "klingon").encode(), "utf-8"),
        (TEXT.replace("Anna", "Ren\u00e9").replace("UTF-8", "punycode").encode(), "utf-8"),
    ],
)
def test_every_encoding_is_read(data: bytes, encoding: str) -> None:
    source = Source(data)
    assert source.encoding == encoding
    assert read_document(source).model.credits == "Ren\u00e9"


def test_one_foreign_byte_spoils_nothing_else() -> None:
    data = TEXT.replace("Anna", "Ren\u00e9 \u2013 ").encode() + b"<!-- 1 \x96 2 -->\n"
    source = Source(data)
    assert source.encoding == "cp1252"
    assert read_document(source).model.credits == "Ren\u00e9 \u2013"
    assert "1 \u2013 2" in source.text


def test_half_a_character_at_the_end_stands_for_one_that_is_missing() -> None:
    data = TEXT.encode("utf-16")
    assert Source(data[:-1]).text == TEXT[:-1] + "\ufffd"
    assert Source(data[:101]).text == TEXT[:49] + "\ufffd"
    assert Source(b"\xff\xfe").text == ""
    assert Source(b"\xfe\xff\x00").text == Source(b"\xff\xfe\x00\x00\x00").text == "\ufffd"


@pytest.mark.parametrize("cut", range(0, len(TEXT), 7))
def test_a_text_that_breaks_off_is_surveyed_as_far_as_it_goes(cut: int) -> None:
    result = survey_source(Source(TEXT[:cut].encode()))
    assert result.faults
    assert all(fault.line is not None for fault in result.faults)


def test_what_is_recovered_of_an_old_document_is_upgraded() -> None:
    old = '<OpenSimDocument Version="30000"><Model name="m"><ForceSet><objects><CoordinateActuator name="c">'
    result = survey_source(
        Source((old + "<isDisabled>true</isDisabled></CoordinateActuator></objects>").encode())
    )
    assert result.document is not None
    assert result.document.model["/forceset/c"].appliesForce is False
    assert result.document.notes == []


# The reader ends soon on any text


@pytest.mark.parametrize(
    "piece",
    [
        "<",
        "<a",
        "<!--",
        "<a b='",
        '<a b="',
        "<![CDATA[",
        "</",
        "<a ",
        "&",
        "a",
        "<?",
        "<!DOCTYPE",
        "--",
        "=\" '",
    ],
)
def test_time_is_linear_in_the_length(piece: str) -> None:
    text = "<OpenSimDocument Version='40600'><Model>" + piece * (400_000 // len(piece))
    start = time.process_time()
    with pytest.raises(DocumentError) as caught:
        read_text(text)
    assert caught.value.line == 1
    assert time.process_time() - start < 5


@pytest.mark.parametrize("instruction", ["<?x >", "<?x y>", "<??>", "<?x <b>"])
@pytest.mark.parametrize(
    "place", ["<Model", "<gravity", "0 -9", "</gravity>", "</Model>", "</OpenSimDocument>"]
)
def test_an_instruction_ends_at_its_first_bracket_as_in_opensim(instruction, place):
    text = """<?xml version="1.0"?><OpenSimDocument Version="40600"><Model name="m"><gravity> 0 -9 0</gravity>
</Model></OpenSimDocument>"""
    model = read_text(text.replace(place, instruction + place, 1))
    assert model.name == "m"
    assert list(model.gravity) == [0.0, -9.0, 0.0] or place in ("0 -9", "</gravity>")


@pytest.mark.parametrize("rest", ["<?", "<?x", "<?x y", "<?x?"])
def test_an_open_instruction_after_the_root_is_passed_over(rest):
    text = (
        '<?xml version="1.0"?><OpenSimDocument Version="40600"><Model name="m"/></OpenSimDocument>'
    )
    assert read_text(text + rest).name == "m"
