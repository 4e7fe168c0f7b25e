"""OSIM83x: what a setup names in the model of its tool."""

from __future__ import annotations

from functools import partial

from osimlite.lint.engine import ERROR, WARNING, Found, rule
from osimlite.lint.setup import Setup, is_of
from osimlite.lint.words import called, nearest_name
from osimlite.schema.base import Unknown
from osimlite.schema.fields import Reference
from osimlite.schema.specs import reference_specs
from osimlite.schema.states import variables
from osimlite.text import listed

_IN_MODEL = {
    "coordinate-name": "coordinate",
    "body-name": "body",
    "body-name-or-com": "body",
    "joint-name": "joint",
    "actuator-name": "actuator",
    "muscle-name": "muscle",
    "marker-name": "marker",
    "frame-path-or-body-name": "frame",
    "frame-path-or-member": "frame",
    "model-path": "",
    "state-path": "",
    "pattern": "",
}
"""The rules of references that lead into the model, with what they lead to if that is not said by the reference."""
WORDS = {
    "bodies": {"all", "center_of_mass"},
    "body_names": {"all", "center_of_mass"},
    "coordinates": {"all"},
    "coordinate_names": {"all"},
    "muscle_list": {"all"},
    "moment_arm_coordinate_list": {"all"},
    "joints_to_report_body_forces": {"ALL"},
    "joint_names": {"ALL"},
    "express_in_frame": {"child", "parent", "ground"},
    "relative_to_body_name": {"none", "ground"},
    "body_name": {"ground"},
    "wrt_body": {"center_of_mass", "-1"},
    "express_body": {"ground", "-1"},
    "forces_to_exclude": {"ALL", "ACTUATORS", "MUSCLES"},
}
"""What a property takes besides names."""
_UNUSED = {"CMC_Joint": ("wrt_body", "express_body")}
"""What a class has from its base and does not use."""
_SETS = {"Marker": "/markerset", "Force": "/forceset"}
"""Where in the model stands what a tool adds to it; relative paths start there."""
_SILENT = {
    "muscle_list",
    "moment_arm_coordinate_list",
    "joint_names",
    "joints_to_report_body_forces",
    "relative_to_body_name",
    "force_expressed_in_body",
    "point_expressed_in_body",
    "markers",
    "actuator_list",
    "actuators_to_exclude",
    "segment",
}
"""Properties of which OpenSim leaves out what it does not find."""
_SILENT_CLASSES = ("IKMarkerTask", "BodyScale", "ControlSetController")
"""Classes of which it does so."""


