"""Check classes of plug-ins, which are declared in a file and treated like OpenSim's classes."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import osimlite
from osimlite.cli._validating import validate_paths as validate_paths
from osimlite.errors import OsimliteError
from osimlite.io.document.plugins import classes_in
from osimlite.io.document.source import Source
from osimlite.lint import Config, validate
from osimlite.lint.many import check_files
from osimlite.lint.settings import load_settings
from osimlite.schema.base import Unknown
from osimlite.schema.registry import MODULES, find_class, get_plugin_classes
from osimlite.schema.specs import get_field_specs
from tests.suite import choose

REPO = Path(__file__).resolve().parents[3]
CLASSES = re.findall(
    r"```json\n(.*?)```",
    (REPO / "docs" / "plugin-classes.md").read_text(encoding="utf-8"),
    re.DOTALL,
)
FORCES = """
				<BodyDragForce name="drag">
					<body_name>thigh</body_name>
					<coefficient>0.7</coefficient>
				</BodyDragForce>"""
PATCH = """		<components>
			<FluidPatch name="patch">
				<socket_frame>/bodyset/shank</socket_frame>
				<!--Up.-->
				<normal>0 0 1</normal>
				<Sine name="pressure">
					<amplitude>2</amplitude>
				</Sine>
			</FluidPatch>
		</components>
"""


@pytest.fixture
def folder(fixtures, tmp_path, monkeypatch):
    """Return a folder with the classes of the manual and a model that has objects of them."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    Path("classes.json").write_text(CLASSES[0])
    text = (fixtures / "lint" / "leg.osim").read_text()
    text = text.replace(
        "\n\t\t\t</objects>\n\t\t</ForceSet>", FORCES + "\n\t\t\t</objects>\n\t\t</ForceSet>", 1
    )
    Path("m.osim").write_text(text.replace("\t</Model>", PATCH + "\t</Model>"))
    return tmp_path


def test_without_the_file_they_are_unknown_and_with_it_objects(folder):
    assert dict(validate("m.osim").codes) == {"OSIM102": 2}
    assert str(validate("m.osim", classes="classes.json")) == "nothing found"
    model = osimlite.read("m.osim", classes="classes.json")
    drag = model.force_set.objects[-1]
    assert (drag.coefficient, drag.exponent, drag.body_name, drag.appliesForce) == (
        0.7,
        2.0,
        "thigh",
        True,
    )
    (patch,) = model.subcomponents
    assert patch.path == "/patch" and patch.normal == (0, 0, 1) and patch.pressure.amplitude == 2
    # Declarations for one file do not apply to other files.
    assert not get_plugin_classes() and find_class("BodyDragForce") is None
    assert isinstance(osimlite.read("m.osim").force_set.objects[-1], Unknown)


def test_a_file_is_printed_as_it_was(folder):
    plain = osimlite.to_text(osimlite.read("m.osim"))
    typed = osimlite.read("m.osim", classes="classes.json")
    assert osimlite.to_text(typed) == plain
    assert osimlite.read_text(osimlite.to_text(typed), classes=["classes.json"]) == typed


