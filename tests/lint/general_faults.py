"""Faults that can be made in any model of any version, to compare verdicts with OpenSim.

The faults of `tests.lint.faults` name objects of the walker. Those of this module change the last
object of a kind, so that two of them often concern the same object.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

Change = Callable[[str], str]
"""Function from the text of a model to the faulty text.

It raises `ValueError` if the model has nothing to change.
"""

# Tags of physical parameters, as a regular expression.
PARAMETERS = (
    "stiffness|radius|max_isometric_force|optimal_fiber_length|tendon_slack_length|optimal_force|"
    "resting_length|rest_length|translational_stiffness|upper_stiffness"
)
# Tags of boolean properties, as a regular expression.
FLAGS = "locked|clamped|prescribed|isDisabled|appliesForce|isEnforced|compute_energy"


class GeneralFault(NamedTuple):
    """Fault with its name and its change of the text."""

    name: str
    change: Change


def find_last(expression: str, text: str) -> re.Match[str]:
    """Return the last match of an expression.

    Raises:
        ValueError: the text has no match.
    """
    matches = list(re.finditer(expression, text, re.DOTALL))
    if not matches:
        raise ValueError(expression)
    return matches[-1]


def write_value(tags: str, new: str | Callable[[str], str]) -> Change:
    """Return a change that gives the last property of one of the tags another text."""

    def change(text: str) -> str:
        match = find_last(rf"(<({tags})>)([^<]*)(?=</\2>)", text)
        written = new if isinstance(new, str) else new(match[3])
        return text[: match.start(3)] + written + text[match.end(3) :]

    return change


def take_out(expression: str) -> Change:
    """Return a change that removes the last match of an expression."""
    return replace_last(expression, "")


def replace_last(expression: str, new: str) -> Change:
    """Return a change that replaces the last match of an expression by a template."""

    def change(text: str) -> str:
        match = find_last(expression, text)
        return text[: match.start()] + match.expand(new) + text[match.end() :]

    return change


def rename_tag(tags: str, edit: Callable[[str], str]) -> Change:
    """Return a change that renames the last element of one of the tags."""

    def change(text: str) -> str:
        match = find_last(rf"<({tags})(?=[\s>])", text)
        tag = match[1]
        end = text.find(f"</{tag}>", match.end())
        if end < 0:
            raise ValueError(tag)
        head, inside, tail = text[: match.start()], text[match.end() : end], text[end:]
        return f"{head}<{edit(tag)}{inside}</{edit(tag)}>{tail[len(tag) + 3 :]}"

    return change


def name_objects(kind: str, text: str) -> list[str]:
    """Return the names of the objects whose tag matches an expression.

    Raises:
        ValueError: the text has no such object.
    """
    names = re.findall(rf'<(?:{kind}) name="([^"]+)"', text)
    if not names:
        raise ValueError(kind)
    return names


def write_reference(kind: str, new: Callable[[str], str]) -> Change:
    """Return a change that writes the last reference to an object of a kind in another form."""

    def change(text: str) -> str:
        names = "|".join(map(re.escape, name_objects(kind, text)))
        match = find_last(rf"<(\w+)>\s*([\w/.]*?(?:^|/|(?<=>))(?:{names}))\s*</\1>", text)
        return text[: match.start(2)] + new(match[2]) + text[match.end(2) :]

    return change


def rename_last(kind: str, edit: Callable[[str], str]) -> Change:
    """Return a change that renames the last object of a kind together with all references to it."""

    def change(text: str) -> str:
        name = name_objects(kind, text)[-1]
        return re.sub(rf'(?<=[">/\s]){re.escape(name)}(?=["</\s])', edit(name), text)

    return change


def _name_like_the_first(kind: str) -> Change:
    def change(text: str) -> str:
        names = [name for name in name_objects(kind, text) if name != "ground"]
        if len(names) < 2:
            raise ValueError(kind)
        expression = rf'(<(?:{kind}) name="){re.escape(names[-1])}"'
        return replace_last(expression, rf'\g<1>{names[0]}"')(text)

    return change


def _join_to_itself(text: str) -> str:
    child = find_last(r"<socket_child_frame>([^<]*)<", text)
    return replace_last(r"(<socket_parent_frame>)[^<]*<", rf"\g<1>{child[1]}<")(text)


def _double_last_joint(text: str) -> str:
    joint = find_last(r'<(\w+Joint) name="[^"]*">(?:(?!<\w+Joint ).)*?</\1>', text)
    copy = re.sub(r'name="([^"]*)"', r'name="\1_again"', joint[0])
    return text[: joint.end()] + copy + text[joint.end() :]


# Tags of classes, as regular expressions.
BODY, JOINT, COORDINATE = "Body", r"\w+Joint", "Coordinate"
FORCE = r"\w+(?:Force|Muscle|Actuator|Ligament)\w*"

GENERAL_FAULTS = [
    GeneralFault("body reference misspelled", write_reference(BODY, lambda name: name + "x")),
    GeneralFault("body reference in capitals", write_reference(BODY, str.swapcase)),
    GeneralFault("body reference emptied", write_reference(BODY, lambda name: "")),
    GeneralFault("body reference bare", write_reference(BODY, lambda name: name.split("/")[-1])),
    GeneralFault("coordinate reference misspelled", write_reference(COORDINATE, lambda n: n + "x")),
    GeneralFault("body referenced as ground", write_reference(BODY, lambda name: "/ground")),
    GeneralFault("joint to itself", _join_to_itself),
    GeneralFault("unknown tag", replace_last("<mass>", "<foo>1</foo><mass>")),
    GeneralFault("mass tag misspelled", rename_tag("mass", lambda tag: "mas")),
    GeneralFault("joint class misspelled", rename_tag(JOINT, lambda tag: tag + "t")),
    GeneralFault("force class misspelled", rename_tag(FORCE, lambda tag: tag + "t")),
    GeneralFault(
        "body among the forces",
        replace_last(r"(<ForceSet[^>]*>\s*<objects>)", r'\1<Body name="x"><mass>1</mass></Body>'),
    ),
    GeneralFault("force set misspelled", rename_tag("ForceSet", lambda tag: "FroceSet")),
    GeneralFault("mass twice", replace_last("(<mass>[^<]*</mass>)", r"\1<mass>7</mass>")),
    GeneralFault("default value misspelled", rename_tag("default_value", lambda tag: "defalt")),
    GeneralFault("vector of two", write_value("mass_center", "0 0.1")),
    GeneralFault("vector of four", write_value("mass_center", "0 0.1 0 5")),
    GeneralFault("vector with commas", write_value("mass_center|location", "0,0.1,0")),
    GeneralFault("vector of words", write_value("location|translation", "0 abc 0")),
    GeneralFault("inertia of words", write_value("inertia|inertia_xx", "abc")),
    GeneralFault("mass of a word", write_value("mass", "abc")),
    GeneralFault("mass with its unit", write_value("mass", "5kg")),
    GeneralFault("mass empty", write_value("mass", "")),
    GeneralFault("flag of a word", write_value(FLAGS, "yes")),
    GeneralFault("range of one", write_value("range", "0")),
    GeneralFault("range inverted", write_value("range", "1 -1")),
    GeneralFault("gravity of two", write_value("gravity", "0 -5")),
    GeneralFault("gravity of NaN", write_value("gravity", "0 NaN 0")),
    GeneralFault("mass missing", take_out("<mass>[^<]*</mass>")),
    GeneralFault("mass negative", write_value("mass", "-1")),
    GeneralFault("mass zero", write_value("mass", "0")),
    GeneralFault("inertia zero", write_value("inertia|inertia_xx", lambda old: "0 " * len(old.split()))),
    GeneralFault("inertia of no body", write_value("inertia|inertia_xx", "1 1 5 0 0 0")),
    GeneralFault("mass of NaN", write_value("mass", "NaN")),
    GeneralFault("default value of NaN", write_value("default_value", "NaN")),
    GeneralFault("parameter zero", write_value(PARAMETERS, "0")),
    GeneralFault("parameter negative", write_value(PARAMETERS, "-1")),
    GeneralFault("parameter of NaN", write_value(PARAMETERS, "NaN")),
    GeneralFault("bodies of one name", _name_like_the_first(BODY)),
    GeneralFault("coordinates of one name", _name_like_the_first(COORDINATE)),
    GeneralFault("forces of one name", _name_like_the_first(FORCE)),
    GeneralFault("body without name", replace_last(r'<Body name="[^"]*"', "<Body")),
    GeneralFault("body with a slash", rename_last(BODY, lambda name: f"a/{name}")),
    GeneralFault("coordinate with a blank", rename_last(COORDINATE, lambda name: f"a {name}")),
    GeneralFault("joint left out", take_out(r"<(\w+Joint)\s(?:(?!<\w+Joint\s).)*?</\1>")),
    GeneralFault("joint doubled", _double_last_joint),
    GeneralFault("coordinate left out", take_out(r"<Coordinate (?:(?!<Coordinate ).)*?</Coordinate>")),
    GeneralFault("path point left out", take_out(r"<(PathPoint) (?:(?!<PathPoint ).)*?</\1>")),
    GeneralFault("function without points", write_value("x|y|coefficients", "")),
    GeneralFault(
        "prescribed by nothing",
        replace_last("(</Coordinate>)", r"<prescribed>true</prescribed>\1"),
    ),
    GeneralFault("version of the future", replace_last('Version="[^"]*"', 'Version="99999"')),
    GeneralFault("version before 4", replace_last('Version="[^"]*"', 'Version="30000"')),
]  # fmt: skip
