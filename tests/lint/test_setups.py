"""Check the references of setups to the model, to data, and to each other."""

from __future__ import annotations

import random
import re
from shutil import copy

import pytest

from osimlite.cli._validating import validate_paths
from osimlite.lint import Config, validate
from osimlite.lint.engine import load_subject, run_rules
from osimlite.lint.many import check_files
from osimlite.lint.project_files import find_project_files
from osimlite.schema.registry import MODULES


@pytest.fixture
def project(fixtures, tmp_path, monkeypatch):
    """Return a folder with a model, data and setups, which becomes the current folder."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "project"
    folder.mkdir()
    for file in (fixtures / "lint").glob("leg*"):
        copy(file, folder)
    for code, name in (
        ("OSIM821", "pass-ik.xml"),
        ("OSIM853", "pass-scale.xml"),
        ("OSIM852", "pass-analyze.xml"),
        ("OSIM862", "pass-markers.omoco"),
    ):
        text = (fixtures / "lint" / code / name).read_text().replace("../", "")
        (folder / name.removeprefix("pass-")).write_text(text)
    (folder / "pom.xml").write_text("<project/>")
    monkeypatch.chdir(folder)
    return folder


def test_findings_call_a_study_a_study(project):
    path = project / "markers.omoco"
    text = path.read_text().replace(
        "</MocoCas", "<num_mesh_intervals>-5</num_mesh_intervals></MocoCas"
    )
    path.write_text(text)
    (finding,) = validate(path, select="OSIM206").findings
    assert finding.message.endswith(": OpenSim rejects the study")


def test_a_folder_is_checked_as_a_whole(project, capsys):
    (project / "leg_no_knee.mot").unlink()
    (project / "leg_degrees.mot").unlink()
    assert validate_paths(["."], no_cache=True) == 0
    assert capsys.readouterr().out.startswith("No findings in 12")
    assert validate(".").checked == 12
    assert len(find_project_files([".", project / "ik.xml", "./../project"])) == 12
    # The marker is renamed in the model only.
    model = project / "leg.osim"
    model.write_text(model.read_text().replace('"knee_marker"', '"knee"'))
    report = check_files(
        sorted(str(file) for file in project.glob("*.xml") if file.name != "pom.xml"), Config()
    )
    assert {(finding.file.rpartition("/")[2], finding.code) for finding in report} == {
        ("ik.xml", "OSIM831"),
        ("ik.xml", "OSIM841"),
        ("scale.xml", "OSIM831"),
    }


def test_a_missing_file_leads_to_one_with_a_similar_name(project):
    text = (project / "ik.xml").read_text()
    (project / "ik.xml").write_text(text.replace(">leg.trc<", ">legs.trc<"))
    (finding,) = validate(project / "ik.xml", select=["OSIM821"]).findings
    assert "does not exist, but 'leg.trc' does: OpenSim rejects" in finding.message
    (project / "leg.trc").rename(project / "motion.trc")
    (finding,) = validate(project / "ik.xml", select=["OSIM821"]).findings
    assert "does not exist: OpenSim rejects" in finding.message


@pytest.mark.parametrize(("folder", "severity"), [("data", "warning"), (" ", "info")])
def test_the_input_directory_of_old_setups_is_no_misspelling(project, folder, severity):
    """OpenSim 2 wrote this property; OpenSim 4.6 ignores it in files of every version."""
    text = (project / "ik.xml").read_text()
    old = f"<input_directory>{folder}</input_directory><model_file>"
    (project / "ik.xml").write_text(text.replace("<model_file>", old, 1))
    (finding,) = validate(project / "ik.xml", select=["OSIM101"]).findings
    assert (finding.severity.value, finding.suggestion) == (severity, None)
    assert "ignores <input_directory>" in finding.message and finding.fix is not None


@pytest.mark.parametrize(
    ("missing", "writable"),
    [("leg_walk.trc", False), ("leg_loads.mot", True), ("leg_states.sto", True)],
)
def test_only_files_that_a_tool_can_write_may_be_missing(project, missing, writable):
    """A tool writes tables under its own name, but no marker files; a ScaleTool writes no tables."""
    for writer in ("ScaleTool", "AnalyzeTool"):
        (project / "scale.xml").write_text(
            f'<OpenSimDocument Version="40600"><{writer} name="leg"/></OpenSimDocument>'
        )
        ik = (
            '<OpenSimDocument Version="40600"><InverseKinematicsTool name="ik"><model_file>leg.osim</model_file>'
            f"<marker_file>{missing}</marker_file></InverseKinematicsTool></OpenSimDocument>"
        )
        (project / "ik.xml").write_text(ik)
        codes = dict(check_files(["ik.xml"], Config()).codes)
        assert ("OSIM821" in codes) == (writer == "ScaleTool" or not writable)


def test_what_was_found_in_a_setup_is_found_again_when_its_model_changes(project):
    assert not check_files(["ik.xml"], Config()).findings
    assert not check_files(["ik.xml"], Config()).findings
    model = project / "leg.osim"
    model.write_text(model.read_text().replace('"knee_marker"', '"knee"'))
    assert dict(check_files(["ik.xml"], Config()).codes) == {"OSIM831": 1, "OSIM841": 1}


@pytest.mark.parametrize(
    ("names", "meant"), [(["hip_moter"], "hip_motor"), (["hip_motor", "hip_moter"], None)]
)
def test_no_control_is_to_be_called_what_another_is(project, names, meant):
    node = "<x_nodes><ControlLinearNode><t>0</t><value>1</value></ControlLinearNode></x_nodes>"
    controls = "".join(f'<ControlLinear name="{name}">{node}</ControlLinear>' for name in names)
    motor = '<CoordinateActuator name="hip_motor"><coordinate>hip_flexion</coordinate></CoordinateActuator>'
    tool = """<model_file>leg.osim</model_file><force_set_files>motors.xml</force_set_files><ControllerSet><objects>
        <ControlSetController name="c"><controls_file>controls.xml</controls_file></ControlSetController>
        </objects></ControllerSet>"""
    for file, text in {
        "controls.xml": f'<ControlSet name="c"><objects>{controls}</objects></ControlSet>',
        "motors.xml": f'<ForceSet name="f"><objects>{motor}</objects></ForceSet>',
        "run.xml": f'<ForwardTool name="run">{tool}</ForwardTool>',
    }.items():
        (project / file).write_text(f'<OpenSimDocument Version="40600">{text}</OpenSimDocument>')
    (finding,) = check_files(["run.xml", "controls.xml"], Config(select=("OSIM831",))).findings
    assert finding.suggestion == meant


def test_what_another_setup_writes_need_not_be_there(project):
    later = (
        (project / "ik.xml")
        .read_text()
        .replace("leg.osim", "placed.osim")
        .replace('name="ik"', 'name="again"')
    )
    (project / "later.xml").write_text(later)
    assert str(validate(project / "later.xml")) == "nothing found"
    (project / "scale.xml").unlink()
    assert dict(validate(project / "later.xml").codes) == {"OSIM821": 1}


def test_loads_are_checked_with_the_model_of_the_tool_that_names_them(project, fixtures):
    tool = (fixtures / "lint" / "OSIM822" / "pass-loads.xml").read_text().replace("../", "")
    assert str(validate(project / "leg_grf.xml")) == "nothing found"
    loads = project / "leg_grf.xml"
    loads.write_text(loads.read_text().replace(">shank<", ">shin<"))
    assert str(validate(loads)) == "nothing found"
    (project / "id.xml").write_text(tool)
    (finding,) = validate(loads).findings
    assert (finding.code, finding.line) == ("OSIM831", 6)


def test_loads_that_several_tools_read_are_looked_at_with_the_motion_that_is_there(
    project, fixtures
):
    for name in ("fail-01-pelvis.xml", "pass-id-pelvis.xml"):
        text = (fixtures / "lint" / "OSIM849" / name).read_text().replace("../", "")
        (project / name).write_text(text)
    (project / "a_first.xml").write_text(text.replace("leg.mot", "later.mot"))
    assert "OSIM849" in validate(project / "fail-01-pelvis.xml").codes


@pytest.mark.parametrize(
    ("sizes", "line"),
    [((1, 1), 0), ((-1, 1), 13), ((1, 1000), 11), ((0.01, -0.01), 0)],
    ids=["as measured", "signs turned", "newton millimetres", "a small push"],
)
def test_loads_that_no_subject_bears_are_told(project, fixtures, sizes, line):
    text = (fixtures / "lint" / "OSIM822" / "pass-loads.xml").read_text().replace("../", "")
    (project / "id.xml").write_text(text)
    loads = (fixtures / "lint" / "OSIM849" / "pass-loads.xml").read_text().replace("../", "")
    torque = "<torque_identifier>ground_torque_</torque_identifier></ExternalForce>"
    (project / "leg_grf.xml").write_text(loads.replace("</ExternalForce>", torque))
    header, _, rows = (project / "leg_grf.mot").read_text().partition("torque_z\n")
    table = [[float(cell) for cell in row.split()] for row in rows.splitlines()]
    scaled = [
        [*row[:1], *(n * sizes[0] for n in row[1:4]), *row[4:7], *(n * sizes[1] for n in row[7:])]
        for row in table
    ]
    (project / "leg_grf.mot").write_text(
        header + "torque_z\n" + "\n".join("\t".join(map(repr, row)) for row in scaled) + "\n"
    )
    assert [(f.code, f.line) for f in validate(project / "leg_grf.xml").findings] == [
        ("OSIM849", line)
    ] * bool(line)


@pytest.mark.parametrize(
    ("file", "old", "new", "codes"),
    [
        # Two markers at one position have no distance by which a body could be scaled.
        (
            "leg.osim",
            r"/bodyset/shank</socket_parent_frame>\s*<location>0 0.2 0.05",
            "/bodyset/pelvis</socket_parent_frame><location>0.1 0.1 0.1",
            {"OSIM855"},
        ),
        ("leg.trc", "Units", "units", {"OSIM801"}),
        # A path through a missing folder is invalid, although its text could be simplified.
        ("ik.xml", ">leg.osim<", ">data/../leg.osim<", {"OSIM821"}),
        ("markers.omoco", "<goals>", "<state_infos><Foo/></state_infos><goals>", {"OSIM102"}),
        (
            "markers.omoco",
            r"<ModelProcessor.*?</ModelProcessor>",
            '<ModelProcessor name="model"/>',
            {"OSIM821"},
        ),
        (
            "markers.omoco",
            "<goals>",
            '<MocoFinalBounds name="time_final_bounds"/><goals>',
            {"OSIM861"},
        ),
    ],
)
def test_what_mutants_have_shown(project, file, old, new, codes):
    text = (project / file).read_text()
    assert re.search(old, text, re.DOTALL)
    (project / file).write_text(re.sub(old, new, text, flags=re.DOTALL))
    assert codes <= validate(project).codes.keys()


def test_a_file_of_coordinates_in_radians_is_told_to_inverse_kinematics(project):
    text = (project / "ik.xml").read_text()
    task = '<IKCoordinateTask name="knee_angle"><value_type>from_file</value_type><weight>1</weight></IKCoordinateTask>'
    text = text.replace("<objects>", f"<objects>{task}", 1)
    (project / "ik.xml").write_text(
        text.replace("</InverseK", "<coordinate_file>leg.mot</coordinate_file></InverseK")
    )
    motion = (project / "leg.mot").read_text()
    (project / "leg.mot").write_text(motion.replace("inDegrees=yes", "inDegrees=no"))
    assert "OSIM847" in validate(project / "ik.xml").codes
    (project / "leg.mot").write_text(motion.replace("inDegrees=no", "inDegrees=yes"))
    assert "OSIM847" not in validate(project / "ik.xml").codes


@pytest.mark.parametrize("name", ["leg.osim", "ik.xml", "leg_grf.xml"])
def test_what_is_at_the_top_is_read_from_where_it_stands(project, name):
    """OpenSim 4.6 does not read the `file` attribute of a root object."""
    text = (project / name).read_text()
    (project / name).write_text(
        re.sub(r"(Document Version=.*?<\w+)", r'\1 file="nowhere.xml"', text, flags=re.DOTALL)
    )
    (finding,) = validate(project / name).findings
    assert (finding.code, finding.severity) == ("OSIM702", "info")


@pytest.mark.parametrize(
    ("analysis", "refused"),
    [
        ("<MuscleAnalysis><moment_arm_coordinate_list/></MuscleAnalysis>", True),
        ("<MuscleAnalysis/>", False),
        ("<JointReaction><apply_on_bodies/></JointReaction>", False),
    ],
)
def test_lists_of_analyses_may_be_empty_where_opensim_takes_them(project, analysis, refused):
    text = (project / "analyze.xml").read_text()
    (project / "analyze.xml").write_text(re.sub("<objects>", f"<objects>{analysis}", text, count=1))
    assert (
        any(
            "OpenSim fails" in f.message or "words for" in f.message
            for f in validate("analyze.xml")
        )
        == refused
    )


@pytest.mark.parametrize("tag", ["InverseKinematicsTool", "InverseDynamicsTool", "ForwardTool"])
@pytest.mark.parametrize("version", [10500, 20201, 20202])
def test_a_tool_newer_than_its_document_is_refused_as_by_opensim(tmp_path, tag, version):
    tool = f'<{tag} name="x"><model_file></model_file></{tag}>'
    (tmp_path / "document.xml").write_text(
        f'<OpenSimDocument Version="{version}">{tool}</OpenSimDocument>'
    )
    (tmp_path / "alone.xml").write_text(tool)
    refused = tag != "ForwardTool" and version < 20202
    assert ("OSIM112" in validate(tmp_path / "document.xml").codes) == refused
    assert "OSIM112" not in validate(tmp_path / "alone.xml").codes


KINDS = ("osimlite.schema.tools", "osimlite.schema.moco")
TOOLS = sorted(tag for tag, module in MODULES.items() if module.startswith(KINDS))


@pytest.mark.parametrize("tag", TOOLS)
def test_every_class_of_setups_is_checked_by_every_rule(project, tag):
    files = "<states_file>leg.mot</states_file><desired_kinematics_file>leg.mot</desired_kinematics_file>"
    for given in (
        "",
        f"<model_file>leg.osim</model_file>{files}<external_loads_file>leg_grf.xml</external_loads_file>",
    ):
        text = f'<OpenSimDocument Version="40600"><{tag} name="x">{given}</{tag}></OpenSimDocument>'
        (project / "setup.xml").write_text(text)
        run_rules(load_subject("setup.xml"))


@pytest.mark.parametrize(
    "name", ["ik.xml", "scale.xml", "analyze.xml", "leg_grf.xml", "markers.omoco"]
)
def test_no_damage_makes_the_check_fail(project, name):
    good = (project / name).read_bytes()
    draw = random.Random(2)
    for size in range(0, len(good), 41):
        (project / name).write_bytes(good[:size])
        run_rules(load_subject(name))
    for _ in range(80):
        damaged = bytearray(good)
        for _ in range(draw.randint(1, 3)):
            damaged[draw.randrange(len(damaged))] = draw.choice(b' <>/"=.x9\xff-')
        (project / name).write_bytes(bytes(damaged))
        run_rules(load_subject(name))


@pytest.mark.parametrize(
    ("element", "severity"),
    [
        ("<use_specified_dt> false </use_specified_dt>", "info"),
        ("<spring_force_threshold />", "info"),
        ("<body1_scaling_rise_time_on> 0.000 </body1_scaling_rise_time_on>", "info"),
        ("<output_joint_file> Unassigned </output_joint_file>", "info"),
        ("<use_specified_dt>true</use_specified_dt>", "warning"),
        ("<spring_force_threshold>5</spring_force_threshold>", "warning"),
        (
            "<corrective_spring_linear_damping>0 0 1500</corrective_spring_linear_damping>",
            "warning",
        ),
        ("<finl_time></finl_time>", "error"),
        ("<finl_time>2</finl_time>", "error"),
        ("<finl_time>1.0</finl_time>", "warning"),
    ],
)
def test_a_tag_of_older_versions_is_as_bad_as_what_is_lost_with_it(tmp_path, element, severity):
    setup = tmp_path / "forward.xml"
    setup.write_text(
        f'<OpenSimDocument Version="40600"><ForwardTool name="run">{element}</ForwardTool></OpenSimDocument>'
    )
    (finding,) = validate(setup, select="OSIM101").findings
    assert str(finding.severity) == severity


@pytest.mark.parametrize(
    ("elements", "severities"),
    [
        ("<final_time>2</final_time><final_time> 2 </final_time>", ["warning"]),
        (
            "<final_time>2</final_time><final_time>3</final_time><final_time>2</final_time>",
            ["error", "warning"],
        ),
        (
            "<solve_for_equilibrium_for_auxiliary_states>no</solve_for_equilibrium_for_auxiliary_states>",
            ["warning"],
        ),
        (
            "<solve_for_equilibrium_for_auxiliary_states>flase</solve_for_equilibrium_for_auxiliary_states>",
            ["warning"],
        ),
        (
            "<solve_for_equilibrium_for_auxiliary_states>yes</solve_for_equilibrium_for_auxiliary_states>",
            ["error"],
        ),
        (
            "<solve_for_equilibrium_for_auxiliary_states>ture</solve_for_equilibrium_for_auxiliary_states>",
            ["error"],
        ),
    ],
)
def test_what_opensim_ignores_is_no_error_where_it_does_what_is_meant(
    tmp_path, elements, severities
):
    setup = tmp_path / "forward.xml"
    setup.write_text(
        f'<OpenSimDocument Version="40600"><ForwardTool name="run">{elements}</ForwardTool></OpenSimDocument>'
    )
    findings = validate(setup, select=["OSIM104", "OSIM201"]).findings
    assert [str(finding.severity) for finding in findings] == severities


@pytest.mark.parametrize(
    ("said", "lost"), [("", True), ("<time_range/>", True), ("<time_range>0 3</time_range>", False)]
)
def test_inverse_kinematics_without_a_time_range_stops_at_two_seconds(project, said, lost):
    data, setup = project / "leg.trc", project / "ik.xml"
    lines = data.read_text().splitlines()
    lines[2] = lines[2].replace("51", "151")
    last = lines[-1].split("\t", 2)[2]
    lines += [f"{52 + row}\t{1.02 + 0.02 * row:.2f}\t{last}" for row in range(100)]
    data.write_text("\n".join([*lines, ""]))
    setup.write_text(setup.read_text().replace("<IKTaskSet", f"{said}<IKTaskSet", 1))
    report = validate(setup, select="OSIM844")
    assert ["stops at 2 s" in finding.message for finding in report.findings] == [True] * lost


@pytest.mark.parametrize(("motion", "found"), [("leg.mot", 1), ("not_yet_written.mot", 0)])
def test_how_long_a_motion_lasts_that_is_not_there_is_not_known(project, motion, found):
    (project / "analyze.xml").write_text(
        '<OpenSimDocument Version="40600"><AnalyzeTool name="run"><model_file>leg.osim</model_file>'
        "<final_time>100</final_time><external_loads_file>leg_grf.xml</external_loads_file>"
        f"<coordinates_file>{motion}</coordinates_file></AnalyzeTool></OpenSimDocument>"
    )
    assert len(validate(project / "analyze.xml", select="OSIM845").findings) == found


@pytest.mark.parametrize(
    ("content", "severity"),
    [
        ("<objects/> <groups/>", "info"),
        ("", "info"),
        ("<objects> <IKMarkerTask name='asis'/> </objects>", "error"),
    ],
)
def test_what_stands_in_a_set_that_is_read_from_a_file_is_lost_only_if_it_is_something(
    project, content, severity
):
    setup = project / "ik.xml"
    start, rest = setup.read_text().split("<IKTaskSet")
    tasks, end = rest.split("</IKTaskSet>")
    head = '<?xml version="1.0" encoding="UTF-8" ?>\n<OpenSimDocument Version="40600">\n'
    (project / "tasks.xml").write_text(f"{head}<IKTaskSet{tasks}</IKTaskSet>\n</OpenSimDocument>\n")
    setup.write_text(f'{start}<IKTaskSet file="tasks.xml">{content}</IKTaskSet>{end}')
    (finding,) = validate(setup).findings
    assert (finding.code, str(finding.severity)) == ("OSIM702", severity)


def test_a_weight_of_zero_is_a_warning_where_nobody_gave_it(project):
    setup = project / "ik.xml"
    setup.write_text(
        setup.read_text().replace("<weight>1</weight>", "").replace("<weight>2<", "<weight>0<")
    )
    assert [str(finding.severity) for finding in validate(setup, select="OSIM851").findings] == [
        "warning",
        "info",
    ]


@pytest.mark.parametrize("body", ["", "<body><a/></body>", "<body>ground<!-- --></body>"])
@pytest.mark.parametrize("version", [20302, 30000, 30500, 30501])
def test_a_marker_of_an_old_file_needs_a_body(tmp_path, body, version):
    """OpenSim 4.6 reads the body of such a marker without checking that it exists."""
    path = tmp_path / "markers.xml"
    path.write_text(
        f'<OpenSimDocument Version="{version}"><MarkerSet name="s"><objects><Marker name="a">{body}'
        "<location>0 0 0</location></Marker></objects></MarkerSet></OpenSimDocument>"
    )
    is_rejected = version < 30501 and "<!--" not in body
    codes = {"OSIM112"} if "<a/>" not in body else {"OSIM107"}
    assert bool(codes & {*validate(path).codes}) == is_rejected


@pytest.mark.parametrize("start", ["trolSet name='c'>", "ls>"])
def test_a_text_whose_root_tag_is_damaged_gets_a_syntax_error(tmp_path, start):
    """The reader notices the wrong root before it notices the damage."""
    path = tmp_path / "controls.xml"
    path.write_text(
        f"<?xml version='1.0'?>{start}<objects><ControlLinear name='a'/></objects></ControlSet>"
        "</OpenSimDocument>"
    )
    assert "OSIM001" in {finding.code for finding in run_rules(load_subject(str(path)))}


def test_a_correct_identifier_is_not_suggested_if_a_label_is_wrong(fixtures, project):
    """The table lacks one of three columns: no spelling of the identifier is correct."""
    text = (fixtures / "lint" / "OSIM843" / "pass-columns.xml").read_text().replace("../", "")
    (project / "loads.xml").write_text(text)
    assert not validate(project / "loads.xml", select="OSIM843").findings
    table = project / "leg_grf.mot"
    table.write_text(table.read_text().replace("ground_force_vy", "ground_force_y"))
    (finding,) = validate(project / "loads.xml", select="OSIM843").findings
    assert (finding.suggestion, finding.fix) == (None, None)
