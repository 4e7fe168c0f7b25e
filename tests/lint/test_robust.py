"""Check that the linter answers any content of a file with findings."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

import osimlite
from osimlite.io.document.source import Source
from osimlite.lint import validate
from osimlite.lint.reporters import render
from osimlite.schema.fields import ObjectField
from osimlite.schema.path_forces import PathSpring
from osimlite.schema.paths import GeometryPath, PathPoint, PathWrap
from osimlite.schema.registry import find_class, list_tags
from osimlite.schema.specs import get_field_specs

ROOT = Path(__file__).resolve().parents[2]
TEXTS = [
    path.read_text()
    for path in (
        ROOT / "fixtures/lint/skeleton.osim",
        ROOT / "fixtures/walker/DynamicWalkerModel.osim",
    )
]
SCRAPS = [
    "<",
    ">",
    "&",
    "</objects>",
    "<objects>",
    "<Body name='x'/>",
    "NaN",
    "1e999",
    "\x00",
    "é",
    "<!--",
    "-->",
    "]]>",
    "'",
]


def spoilt(text: str, draw: random.Random) -> str:
    for _ in range(draw.randint(1, 4)):
        at = draw.randrange(len(text))
        match draw.randrange(5):
            case 0:
                text = text[:at] + text[at + draw.randint(1, 200) :]
            case 1:
                text = text[:at] + draw.choice(SCRAPS) + text[at:]
            case 2:
                text = text[:at] + text[at : at + draw.randint(1, 400)] * 2 + text[at:]
            case 3:
                words = text.split(" ")
                draw.shuffle(words[: draw.randint(1, 3)])
                first, second = draw.sample(range(len(words)), 2)
                words[first], words[second] = words[second], words[first]
                text = " ".join(words)
            case _:
                lines = text.splitlines(keepends=True)
                del lines[draw.randrange(len(lines))]
                text = "".join(lines)
    return text


@pytest.mark.parametrize("seed", range(60))
def test_a_spoilt_text_has_findings_in_places_that_exist(seed):
    draw = random.Random(seed)
    text = spoilt(draw.choice(TEXTS), draw)
    source = Source(text.encode(), "spoilt.osim")
    report = validate(source)
    lines = source.lines
    for finding in report:
        assert finding.line is not None and 1 <= finding.line <= len(lines) + 1
        assert finding.column is not None and finding.column >= 1
    assert render(report)


def test_a_text_may_end_within_a_tag():
    for match in re.finditer(r"<[A-Z][\w:]* na", TEXTS[0]):
        assert validate(Source(TEXTS[0][: match.end()].encode(), "cut.osim")).errors


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff\xfe",
        b"\x00" * 100,
        b"<" * 1000,
        b"<OpenSimDocument Version='40600'/>",
        b"<OpenSimDocument Version='40600'><Model/></OpenSimDocument>",
        b"<OpenSimDocument Version='-1'><Model/></OpenSimDocument>",
        b"<OpenSimDocument Version='40600'><Model>"
        + b"<a>" * 5000
        + b"</a>" * 5000
        + b"</Model></OpenSimDocument>",
        b"<!DOCTYPE a [<!ENTITY b 'c'>]><OpenSimDocument Version='40600'><Model/></OpenSimDocument>",
        '<OpenSimDocument Version="40600"><Model name="m"/></OpenSimDocument>'.encode("utf-16"),
    ],
    ids=range(10),
)
def test_odd_bytes_raise_nothing(data):
    assert render(validate(Source(data, "odd.osim")), "json")


def renamed(source: Source, number: int, tag: str) -> str:
    """Return the text with one element renamed."""
    span, text = source.spans[number], source.text
    if span.inner_end < span.end:
        text = text[: span.inner_end + 2] + tag + text[span.inner_end + 2 + len(span.tag) :]
    return text[: span.start + 1] + tag + text[span.start + 1 + len(span.tag) :]


@pytest.mark.parametrize(
    "path",
    sorted((ROOT / "fixtures/lint").glob("OSIM[1-7]*/fail-*example.osim")),
    ids=lambda p: p.parent.name,
)
@pytest.mark.parametrize("tag", ["Plugin", "Marker"])
def test_an_object_of_another_class_anywhere_has_a_finding(path, tag):
    """Replace each element that a rule reads by a class of a plug-in, and by a misplaced class."""
    source = Source.from_file(path)
    known = {span.tag for span in Source(TEXTS[0].encode()).spans}
    for number, span in enumerate(source.spans):
        if (
            number > 1
            and span.tag != tag
            and (span.tag not in known or span.tag in ("Coordinate", "PinJoint", "Body"))
        ):
            assert validate(Source(renamed(source, number, tag).encode())).findings


@pytest.mark.parametrize(
    "scrap",
    [
        # Invalid values in objects that are not part of the model that OpenSim builds from the
        # text.
        "<prescribed_function><Constant/><Constant><value>1,5</value></Constant></prescribed_function>",
        "<prescribed_function><Constant/><SimmSpline><x>0 a</x></SimmSpline></prescribed_function>",
        "<prescribed_function><Plugin/><Constant><value>x</value></Constant></prescribed_function>",
    ],
)
def test_what_opensim_leaves_out_has_findings_too(scrap):
    text = TEXTS[0].replace("<range>-2.1 0</range>", f"<range>-2.1 0</range>{scrap}")
    assert validate(Source(text.encode())).errors
    text = TEXTS[0].replace(
        "</Model>", f'<defaults><Coordinate name="default">{scrap}</Coordinate></defaults></Model>'
    )
    assert validate(Source(text.encode())).findings


SLOTS = [
    (tag, spec.tag)
    for tag in sorted(list_tags())
    for spec in get_field_specs(find_class(tag)).values()
    if tag != "Model"
    and isinstance(spec.kind, ObjectField)
    and spec.kind.form in ("single", "optional")
]


@pytest.mark.parametrize(
    "inside", ["", "<PlugIn/>", "<objects/>", "<PlugIn name='a'/><PlugIn name='a'/>", "<Body/>"]
)
def test_whatever_stands_in_the_place_of_an_object(inside):
    members = "".join(
        f"<{tag} name='{tag}_{slot}'><{slot}>{inside}</{slot}></{tag}>\n" for tag, slot in SLOTS
    )
    text = TEXTS[0].replace(
        "</Model>", f"<ComponentSet>\n<objects>\n{members}</objects></ComponentSet>\n</Model>"
    )
    first = text[: text.index("<ComponentSet>")].count("\n") + 3
    report = validate(Source(text.encode()), select="OSIM1,OSIM204")
    lines = {
        finding.line
        for finding in report
        if finding.code in ("OSIM102", "OSIM103", "OSIM107", "OSIM204")
    }
    assert render(validate(Source(text.encode())))
    if inside == "<PlugIn/>":
        assert lines >= {first + number for number in range(len(SLOTS))}


def test_a_property_of_tools_is_none_of_parts_of_a_model() -> None:
    body = "<Body name='b'> <weight>1</weight> <coordinates>x</coordinates> </Body>"
    model = f"<Model><BodySet><objects>{body}</objects></BodySet></Model>"
    source = Source(f'<OpenSimDocument Version="40600">{model}</OpenSimDocument>'.encode())
    weight, coordinates = (
        finding.message for finding in validate(source, select="OSIM101").findings
    )
    assert "it is a property of" not in weight
    assert "TransformAxis" in coordinates


@pytest.mark.parametrize("tag", ["inertia", "xyz_body_rotation"])
@pytest.mark.parametrize("number", ["1e308", "-1e-320", "inf"])
def test_numbers_beyond_computation_raise_nothing(tag, number, tmp_path):
    body = osimlite.Body(name="body", mass=1.0, inertia=(0.5, 0.5, 0.5, 0.006, -0.002, -0.03))
    body.wrap_object_set.objects.append(
        osimlite.WrapSphere(name="ball", radius=0.1, xyz_body_rotation=(0.1, 0.2, 0.3))
    )
    model = osimlite.Model(name="model")
    model.add(body)
    model.add(osimlite.PinJoint(name="joint").between(model.ground, body))
    path = GeometryPath(name="path")
    for name, frame in (("a", "/ground"), ("b", "/bodyset/body")):
        path.path_point_set.objects.append(
            PathPoint(name=name, socket_parent_frame=frame, location=(0.5, 0.0, 0.0))
        )
    path.path_wrap_set.objects.append(PathWrap(name="wrap", wrap_object="ball"))
    model.add(
        PathSpring(
            name="spring", resting_length=0.1, stiffness=1.0, dissipation=0.0, geometry_path=path
        )
    )
    text = osimlite.to_text(model)
    start = (
        text.index(f"<{tag}>", text.index("<WrapSphere") if tag != "inertia" else 0) + len(tag) + 2
    )
    end = text.index("<", start)
    for words in (text[start:end].split()[1:], []):
        file = tmp_path / "model.osim"
        values = [number, *words] if words else [number] * len(text[start:end].split())
        file.write_text(text[:start] + " ".join(values) + text[end:])
        validate(file)


def test_a_byte_that_is_no_character_is_placed_by_the_characters_before_it():
    text = (
        "<!-- äöü -->".encode()
        + b"<OpenSimDocument Version='40600'><Model name='\xe4'/></OpenSimDocument>"
    )
    (finding,) = validate(Source(text), select="OSIM002")
    assert (finding.line, finding.column) == (
        1,
        13 + len("<OpenSimDocument Version='40600'><Model name='"),
    )