@pytest.mark.parametrize(
    ("old", "new", "code", "suggestion"),
    [
        ("<coefficient>0.7</coefficient>", "<coeficient>0.7</coeficient>", "OSIM101", "coefficient"),
        ("0.7", "much", "OSIM201", None),
        (">0 0 1<", ">0 1<", "OSIM202", None),
        (">thigh<", ">thihg<", "OSIM301", "thigh"),
        ("/bodyset/shank</socket_frame>\n\t\t\t\t<!", "shank</socket_frame>\n\t\t\t\t<!", "OSIM304", "/bodyset/shank"),
        ("BodyDragForce", "BodyDragForze", "OSIM102", "BodyDragForce"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_them_is_found(folder, old, new, code, suggestion):
    text = Path("m.osim").read_text()
    assert old in text
    Path("m.osim").write_text(text.replace(old, new))
    assert [
        (each.code, each.suggestion) for each in validate("m.osim", classes="classes.json")
    ] == [(code, suggestion)]


def test_settings_and_option_name_files_and_the_cache_knows_them(folder, capsys):
    (folder / "sub").mkdir()
    Path("m.osim").rename("sub/m.osim")
    Path("osimlite.toml").write_text('classes = ["classes.json"]\n')
    for _ in range(2):
        assert check_files(["sub/m.osim"], Config()).findings == []
    Path("classes.json").write_text(CLASSES[0].replace('"coefficient"', '"factor"'))
    assert {each.code for each in check_files(["sub/m.osim"], Config())} == {"OSIM101"}
    (folder / "osimlite.toml").rename(folder / "sub" / "classes.toml")
    load_settings.cache_clear()
    Path("classes.json").write_text(CLASSES[0])
    assert validate_paths(["sub"], classes=["classes.json"]) == 0
    assert validate_paths(["sub"]) == 1


def test_objects_are_made_in_python(folder):
    cls = classes_in("classes.json")["BodyDragForce"]
    drag = cls(name="more", body_name="shank", coefficient=3)
    model = osimlite.read("m.osim", classes="classes.json")
    model.force_set.objects.append(drag)
    assert "<coefficient>3</coefficient>" in osimlite.to_text(model)
    with pytest.raises(OsimliteError, match="did you mean 'coefficient'"):
        cls(coeficient=3)
    assert classes_in("classes.json")["BodyDragForce"] is cls


def declared(folder, **classes):
    path = folder / "mine.json"
    path.write_text(json.dumps({"classes": classes}, indent=1))
    return path


def test_a_class_may_derive_from_another_and_hold_objects_of_a_third(folder):
    path = declared(
        folder,
        Wheel={"bases": ["Round"], "properties": [{"name": "spokes", "type": "Spoke", "kind": "list", "object": True}]},
        Round={"bases": ["ModelComponent"], "abstract": True, "properties": [{"name": "radius", "type": "double"}]},
        Spoke={
            "bases": ["Object"],
            "properties": [
                {"name": "path", "type": "string"},
                {"name": "from", "type": "int", "kind": "optional"},
                {"name": "loads", "type": "double", "kind": "list", "max": 2, "default": [1, 2]},
            ],
        },
    )  # fmt: skip
    classes = classes_in(path)
    assert list(get_field_specs(classes["Wheel"])) == ["components", "radius", "spokes"]
    spoke = classes["Spoke"]()
    assert list(get_field_specs(classes["Spoke"])) == ["path", "from", "loads"]
    assert (spoke.path, spoke.from_, spoke.loads) == ("", None, (1.0, 2.0))
    assert classes["Wheel"](radius=1, spokes=[spoke]).spokes == [spoke]


def test_a_default_of_the_base_may_be_another(folder):
    path = declared(
        folder,
        Ours={
            "bases": ["Force"],
            "properties": [{"name": "appliesForce", "type": "bool", "default": "false"}],
        },
    )
    cls = classes_in(path)["Ours"]
    assert (
        list(get_field_specs(cls)) == ["components", "appliesForce"] and cls().appliesForce is False
    )


PROPERTY = {"name": "gain", "type": "double"}


@pytest.mark.parametrize(
    ("entry", "line", "words"),
    [
        ({"bases": ["Forze"]}, 5, "there is no class 'Forze'; did you mean 'Force'?"),
        ({"bases": []}, 3, "'bases' of 'Mine' must list the class that it derives from"),
        (
            {"bases": ["Force"], "propertys": []},
            7,
            "has no 'propertys'; did you mean 'properties'?",
        ),
        (
            {"bases": ["Force"], "properties": [{**PROPERTY, "defalt": "1"}]},
            11,
            "no 'defalt'; did you mean 'default'?",
        ),
        (
            {"bases": ["Force"], "properties": [{**PROPERTY, "default": "x"}]},
            11,
            "must be one number, not 'x'",
        ),
        ({"bases": ["Force"], "properties": [{"name": "gain"}]}, 9, "'gain' of 'Mine' has no type"),
        (
            {"bases": ["Force"], "properties": [{**PROPERTY, "kind": "lists"}]},
            11,
            "did you mean 'list'?",
        ),
        (
            {"bases": ["Force"], "properties": [{**PROPERTY, "type": "dubble"}]},
            10,
            "there is no class 'dubble'",
        ),
        (
            {"bases": ["Force"], "properties": [{**PROPERTY, "type": "Function", "object": True}]},
            9,
            "must be an object",
        ),
        (
            {"bases": ["Force"], "sockets": [{"tag": "socket_a"}]},
            3,
            "needs 'tag' and 'connectee_type'",
        ),
        ({"bases": ["Mine"]}, 3, "form a circle"),
    ],
)
def test_a_wrong_declaration_is_told_with_its_line(folder, entry, line, words):
    path = declared(folder, Mine=entry)
    with pytest.raises(OsimliteError) as caught:
        classes_in(path)
    assert words in str(caught.value) and (caught.value.file, caught.value.line) == (
        str(path),
        line,
    )


def test_what_is_no_declaration_at_all_is_told(folder, capsys):
    for text, words in [
        ("{", "mine.json:1: not JSON"),
        ("[]", "must be an object of JSON"),
        ('{"classes": {"Body": {"bases": ["Frame"]}}}', "'Body' is a class of OpenSim itself"),
        (
            '{"classes": {}, "references": [{"cls": "A", "property": "b", "resolution": "body-names"}]}',
            "'body-name'?",
        ),
        (
            '{"classes": {}, "references": [{"cls": "A", "property": "b", "resolution": "body-name"}]}',
            "'A.b'",
        ),
    ]:
        Path("mine.json").write_text(text)
        with pytest.raises(OsimliteError, match=re.escape(words)):
            osimlite.read("m.osim", classes="mine.json")
    with pytest.raises(OsimliteError, match=r"no\.json: cannot read the file: no such file"):
        validate_paths(["m.osim"], classes=["no.json"])


def test_an_output_of_a_plugin_is_one(folder):
    classes = json.loads(CLASSES[0])
    classes["classes"]["FluidPatch"]["outputs"] = [
        {"name": "flow", "type": "double", "list": False}
    ]
    Path("classes.json").write_text(json.dumps(classes))
    reporter = '<TableReporter__double_ name="t"> <input_inputs>/patch|{}</input_inputs> </TableReporter__double_>'
    text = Path("m.osim").read_text()
    result = []
    for word in ("flow", "flou"):
        Path("m.osim").write_text(
            text.replace("\t\t</components>", reporter.format(word) + "\t\t</components>")
        )
        result.append(
            [(each.code, each.suggestion) for each in validate("m.osim", classes="classes.json")]
        )
    assert result == [[], [("OSIM332", "/patch|flow")]]


def test_a_class_may_derive_from_any(folder):
    """Classes derived from every class work: all rules check an object with two faults."""
    names = sorted(set(MODULES) - {"Model", "Object", "Unknown"})[:: choose(4, 1)]
    more = {
        "properties": [
            {"name": "gain", "type": "double"},
            {
                "name": "helper",
                "type": "Function",
                "object": True,
                "default": {"class": "Constant"},
            },
        ],
        "sockets": [{"tag": "socket_spot", "connectee_type": "Frame"}],
    }
    path = declared(folder, **{f"My{name}": {"bases": [name], **more} for name in names})
    config = Config(classes=(str(path),))
    text = Path("m.osim").read_text()
    for name, cls in classes_in(path).items():
        item = f'<{name} name="mine"> <gian>2</gian> <socket_spot>/bodyset/thgh</socket_spot> </{name}>'
        file, whole = "m.xml", f'<OpenSimDocument Version="40600"> {item} </OpenSimDocument>'
        if cls.is_component:
            file, whole = "m.osim", text.replace("\t\t<components>", f"\t\t<components> {item}")
        codes = validate(Source(whole.encode(), file), config=config).codes
        assert "OSIM101" in codes and (
            not cls.is_component or codes.keys() & {"OSIM301", "OSIM103"}
        ), name


@pytest.mark.corpus
def test_a_real_model_with_a_class_of_a_plugin(corpus, folder):
    path = next(model.path for model in corpus if model.id == "m0119")
    path_of_classes = declared(
        folder,
        BodyDragForce={
            "bases": ["Force"],
            "properties": [
                {"name": "body_name", "type": "string"},
                {"name": "coefficient", "type": "double"},
                {"name": "exponent", "type": "double"},
            ],
        },
    )
    assert validate(path).codes["OSIM102"] == 3
    assert validate(path, classes=path_of_classes).codes["OSIM102"] == 0
    model = osimlite.read(path, classes=path_of_classes)
    assert [force.coefficient for force in model.force_set.objects[:3]] == [0.0, 0.7, 1.4]
