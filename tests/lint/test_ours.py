"""Check which XML files count as OpenSim's despite a misspelt root, skipped files, and missing folders."""

from __future__ import annotations

import re

import pytest

from osimlite.cli import main
from osimlite.lint import validate
from osimlite.lint.project_files import is_opensim_xml

SETUP = """<?xml version="1.0"?>
<OpenSimDocument Version="40600">
  <InverseKinematicsTool name="ik">
    <model_file>leg.osim</model_file>
    <results_directory>.</results_directory>
  </InverseKinematicsTool>
</OpenSimDocument>
"""
# XML files of other programs.
OTHERS = {
    "urdf": """<robot name="r"><link name="a"><inertial><mass value="1"/></inertial></link>
        <joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="0 0 0"/></joint></robot>""",
    "mjcf": """<mujoco model="m"><compiler angle="radian"/><option gravity="0 0 -9.81"/><worldbody><body name="b">
        <joint type="hinge"/><geom type="sphere"/></body></worldbody><actuator><muscle/></actuator></mujoco>""",
    "maven": "<project><modelVersion>4</modelVersion><properties><name>x</name></properties></project>",
    "doxygen": '<doxygen><compounddef kind="class"><compoundname>OpenSim::InverseKinematicsTool</compoundname>'
    "<listofallmembers><member/></listofallmembers></compounddef></doxygen>",
    "sdf": "<sdf><world><model name='m'><link><inertial><mass>1</mass></inertial></link></model></world></sdf>",
    "words": "<Model><Body><mass>1</mass><inertia>1 1 1</inertia></Body><Marker><fixed>0</fixed></Marker></Model>",
    "plugin": "<MyPluginTool><my_model>a</my_model></MyPluginTool>",
    "markers": "<MotoNMS><Markers><Marker>LASI</Marker></Markers><OpenSim>yes</OpenSim></MotoNMS>",
    "hidden": "<a><!-- <ScaleTool><mass>1</mass><height>2</height></ScaleTool> --><b/></a>",
}


@pytest.mark.parametrize(
    ("root", "right"),
    [
        ("OpenSimDocumnt", "OpenSimDocument"),
        ("opensimdocument", "OpenSimDocument"),
        ("OPENSIMDOCUMENT", "OpenSimDocument"),
        ("os:OpenSimDocument", "OpenSimDocument"),
        ("OpenSim_Document", "OpenSimDocument"),
        ("Settings", "OpenSimDocument"),
    ],
)
def test_a_document_with_another_root_is_told_with_the_right_one(tmp_path, root, right):
    file = tmp_path / "ik.xml"
    file.write_text(SETUP.replace("OpenSimDocument", root))
    (tmp_path / "pom.xml").write_text(OTHERS["maven"])
    report = validate(tmp_path)
    assert report.passed == [str(tmp_path / "pom.xml")]
    first = report.findings[0]
    assert (first.code, first.line, first.column, first.suggestion) == ("OSIM003", 2, 1, right)
    # The content is checked all the same.
    assert "OSIM821" in report.codes
    assert main_code("validate", str(tmp_path), "--unsafe-fixes") == 1
    assert re.sub(" xmlns.*?>", ">", file.read_text()) == SETUP


@pytest.mark.parametrize(
    "tag", ["InverseKinematicTool", "inversekinematicstool", "InverseKinemtaicsTool"]
)
@pytest.mark.parametrize("root", ["OpenSimDocument", "OpenSimDocumnt", None])
def test_a_misspelt_tool_is_told_with_the_right_name(tmp_path, tag, root):
    text = SETUP.replace("InverseKinematicsTool", tag).replace(
        "OpenSimDocument", root or "OpenSimDocument"
    )
    if root is None:
        text = "\n".join(line for line in text.split("\n") if "OpenSimDocument" not in line)
    (tmp_path / "ik.xml").write_text(text)
    result = {
        (finding.line, finding.suggestion)
        for finding in validate(tmp_path)
        if finding.code == "OSIM003"
    }
    assert (2 if root is None else 3, "InverseKinematicsTool") in result
    assert root is None or ((2, "OpenSimDocument") in result) == (root != "OpenSimDocument")


@pytest.mark.parametrize("name", OTHERS)
def test_xml_of_other_programs_is_left_alone(name):
    assert not is_opensim_xml(OTHERS[name].encode())
    assert not is_opensim_xml(('<?xml version="1.0"?><!DOCTYPE x>' + OTHERS[name]).encode("utf-16"))


def main_code(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(list(words))
    return int(ended.value.code or 0)


def test_what_is_passed_over_is_counted_and_named(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "project"
    folder.mkdir()
    monkeypatch.chdir(folder)
    (folder / "m.osim").write_text(
        '<OpenSimDocument Version="40600"><Model name="m"/></OpenSimDocument>'
    )
    for name in ("maven", "urdf"):
        (folder / f"{name}.xml").write_text(OTHERS[name])
    for form in ("concise", "full"):
        assert main_code("validate", ".", "--format", form) == 0
        assert "2 files skipped (not OpenSim files)." in capsys.readouterr().out
        assert main_code("validate", ".", "--format", form, "--all") == 0
        assert "Skipped, not OpenSim files: maven.xml, urdf.xml." in capsys.readouterr().out
    assert main_code("validate", ".", "--statistics") == 0
    assert "2 files skipped (not OpenSim files)." in capsys.readouterr().out
    assert main_code("validate", "m.osim") == 0
    assert "skipped" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("nowhere", "no such file or folder"),
        ("./a/b", "no such file or folder"),
        ("nowhere/", "the folder does not exist"),
        ("no.where/", "the folder does not exist"),
    ],
)
@pytest.mark.parametrize("command", ["validate", "format"])
def test_a_path_that_is_not_there(tmp_path, monkeypatch, capsys, command, path, message):
    monkeypatch.chdir(tmp_path)
    assert main_code(command, path) == 2
    assert (
        capsys.readouterr().err
        == f"osimlite: {path}: {message}; check its name (see docs/errors.md#folders)\n"
    )


def test_only_folders_that_are_named_lead_to_the_page_about_folders(
    tmp_path, fixtures, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    model = str(fixtures / "lint" / "leg.osim")
    (tmp_path / "taken").touch()
    assert main_code("upgrade", model, "-o", "taken/such.osim") == 2
    assert "this is a file, not a folder (see docs/errors.md#files)" in capsys.readouterr().err
    assert main_code("validate", model, "--geometry", "nowhere") == 2
    assert capsys.readouterr().err.endswith("(see docs/errors.md#folders)\n")
