"""Check fixes of tables and setups: they restore the original text, and change nothing else."""

from __future__ import annotations

import re
from shutil import copy

import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.io.document.source import Source
from osimlite.lint.engine import make_subject, run_rules
from osimlite.lint.fixes import select_edits
from tests.lint.support import BROKEN, LINT, MARKERS, MOTION, mend


@pytest.mark.parametrize("end", [b"\n", b"\r\n"], ids=["unix", "windows"])
@pytest.mark.parametrize(("what", "data", "old", "new"), BROKEN, ids=[each[0] for each in BROKEN])
def test_a_broken_table_is_as_it_was(what, data, old, new, end):
    broken = re.sub(old, new, data, count=0 if what == "last-tabs" else 1)
    assert broken != data
    name = "a.trc" if data is MARKERS else "a.sto"
    assert mend(name, broken.replace(b"\n", end)) == data.replace(b"\n", end)


@given(st.text(max_size=20), st.sampled_from(["true", "1", "TRUE"]))
def test_letters_of_any_script_before_a_mend_stay(title, word):
    title = re.sub(r"\s|=", "", title).encode("utf-8", "ignore").decode()
    data = MOTION.replace(b"knee\n", f"{title or 'k'}\n".encode(), 1).replace(
        b"\thip", "\tHüfte".encode()
    )
    assert mend("a.mot", data.replace(b"=yes", f"={word}".encode())) == data


def test_bytes_of_no_encoding_stay_and_hide_no_mend_elsewhere():
    data = MOTION.replace(b"\tknee", b"\tkn\xe9e")
    assert mend("a.mot", data.replace(b"nRows=3", b"nRows=9")) == data
    assert mend("a.mot", data.replace(b"time\t", b"Time\t")) == data.replace(b"time\t", b"Time\t")


def test_what_nobody_knows_is_left_alone():
    for damage in (b"0.1\tx\t3", b"0.1\t1", b"0\t1\t3"):
        data = MOTION.replace(b"0.1\t1\t3", damage)
        assert mend("a.sto", data, unsafe=True) == data


@pytest.mark.parametrize(
    ("data", "old", "new"),
    [
        # A label is missing, a line is broken in two, or a header line is invalid.
        (MOTION, b"\thip", b""),
        (MARKERS, b"knee_marker", b"knee\nmarker"),
        (MARKERS, b"Frame#\tTime\t", b"asis\t\t\t"),
        (MARKERS, b"\t\tX1\t", b"\t\tleft\t"),
        (MARKERS, b"NumFrames\t", b""),
    ],
)
def test_what_may_mean_another_thing_is_left_alone(data, old, new):
    assert data.count(old) == 1
    broken = data.replace(old, new)
    assert mend("a.sto" if data is MOTION else "a.trc", broken, unsafe=True) == broken


SETUP = """<OpenSimDocument Version="{version}">
\t<InverseKinematicsTool name="ik">
\t\t<model_file>leg.osim</model_file>
\t\t<marker_file>{markers}</marker_file>
\t\t<output_motion_file>ik.mot</output_motion_file>
\t\t<IKTaskSet>
\t\t\t<objects>
\t\t\t\t<IKMarkerTask name="{task}"> <weight>1</weight> </IKMarkerTask>
\t\t\t\t<IKCoordinateTask name="{coordinate}"> <weight>1</weight> </IKCoordinateTask>
\t\t\t</objects>
\t\t</IKTaskSet>
\t</InverseKinematicsTool>
</OpenSimDocument>
"""
RIGHT = {"version": "40600", "markers": "leg.trc", "task": "asis", "coordinate": "knee_angle"}


@pytest.fixture
def setup_file(tmp_path):
    """Return the path of a setup in a folder with the files that it names."""
    for file in LINT.glob("leg*"):
        copy(file, tmp_path)
    (tmp_path / "ik.xml").touch()
    return str(tmp_path / "ik.xml")


@pytest.mark.parametrize(
    ("changed", "is_safe"),
    [
        ({"markers": "Leg.trc"}, True),
        ({"markers": ".\\leg.trc"}, True),
        ({"task": "ASIS"}, True),
        ({"coordinate": "knee_anlge"}, False),
        ({"coordinate": "knee_anlge", "version": "30000"}, False),
    ],
)
def test_a_name_in_a_setup_is_mended_as_surely_as_it_is_known(setup_file, changed, is_safe):
    right = SETUP.format(**{**RIGHT, "version": changed.get("version", "40600")})
    broken = SETUP.format(**{**RIGHT, **changed})
    meant = right.replace("leg.trc", "./leg.trc") if "\\" in broken else right
    assert mend(setup_file, broken.encode()).decode() == (meant if is_safe else broken)
    assert mend(setup_file, broken.encode(), unsafe=True).decode() == meant


def test_only_the_words_of_the_finding_are_replaced(setup_file):
    # A character reference was written on purpose, therefore it is not fixed.
    broken = SETUP.format(**{**RIGHT, "coordinate": "knee_anlge"}).replace(
        '"knee_anlge"', '"&#107;nee_anlge"'
    )
    assert mend(setup_file, broken.encode(), unsafe=True).decode() == broken


def test_mends_of_many_rows_are_many_edits():
    rows = b"".join(b"%d\t%.2f\t1.1\t1.2\t1.3\t\t\t\n" % (k, k / 100) for k in range(1, 3001))
    head = MARKERS.split(b"\n")[:5]
    head[2] = b"100\t100\t3000\t1\tm\t100\t1\t3000"
    head[3], head[4] = b"Frame#\tTime\tasis", b"\t\tX1\tY1\tZ1"
    data = b"\n".join([*head, b"", rows])
    report = run_rules(make_subject(Source(data, "a.trc")))
    assert len(select_edits(report)[0]) == 3000
    assert mend("a.trc", data) == data.replace(b"\t\t\t\n", b"\n")
