"""Check that each fault of the table of faults is found on its line, and that harmless changes are not."""

from __future__ import annotations

from pathlib import Path

import pytest

from osimlite.lint.engine import load_subject, run_rules
from osimlite.lint.project_files import is_document, is_table
from tests.lint.setup_faults import FAULTS, HARMLESS, STUDIES, TEXTS, UNTOLD, Fault, put_in


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder for all tests, so that the model in it is read only once."""
    folder = tmp_path_factory.mktemp("pipeline")
    for name, text in TEXTS.items():
        (folder / name).write_text(text)
    return folder


@pytest.fixture
def pipeline(folder):
    """Return the folder of the pipeline; files that the test changes are restored afterwards."""
    yield folder
    for name, text in TEXTS.items():
        if (folder / name).read_bytes().decode() != text:
            (folder / name).write_text(text)


def checked(*files: Path) -> list[tuple[str, int | None, str, str]]:
    """Return file, line, code and text of all findings in setups and tables."""
    return [
        (file.name, one.line, one.code, str(one))
        for file in files
        if is_table(file.name) or is_document(file.name)
        for one in run_rules(load_subject(str(file)))
    ]


def test_the_pipeline_is_without_findings(pipeline):
    assert checked(*sorted(pipeline.iterdir())) == []


@pytest.mark.parametrize("fault", [*FAULTS, *STUDIES], ids=lambda fault: str(fault.number))
def test_a_fault_is_found_on_its_line(pipeline, fault):
    line = put_in(pipeline, fault)
    where = fault.found_in or fault.file
    text = (pipeline / where).read_text()
    place = fault.line_of
    if place == "second:R.ASIS":
        line = text[: text.rindex('name="R.ASIS"')].count("\n") + 1
    elif place == "first":
        line = 1
    elif place == "NumMarkers-values":
        line = 3
    elif place:
        line = next(
            k
            for k, row in enumerate(text.split("\n"), 1)
            if row.lstrip().startswith(place) or place in row
        )
    result = checked(pipeline / where)
    assert (where, line) in {(file, at) for file, at, _, _ in result}, f"{where}:{line}\n{result}"


def test_a_model_may_be_named_by_its_absolute_path(pipeline):
    put_in(pipeline, Fault(281, "ik.xml", "model.osim", str(pipeline / "model.osim")))
    assert checked(*sorted(pipeline.iterdir())) == []


@pytest.mark.parametrize(
    ("version", "given", "severities"),
    [
        (40600, "socket_actuators>/forceset/nosuch", ["error"]),
        (40600, "socket_actuators>hamstrings_r", ["error"]),
        (40600, "socket_actuators>../../forceset/hamstrings_r", []),
        (40600, "socket_actuators>/forceset/hip_flexion_r_reserve", []),
        (40500, "actuator_list>nosuch", ["warning"]),
        (40500, "actuator_list>hamstrings_r", []),
    ],
)
def test_a_controller_names_actuators_by_their_paths_and_names_of_older_documents_are_left_out(
    pipeline, version, given, severities
):
    """OpenSim 4.6 does the same."""
    text = TEXTS["forward.xml"].replace('"40600"', f'"{version}"')
    text = text.replace(
        "<results_directory>", "<force_set_files>reserves.xml</force_set_files><results_directory>"
    )
    text = text.replace("<enabled>true", f"<{given}</{given.partition('>')[0]}>\n<enabled>true", 1)
    (pipeline / "forward.xml").write_text(text)
    report = run_rules(load_subject(str(pipeline / "forward.xml")))
    assert [str(finding.severity) for finding in report if finding.code == "OSIM831"] == severities


@pytest.mark.parametrize("fault", HARMLESS, ids=lambda fault: str(fault.number))
def test_what_is_harmless_is_not_found(pipeline, fault):
    put_in(pipeline, fault)
    assert (
        checked(*([pipeline / fault.found_in] if fault.found_in else sorted(pipeline.iterdir())))
        == []
    )


def test_every_fault_of_the_table_is_accounted_for():
    numbers = {fault.number for fault in [*FAULTS, *HARMLESS] if isinstance(fault.number, int)}
    assert sorted(numbers | UNTOLD.keys()) == [*range(332)]