@rule("OSIM831", "unknown-name", severity=ERROR, mends="both", about="document")
def unknown_name(setup: Setup, found: Found) -> None:
    """A setup names what the model of its tool does not have.

    ## What it does
    Looks up every marker, coordinate, body, joint, muscle and actuator that a setup, or a set that a setup reads, names
    in the model of the tool, with the sets of forces and markers that the tool adds to it. In studies of Moco also
    states, controls and outputs, by their paths or by patterns of them.

    ## Why is this bad
    Most tools refuse the setup, some crash. Tasks of markers, scale factors of bodies, muscles of an analysis that are
    not there are left out without a word, and so are patterns that nothing matches (warnings).

    ## Example
    ```setup
    <OpenSimDocument Version="40600">
        <AnalyzeTool name="analyze">
            <model_file>leg.osim</model_file>
            <coordinates_file>leg.mot</coordinates_file>
            <AnalysisSet name="Analyses">
                <objects> <BodyKinematics name="bk"> <bodies>thigh shnak</bodies> </BodyKinematics> </objects>
            </AnalysisSet>
        </AnalyzeTool>
    </OpenSimDocument>
    ```

    ## Use instead
    ```setup
    <OpenSimDocument Version="40600">
        <AnalyzeTool name="analyze">
            <model_file>leg.osim</model_file>
            <coordinates_file>leg.mot</coordinates_file>
            <AnalysisSet name="Analyses">
                <objects> <BodyKinematics name="bk"> <bodies>thigh shank</bodies> </BodyKinematics> </objects>
            </AnalysisSet>
        </AnalyzeTool>
    </OpenSimDocument>
    ```
    """
    tree = setup.tree
    if tree is None:
        return
    unknown = {item.name for item in tree.by_class.get(Unknown, ())}
    model = tree.model
    known: dict[tuple[str, str], set[str]] = {}
    off = {id(part) for goal in setup.named("MocoGoal") if not goal.enabled for part in goal.walk()}
    for cls, items in setup.by_class.items():
        for spec in reference_specs(cls) if is_of(items[0], "Force") else ():
            what = _IN_MODEL.get(spec.kind.rule) if isinstance(spec.kind, Reference) and spec.kind.required else None
            for item in items if what else ():
                if getattr(item, spec.name) in ("", None):
                    found(f"{called(item)} names no {what}: OpenSim refuses it", item, tag=spec.tag)
    for use in setup.uses:
        item, kind, tag, text = use.holder, use.reference, use.spec.tag, str(use.value).strip()
        what = _IN_MODEL.get(kind.rule)
        if what == "":
            what = kind.target
        if kind.rule == "socket" and kind.target.endswith("Frame"):
            # Relative paths start where the model has what is added to it.
            base = next((f"{path}/{item.name}" for cls, path in _SETS.items() if is_of(item, cls)), "")
            if not (base or text.startswith("/")) or tree.walk(text, base, kind.target).target is not None:
                continue
            what = "component"
        elif kind.rule == "socket" and is_of(item, "Controller"):
            what = "actuator"
            text = text.rpartition("/")[2]
        elif what == "output" and kind.rule == "state-path" and not text.startswith("/"):
            text = f"/{text}"
        if tag in _UNUSED.get(type(item).__name__, ()):
            continue
        if what is None or not text or text in WORDS.get(tag, ()) or text.lower() == "unassigned":
            continue
        if is_of(item, "ObjectGroup") or (is_of(item, "Controller") and text == "ALL"):
            continue
        if id(item) in off or not vars(item).get("on", True) or not vars(item).get("apply", True):
            continue
        reference = kind if kind.rule != "body-name-or-com" else Reference("body-name", "Body")
        if tree.lookup(reference, text, model).target is not None:
            continue
        if what == "frame" and tree.lookup(Reference("model-path", "Frame"), text, model).target is not None:
            continue
        key = (what, kind.target)
        if key not in known:
            known[key] = (
                set()
                if what == "component"
                else set(variables(tree, what))
                if not _IN_MODEL.get(kind.rule)
                else setup.names_of({"body": "Body", "frame": "Body", "joint": "Joint"}.get(what, kind.target))
            )
        names = known[key]
        if text in names or not unknown.isdisjoint(text.split("/")) or _is_made(setup, text):
            continue
        silent = tag in _SILENT or any(map(partial(is_of, item), _SILENT_CLASSES))
        silent = not use.spec.names.refused if use.spec.names is not None else silent
        fate = "OpenSim leaves it out" if silent else "OpenSim refuses it"
        more = "; it is written in small letters" if text == "ALL" else ""
        of_name = tag == "@name"
        found(
            f"the model has no {what} '{text}', which {called(item)} names: {fate}{more}",
            item, tag=None if of_name else tag, word=None if of_name else text,
            attribute="name" if of_name else None, severity=WARNING if silent else None,
            suggestion="all" if more else nearest_name(text, sorted(names)),
        )  # fmt: skip
    if setup.tool is not None and is_of(setup.tool[1], "AbstractTool"):
        # Of tools that follow a motion these are bounds, and go by the whole name.
        follows = hasattr(setup.tool[1], "desired_kinematics_file")
        fate = "OpenSim leaves it out" if follows else "OpenSim refuses it"
        plain = setup.names_of("Actuator") | unknown
        actuators = {f"{name}.excitation" for name in plain} | (set() if follows else plain)
        for control in setup.named("Control") if plain else ():
            if control.name not in actuators:
                found(
                    f"the model has no actuator for {called(control)}: {fate}", control, attribute="name",
                    severity=WARNING if follows else None, suggestion=nearest_name(control.name, sorted(actuators)),
                )  # fmt: skip
            elif not follows and getattr(control, "x_nodes", None) == []:
                found(f"{called(control)} has no nodes: OpenSim fails", control, tag="x_nodes")
            elif follows and not control.is_model_control:
                found(
                    f"{called(control)} bounds no control of the model: OpenSim fails", control, tag="is_model_control"
                )
        for controller in setup.named("ControlSetController") if plain else ():
            table = setup.table(controller.controls_file)
            lost = [column for column in table.columns if column not in actuators] if table is not None else []
            if lost:
                found(
                    f"the model has no actuator for the columns {listed(map(repr, lost))} of "
                    f"'{controller.controls_file}': OpenSim refuses it",
                    controller, tag="controls_file",
                )  # fmt: skip


