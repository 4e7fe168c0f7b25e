"""Check inputs, axes of custom joints, and names in constraints and probes."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import pytest

from osimlite.io.document.source import Source
from osimlite.lint import validate
from osimlite.lint.axes import refuses_axes
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.custom_joint import CustomJoint
from osimlite.schema.registry import MODULES
from osimlite.schema.states import list_outputs

HERE = Path(__file__).resolve().parent
_spec = importlib.util.spec_from_file_location("skeleton", HERE / "skeleton.py")
assert _spec is not None and _spec.loader is not None
skeleton = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(skeleton)


def codes(fragment):
    return set(validate(Source(skeleton.document(fragment).encode()), ignore="OSIM7").codes)


def test_outputs_are_those_of_the_catalogue():
    catalogue = json.loads((HERE.parents[1] / "schemas" / "opensim-4.6.json").read_text())[
        "classes"
    ]
    seen = 0
    for name, module in MODULES.items():
        known = catalogue.get(name)
        if known is None or known["abstract"]:
            continue
        cls = getattr(importlib.import_module(f"{module}"), name)
        expected = {
            item["name"]: (item["type"], item["list"]) for item in known.get("outputs") or []
        }
        assert {word: tuple(output) for word, output in list_outputs(cls).items()} == expected, name
        seen += bool(expected)
    assert seen > 60


KNEE = "/jointset/knee/knee_angle"


@pytest.mark.parametrize(
    ("words", "right"),
    [
        # The verdicts were measured with OpenSim 4.6.
        (f"{KNEE}|value", True),
        (f"{KNEE}|value(knee)", True),
        (f"{KNEE}|value:", True),
        ("/|kinetic_energy", True),
        ("..|kinetic_energy", True),
        (f"{KNEE}|value {KNEE}|speed", True),
        (f"{KNEE}|value {KNEE}|value", True),
        ("/forceset/foot_ground|potential_energy", True),
        ("/jointset/knee|power", True),
        ("", True),
        (f"{KNEE}|valu", False),
        (f"{KNEE}|Value", False),
        (f"{KNEE}", False),
        (f"{KNEE}/value", False),
        (f"{KNEE}||value", False),
        (f"{KNEE}|value:first", False),
        ("|kinetic_energy", False),
        ("/jointset/knee/kne|value", False),
        ("jointset/knee/knee_angle|value", False),
        ("../../jointset/knee/knee_angle|value", False),
        ("/bodyset/thigh|position", False),
        ("/ground|position", False),
        ("/bodyset|position", False),
        ("/forceset/foot_ground|record", False),
        ("/contactgeometryset/heel|x", False),
    ],
)
def test_inputs_are_followed_as_opensim_does(words, right):
    tag = "TableReporter__double_"
    result = codes(
        f'<components><{tag} name="r"><input_inputs>{words}</input_inputs></{tag}></components>'
    )
    assert result == (set() if right else {"OSIM332"})


def test_a_geometry_that_a_frame_draws_takes_no_input():
    thigh = (
        '<Body name="thigh"><mass>8</mass><inertia>0.1 0.1 0.02 0 0 0</inertia><attached_geometry><Sphere name="s">'
        "<input_transform>/bodyset/shank|transform</input_transform></Sphere></attached_geometry></Body>"
    )
    assert codes(thigh) == {"OSIM332"}


def joint(declared, *names):
    custom = CustomJoint(name="j", coordinates=[Coordinate(name=name) for name in declared])
    transform = custom.spatial_transform
    for axis, name in zip(
        (transform.rotation1, transform.rotation2, transform.translation1), names, strict=False
    ):
        axis.coordinates = (name,) if name else ()
    return custom


@pytest.mark.parametrize(
    ("declared", "names", "refused"),
    [
        ("k", "k", False),
        ("k", "x", True),
        ("k", "kx", False),
        ("km", "k", False),
        ("mk", "k", True),
        ("k", "", True),
        ("km", "kx", True),
        ("", "k", False),
        ("km", "mk", False),
        ("kmn", "km", False),
        ("kmn", "mk", True),
        ("k", "k*", True),
    ],
)
def test_axes_are_refused_as_opensim_does(declared, names, refused):
    assert refuses_axes(joint(declared, *names)) is refused


@pytest.mark.parametrize(
    ("fragment", "code"),
    [
        (
            '<CoordinateCouplerConstraint name="c"><independent_coordinate_names>{}</independent_coordinate_names>'
            "<dependent_coordinate_name>knee_angle</dependent_coordinate_name><coupled_coordinates_function>"
            "<LinearFunction/></coupled_coordinates_function></CoordinateCouplerConstraint>",
            "OSIM301",
        ),
        (
            '<ConstantDistanceConstraint name="c"><socket_body_1>/ground</socket_body_1><socket_body_2>/bodyset/{}'
            "</socket_body_2></ConstantDistanceConstraint>",
            "OSIM301",
        ),
        (
            '<JointInternalPowerProbe name="p"><joint_names>{}</joint_names></JointInternalPowerProbe>',
            "OSIM301",
        ),
        (
            '<ActuatorPowerProbe name="p"><actuator_names>{}</actuator_names></ActuatorPowerProbe>',
            "OSIM301",
        ),
    ],
)
def test_names_in_constraints_and_probes_are_followed(fragment, code):
    assert code in codes(fragment.format("no_such"))


@pytest.mark.parametrize(("words", "found"), [("ALL", False), ("no_such all", True)])
def test_a_probe_takes_all_for_its_first_word(words, found):
    probe = f'<JointInternalPowerProbe name="p"><joint_names>{words}</joint_names></JointInternalPowerProbe>'
    assert ("OSIM301" in codes(probe)) is found


def test_constraints_of_one_name_are_renamed():
    weld = '<WeldConstraint name="{}"><socket_frame1>/ground</socket_frame1><socket_frame2>/bodyset/{}</socket_frame2>'
    weld += "</WeldConstraint>"
    both = f"<ConstraintSet><objects>{weld.format('w', 'thigh')}{weld.format('w', 'shank')}</objects></ConstraintSet>"
    assert "OSIM311" in codes(both)
