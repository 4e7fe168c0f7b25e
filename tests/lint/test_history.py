"""Check the target version of OpenSim: only what this version lacks is reported."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from osimlite.errors import OsimliteError
from osimlite.io.document.source import Source
from osimlite.lint import Config, validate
from osimlite.lint.engine import check_source
from osimlite.lint.history import NEWEST, load_later_changes
from osimlite.schema.registry import find_class
from tests.cli.command import run

REPO = Path(__file__).resolve().parents[2]
CLONE = REPO.parent / ".mirror" / "opensim-org+opensim-core" / "repo"
TABLE = json.loads((REPO / "osimlite" / "lint" / "history.json").read_text())


def told(
    text: str, target: str, tmp_path: Path, name: str = "m.xml"
) -> list[tuple[int | None, str, str]]:
    """Return line, severity and message of what OSIM113 reports for a target version."""
    path = tmp_path / name
    path.write_text(text)
    report = validate(path, config=Config(("OSIM113",), target_version=target))
    return [(each.line, each.severity.value, each.message) for each in report]


STUDY = """<OpenSimDocument Version="40000">
<MocoStudy name="s">
<MocoProblem name="problem"> <MocoPhase name="phases">
<goals>
<MocoContactImpulseTrackingGoal name="impulse" />
<MocoControlGoal name="effort">
<divide_by_duration>true</divide_by_duration>
<divide_by_mass>false</divide_by_mass>
<weight>2</weight>
</MocoControlGoal>
</goals>
</MocoPhase> </MocoProblem>
</MocoStudy>
</OpenSimDocument>
"""


def test_classes_and_properties_that_came_later_are_told_with_their_line(tmp_path):
    assert (
        told(STUDY, "", tmp_path)
        == told(STUDY, "4.6", tmp_path)
        == told(STUDY, "4.5", tmp_path)
        == []
    )
    goal = (5, "error", "MocoContactImpulseTrackingGoal 'impulse': OpenSim has a MocoContactImpulseTrackingGoal since "
            "version 4.4.1; 4.3 rejects it")  # fmt: skip
    divided = "MocoControlGoal 'effort': OpenSim has divide_by_{} since version 4.5; {} ignores it"
    properties = [
        (7, "error", divided.format("duration", "{}")),
        (8, "info", divided.format("mass", "{}")),
    ]
    assert told(STUDY, "4.4.1", tmp_path) == [
        (line, bad, text.format("4.4.1")) for line, bad, text in properties
    ]
    assert told(STUDY, "4.3", tmp_path) == [
        goal,
        *((line, bad, text.format("4.3")) for line, bad, text in properties),
    ]
    # Properties of a class that the target version lacks are not reported in addition.
    assert {line for line, _, _ in told(STUDY, "4.1", tmp_path)} == {2, 3, 5, 6}


def controller(version: int, tag: str, value: str) -> str:
    return (
        f'<OpenSimDocument Version="{version}">\n<ControllerSet name="c"> <objects>\n<ControlSetController name="c">\n'
        f"<{tag}>{value}</{tag}>\n</ControlSetController>\n</objects> </ControllerSet>\n</OpenSimDocument>\n"
    )


def test_a_new_name_is_told_with_the_old_and_an_old_one_in_an_old_file_is_none(tmp_path):
    new, old = (
        controller(40600, "socket_actuators", "/forceset/a"),
        controller(40000, "actuator_list", "a"),
    )
    name = "ControlSetController 'c': OpenSim has socket_actuators since version 4.5.1; 4.5 ignores it; before it was "
    assert told(new, "4.5", tmp_path) == [
        (
            1,
            "info",
            "the file has version 40600; OpenSim 4.5 writes version 40500, and reads the file as if it had that version",
        ),
        (4, "error", name + "called actuator_list"),
    ]
    assert told(new, "4.5.1", tmp_path) == told(old, "4.5", tmp_path) == []


def test_a_model_made_in_python_is_checked_too():
    from osimlite import Body, ConstantCurvatureJoint, Model

    model = Model(name="m")
    model.body_set.objects.append(Body(name="b", mass=1))
    model.joint_set.objects.append(ConstantCurvatureJoint(name="j"))
    result = validate(model, config=Config(("OSIM113",), target_version="4.4"))
    assert [each.component for each in result] == ["/jointset/j"]


def test_a_release_that_is_not_known_is_refused_with_those_that_are(tmp_path):
    with pytest.raises(
        OsimliteError, match=r"unknown release of OpenSim '3.3'; known are 4\.0, 4\.1.* and 4\.6"
    ):
        Config(target_version="3.3")
    model = REPO / "fixtures" / "walker" / "DynamicWalkerModel.osim"
    done = run("validate", model, "--target-version", "4.7")
    assert done.code == 2 and "known are 4.0" in done.err
    (tmp_path / "osimlite.toml").write_text("target-version = 4.5\n")
    (tmp_path / "m.xml").write_text(controller(40600, "socket_actuators", "/forceset/a"))
    done = run("validate", tmp_path, "--no-cache", "--format", "concise")
    assert "4.5 ignores it" in done.out and done.code == 1
    assert run("validate", tmp_path, "--target-version", "4.6").code == 0


def test_the_table_speaks_of_classes_and_properties_that_exist():
    assert list(TABLE["formats"])[-1] == NEWEST
    assert (
        load_later_changes(NEWEST).format == TABLE["formats"][NEWEST]
        and not load_later_changes(NEWEST).classes
    )
    for tag in TABLE["classes"]:
        assert find_class(tag) is not None, tag
    assert {first for first, *_ in TABLE["properties"].values()} | set(
        TABLE["classes"].values()
    ) < set(TABLE["formats"])


@pytest.fixture
def clone():
    """Return a clone of opensim-core with its tags; skip the test without a clone."""
    if not CLONE.is_dir():
        pytest.skip(f"needs a clone of opensim-core with its tags at {CLONE}")
    return CLONE


def test_the_table_is_what_the_script_makes_of_the_releases(clone, tmp_path):
    script = REPO / "schemas" / "history.py"
    subprocess.run([sys.executable, script, clone, tmp_path / "made.json"], check=True, timeout=120)
    assert json.loads((tmp_path / "made.json").read_text()) == TABLE


@pytest.mark.parametrize("release", ["4.1", "4.3", "4.5"])
def test_nothing_is_said_of_what_a_release_came_with(clone, release):
    git = ["git", "-C", clone]
    listing = subprocess.run(
        [*git, "ls-tree", "-r", release], capture_output=True, text=True, check=True
    )
    names = (row.split("\t") for row in listing.stdout.splitlines())
    files = {
        row.split()[2]: name for row, name in names if name.endswith((".osim", ".xml", ".omoco"))
    }
    count = 0
    for blob, name in files.items():
        text = subprocess.run(
            [*git, "cat-file", "blob", blob], capture_output=True, check=True
        ).stdout
        if b"<OpenSimDocument" in text and len(text) < 60_000:
            count += 1
            file = f"x.{name.rpartition('.')[2]}"
            report = check_source(Source(text, file), Config(("OSIM113",), target_version=release))
            assert not report.findings, f"{name}: {report}"
    assert count > 100