def _is_made(setup: Setup, text: str) -> bool:
    """Whether the operators that a study lets loose on its model may make what has this path."""
    makes = {type(operator).__name__ for operator in setup.named("ModelOperator")}
    return ("ModOpAddReserves" in makes and "/reserve_" in text) or (
        "ModOpReplaceMusclesWithDeGrooteFregly2016" in makes and text.endswith("/normalized_tendon_force")
    )


@rule("OSIM832", "excluded-force", severity=WARNING, mends="unsafe", about="document")
def excluded_force(setup: Setup, found: Found) -> None:
    """Inverse dynamics is told to leave out a force that there is not.

    ## What it does
    Compares `forces_to_exclude` with the words OpenSim knows (ALL, ACTUATORS, MUSCLES), the groups of the model's
    forces, and, where there is no group, with the names of the forces: of a model with groups OpenSim looks at groups
    alone. An empty list is pointed out where the model has muscles.

    ## Why is this bad
    The force takes part: moments of the joints are without what the passive muscles give.

    ## Example
    ```setup
    <OpenSimDocument Version="40600">
        <InverseDynamicsTool name="id">
            <model_file>leg.osim</model_file>
            <forces_to_exclude>Musles</forces_to_exclude>
            <coordinates_file>leg.mot</coordinates_file>
        </InverseDynamicsTool>
    </OpenSimDocument>
    ```

    ## Use instead
    ```setup
    <OpenSimDocument Version="40600">
        <InverseDynamicsTool name="id">
            <model_file>leg.osim</model_file>
            <forces_to_exclude>Muscles</forces_to_exclude>
            <coordinates_file>leg.mot</coordinates_file>
        </InverseDynamicsTool>
    </OpenSimDocument>
    ```
    """
    tree = setup.tree
    if tree is None:
        return
    forces = tree.model.force_set
    groups = [group.name for group in forces.groups]
    names = [force.name for force in forces.objects]
    for tool in setup.named("InverseDynamicsTool"):
        if not tool.forces_to_exclude and any(is_of(force, "Muscle") for force in forces.objects):
            found(f"{called(tool)} leaves out no force: muscles take part", tool, tag="forces_to_exclude")
        for word in tool.forces_to_exclude:
            if word.upper() in ("ALL", "ACTUATORS", "MUSCLES") or word in (groups or names):
                continue
            why = "; the model has groups, and of forces with groups OpenSim looks at the groups alone"
            found(
                f"the model has no force or group of forces '{word}'{why if word in names else ''}: OpenSim leaves "
                "nothing out for it",
                tool, tag="forces_to_exclude", word=word,
                suggestion=nearest_name(word, ["MUSCLES", "ACTUATORS", "ALL", *groups, *([] if groups else names)]),
            )  # fmt: skip
