"""Check models for which an earlier version missed a finding or reported a wrong one."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from osimlite.io.document.source import Source
from osimlite.lint import Report, validate
from osimlite.lint.many import check_files
from tests.bare import BareEnvironment
from tests.cases import of_each
from tests.lint.verdict_cases import CASES, FAILS, Case, old_names, small_model

SPRING = "<resting_length>1</resting_length><stiffness>1</stiffness><dissipation>0</dissipation>"


def check(text: str) -> Report:
    """Return the findings in a text, except for those that need measurements over ranges."""
    return validate(Source(text.encode(), "m.osim"), ignore="OSIM63")


@of_each(CASES, lambda case: case.name)
def test_a_small_model_has_the_finding(case: Case):
    report = check(case.text)
    if case.code:
        assert case.code in report.codes, str(report)
    if case.verdict == FAILS:
        assert report.errors, str(report)
    else:
        assert not report.errors, str(report)


@pytest.mark.parametrize(
    "unknown",
    [
        '<FroceSet><CoordinateActuator name="t"><coordinate>a q</coordinate></CoordinateActuator>'
        "</FroceSet>",
        "<part><coordinate>a q</coordinate></part>",
    ],
    ids=["a set", "a part"],
)
def test_what_opensim_leaves_out_refers_to_no_old_name(unknown: str):
    # OpenSim 4.6 runs both models (measured).
    (text,) = [case.text for case in old_names() if case.name.endswith("used by nobody")]
    report = check(text.replace("</ForceSet>", f"{unknown}</ForceSet>"))
    (finding,) = [finding for finding in report.findings if finding.code == "OSIM312"]
    assert str(finding.severity) == "warning"


def test_a_rule_that_reads_the_model_needs_no_numeric_library(tmp_path: Path):
    """Without numpy the other rules report as before.

    The report says which rules were not measured.
    """
    environment = BareEnvironment(tmp_path / "environment")
    files = [f"{number}.osim" for number in range(len(CASES))]
    for name, case in zip(files, CASES, strict=True):
        (tmp_path / name).write_text(case.text)
    done = environment.call("validate", "--no-cache", "--format", "json", *files, folder=tmp_path)
    # On a busy machine the command takes long enough to print its progress.
    lines = done.stderr.splitlines()
    assert [line for line in lines if not line.startswith("osimlite: checking: ")] == []
    codes: dict[str, set[str]] = {name: set() for name in files}
    for finding in json.loads(done.stdout):
        if finding["name"] == "not-measured":
            assert "they need osimlite[sim]" in finding["message"]
            codes[finding["file"]].add("note")
        else:
            codes[finding["file"]].add(finding["code"])
    for name, case in zip(files, CASES, strict=True):
        found = codes[name]
        if case.code.startswith(("OSIM42", "OSIM53")):
            assert "note" in found, case.name
        elif case.code:
            assert case.code in found, case.name
        assert not any(code.startswith(("OSIM42", "OSIM53")) for code in found), case.name


def test_a_force_that_is_not_finite_is_reported_beside_ignored_elements():
    """An element that OpenSim ignores, in the same force, does not explain a result of NaN."""
    force = (
        '<ExpressionBasedCoordinateForce name="f"><coordinate>q</coordinate>'
        "<expression>log(q-0.3)</expression><Colour>red</Colour></ExpressionBasedCoordinateForce>"
    )
    assert {"OSIM101", "OSIM532"} <= set(check(small_model(forces=force)).codes)


def test_an_actuator_in_a_list_that_no_set_holds():
    """OpenSim does not read such an actuator, so that the controller drives the one in the ForceSet."""
    actuator = '<CoordinateActuator name="act"><coordinate>q</coordinate></CoordinateActuator>'
    controller = (
        '<PrescribedController name="c"><actuator_list>act</actuator_list>'
        '<FunctionSet name="ControlFunctions"><objects><Constant name="act"/></objects></FunctionSet>'
        "</PrescribedController>"
    )
    text = small_model(forces=actuator, controllers=controller).replace("40600", "40000")
    stray = text.replace("<BodySet", f"<objects>{actuator}</objects><BodySet", 1)
    assert not check(text).errors
    assert [finding.code for finding in check(stray).errors] == ["OSIM101"]


def test_a_coupler_without_coordinates():
    """OpenSim reads uninitialised memory: it runs, or computes NaN."""
    constraint = (
        '<CoordinateCouplerConstraint name="f"><coupled_coordinates_function><LinearFunction>'
        "<coefficients>1 0</coefficients></LinearFunction></coupled_coordinates_function>"
        "<independent_coordinate_names></independent_coordinate_names>"
        "<dependent_coordinate_name>s</dependent_coordinate_name></CoordinateCouplerConstraint>"
    )
    (finding,) = check(small_model(constraints=constraint)).errors
    assert finding.code == "OSIM604" and "undefined number" in finding.message


def test_the_message_says_which_constraint_and_how_far():
    case = next(case for case in CASES if case.name == "a distance on one body")
    (finding,) = check(case.text).errors
    assert finding.component == "/constraintset/f"
    assert "ConstantDistanceConstraint 'f'" in finding.message and "off by 1" in finding.message


def test_a_comment_written_as_an_element_is_one_finding_with_a_fix(tmp_path: Path):
    comments = "<Comment>measured on the left leg</Comment>" * 5
    path = tmp_path / "m.osim"
    path.write_text(small_model(coordinate=comments, children="<Note>see thesis</Note>"))
    report = validate(path, ignore="OSIM63")
    assert report.codes == {"OSIM101": 2}
    assert not report.errors
    assert any("<Comment> occurs 4 more times" in finding.message for finding in report)
    text = _apply(path, report)
    assert text.count("<!-- measured on the left leg -->") == 5
    assert not check(text).codes


def _apply(path: Path, report: Report) -> str:
    text = path.read_text()
    edits = sorted(
        (edit for item in report if item.fix for edit in item.fix.edits),
        key=lambda edit: -edit.start,
    )
    for edit in edits:
        text = text[: edit.start] + edit.text + text[edit.end :]
    return text


def test_the_location_of_a_moving_point_goes_with_a_fix():
    coordinate = "/jointset/j/q"
    sockets = "".join(
        f"<socket_{axis}_coordinate>{coordinate}</socket_{axis}_coordinate>" for axis in "xyz"
    )
    functions = "".join(
        f"<{axis}_location><Constant><value>0.1</value></Constant></{axis}_location>"
        for axis in "xyz"
    )
    moving = (
        '<MovingPathPoint name="M"><location>0 0 0</location>'
        f"<socket_parent_frame>/bodyset/a</socket_parent_frame>{sockets}{functions}</MovingPathPoint>"
    )
    path = (
        '<GeometryPath name="path"><PathPointSet><objects><PathPoint name="p">'
        f"<socket_parent_frame>/ground</socket_parent_frame></PathPoint>{moving}</objects></PathPointSet></GeometryPath>"
    )
    spring = f'<PathSpring name="s">{path}{SPRING}</PathSpring>'
    report = check(small_model(forces=spring))
    (finding,) = [item for item in report if item.code == "OSIM101"]
    assert finding.severity == "warning" and finding.suggestion is None and finding.fixable


@pytest.mark.parametrize(
    ("tag", "suggestion"),
    [
        ("CoordinateLinearDamper", None),
        ("UWLigament", None),
        ("MyLigament", None),
        ("Smith2018ArticularContactForce", None),
        ("CoordinateLimitForc", "CoordinateLimitForce"),
        ("coordinatelimitforce", "CoordinateLimitForce"),
        ("CoordinatLimitForces", "CoordinateLimitForce"),
    ],
)
def test_an_unknown_class_is_renamed_only_where_it_is_misspelt(tag: str, suggestion: str | None):
    force = f'<{tag} name="x"><coordinate>q</coordinate><upper_limit>10</upper_limit></{tag}>'
    (finding,) = check(small_model(forces=force)).errors
    assert finding.code == "OSIM102" and finding.suggestion == suggestion
    if suggestion is None:
        assert "plug-in" in finding.message and finding.fix is None


def test_a_class_is_not_suggested_whose_properties_are_others():
    force = "<CoordinateLimitForc name='x'><alpha>1</alpha><beta>2</beta></CoordinateLimitForc>"
    (finding,) = check(small_model(forces=force)).errors
    assert finding.suggestion is None


@pytest.mark.parametrize(
    ("shapes", "acts"),
    [
        (("ContactSphere", "ContactHalfSpace"), True),
        (("ContactSphere", "ContactEllipsoid"), True),
        (("ContactHalfSpace", "ContactHalfSpace"), False),
        (("ContactCylinder", "ContactHalfSpace"), False),
        (("ContactTorus", "ContactSphere"), False),
    ],
)
@pytest.mark.parametrize("force", ["HuntCrossleyForce", "ElasticFoundationForce"])
def test_a_contact_that_cannot_act_is_reported(force: str, shapes: tuple[str, str], acts: bool):
    frames = "/ground", "/bodyset/a"
    size = "<radius>0.1</radius>"
    sizes = {
        "ContactSphere": size,
        "ContactCylinder": size,
        "ContactEllipsoid": "<radii>0.1 0.1 0.1</radii>",
        "ContactTorus": "<torus_radius>0.3</torus_radius><tube_radius>0.1</tube_radius>",
    }
    geometry = "".join(
        f'<{shape} name="g{number}"><socket_frame>{frame}</socket_frame>{sizes.get(shape, "")}</{shape}>'
        for number, (shape, frame) in enumerate(zip(shapes, frames, strict=True))
    )
    text = (
        f'<{force} name="f"><{force}::ContactParametersSet name="contact_parameters"><objects>'
        f"<{force}::ContactParameters><geometry>g0 g1</geometry><stiffness>1000</stiffness>"
        f"</{force}::ContactParameters></objects></{force}::ContactParametersSet></{force}>"
    )
    codes = check(small_model(forces=text, geometry=geometry)).codes
    acts = acts and force == "HuntCrossleyForce"
    assert ("OSIM321" in codes) != acts


def test_contact_on_one_body_is_reported():
    sphere = '<ContactSphere name="{}"><socket_frame>/bodyset/a</socket_frame><radius>0.1</radius></ContactSphere>'
    force = (
        '<HuntCrossleyForce name="f"><HuntCrossleyForce::ContactParametersSet name="contact_parameters"><objects>'
        "<HuntCrossleyForce::ContactParameters><geometry>x y</geometry><stiffness>1</stiffness>"
        "</HuntCrossleyForce::ContactParameters></objects></HuntCrossleyForce::ContactParametersSet></HuntCrossleyForce>"
    )
    report = check(small_model(forces=force, geometry=sphere.format("x") + sphere.format("y")))
    assert "OSIM321" in report.codes


@pytest.mark.parametrize(
    ("interval", "is_reported", "suggestion"),
    [
        ("10 90", True, "0.174533 1.5708"),
        ("-120 -60", True, "-2.0944 -1.0472"),
        ("-90 2.2", True, "-1.5708 2.2"),
        ("2.5 3", True, None),
        ("-1 1", False, None),
        ("1.9 3", False, None),
    ],
)
def test_a_conditional_point_that_never_counts_is_reported(interval, is_reported, suggestion):
    point = (
        '<ConditionalPathPoint name="C"><socket_parent_frame>/bodyset/a</socket_parent_frame>'
        f"<socket_coordinate>/jointset/j/q</socket_coordinate><range>{interval}</range></ConditionalPathPoint>"
    )
    path = (
        '<GeometryPath name="path"><PathPointSet><objects><PathPoint name="p">'
        "<socket_parent_frame>/ground</socket_parent_frame><location>0 1 0</location></PathPoint>"
        f'{point}<PathPoint name="r"><socket_parent_frame>/bodyset/a</socket_parent_frame>'
        "<location>0.2 0 0</location></PathPoint></objects></PathPointSet></GeometryPath>"
    )
    spring = f'<PathSpring name="s">{path}{SPRING}</PathSpring>'
    text = small_model(forces=spring).replace("<range>-2 2<", "<range>-2.2 2.2<", 1)
    found = [item for item in check(text) if item.code == "OSIM613"]
    assert bool(found) == is_reported
    if is_reported:
        assert found[0].suggestion == suggestion


def test_a_mesh_with_a_backslash_is_found_on_windows_alone(tmp_path: Path):
    (tmp_path / "geo").mkdir()
    (tmp_path / "geo" / "bone.obj").write_text("v 0 0 0\n")
    mesh = '<attached_geometry><Mesh name="g"><mesh_file>{}</mesh_file></Mesh></attached_geometry>'
    path = tmp_path / "m.osim"
    for name in ("geo\\bone.obj", "geo\\Bone.obj"):
        path.write_text(small_model(children=mesh.format(name)))
        (finding,) = validate(path, ignore="OSIM63").findings
        assert finding.code == "OSIM701" and finding.suggestion == "geo/bone.obj"
    path.write_text(small_model(children=mesh.format("geo\\skull.obj")))
    (finding,) = validate(path, ignore="OSIM63").findings
    assert "was not found" in finding.message and finding.suggestion is None


@pytest.mark.parametrize("kind", ["Schutte1993Muscle_Deprecated", "Delp1990Muscle_Deprecated"])
@pytest.mark.parametrize("velocity", [0, -1])
def test_a_velocity_that_a_muscle_never_uses_is_not_checked(kind: str, velocity: int):
    from tests.lint.verdict_cases import path_of

    muscle = (
        f'<{kind} name="t">{path_of(("/ground", "0 0.1 0"), ("/bodyset/a", "0 0 0"))}'
        "<optimal_fiber_length>0.1</optimal_fiber_length><tendon_slack_length>0.2</tendon_slack_length>"
        f"<max_contraction_velocity>{velocity}</max_contraction_velocity></{kind}>"
    )
    report = check(small_model(forces=muscle))
    assert not [item for item in report if "max_contraction_velocity" in item.message]


def test_a_coordinate_that_stands_three_times_is_no_traceback(shared: Path):
    report = validate(shared / "cases" / "attack-26-duplicate-coordinates-keyerror" / "m.osim")
    assert report.errors


@pytest.mark.parametrize("number", ["29", "30", "32", "34"])
def test_a_file_that_opensim_loads_is_not_said_to_be_refused(shared: Path, number: str):
    (folder,) = (shared / "cases").glob(f"attack-{number}-*")
    report = validate(folder / "m.osim", ignore="OSIM63")
    claims = [
        item for item in report.errors if re.search("OpenSim.* refuses|refuses the", item.message)
    ]
    assert not claims, str(report)


@pytest.mark.parametrize("number", ["16", "28"])
def test_a_file_that_opensim_refuses_has_an_error(shared: Path, number: str):
    (folder,) = (shared / "cases").glob(f"attack-{number}-*")
    assert validate(folder / "m.osim", ignore="OSIM63").codes["OSIM107"] == 1


def test_every_case_of_the_review_has_its_verdict(shared: Path):
    expected = {
        "model-01": "error",
        "model-02": "error",
        "model-04": "error",
        "model-05": "error",
        "model-06": "error",
        "model-07": "error",
        "model-08": "error",
        "model-09": "warning",
        "model-10": "warning",
        "model-11": "error",
        "model-15": "warning",
        "model-16": "error",
        "model-18": "error",
        "model-19": "error",
        "model-21": "warning",
        "model-22": "error",
    }
    for path in sorted((shared / "cases").glob("model-*/*.osim")):
        severities = {str(item.severity) for item in validate(path, ignore="OSIM63").findings}
        wanted = expected.get(path.parent.name[:8])
        if wanted:
            assert wanted in severities, path.name
    for name in ("model-03-locked-and-prescribed/b10b_prescribed_locked_sine.osim",):
        assert validate(shared / "cases" / name).errors


def test_files_are_checked_once_for_what_stops_them(tmp_path: Path):
    case = next(case for case in CASES if case.code == "OSIM422")
    path = tmp_path / "m.osim"
    path.write_text(case.text)
    from osimlite.lint import Config

    for _ in range(2):
        assert check_files([str(path)], Config()).codes["OSIM422"] == 1
