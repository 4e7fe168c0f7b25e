"""Single faults in the text of the walker, with the code and the line that the linter must report.

What OpenSim 4.6 does with each was measured: it accepts half of them without a message.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

Change = Callable[[str], tuple[str, int | None]]
"""Function from the walker's text to the faulty text and the offset of the fault in it.

The offset is None where the finding has no particular position.
"""


class Fault(NamedTuple):
    """Fault: its change of the text, the code that must be reported, and its severity."""

    name: str
    change: Change
    code: str
    severity: str = "error"


def put(marker: str, old: str, new: str, at: str | None = None) -> Change:
    """Return a change that replaces the next `old` after `marker` by `new`.

    The fault is at the position of `at` in `new`, or at the beginning of `new`.
    """

    def change(text: str) -> tuple[str, int]:
        start = text.index(old, text.index(marker))
        place = start + (new.index(at) if at is not None else len(new) - len(new.lstrip()))
        return text[:start] + new + text[start + len(old) :], place

    return change


def each(*pairs: tuple[str, str], at: str) -> Change:
    """Return a change that replaces every occurrence of each pair.

    The fault is at the last `at` in the result.
    """

    def change(text: str) -> tuple[str, int]:
        for old, new in pairs:
            assert old in text, old
            text = text.replace(old, new)
        return text, text.rindex(at)

    return change


def pattern(expression: str, new: str, at: str, behind: str = "") -> Change:
    """Return a change that replaces the first match of a regular expression.

    The fault is at the first `at` after `behind` in the result.
    """

    def change(text: str) -> tuple[str, int]:
        text, count = re.subn(expression, new, text, count=1, flags=re.DOTALL)
        assert count == 1, expression
        return text, text.index(at, text.index(behind))

    return change


def nowhere(edit: Callable[[str], str]) -> Change:
    """Return a change whose fault has no particular position."""
    return lambda text: (edit(text), None)


def value(tag: str, new: str, marker: str = '<Body name="RightShank">') -> Change:
    """Return a change that gives the next property `tag` after `marker` another text."""

    def change(text: str) -> tuple[str, int]:
        start = text.index(f"<{tag}>", text.index(marker))
        end = text.index(f"</{tag}>", start)
        head = f"<{tag}>"
        return text[: start + len(head)] + new + text[end:], start

    return change


def tag(old: str, new: str, marker: str) -> Change:
    """Return a change that renames the next element `old` after `marker`, in both of its tags."""

    def change(text: str) -> tuple[str, int]:
        start = re.compile(rf"<{re.escape(old)}(?=[\s>/])").search(text, text.index(marker))
        assert start is not None
        end = text.index(f"</{old}>", start.end())
        text = (
            text[: start.start()]
            + f"<{new}"
            + text[start.end() : end]
            + f"</{new}>"
            + text[end + len(old) + 3 :]
        )
        return text, start.start()

    return change


# Beginnings of elements of the walker after which changes are made.
SHANK = '<Body name="RightShank">'
FOOT_FORCE = '<HuntCrossleyForce name="RFootForce">'
FOOT = '<ContactSphere name="RFootContact">'
LIMIT = '<CoordinateLimitForce name="RHipLimitTorque">'
KNEE = '<Coordinate name="RKnee_rz">'
PLANAR = '<PlanarJoint name="PelvisToPlatform">'
PLATFORM = '<Coordinate name="platform_rz">'
HIP = '<PinJoint name="RightThighToPelvis">'
GEOMETRY = "<geometry>RFootContact PlatformContact</geometry>"


def geometry(text: str) -> Change:
    return put(FOOT_FORCE, GEOMETRY, f"<geometry>{text}</geometry>")


def loop(kind: str, coordinates: str = "") -> Change:
    joint = (
        f'<{kind} name="Loop"><socket_parent_frame>/bodyset/RightShank</socket_parent_frame>\n'
        f"<socket_child_frame>/bodyset/LeftShank</socket_child_frame>{coordinates}</{kind}>\n"
    )

    def change(text: str) -> tuple[str, int]:
        place = text.index("</objects>", text.index("<JointSet"))
        return text[:place] + joint + text[place:], place + joint.index("<socket_child")

    return change


def _coordinates(*names: str) -> str:
    return (
        "<coordinates>"
        + "".join(f'<Coordinate name="{name}" />' for name in names)
        + "</coordinates>"
    )


def _second_knee(text: str) -> tuple[str, int]:
    knee = re.search(r'<PinJoint name="RightShankToThigh">.*?</PinJoint>', text, re.DOTALL)
    assert knee is not None
    joint = knee[0].replace("RightShankToThigh", "Again").replace("RKnee_rz", "Again_rz")
    return text[: knee.end()] + "\n" + joint + text[knee.end() :], knee.end() + 1


def _unclosed(text: str) -> tuple[str, int]:
    place = text.rindex("</Body>")
    text = text[:place] + text[place + len("</Body>") :]
    return text, text.index("</objects>", place)


def _two_knees(text: str) -> tuple[str, int]:
    text = text.replace('<Coordinate name="LKnee_rz">', KNEE)
    force = re.compile(
        r'<CoordinateLimitForce name="LKneeLimitTorque">.*?</CoordinateLimitForce>', re.DOTALL
    )
    return force.sub("", text), text.rindex(KNEE)


def _limit_of_left_knee(text: str) -> tuple[str, int]:
    text = text.replace('<Coordinate name="LKnee_rz">', '<Coordinate name="RKnee_rz">')
    text = text.replace("<coordinate>LKnee_rz</coordinate>", "<coordinate>RKnee_rz</coordinate>")
    first = text.index('<Coordinate name="RKnee_rz">')
    return text, text.index('<Coordinate name="RKnee_rz">', first + 1)


REFERENCES = [
    Fault("hc_geom_misspelled", geometry("RFootContct PlatformContact"), "OSIM301"),
    Fault("hc_geom_one_missing", geometry("RFootContact"), "OSIM321", "warning"),
    Fault("hc_geom_empty", geometry(""), "OSIM321", "warning"),
    Fault("hc_geom_twice", geometry("RFootContact RFootContact PlatformContact"), "OSIM322"),
    Fault("hc_geom_is_a_body", geometry("RightShank PlatformContact"), "OSIM302"),
    Fault("hc_geom_comma", geometry("RFootContact, PlatformContact"), "OSIM301"),
    Fault("hc_geom_wrong_case", geometry("rfootcontact PlatformContact"), "OSIM305"),
    Fault(
        "joint_parent_misspelled",
        value("socket_parent_frame", "/bodyset/Platfrom", PLANAR),
        "OSIM301",
    ),
    Fault("offset_parent_misspelled", value("socket_parent", "/bodyset/Pelvs", HIP), "OSIM301"),
    Fault(
        "joint_child_offset_misspelled",
        value("socket_child_frame", "RightThigh_offst", HIP),
        "OSIM301",
    ),
    Fault(
        "joint_parent_wrong_type",
        value("socket_parent_frame", "/jointset/PlatformToGround", PLANAR),
        "OSIM302",
    ),
    Fault("joint_parent_empty", value("socket_parent_frame", "", PLANAR), "OSIM303"),
    Fault(
        "joint_parent_removed",
        pattern(
            r"(<PlanarJoint [^>]*>.*?)<socket_parent_frame>[^<]*</socket_parent_frame>",
            r"\1",
            PLANAR,
        ),
        "OSIM303",
    ),
    Fault("joint_parent_bare_name", value("socket_parent_frame", "Platform", PLANAR), "OSIM304"),
    Fault(
        "joint_parent_missing_slash",
        value("socket_parent_frame", "bodyset/Platform", PLANAR),
        "OSIM304",
    ),
    Fault(
        "socket_tag_misspelled", tag("socket_parent_frame", "socket_parent_fram", PLANAR), "OSIM101"
    ),
    Fault("contact_frame_misspelled", value("socket_frame", "/bodyset/RightShnk", FOOT), "OSIM301"),
    Fault("limit_coord_misspelled", value("coordinate", "RHip_rx", LIMIT), "OSIM301"),
    Fault(
        "limit_coord_path",
        value("coordinate", "/jointset/RightThighToPelvis/RHip_rz", LIMIT),
        "OSIM304",
    ),
    Fault(
        "limit_coord_missing", pattern(r"<coordinate>RHip_rz</coordinate>", "", LIMIT), "OSIM303"
    ),
]

STRUCTURE = [
    Fault("unknown_tag", put(SHANK, "<mass>", "<foo>1</foo><mass>"), "OSIM101"),
    Fault("misspelled_mass_tag", tag("mass", "mas", SHANK), "OSIM101"),
    Fault("case_mass_tag", tag("mass", "Mass", SHANK), "OSIM101"),
    Fault("misspelled_stiffness", tag("stiffness", "stifness", FOOT_FORCE), "OSIM101"),
    Fault(
        "misspelled_transition_velocity",
        tag("transition_velocity", "transition_velcity", FOOT_FORCE),
        "OSIM101",
    ),
    Fault(
        "misspelled_paramset",
        tag(
            "HuntCrossleyForce::ContactParametersSet",
            "HuntCrossleyForce::ContactParameterSet",
            FOOT_FORCE,
        ),
        "OSIM102",
    ),
    Fault(
        "unknown_force_class", tag("HuntCrossleyForce", "HuntCrosslyForce", FOOT_FORCE), "OSIM102"
    ),
    Fault("unknown_joint_class", tag("PinJoint", "PinJnt", HIP), "OSIM102"),
    Fault(
        "wrong_class_in_set",
        put("<ForceSet", "<objects>", '<objects>\n<Body name="x"><mass>1</mass></Body>', "<Body"),
        "OSIM103",
    ),
    Fault("misspelled_set_tag", tag("ForceSet", "FroceSet", "<ForceSet"), "OSIM101"),
    Fault(
        "dup_property",
        put(SHANK, "<mass>1</mass>", "<mass>1</mass>\n<mass>7</mass>", "<mass>7"),
        "OSIM104",
    ),
    Fault(
        "missing_objects_wrapper",
        pattern(r"(<BodySet [^>]*>\s*)<objects>(.*?)</objects>", r"\1\2", '<Body name="Platform">'),
        "OSIM109",
    ),
    Fault("misspelled_limit_tag", tag("upper_limit", "uper_limit", LIMIT), "OSIM101"),
    Fault("misspelled_location_tag", tag("location", "loction", FOOT), "OSIM101"),
    Fault("misspelled_default_value", tag("default_value", "defalt_value", KNEE), "OSIM101"),
    Fault("misspelled_locked", tag("locked", "lockd", PLATFORM), "OSIM101"),
    Fault("misspelled_gravity", tag("gravity", "gravty", "<Model"), "OSIM101", severity="warning"),
    Fault("misspelled_joint_frames", tag("frames", "frmes", HIP), "OSIM101"),
    Fault("unknown_geometry_class", tag("Brick", "Brik", '<Body name="Platform">'), "OSIM102"),
    Fault(
        "unknown_attribute", put("<Model", SHANK, '<Body name="RightShank" mass="7">'), "OSIM105"
    ),
]

VALUES = [
    Fault("vec3_two", value("location", "0 -0.2175", FOOT), "OSIM202"),
    Fault("vec3_four", value("location", "0 -0.2175 0 5", FOOT), "OSIM202"),
    Fault("vec3_comma", value("location", "0,-0.2175,0", FOOT), "OSIM201"),
    Fault("vec3_empty", value("location", "", FOOT), "OSIM204", severity="warning"),
    Fault("vec3_text", value("location", "0 abc 0", FOOT), "OSIM201"),
    Fault("inertia_three", value("inertia", "2 2 2"), "OSIM202"),
    Fault("inertia_seven", value("inertia", "2 2 2 0 0 0 9"), "OSIM202"),
    Fault("mass_text", value("mass", "abc"), "OSIM201"),
    Fault("mass_trailing", value("mass", "5kg"), "OSIM203"),
    Fault("mass_decimal_comma", value("mass", "1,5"), "OSIM203"),
    Fault("mass_two_values", value("mass", "5 6"), "OSIM202"),
    Fault("mass_empty", value("mass", ""), "OSIM204"),
    Fault("mass_hex", value("mass", "0x10"), "OSIM203"),
    Fault("radius_text", value("radius", "0.05m", FOOT), "OSIM203"),
    Fault("radius_negative", value("radius", "-0.05", FOOT), "OSIM207", "warning"),
    Fault("radius_nan", value("radius", "NaN", FOOT), "OSIM205"),
    Fault("bool_yes", value("locked", "yes", PLATFORM), "OSIM201"),
    Fault("range_one", value("range", "0", KNEE), "OSIM202"),
    Fault("range_three", value("range", "-1 0 1", KNEE), "OSIM202"),
    Fault("range_inverted", value("range", "0 -1.745", KNEE), "OSIM511", "warning"),
    Fault(
        "clamped_default_outside",
        pattern(
            rf"({re.escape(KNEE)}.*?)<range>[^<]*</range>",
            r"\1<range>-0.1 0</range><clamped>true</clamped>",
            "<default_value>",
            KNEE,
        ),
        "OSIM512",
    ),
    Fault("gravity_text", value("gravity", "down", "<Model"), "OSIM201"),
    Fault("gravity_two", value("gravity", "0 -5", "<Model"), "OSIM202"),
    Fault("mass_fortran_exp", value("mass", "1d1"), "OSIM203"),
    Fault("vec3_parens", value("location", "(0 -0.2175 0)", FOOT), "OSIM201"),
    Fault("vec3_tilde_brackets", value("location", "~[0,-0.2175,0]", FOOT), "OSIM201"),
]

PHYSICS = [
    Fault(
        "mass_missing", pattern(rf"({re.escape(SHANK)}.*?)<mass>1</mass>", r"\1", SHANK), "OSIM501"
    ),
    Fault("mass_negative", value("mass", "-1"), "OSIM206"),
    Fault("mass_zero_leaf", value("mass", "0"), "OSIM407"),
    Fault(
        "massless_leaf",
        pattern(
            rf"({re.escape(SHANK)}.*?)<mass>1</mass>(.*?)<inertia>[^<]*<",
            r"\1<mass>0</mass>\2<inertia>0 0 0 0 0 0<",
            "<mass>",
            SHANK,
        ),
        "OSIM407",
    ),
    Fault("zero_inertia", value("inertia", "0 0 0 0 0 0"), "OSIM504", "warning"),
    Fault("inertia_triangle", value("inertia", "1 1 5 0 0 0"), "OSIM502", "warning"),
    Fault("inertia_negative", value("inertia", "1 1 -1 0 0 0"), "OSIM503", "warning"),
    Fault("inertia_product_too_big", value("inertia", "1 1 1 2 0 0"), "OSIM503", "warning"),
    Fault(
        "inertia_missing",
        pattern(rf"({re.escape(SHANK)}.*?)<inertia>[^<]*</inertia>", r"\1", SHANK),
        "OSIM504",
        "warning",
    ),
    Fault("mass_nan", value("mass", "NaN"), "OSIM205"),
    Fault("mass_inf", value("mass", "Inf"), "OSIM205"),
    Fault("inertia_nan", value("inertia", "NaN 1 1 0 0 0"), "OSIM205"),
    Fault("default_value_nan", value("default_value", "NaN", KNEE), "OSIM205"),
    Fault("gravity_nan", value("gravity", "0 NaN 0", "<Model"), "OSIM205"),
    Fault("stiffness_nan", value("stiffness", "NaN", FOOT_FORCE), "OSIM205"),
    Fault("stiffness_zero", value("stiffness", "0", FOOT_FORCE), "OSIM206"),
    Fault("stiffness_negative", value("stiffness", "-1e6", FOOT_FORCE), "OSIM206"),
    Fault("dissipation_negative", value("dissipation", "-2", FOOT_FORCE), "OSIM207", "warning"),
    Fault(
        "transition_velocity_zero",
        value("transition_velocity", "0", FOOT_FORCE),
        "OSIM207",
        "warning",
    ),
    Fault("limit_transition_zero", value("transition", "0", LIMIT), "OSIM206"),
    Fault("limit_stiffness_zero", value("upper_stiffness", "0", LIMIT), "OSIM206"),
    Fault("limit_upper_lt_lower", value("upper_limit", "-150", LIMIT), "OSIM507", "warning"),
    Fault("mass_nan_lower", value("mass", "nan"), "OSIM205"),
]

NAMES = [
    Fault("dup_body_name", put("<Model", '<Body name="LeftShank">', SHANK), "OSIM311"),
    Fault(
        "dup_body_name_consistent",
        put(
            '<Body name="LeftShank">',
            "</Body>",
            '</Body>\n<Body name="RightShank"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body>',
            "<Body",
        ),
        "OSIM311",
    ),
    Fault(
        "dup_joint_name",
        put("<Model", '<PinJoint name="LeftShankToThigh">', '<PinJoint name="RightShankToThigh">'),
        "OSIM311",
    ),
    Fault(
        "dup_coord_name",
        _two_knees,
        "OSIM406",
    ),
    Fault(
        "dup_coord_same_joint",
        each(('"Pelvis_tx"', '"Pelvis_ty"'), at='<Coordinate name="Pelvis_ty"'),
        "OSIM311",
    ),
    Fault(
        "dup_force_name",
        put("<Model", '<HuntCrossleyForce name="LFootForce">', FOOT_FORCE),
        "OSIM311",
    ),
    Fault(
        "dup_contact_name",
        each(("LFootContact", "RFootContact"), at=FOOT),
        "OSIM311",
    ),
    Fault("name_missing", put("<Model", '<Body name="LeftShank">', "<Body>"), "OSIM313"),
    Fault("name_empty", put("<Model", '<Body name="LeftShank">', '<Body name="">'), "OSIM313"),
    Fault(
        "name_slash",
        each(
            ('"LeftShank"', '"Left/Shank"'),
            ("/bodyset/LeftShank", "/bodyset/Left/Shank"),
            at='<Body name="Left/',
        ),
        "OSIM312",
    ),
    Fault(
        "name_space",
        each(
            ('"LeftShank"', '"Left Shank"'),
            ("/bodyset/LeftShank", "/bodyset/Left Shank"),
            at='<Body name="Left ',
        ),
        "OSIM312",
    ),
    Fault(
        "contact_name_space",
        each(("LFootContact", "LFoot Contact"), at='<ContactSphere name="LFoot '),
        "OSIM312",
    ),
    Fault("dup_coord_clf", _limit_of_left_knee, "OSIM406"),
]

TOPOLOGY = [
    Fault(
        "body_unconnected",
        pattern(
            r'<PinJoint name="RightShankToThigh">.*?</PinJoint>(.*?)<CoordinateLimitForce name="RKneeLimitTorque">.*?'
            r"</CoordinateLimitForce>",
            r"\1",
            SHANK,
        ),
        "OSIM401",
    ),
    Fault("joint_loop_weld", loop("WeldJoint"), "OSIM403"),
    Fault("joint_loop_ball", loop("BallJoint", _coordinates("a", "b", "c")), "OSIM403"),
    Fault("joint_loop_pin", loop("PinJoint", _coordinates("a")), "OSIM403"),
    Fault("two_joints_same_pair", _second_knee, "OSIM404"),
    Fault(
        "self_joint",
        pattern(
            rf"({re.escape(PLANAR)}.*?<socket_parent_frame>)/bodyset/Platform<",
            r"\1/bodyset/Pelvis<",
            "<socket_child_frame>",
            PLANAR,
        ),
        "OSIM402",
    ),
    Fault(
        "reversed_root",
        pattern(
            r"<socket_parent_frame>ground_offset<(.*?)<socket_child_frame>Platform_offset<",
            r"<socket_parent_frame>Platform_offset<\1<socket_child_frame>ground_offset<",
            "<socket_child_frame>ground_offset",
        ),
        "OSIM408",
        "info",
    ),
    Fault(
        "pin_two_coords",
        pattern(
            rf"({re.escape(HIP)}.*?<coordinates>)",
            r'\1<Coordinate name="extra" />',
            "<coordinates>",
            HIP,
        ),
        "OSIM405",
    ),
    Fault(
        "planar_two_coords",
        pattern(r'<Coordinate name="Pelvis_ty">.*?</Coordinate>', "", "<coordinates>", PLANAR),
        "OSIM405",
    ),
    Fault(
        "pin_no_coords",
        pattern(rf"({re.escape(HIP)}.*?)<coordinates>.*?</coordinates>", r"\1", HIP),
        "OSIM405",
        "warning",
    ),
]

FILES = [
    Fault(
        "version_future", put("<?xml", 'Version="40600"', 'Version="99999"'), "OSIM004", "warning"
    ),
    Fault("version_old", put("<?xml", 'Version="40600"', 'Version="30000"'), "OSIM004"),
    Fault(
        "version_missing",
        put("<?xml", '<OpenSimDocument Version="40600">', "<OpenSimDocument>"),
        "OSIM004",
    ),
    Fault("version_text", put("<?xml", 'Version="40600"', 'Version="abc"'), "OSIM004"),
    Fault("xml_unclosed", _unclosed, "OSIM001"),
    Fault("xml_truncated", nowhere(lambda text: text[: len(text) // 2]), "OSIM001"),
    Fault("empty_file", nowhere(lambda text: ""), "OSIM001"),
    Fault("not_xml", nowhere(lambda text: "this is not a model\n"), "OSIM001"),
    Fault("root_wrong", tag("OpenSimDocument", "Foo", "<?xml"), "OSIM003"),
    Fault(
        "mesh_missing",
        put(
            SHANK,
            "<attached_geometry>",
            '<attached_geometry>\n<Mesh name="m"><mesh_file>nope.vtp</mesh_file></Mesh>',
            "<Mesh",
        ),
        "OSIM701",
        "warning",
    ),
    Fault(
        "prescribed_no_function",
        put(KNEE, "<range>", "<prescribed>true</prescribed><range>"),
        "OSIM513",
    ),
]

# All faults; OpenSim's reaction to each was measured.
FAULTS = [*REFERENCES, *STRUCTURE, *VALUES, *PHYSICS, *NAMES, *TOPOLOGY, *FILES]

VALID = {
    "bool_1": value("locked", "1", PLATFORM),
    "bool_True": value("locked", "True", PLATFORM),
    "hc_geom_abs_path": geometry("/contactgeometryset/RFootContact PlatformContact"),
    "mass_leading_plus": value("mass", "+2.5e0"),
    "vec3_newlines_tabs": value("location", "\n0\t-0.2175\n0\n", FOOT),
}
"""Unusual spellings that OpenSim accepts."""
