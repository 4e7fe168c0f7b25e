"""Check fixes: they are exact, and change nothing else."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from osimlite.errors import OsimliteError
from osimlite.io.document.source import Source
from osimlite.lint import validate
from osimlite.lint.fixes import apply_fixes

HERE = Path(__file__).resolve().parent
WALKER = HERE.parents[1] / "fixtures" / "walker" / "DynamicWalkerModel.osim"

_spec = importlib.util.spec_from_file_location("faults", HERE / "faults.py")
assert _spec is not None and _spec.loader is not None
faults = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(faults)
BY_NAME = {fault.name: fault for fault in faults.FAULTS}

# Faults with a safe fix.
SAFE = [
    "hc_geom_comma",
    "hc_geom_wrong_case",
    "joint_parent_bare_name",
    "joint_parent_missing_slash",
    "limit_coord_path",
    "case_mass_tag",
    "dup_property",
    "unknown_attribute",
]
# Faults with an unsafe fix only.
UNSAFE = [
    "hc_geom_misspelled",
    "joint_parent_misspelled",
    "offset_parent_misspelled",
    "joint_child_offset_misspelled",
    "contact_frame_misspelled",
    "misspelled_mass_tag",
    "misspelled_stiffness",
    "misspelled_paramset",
    "misspelled_set_tag",
    "misspelled_joint_frames",
    "misspelled_gravity",
    "unknown_joint_class",
    "unknown_geometry_class",
    "socket_tag_misspelled",
]


def mend(text: str, *, unsafe: bool = False) -> tuple[str, int]:
    source = Source(text.encode())
    data, count = apply_fixes(source, validate(source), unsafe=unsafe)
    return data.decode(), count


@pytest.mark.parametrize("name", SAFE)
def test_a_safe_mend_gives_the_walker_back(name):
    text, _ = BY_NAME[name].change(WALKER.read_text())
    assert mend(text) == (WALKER.read_text(), 1)
    assert any(finding.fixable for finding in validate(Source(text.encode())))


@pytest.mark.parametrize("name", UNSAFE)
def test_an_unsafe_mend_gives_the_walker_back_when_asked_for(name):
    text, _ = BY_NAME[name].change(WALKER.read_text())
    assert mend(text) == (text, 0)
    assert mend(text, unsafe=True)[0] == WALKER.read_text()


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("vec3_comma", "<location>0 -0.2175 0</location>"),
        ("vec3_parens", "<location>0 -0.2175 0</location>"),
        ("bool_yes", "<locked>true</locked>"),
    ],
)
def test_a_value_is_written_as_opensim_reads_it(name, expected):
    text, _ = BY_NAME[name].change(WALKER.read_text())
    fixed, count = mend(text)
    assert count == 1 and expected in fixed
    assert len(fixed.splitlines()) == len(text.splitlines())


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("mass_decimal_comma", "<mass>1.5</mass>"),
        ("mass_trailing", "<mass>5</mass>"),
        ("mass_fortran_exp", "<mass>1e1</mass>"),
        ("range_inverted", "<range>-1.745 0</range>"),
    ],
)
def test_a_value_that_changes_is_an_unsafe_mend(name, expected):
    text, _ = BY_NAME[name].change(WALKER.read_text())
    assert mend(text) == (text, 0)
    fixed, count = mend(text, unsafe=True)
    assert count == 1 and expected in fixed


@pytest.mark.parametrize("fault", faults.FAULTS, ids=lambda fault: fault.name)
def test_no_mend_makes_a_model_worse(fault):
    text, _ = fault.change(WALKER.read_text())
    # Once a model is connected again, further rules can compute the positions of its feet.
    before = validate(Source(text.encode()), ignore="OSIM521")
    for unsafe in (False, True):
        fixed, count = mend(text, unsafe=unsafe)
        after = validate(Source(fixed.encode()), ignore="OSIM521")
        assert len(after.errors) <= len(before.errors)
        assert count == 0 or len(after) < len(before), f"{before}\n->\n{after}"


def test_line_ends_comments_and_indentation_stay():
    text = (
        '<OpenSimDocument Version="40600">\r\n\t<Model name="m" colour="red"> <!-- mine -->\r\n'
        "\t</Model>\r\n</OpenSimDocument>"
    )
    assert mend(text) == (text.replace(' colour="red"', ""), 1)


def test_another_encoding_stays():
    text = (
        '<?xml version="1.0" encoding="ISO-8859-1"?>\n<OpenSimDocument Version="40600">\n'
        '<Model name="m" colour="red"><credits>Müller</credits></Model>\n</OpenSimDocument>\n'
    )
    data, count = apply_fixes(source := Source(text.encode("latin-1")), validate(source))
    assert count == 1 and data == text.replace(' colour="red"', "").encode("latin-1")


def test_mixed_encodings_are_left_alone():
    data = (
        b'<OpenSimDocument Version="40600"><Model name="m" a="1"><credits>\xc3\xbc \xfc</credits></Model>'
        b"</OpenSimDocument>"
    )
    source = Source(data)
    with pytest.raises(OsimliteError, match="mixes encodings"):
        apply_fixes(source, validate(source))


@pytest.mark.parametrize(("named", "meant"), [("Pelviz", "Pelvis"), ("Pelvis Pelviz", None)])
def test_nothing_is_proposed_that_a_list_has_already(named, meant):
    group = f'<groups><ObjectGroup name="half"><members>{named}</members></ObjectGroup></groups></BodySet>'
    text = WALKER.read_text()
    before, _, after = text.partition("</BodySet>")
    source = Source((before.replace("<groups />", "") + group + after).encode())
    (finding,) = validate(source, select="OSIM301").findings
    assert finding.suggestion == meant


def test_a_name_that_a_property_had_in_early_releases_is_known():
    element = "<enable_controller>false</enable_controller>"
    text = f"""<OpenSimDocument Version="20302"><AnalyzeTool name="a"><ControllerSet><objects>
        <ControlSetController name="c">{element}</ControlSetController>
        </objects></ControllerSet></AnalyzeTool></OpenSimDocument>"""
    (finding,) = validate(Source(text.encode(), "a.xml"), select="OSIM101").findings
    assert (finding.severity, finding.suggestion) == ("error", "enabled")
    (finding,) = validate(
        Source(text.replace("false", "true").encode(), "a.xml"), select="OSIM101"
    ).findings
    assert finding.severity == "warning"
