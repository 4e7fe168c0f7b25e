"""OSIM83x: names in a setup that refer to the model of its tool."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from osimlite.base.text import join_words
from osimlite.lint.checked import LocationArguments
from osimlite.lint.registry import ERROR, WARNING, FindingCollector, rule
from osimlite.lint.setup import Setup
from osimlite.lint.words import describe_object, find_nearest_name
from osimlite.schema.base import Component, Object, Unknown
from osimlite.schema.fields import Reference
from osimlite.schema.specs import get_reference_specs
from osimlite.schema.states import find_variables
from osimlite.schema.tree import Tree, Use, is_a

_PART_CLASSES = ("actuator", "body", "coordinate", "frame", "joint", "marker", "muscle")
"""Beginnings of the names of reference rules that search a name in one part of the model."""
_PATHS = ("model-path", "state-path", "pattern")
"""Other reference rules that lead from a setup into the model, with any target."""
_CONSEQUENCES = {
    "refused": ("OpenSim rejects it", None),
    "left out": ("OpenSim ignores it", WARNING),
}
_SET_PATHS = {"Marker": "/markerset", "Force": "/forceset", "Controller": "/controllerset"}
"""Paths in the model of the sets to which tools add components; relative paths start there."""


@rule("OSIM831", "unknown-name", severity=ERROR, fixes="both", about="document")
def report_unknown_name(setup: Setup, report: FindingCollector) -> None:
    """A setup refers to something that the model of its tool does not have.

    Checks whether the model of the tool has every marker, coordinate, body, joint, muscle and
    actuator that the setup names. Names in set files that the setup reads are checked, too. Forces
    and markers that the tool adds count as parts of the model. In Moco studies the rule also checks
    the states, controls and outputs that the study names by path or pattern.

    Most tools reject the setup, some crash. OpenSim ignores missing markers of tasks, bodies of
    scale factors and muscles of an analysis without a message, and patterns without a match. These
    findings are warnings.

    ```setup
      <AnalyzeTool name="analyze">
          <model_file>leg.osim</model_file>
          <coordinates_file>leg.mot</coordinates_file>
          <AnalysisSet name="Analyses">
    -         <objects> <BodyKinematics name="bk"> <bodies>thigh shnak</bodies> </BodyKinematics> </objects>
    +         <objects> <BodyKinematics name="bk"> <bodies>thigh shank</bodies> </BodyKinematics> </objects>
          </AnalysisSet>
      </AnalyzeTool>
    ```
    """
    tree = setup.tree
    if tree is None:
        return
    # Parts of disabled goals are not looked up by OpenSim.
    disabled_parts = {
        id(part)
        for goal in setup.find_by_class("MocoGoal")
        if not goal.enabled
        for part in goal.walk()
    }

    def counts(item: Any) -> bool:
        # OpenSim looks up the coordinates of all tasks of RRA and CMC, also of those that are off.
        return is_a(item, "TrackingTask") or (
            id(item) not in disabled_parts
            and vars(item).get("on", True)
            and vars(item).get("apply", True)
        )

    for cls, items in setup.by_class.items():
        for spec in get_reference_specs(cls):
            kind = spec.reference
            target_kind = (
                _get_target_class(kind) if kind.required and kind.shape != "list" else None
            )
            for item in items if target_kind else ():
                if getattr(item, spec.name) in ("", None) and counts(item):
                    consequence, severity = _CONSEQUENCES[kind.consequence]
                    report(
                        f"{describe_object(item)} names no {target_kind}: {consequence}",
                        item,
                        tag=spec.tag,
                        severity=severity,
                    )
    # An object of an unknown class may be what is named.
    unknown = {item.name for item in tree.by_class.get(Unknown, ())}

    @cache
    def list_known_names(target_kind: str, rule: str) -> set[str]:
        if rule in _PATHS:
            return set(find_variables(tree, target_kind))
        # Actuators may be named by their path in the force set.
        if target_kind == "Actuator":
            return {
                *find_variables(tree, target_kind),
                *(f"/forceset/{name}" for name in setup.list_names(target_kind)),
            }
        return (
            set()
            if target_kind == "component"
            else setup.list_names({"frame": "Body"}.get(target_kind, target_kind.capitalize()))
        )

    for use in setup.uses:
        # References that OpenSim does not look up at all are no finding.
        item = use.holder
        kind = use.reference
        text = str(use.value).strip()
        if (
            not text
            or text.lower() == "unassigned"
            or kind.accepts_word(text)
            or kind.consequence == "ignored"
        ):
            continue
        if not counts(item):
            continue
        target_kind, text, target = _look_up_text(setup, tree, use, text)
        if target_kind is None or target is not None:
            continue
        names = list_known_names(target_kind, kind.rule)
        # 1. Known names; 2. parts of unknown objects; 3. what operators of the study will create.
        if (
            text in names
            or not unknown.isdisjoint(text.split("/"))
            or _is_made_by_operators(setup, text)
        ):
            continue
        # Of names in the older <actuator_list> only those are missed that are to have a function
        # each.
        is_lost = (
            kind.rule == "socket"
            and target_kind == "actuator"
            and not is_a(item, "PrescribedController")
        )
        consequence, severity = _CONSEQUENCES["left out" if is_lost else kind.consequence]
        hint = "; write it in lower case" if text.lower() in kind.words else ""
        position: LocationArguments = {"tag": use.spec.tag, "word": text}
        if use.spec.tag == "@name":
            position = {"attribute": "name"}
            # Names that other objects of this class use already are no likely spelling.
            names = names.difference(sibling.name for sibling in setup.by_class[type(item)])
        report(
            f"{describe_object(item)} names the {target_kind} '{text}', which the model does not have: {consequence}{hint}",
            item,
            **position,
            severity=severity,
            suggestion=text.lower() if hint else find_nearest_name(text, sorted(names)),
        )
    if setup.tool is not None and is_a(setup.tool[1], "AbstractTool"):
        _look_up_controls(setup, setup.tool[1], setup.list_names("Actuator") | unknown, report)


def _get_target_class(reference: Reference) -> str | None:
    """Return the class that a reference names in the model; None if it names nothing there."""
    by_rule = (part_class for part_class in _PART_CLASSES if reference.rule.startswith(part_class))
    return reference.target if reference.rule in _PATHS else next(by_rule, None)


def _look_up_text(
    setup: Setup, tree: Tree, use: Use, text: str
) -> tuple[str | None, str, Component | None]:
    """Look up a text in the model.

    Returns:
        Class that the text should name or None, the searched text, and the component or None.
    """
    item = use.holder
    kind = use.reference
    target_kind = _get_target_class(use.reference)
    # In older formats controllers name their actuators without a path.
    if kind.rule == "socket" and kind.target == "Actuator" and setup.upgraded:
        # A name, that OpenSim looks for everywhere.
        return "actuator", text.rpartition("/")[2], None
    if kind.rule == "socket" and kind.target.endswith(("Frame", "Actuator")):
        set_path = next(
            (f"{path}/{item.name}" for cls, path in _SET_PATHS.items() if is_a(item, cls)), ""
        )
        socket_kind = kind.target if kind.target == "Actuator" else "component"
        target_kind = socket_kind if set_path or text.startswith("/") else None
        return target_kind, text, tree.walk(text, set_path, kind.target).target
    if kind.rule == "state-path" and kind.target == "output":
        # A channel and another name may follow.
        # The channel of an output, and an alias, follow after ":" or in brackets.
        text = re.sub(r"(?<=\|)([^:(]*).*", r"\1", text if text.startswith("/") else f"/{text}")
    target = tree.lookup(kind, text, tree.model).target if target_kind is not None else None
    return (
        target_kind,
        text,
        target or (tree.walk(text, "", "Frame").target if target_kind == "frame" else None),
    )


def _look_up_controls(
    setup: Setup, tool: Object, actuator_names: set[str], report: FindingCollector
) -> None:
    """Report controls, and columns of controls, without an actuator."""
    # Without a model every control would be unknown.
    if not actuator_names:
        return
    # Tools that follow a motion take these as bounds, and compare complete names.
    follows = hasattr(tool, "desired_kinematics_file")
    consequence, severity = _CONSEQUENCES["left out" if follows else "refused"]
    actuators = {f"{name}.excitation" for name in actuator_names} | (
        set() if follows else actuator_names
    )
    controls = list(setup.find_by_class("Control"))
    # A free actuator is more likely to be meant than one that has a control.
    used_actuators = actuators.intersection(control.name for control in controls)
    for control in controls:
        if control.name not in actuators:
            report(
                f"the model has no actuator for {describe_object(control)}: {consequence}",
                control,
                attribute="name",
                severity=severity,
                suggestion=find_nearest_name(control.name, sorted(actuators), used_actuators),
            )
        elif not follows and getattr(control, "x_nodes", None) == []:
            report(
                f"{describe_object(control)} has no nodes: OpenSim fails", control, tag="x_nodes"
            )
        elif follows and not control.is_model_control:
            report(
                f"{describe_object(control)} has is_model_control false, so it bounds no control: OpenSim fails",
                control,
                tag="is_model_control",
            )
    for controller, table in setup.iterate_with_tables(
        setup.find_by_class("ControlSetController"), "controls_file"
    ):
        if unknown_columns := [column for column in table.columns if column not in actuators]:
            report(
                f"the model has no actuator for the columns {join_words(map(repr, unknown_columns))} of "
                f"'{controller.controls_file}': OpenSim rejects it",
                controller,
                tag="controls_file",
            )


def _is_made_by_operators(setup: Setup, text: str) -> bool:
    """Return whether the model operators of a study may create the component with this path."""
    operator_names = {type(operator).__name__ for operator in setup.find_by_class("ModelOperator")}
    return ("ModOpAddReserves" in operator_names and "/reserve_" in text) or (
        "ModOpReplaceMusclesWithDeGrooteFregly2016" in operator_names
        and text.endswith("/normalized_tendon_force")
    )


@rule("OSIM832", "excluded-force", severity=WARNING, fixes="unsafe", about="document")
def report_excluded_force(setup: Setup, report: FindingCollector) -> None:
    """Inverse dynamics excludes a force that does not exist.

    Checks whether OpenSim finds each entry of `forces_to_exclude`. An entry is a word that OpenSim
    knows (ALL, ACTUATORS, MUSCLES) or the name of a group of forces. Names of single forces count
    only in a model without groups. An empty list is reported if the model has muscles.

    The force still acts. If muscles act, their passive forces produce a part of the joint moments,
    and the tool writes only the rest.

    ```setup
      <InverseDynamicsTool name="id">
          <model_file>leg.osim</model_file>
    -     <forces_to_exclude>Musles</forces_to_exclude>
    +     <forces_to_exclude>Muscles</forces_to_exclude>
          <coordinates_file>leg.mot</coordinates_file>
      </InverseDynamicsTool>
    ```
    """
    tree = setup.tree
    if tree is None:
        return
    forces = tree.model.force_set
    groups = [group.name for group in forces.groups]
    names = [force.name for force in forces.objects]
    for tool in setup.find_by_class("InverseDynamicsTool"):
        # Inverse dynamics with muscles computes what they leave, which is seldom meant.
        if not tool.forces_to_exclude and any(is_a(force, "Muscle") for force in forces.objects):
            report(
                f"{describe_object(tool)} excludes no force: muscles act, and their passive forces change the joint moments",
                tool,
                tag="forces_to_exclude",
            )
    for use in setup.uses:
        word = str(use.value)
        if (
            use.spec.tag != "forces_to_exclude"
            or use.reference.accepts_word(word)
            or word in (groups or names)
        ):
            continue
        # If a model has groups, OpenSim compares with their names only.
        reason = (
            f"'{word}' is a force, but the model has groups of forces, and OpenSim then searches only them"
            if word in names
            else f"the model has no force or group of forces '{word}'"
        )
        report(
            f"{reason}: OpenSim does not exclude '{word}'",
            use.holder,
            tag="forces_to_exclude",
            word=word,
            suggestion=find_nearest_name(
                word, [*use.reference.words, *groups, *([] if groups else names)]
            ),
        )
