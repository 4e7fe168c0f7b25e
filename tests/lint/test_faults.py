"""Check that faults that were tried with OpenSim are found on their lines, and valid text is not."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from osimlite.errors import MissingFileError
from osimlite.io.document.source import Source
from osimlite.lint import validate

HERE = Path(__file__).resolve().parent
WALKER = HERE.parents[1] / "fixtures" / "walker" / "DynamicWalkerModel.osim"

_spec = importlib.util.spec_from_file_location("faults", HERE / "faults.py")
assert _spec is not None and _spec.loader is not None
faults = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(faults)


def faulty(change, tmp_path):
    text, place = change(WALKER.read_text())
    path = tmp_path / "walker.osim"
    path.write_text(text)
    return path, None if place is None else Source(text.encode()).position(place).line


@pytest.mark.parametrize("fault", faults.FAULTS, ids=lambda fault: fault.name)
def test_a_fault_is_found_in_its_line(fault, tmp_path):
    path, line = faulty(fault.change, tmp_path)
    report = validate(path)
    here = [f for f in report if f.code == fault.code and (line is None or f.line == line)]
    assert here, f"expected {fault.code} in line {line}:\n{report}"
    assert {finding.severity.value for finding in here} == {fault.severity}
    assert all(finding.message and finding.file == str(path) for finding in report)


def test_the_table_is_whole():
    # OpenSim was asked about 129 changes: 5 of them are valid, and one is a missing file.
    assert len(faults.FAULTS) == 129 - 5 - 1
    assert len({fault.name for fault in faults.FAULTS}) == len(faults.FAULTS)


@pytest.mark.parametrize("name", faults.VALID)
def test_what_is_valid_is_left_alone(name, tmp_path):
    report = validate(faulty(faults.VALID[name], tmp_path)[0])
    assert not report.errors and not report.warnings, str(report)


def test_the_walker_has_neither_errors_nor_warnings():
    report = validate(WALKER)
    assert report.ok and not report.warnings
    assert [finding.code for finding in report.infos] == ["OSIM508", "OSIM508", "OSIM521"]
    assert "-140 deg" in report.infos[0].message
    assert "'RFootContact' starts 21.6 mm inside" in report.infos[2].message


def test_the_name_of_a_part_of_a_probe_may_not_be_blank():
    text = """<OpenSimDocument Version="40600"><Model name="m"><ProbeSet name="probeset"><objects>
        <Umberger2010MuscleMetabolicsProbe name="probe">
        <Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameterSet><objects>
        <Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter name="  "/>
        </objects></Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameterSet>
        </Umberger2010MuscleMetabolicsProbe></objects></ProbeSet></Model></OpenSimDocument>"""
    (finding,) = validate(Source(text.encode()), select="OSIM303").findings
    assert (
        "is blank, expected the name of a Muscle; OpenSim disables the whole probe"
        in finding.message
    )


def test_a_missing_file_is_no_finding():
    with pytest.raises(MissingFileError, match="no such file"):
        validate("does_not_exist.osim")


def test_all_findings_come_in_one_run_in_the_order_of_the_text(tmp_path):
    text = WALKER.read_text()
    for fault in (faults.FAULTS[0], *faults.VALUES[:2], faults.STRUCTURE[0], faults.PHYSICS[3]):
        text, _ = fault.change(text) if fault.change(text)[0] else (text, 0)
    report = validate(Source(text.encode(), "walker.osim"))
    assert {"OSIM101", "OSIM202", "OSIM301", "OSIM407"} <= set(report.codes)
    places = [(finding.line, finding.column) for finding in report]
    assert places == sorted(places)


def test_a_syntax_error_does_not_hide_what_stands_before_it(tmp_path):
    text = WALKER.read_text().replace("<mass>1</mass>", "<mass>1,5</mass>", 1)
    report = validate(Source(text[: text.index("<JointSet")].encode()))
    assert report.codes == {"OSIM001": 1, "OSIM203": 1}


def test_misspelt_contact_is_reported_with_force_place_and_neighbour(tmp_path):
    path, line = faulty(faults.FAULTS[0].change, tmp_path)
    (finding,) = validate(path).errors
    assert finding.line == line
    source = path.read_text().splitlines()[line - 1]
    assert source[finding.column - 1 : finding.column - 1 + finding.length] == "RFootContct"
    assert "HuntCrossleyForce 'RFootForce'" in finding.message
    assert finding.component == "/forceset/RFootForce"
    assert finding.suggestion == "RFootContact"


@pytest.mark.parametrize(
    ("name", "suggestion"),
    [
        ("hc_geom_comma", "RFootContact"),
        ("hc_geom_wrong_case", "RFootContact"),
        ("joint_parent_misspelled", "/bodyset/Platform"),
        ("offset_parent_misspelled", "/bodyset/Pelvis"),
        ("joint_child_offset_misspelled", "RightThigh_offset"),
        ("joint_parent_bare_name", "/bodyset/Platform"),
        ("joint_parent_missing_slash", "/bodyset/Platform"),
        ("limit_coord_path", "RHip_rz"),
        ("limit_coord_misspelled", "RHip_rz"),
        ("misspelled_mass_tag", "mass"),
        ("misspelled_paramset", "HuntCrossleyForce::ContactParametersSet"),
        ("unknown_joint_class", "PinJoint"),
        ("unknown_geometry_class", "Brick"),
        ("misspelled_set_tag", "ForceSet"),
        ("vec3_comma", "0 -0.2175 0"),
        ("vec3_tilde_brackets", "0 -0.2175 0"),
        ("mass_decimal_comma", "1.5"),
        ("mass_fortran_exp", "1e1"),
        ("mass_hex", "16"),
        ("bool_yes", "true"),
        ("name_missing", "LeftShank"),
        ("name_space", "Left_Shank"),
    ],
)
def test_the_suggestion_is_a_real_neighbour(name, suggestion, tmp_path):
    fault = next(fault for fault in faults.FAULTS if fault.name == name)
    report = validate(faulty(fault.change, tmp_path)[0])
    assert suggestion in {finding.suggestion for finding in report if finding.code == fault.code}, (
        str(report)
    )


def test_a_prescribed_controller_wants_the_plain_path(tmp_path):
    def report(path):
        from osimlite import Constant, CoordinateActuator, FunctionSet, Model, PrescribedController

        actuator = CoordinateActuator(name="motor")
        controller = PrescribedController(
            name="drive",
            socket_actuators=[path],
            ControlFunctions=FunctionSet(objects=[Constant()]),
        )
        model = Model(name="m")
        model.add(actuator, controller)
        return validate(model, select="OSIM304")

    assert not report("/forceset/motor").findings
    assert [finding.suggestion for finding in report("//forceset/motor")] == ["/forceset/motor"]
    assert [finding.suggestion for finding in report("../../forceset/motor")] == ["/forceset/motor"]
