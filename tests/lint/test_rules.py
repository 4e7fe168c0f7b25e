"""Check every rule: its page, its examples, and its fixtures."""

from __future__ import annotations

import importlib.util
import re
from functools import cache
from pathlib import Path
from shutil import copy
from typing import Any

import pytest

from osimlite.io.document.source import Source
from osimlite.lint import Config, Severity, rules, validate
from osimlite.lint.baseline import subtract_baseline, write_baseline
from osimlite.lint.diagnostic import Consequence
from osimlite.lint.engine import run_rules
from osimlite.lint.pages import format_index, format_rule_page
from osimlite.lint.registry import (
    DOCUMENT_MODULES,
    FAMILIES,
    RULE_MODULES,
    Rule,
    all_rules,
    rule_groups,
)
from osimlite.lint.trial import Measurement, Trial
from osimlite.schema.model import CURRENT_VERSION
from tests.cases import of_each

HERE = Path(__file__).resolve().parent
FIXTURES = HERE.parents[1] / "fixtures" / "lint"
HEADINGS = ["What it does", "Why is this bad", "Example", "Use instead"]


def beside(name: str) -> Any:
    """Return a module of this folder, loaded from its file."""
    spec = importlib.util.spec_from_file_location(name, HERE / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


skeleton, trials = beside("skeleton"), beside("trials")

MEASURED = ("OSIM63",)
"""Rules that measure all muscles and paths, and would therefore report in examples of other rules."""

RULES = [pytest.param(rule, id=rule.code) for rule in all_rules()]


@cache
def checked(path: Path, rule: Rule):
    """Return the findings in an example or fixture of a rule."""
    if path.suffix == ".trial":
        return trials.checked_trial(path.read_text(), rule)
    ignored = () if rule.code.startswith(MEASURED) else MEASURED
    return validate(path, ignore=ignored)


def example(rule: Rule, heading: str) -> bytes:
    """Return the document under a heading of a rule's page."""
    section = rule.page.split(f"## {heading}\n", 1)[1].split("\n## ", 1)[0]
    block = re.search(r"```(\S+)\n(.*?)```", section, re.DOTALL)
    assert block is not None, f"{rule.code} shows nothing under '{heading}'"
    if block[1] == "setup":
        return f'<OpenSimDocument Version="{CURRENT_VERSION}">\n{block[2]}</OpenSimDocument>\n'.encode()
    if block[1] in ("document", "sto", "trc", "trial"):
        return block[2].replace("→", "\t").encode()
    return skeleton.document(block[2]).encode()


@pytest.mark.parametrize("path", [skeleton.SKELETON, skeleton.LIMB], ids=lambda path: path.stem)
def test_the_skeleton_is_without_findings(path):
    assert str(validate(path)) == "nothing found"


@of_each(all_rules(), lambda rule: rule.code)
def test_a_module_that_only_some_subjects_load_is_about_these(rule):
    module = rule.check.__module__.rpartition(".")[2]
    (subject,) = (about for about, modules in RULE_MODULES.items() if module in modules)
    assert subject == (rule.about if rule.about in RULE_MODULES else "model")


@of_each(all_rules(), lambda rule: rule.code)
def test_rules_that_apply_to_every_document_are_in_shared_modules(rule):
    module = rule.check.__module__.rpartition(".")[2]
    if rule.about == "model" and (rule.code[4] in "012" or rule.name == "included-file"):
        assert module in DOCUMENT_MODULES


def test_the_table_of_rule_modules_names_every_module():
    folder = Path(rules.__path__[0])
    known = [module for modules in RULE_MODULES.values() for module in modules]
    assert sorted(known) == sorted({path.stem for path in folder.glob("*.py")} - {"__init__"})


@of_each(all_rules(), lambda rule: rule.code)
def test_a_page_has_its_headings_and_prose(rule):
    assert re.findall(r"^## (.*)$", rule.page, re.MULTILINE) == HEADINGS
    assert rule.page.splitlines()[0].endswith(".")
    assert re.fullmatch(r"[a-z]+(-[a-z]+)*", rule.name)
    assert rule.code[4] in FAMILIES and re.fullmatch(r"OSIM\d{3}(\d\d)?", rule.code)


def example_file(rule: Rule, heading: str, folder: Path) -> Path:
    """Write the document under a heading of a rule's page as a file, and return its path."""
    block = re.search(r"```(sto|trc|setup|trial)\n", rule.page)
    path = folder / f"example.{'osim' if block is None else block[1].replace('setup', 'xml')}"
    if path.suffix == ".xml":
        # Copy the files that setups name, and the tool that names the setup.
        for file in filter(Path.is_file, FIXTURES.iterdir()):
            copy(file, folder)
        for file in (FIXTURES / rule.code).glob("tool.xml"):
            (folder / file.name).write_text(file.read_text().replace("../", ""))
    path.write_bytes(example(rule, heading))
    return path


@pytest.mark.parametrize("rule", RULES)
def test_the_example_of_a_page_has_the_finding(rule, tmp_path):
    path = example_file(rule, "Example", tmp_path)
    report = checked(path, rule)
    assert set(report.codes) == {rule.code}, str(report)
    assert all(finding.line is not None for finding in report)


@pytest.mark.parametrize("rule", RULES)
def test_the_mended_example_has_no_finding(rule, tmp_path):
    assert str(checked(example_file(rule, "Use instead", tmp_path), rule)) == "nothing found"


@pytest.mark.parametrize("rule", RULES)
def test_a_rule_has_fixtures_that_fail_and_that_pass(rule):
    folder = FIXTURES / rule.code
    failing, passing = sorted(folder.glob("fail-*")), sorted(folder.glob("pass-*"))
    assert failing and passing, f"fixtures/lint/{rule.code} needs fail-NN-* and pass-*"
    for path in failing:
        expected = int(path.name.split("-")[1])
        report = checked(path, rule)
        assert dict(report.codes) == {rule.code: expected}, f"{path.name}:\n{report}"
    for path in passing:
        assert str(checked(path, rule)) == "nothing found", path.name


@pytest.mark.parametrize("rule", RULES)
def test_a_rule_mends_as_its_page_says(rule):
    kinds = {
        "safe" if finding.fix.safe else "unsafe"
        for path in (FIXTURES / rule.code).glob("fail-*")
        for finding in checked(path, rule)
        if finding.fix is not None
    }
    assert kinds == {"": set(), "both": {"safe", "unsafe"}}.get(rule.fixes, {rule.fixes})


@pytest.mark.parametrize("rule", RULES)
def test_a_finding_says_what_opensim_does_as_its_rule_declares(rule):
    for path in (FIXTURES / rule.code).glob("fail-*"):
        for finding in checked(path, rule):
            if finding.severity is not Severity.ERROR:
                assert finding.consequence is Consequence.RUNS
            elif len(rule.consequences) == 1:
                assert finding.consequence is rule.consequences[0]
            else:
                assert finding.consequence in (None, *rule.consequences)


def test_a_severity_in_the_settings_does_not_change_what_opensim_does():
    path = next((FIXTURES / "OSIM401").glob("fail-*"))
    lenient = Config(severity={"OSIM401": Severity.INFO})
    consequences = [
        [finding.consequence for finding in validate(path, config=config)]
        for config in (Config(), lenient)
    ]
    assert consequences[0] == consequences[1]


def test_the_index_of_rules_is_that_of_the_rules():
    # `python packaging/regenerate.py` updates the index.
    assert (HERE.parents[1] / "docs" / "rules.md").read_text(encoding="utf-8") == format_index()


def test_a_page_says_severity_mends_and_settings():
    pages = {rule.code: format_rule_page(rule) for rule in all_rules()}
    assert pages["OSIM312"].startswith(
        "# illegal-name (OSIM312)\n\nSeverity: error; warning in files of a version before 30500\nFix: none\n"
        "OpenSim: rejects the file\n"
    )
    assert "Fix: sometimes, with --fix\n" in pages["OSIM104"]
    assert (
        "\nOpenSim: in some cases it rejects the file; in others it computes NaN\n"
        in pages["OSIM407"]
    )
    assert "\nOpenSim: " not in pages["OSIM311"]
    assert "\nOpenSim, if the finding is an error: rejects the file\n" in pages["OSIM701"]
    assert (
        "- `contact-depth = 0.001` (m): largest accepted depth of a sphere inside a surface at the start"
        in pages["OSIM521"]
    )
    assert "Settings" not in pages["OSIM104"]


def test_a_body_with_a_blank_in_its_name_is_refused_in_old_files_too():
    text = """<OpenSimDocument Version="30000"><Model name="m"><BodySet>
        <objects> <Body name="ground"/> <Body name="my thigh"/> </objects>
    </BodySet></Model></OpenSimDocument>"""
    (finding,) = validate(Source(text.encode()), select="OSIM312").findings
    assert finding.severity is Severity.ERROR and "frames of that name" in finding.message


@pytest.mark.parametrize(
    ("version", "name", "severity"),
    [
        (40600, "my hip", Severity.ERROR),
        (30500, "my hip", Severity.ERROR),
        # OpenSim removes the blank from the name of the object, but not from the group.
        (30000, "my hip", Severity.WARNING),
        (30000, "my/hip", Severity.ERROR),
    ],
)
def test_the_severity_of_an_illegal_name_depends_on_the_version(version, name, severity):
    text = f"""<OpenSimDocument Version="{version}"><Model name="m"><MarkerSet>
        <objects> <Marker name="{name}"/> </objects>
        <groups> <ObjectGroup name="g"> <members>{name}</members> </ObjectGroup> </groups>
    </MarkerSet></Model></OpenSimDocument>"""
    (finding,) = validate(Source(text.encode()), select="OSIM312").findings
    assert (finding.severity, finding.line, finding.column) == (severity, 2, 33)


@pytest.mark.parametrize(
    ("fragment", "tag", "words"),
    [
        (
            '<Marker name="a"><body>pelvis</body></Marker>',
            "socket_parent_frame",
            "before version 30501",
        ),
        (
            '<PinJoint name="hip"><parent_body>pelvis</parent_body></PinJoint>',
            "socket_parent_frame",
            "version 30505",
        ),
        (
            '<PinJoint name="hip"><location_in_parent>0 0 0</location_in_parent></PinJoint>',
            None,
            "PhysicalOffsetFrame",
        ),
        (
            '<PinJoint name="hip"><socket_parent_frame_connectee_name>/ground</socket_parent_frame_connectee_name>'
            "</PinJoint>",
            "socket_parent_frame",
            "version 30517",
        ),
        (
            '<PathSpring name="s"><isDisabled>true</isDisabled></PathSpring>',
            "appliesForce",
            "the opposite value",
        ),
    ],
)
def test_a_tag_of_an_old_format_is_called_so(fragment, tag, words):
    report = validate(Source(skeleton.document(fragment).encode()), select="OSIM101")
    (finding,) = report.findings
    assert (
        words in finding.message
        and "this file has version 40600, so OpenSim ignores it" in finding.message
    )
    assert finding.suggestion == tag


def test_fixture_folders_belong_to_rules():
    codes = {rule.code for rule in (*all_rules(), *rule_groups())}
    assert {path.name for path in FIXTURES.iterdir() if path.is_dir()} == codes


def test_rules_can_be_selected_and_ignored():
    source = Source(skeleton.document("<foo>1</foo><gravity>0 -9806 0</gravity>").encode())
    assert set(validate(source).codes) == {"OSIM101", "OSIM505"}
    assert set(validate(source, select="OSIM1").codes) == {"OSIM101"}
    assert set(validate(source, select=["unknown-tag", "OSIM505"]).codes) == {"OSIM101", "OSIM505"}
    assert set(validate(source, ignore="structure,OSIM3").codes) == {"OSIM505"}


def test_the_place_of_an_old_connector_is_the_name_in_it():
    text = """<OpenSimDocument Version="30506"><Model name="m"><BodySet><objects>
        <Body name="b"><mass>1</mass><attached_geometry><Brick name="g"><connectors><Connector_Frame_ name="frame">
            <connectee_name>b</connectee_name>
        </Connector_Frame_></connectors></Brick></attached_geometry></Body>
    </objects></BodySet></Model></OpenSimDocument>"""
    (finding,) = validate(Source(text.encode()), select="OSIM304").findings
    assert (finding.line, finding.column) == (3, 29)
    assert "names 'b'" in finding.message


def test_the_place_of_a_cdata_section_is_its_beginning():
    text = """<OpenSimDocument Version="40600"><Model name="m"><BodySet><objects><Body name="b">
        <mass>1
            .5<![CDATA[0]]></mass></Body></objects></BodySet></Model></OpenSimDocument>"""
    (finding,) = validate(Source(text.encode()), select="OSIM107").findings
    assert (finding.line, finding.column, finding.length) == (3, 15, len("<![CDATA["))


@pytest.mark.parametrize(
    ("tag", "nearest"), [("OpenSim::Body", "Body"), ("xml:Body", "Body"), ("o:body", "Body")]
)
def test_a_namespace_does_not_hide_the_right_name(tag, nearest):
    text = f"""<OpenSimDocument Version="40600"><Model name="m"><BodySet>
        <objects> <{tag} name="b"> <mass>1</mass> </{tag}> </objects></BodySet></Model></OpenSimDocument>"""
    (finding,) = validate(Source(text.encode()), select="OSIM102").findings
    assert (finding.suggestion, finding.line, finding.column) == (nearest, 2, 19)


GROUPS = [pytest.param(group, id=group.code) for group in rule_groups()]


@pytest.mark.parametrize("group", GROUPS)
def test_the_code_and_the_name_of_a_group_mean_all_its_faults(group):
    members = [rule for rule in all_rules() if rule.group == group.name]
    assert len(members) > 5
    assert [rule.code for rule in members] == [
        f"{group.code}{number:02d}" for number in range(1, len(members) + 1)
    ]
    for path in (FIXTURES / group.code).glob("fail-*"):
        everything = checked(path, group)
        assert len(everything.findings) == int(path.name.split("-")[1])
        for word in (group.code, group.name):
            assert validate(path, select=word).findings == everything.findings
            assert str(validate(path, ignore=[word, *MEASURED])) == "nothing found"
        first = everything.findings[0]
        assert first.code.startswith(group.code) and first.name != group.name
        alone = [finding for finding in everything.findings if finding.code == first.code]
        for word in (first.code, first.name):
            assert validate(path, select=word).findings == alone
    for path in (FIXTURES / group.code).glob("pass-*"):
        assert str(checked(path, group)) == "nothing found", path.name


@pytest.mark.parametrize("word", ["OSIM852", "tool-setting", "OSIM85206", "activation-exponent"])
def test_a_comment_ignores_a_fault_or_its_group(word, tmp_path):
    text = (
        (FIXTURES / "OSIM852" / "fail-02-optimization.xml")
        .read_text()
        .replace("../", f"{FIXTURES}/")
    )
    path = tmp_path / "run.xml"
    path.write_text(
        text.replace("<AnalyzeTool", f"<!-- osimlite: ignore {word} -->\n<AnalyzeTool", 1)
    )
    left = [finding.code for finding in validate(path, ignore=MEASURED).findings]
    assert left == ([] if word in ("OSIM852", "tool-setting") else ["OSIM85205"])


def test_a_baseline_of_before_the_faults_had_codes_still_counts(tmp_path):
    path = FIXTURES / "OSIM852" / "fail-02-optimization.xml"
    report = validate(path)
    write_baseline(tmp_path / "old.json", report)
    text = (tmp_path / "old.json").read_text()
    (tmp_path / "old.json").write_text(re.sub(r"OSIM852\d\d", "OSIM852", text))
    assert not subtract_baseline(tmp_path / "old.json", report).findings
    (tmp_path / "old.json").write_text(re.sub(r"OSIM852\d\d", "OSIM853", text))
    assert len(subtract_baseline(tmp_path / "old.json", report).findings) == 2


def test_a_group_sets_the_severity_of_its_faults():
    path = FIXTURES / "OSIM853" / "fail-02-pairs.xml"
    for word in ("OSIM853", "scale-setting"):
        result = validate(path, config=Config(severity={word: Severity.INFO})).findings
        assert [str(finding.severity) for finding in result] == ["info", "info"]


def test_a_group_has_a_page_with_its_rules(capsys):
    from osimlite.cli import main

    for word in ("OSIM853", "scale-setting"):
        with pytest.raises(SystemExit):
            main(["rule", word])
        out = capsys.readouterr().out
        assert out.startswith("# scale-setting (OSIM853)\n\nA setting of the scale tool")
        assert "OSIM85307  marker-pair-count" in out and out.count("\nOSIM853") == 12


def test_a_measurement_that_is_nan_has_no_advice_for_its_size() -> None:
    """Static optimization writes NaN where it finds no solution; masses and filters do not matter there."""
    (rule,) = (rule for rule in all_rules() if rule.code == "OSIM911")
    number = Measurement(rule.name, "peak", "FX of static optimization", float("nan"), "N", 850.0)
    (finding,) = run_rules(Trial("r.sto", b"", [number])).findings
    assert (finding.code, finding.severity.value) == ("OSIM911", "warning")
    assert (
        "the peak of FX of static optimization has no value: the results have NaN"
        in finding.message
    )
    assert "masses" not in finding.message
