"""Check that a random fault in a complete project is found on its line in the right file.

The quick suite has 30 faults, the full one 300. ``OSIMLITE_FAULTS=2000 OSIMLITE_SEED=7`` sets their
number and the seed. ``tests/oracle/test_random_faults.py`` compares such faults with OpenSim.
"""

from __future__ import annotations

import os
import random
from itertools import islice

import pytest

from tests.lint.project_faults import faults, harmless
from tests.lint.projects import FIXTURES, Fault, pendulum, walking
from tests.lint.support import Folder, in_place
from tests.suite import choose

WANTED = int(os.environ.get("OSIMLITE_FAULTS", choose("30", "300")))
SEED = int(os.environ.get("OSIMLITE_SEED", "1"))


NODES = (
    (FIXTURES / "setups" / "controls.xml")
    .read_text()
    .partition("<x_nodes>")[2]
    .partition("</x_nodes>")[0]
)
"""Nodes of the control curve in a setup."""


PROCESSOR = """
				<ModelProcessor name="model">
					<filepath>model.osim</filepath>
				</ModelProcessor>"""
"""Model processor of a study."""


@pytest.fixture(scope="module", params=[walking, pendulum], ids=["walking", "pendulum"])
def folder(request, tmp_path_factory):
    return Folder(tmp_path_factory.mktemp("project"), request.param())


def test_the_project_is_without_findings(folder):
    assert (
        folder.check(*(name for name in sorted(folder.project.texts) if not name.endswith(".osim")))
        == []
    )


def test_a_fault_is_found_where_it_is(folder):
    missed = []
    for fault in islice(faults(folder.project, random.Random(SEED)), WANTED // 2):
        findings = folder.found(fault)
        if fault.sure and not in_place(fault, findings):
            missed.append(
                f"{fault.kind} {fault.what}\n  {sorted(fault.places)}\n  "
                + "\n  ".join(map(str, findings[:3]))
            )
    assert not missed, f"{len(missed)} of {WANTED // 2}:\n" + "\n".join(missed)


@pytest.mark.parametrize(
    ("folder", "file", "old", "new"),
    [
        # CMC needs 0.03 s and one time window before it controls anything.
        (walking, "cmc.xml", "<final_time>0.65", "<final_time>0.634"),
        (walking, "cmc.xml", "<cmc_time_window>0.005", "<cmc_time_window>0.021"),
        (walking, "rra.xml", "<final_time>0.51", "<final_time>0.5"),
        (walking, "rra.xml", "<replace_force_set>true", "<replace_force_set>false"),
        (walking, "so.xml", "<initial_time>0.5", "<initial_time>60"),
        (walking, "markers.xml", ">/bodyset/torso<", ">torso<"),
        (walking, "markers.xml", ">/bodyset/torso<", ">/torso<"),
        (walking, "constraints.xml", "hamstrings_r.excitation", "hamstrings_r"),
        (walking, "constraints.xml", "<is_model_control> true", "<is_model_control> false"),
        (walking, "reserves.xml", "<coordinate>hip_flexion_r<", "<coordinate><"),
        (walking, "tasks.xml", "<coordinate>pelvis_ty<", "<coordinate><"),
        (walking, "reserves.xml", "<isDisabled>false", "<isDisabled>true"),
        (walking, "controls.xml", f"<x_nodes>{NODES}</x_nodes>", "<x_nodes />"),
        (walking, "controls.xml", "hamstrings_r.excitation", "/forceset/hamstrings_r.excitation"),
        (walking, "scale.xml", ">markers.xml<", "><"),
        (walking, "so.xml", "<forces_file>Unassigned<", "<forces_file>unassigned<"),
        (pendulum, "study.omoco", PROCESSOR, ""),
        (walking, "forward.xml", ">controls.xml<", ">coords.mot<"),
        (walking, "ik.xml", "> model.osim <", ">walk.trc<"),
        (walking, "loads.xml", ">grf.mot<", ">tasks.xml<"),
        (walking, "tasks.xml", "<kp> 100 <", "<kp> 1e30 <"),
        (walking, "slide_guess.sto", "num_controls=1", "num_controls=2"),
        (walking, "slide_guess.sto", "num_controls=1\n", ""),
        (pendulum, "angles.sto", "DataType=double", "DataType=dubble"),
        (pendulum, "angles.sto", "DataType=double", "DataType = double"),
        (pendulum, "angles.sto", "inDegrees=no", "inDegrees=YES"),
        (pendulum, "orientations.sto", "DataType=Quaternion", "DataType=Vec4"),
    ],
    indirect=["folder"],
)
def test_what_chance_has_shown_is_found(folder, file, old, new):
    text = folder.project.texts[file]
    assert old in text
    places = {(file, text[: text.index(old)].count("\n") + 1), *folder.project.users(file).items()}
    fault = Fault(
        "known",
        f"{file}: {old} -> {new}",
        file,
        {file: text.replace(old, new, 1)},
        frozenset(places),
        True,
    )
    assert in_place(fault, folder.found(fault))


@pytest.mark.parametrize(
    ("folder", "file", "old", "new"),
    [
        (walking, "markers.xml", ">/bodyset/torso<", ">../../bodyset/torso<"),
        (walking, "markers.xml", ">/bodyset/torso<", ">//bodyset/torso/<"),
        (pendulum, "angles.sto", "version=3", "version = 3"),
        (pendulum, "orientations.sto", "DataRate=50.000000\n", ""),
    ],
    indirect=["folder"],
)
def test_what_opensim_takes_is_not_found(folder, file, old, new):
    text = folder.project.texts[file]
    assert old in text
    assert (
        folder.found(Fault("none", "", file, {file: text.replace(old, new, 1)}, frozenset(), False))
        == []
    )


def test_what_changes_nothing_is_not_found(folder):
    wrong = []
    for fault in islice(harmless(folder.project, random.Random(SEED)), WANTED // 6):
        findings = folder.found(fault)
        wrong += [f"{fault.what}\n  {findings[0]}"] if findings else []
    assert not wrong, "\n".join(wrong)
