"""Steps for documents from before version 3 of OpenSim: engines, axes, actuators, tools and loads."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import (
    Draft,
    Element,
    UpgradeError,
    find_with_child,
    get_child_text,
    get_text,
    is_true,
    list_elements,
    list_members,
    parse_reals,
)
from osimlite.io.document.xml_text import is_element
from osimlite.mechanics.laws.vectors import Vector, cross, norm, vector


def move_engine_content(draft: Draft) -> None:
    """Move the content of <DynamicsEngine> to the model.

    Later formats can express the content of Simbody's engine only.

    Raises:
        UpgradeError: the document describes its bodies for another engine than Simbody's.
    """
    model = draft.model
    if model is None:
        return
    for holder in model.findall("DynamicsEngine"):
        for engine in list_elements(holder):
            if engine.tag != "SimbodyEngine":
                lost = (
                    ", ".join(sorted({f"<{part.tag}>" for part in list_elements(engine)}))
                    or "its content"
                )
                raise UpgradeError(
                    f"document version {draft.version} describes its bodies for a <{engine.tag}>. Later formats "
                    f"cannot express this, and {lost} would be lost; export the model for Simbody with the program that wrote it",
                    draft.numbers[engine],
                )
            for part in list_elements(engine):
                draft.move(part, model)
        draft.record_change(model, location=holder)
        draft.remove(holder)


_UNIT_AXES = ("1 0 0", "0 1 0", "0 0 1")


def convert_transform_axes(draft: Draft) -> None:
    """Turn <TransformAxisSet> into a <SpatialTransform> of six axes.

    Raises:
        UpgradeError: a joint has more than three axes of rotation or of translation.
    """
    for joint, old in find_with_child(draft.find_tagged("CustomJoint"), "TransformAxisSet"):
        # Old axes say whether they rotate; new ones know by their order, rotations first.
        axes_by_type: dict[str, list[Element]] = {"rotation": [], "translation": []}
        for axis in list_members(old):
            axes_by_type[
                "rotation" if is_true(get_child_text(axis, "is_rotation") or "") else "translation"
            ].append(axis)
        spatial = draft.add(joint, "SpatialTransform", source=old)
        for kind, axes in axes_by_type.items():
            if len(axes) > 3:
                raise UpgradeError(
                    f"joint '{joint.get('name')}' has {len(axes)} axes of {kind}; a joint has at most three; "
                    "the others would be lost",
                    draft.numbers[axes[3]],
                )
            # A joint has six axes in the new format, and missing ones must be independent.
            directions = _complete_directions([get_child_text(axis, "axis") for axis in axes])
            for index, direction in enumerate(directions):
                name = f"{kind}{index + 1}"
                if index < len(axes):
                    _move_axis(draft, axes[index], spatial, name)
                else:
                    padding = draft.add(spatial, "TransformAxis", source=old, name=name)
                    draft.add(padding, "axis", direction, source=old)
        draft.remove(old)
        draft.record_change(joint, location=old)


def _move_axis(draft: Draft, axis: Element, spatial: Element, name: str) -> None:
    """Move an axis to the <SpatialTransform> under its new name."""
    axis.set("name", name)
    draft.rename_child(axis, "coordinate", "coordinates")
    flag = axis.find("is_rotation")
    if flag is not None:
        draft.remove(flag)
    draft.move(axis, spatial)


def _complete_directions(document_texts: list[str | None]) -> list[str]:
    """Return the texts of three independent directions that begin with those of the document."""
    directions = [
        vector(parse_reals(text, 3) or parse_reals(unit, 3), 0)
        for text, unit in zip(document_texts, _UNIT_AXES, strict=False)
    ]
    texts = [text or unit for text, unit in zip(document_texts, _UNIT_AXES, strict=False)]
    if not directions:
        return [*_UNIT_AXES]
    if len(directions) == 1:
        # The second direction is Y, or Z if the first is nearly Y.
        second = (0.0, 1.0, 0.0) if abs(abs(directions[0][1]) - 1) >= 1e-4 else (0.0, 0.0, 1.0)
        directions.append(second)
        texts.append(" ".join(f"{value:g}" for value in second))
        texts.append(_compute_normal(second, directions[0]))
    elif len(directions) == 2:
        texts.append(_compute_normal(directions[0], directions[1]))
    return texts


def _compute_normal(left: Vector, right: Vector) -> str:
    """Return the text of the unit vector normal to two vectors."""
    normal = cross(left, right)
    length = norm(normal)
    # Adding 0.0 turns -0.0 into 0.0.
    return " ".join(repr(value / length + 0.0) for value in normal) if length else "0 0 1"


_LOCATION_TAGS = ("XAttachment", "YAttachment", "ZAttachment")


def apply_scale_factors(draft: Draft) -> None:
    """Multiply the functions of custom joints and moving points by <scale_factors>.

    Along an oblique axis the factor is the sum of the factors, each times the component of the
    axis, as OpenSim scales now. A translation without a function, or equal to its coordinate, is
    not scaled.
    """
    for joint, factors in find_with_child(draft.find_tagged("CustomJoint"), "scale_factors"):
        scales = parse_reals(get_text(factors), 3)
        # Unreadable factors stay, so that the reader reports them.
        if scales is None:
            continue
        for axis in joint.iter("TransformAxis"):
            direction = parse_reals(get_child_text(axis, "axis"), 3)
            if axis.get("name", "").startswith("translation") and direction is not None:
                x, y, z = (
                    abs(part) * factor for part, factor in zip(direction, scales, strict=True)
                )
                _add_multiplier(draft, axis.find("function"), x + y + z, factors)
        draft.record_change(joint, location=factors)
        draft.remove(factors)
    for point, factors in find_with_child(draft.find_tagged("MovingPathPoint"), "scale_factors"):
        scales = parse_reals(get_text(factors), 3)
        if scales is None:
            continue
        for tag, scale in zip(_LOCATION_TAGS, scales, strict=True):
            _add_multiplier(draft, point.find(tag), scale, factors)
        draft.record_change(point, location=factors)
        draft.remove(factors)


def _add_multiplier(draft: Draft, holder: Element | None, scale: float, source: Element) -> None:
    """Replace the function in `holder` by its product with `scale`."""
    functions = [] if holder is None else list_elements(holder)
    # A factor of 1 changes nothing, and would only lengthen the file.
    if holder is None or not functions or scale == 1.0:
        return
    function = functions[0]
    # OpenSim scales no translation that equals its coordinate.
    if function.tag == "LinearFunction" and parse_reals(
        get_child_text(function, "coefficients"), 2
    ) == [
        1.0,
        0.0,
    ]:
        return
    product = draft.add(holder, "MultiplierFunction", source=function)
    draft.move(function, draft.add(product, "function", source=function))
    draft.add(product, "scale", repr(scale), source=source)


_SPRINGS = [
    f"body{number}_{kind}_corrective_spring_active"
    for number in (1, 2)
    for kind in ("linear", "torsional")
]


def convert_tool_controls(draft: Draft) -> None:
    """Turn the <controls_file> of a tool and its corrective springs into controllers."""
    for tool in draft.find_all("AbstractTool"):
        file = tool.find("controls_file")
        if file is not None:
            if get_text(file) not in ("", "Unassigned"):
                draft.move(
                    file,
                    draft.add(_get_controllers(draft, tool), "ControlSetController", source=file),
                )
            else:
                draft.remove(file)
            draft.record_change(tool)
        spring = next((result for tag in _SPRINGS if (result := tool.find(tag)) is not None), None)
        if spring is not None and tool.tag == "ForwardTool":
            controller = draft.add(
                _get_controllers(draft, tool), "CorrectionController", source=spring
            )
            # The gains that OpenSim's upgrade sets.
            draft.add(controller, "kp", "16", source=spring)
            draft.add(controller, "kv", "8", source=spring)
            draft.record_change(
                tool,
                location=spring,
                lost="corrective springs, which a CorrectionController replaces",
            )
            for tag in _SPRINGS:
                for child in tool.findall(tag):
                    draft.remove(child)


def _get_controllers(draft: Draft, tool: Element) -> Element:
    """Return the list of controllers of a tool; create it if it is missing."""
    controllers = tool.find("ControllerSet")
    if controllers is None:
        controllers = draft.add(tool, "ControllerSet", source=tool, name="Controllers")
    return draft.get_list(controllers, "objects", source=controllers)


_NEW_TAGS = {
    "PointActuator": {"body_B": "body", "point_B": "point", "direction_A": "direction"},
    "TorqueActuator": {"body_A": "bodyB", "body_B": "bodyA", "direction_A": "axis"},
}


_VECTOR = {"PointActuator": ("direction", "1 0 0"), "TorqueActuator": ("axis", "0 0 1")}


"""Vector of each actuator and its default: direction of the force, axis of the torque."""


def convert_actuator_bodies(draft: Draft) -> None:
    """Name the body that a point or torque actuator acts on, and reverse its direction.

    The old direction is expressed in the frame of the reaction body, which is ground by default.
    OpenSim sets force_is_global too, but does not print it. It reverses the direction whenever the
    version is old, even if the tags are new, so that a set of actuators without a version pushes
    backwards.
    """
    # Version 2 named the reaction body first.
    for actuator in draft.find_tagged(*_NEW_TAGS):
        for child in list_elements(actuator):
            if child.tag in _NEW_TAGS[actuator.tag]:
                draft.rename(child, _NEW_TAGS[actuator.tag][child.tag])
        tag, default = _VECTOR[actuator.tag]
        vector = actuator.find(tag)
        if vector is None:
            vector = draft.add(actuator, tag, default, source=actuator)
        vector.text = _reverse_signs(vector)
        lost = None
        if actuator.tag == "PointActuator":
            reacting = actuator.find("body_A")
            if reacting is not None:
                name = get_text(reacting)
                # Reaction on ground is what the new format means.
                lost = None if name in ("", "ground") else f"that the force reacts on '{name}'"
                draft.remove(reacting)
            # The old default is "true", the new one "false".
            if actuator.find("force_is_global") is None:
                draft.add(actuator, "force_is_global", "true", source=actuator)
        draft.record_change(actuator, lost=lost)


def _reverse_signs(element: Element) -> str:
    """Return the text of a vector with every sign reversed."""
    return " ".join(
        word[1:] if word.startswith("-") else "-" + word.lstrip("+")
        for word in get_text(element).split()
    )


_ANALYSIS_TAGS = ("on", "in_degrees", "step_interval", "start_time", "end_time")


_ABSTRACT_TOOL_TAGS = ("output_precision", "initial_time", "final_time")


def report_external_loads(draft: Draft) -> None:
    """Report measured loads, which need a document of ExternalLoads.

    OpenSim writes that document; osimlite changes no other file.
    """
    for tool in draft.find_all("AbstractTool"):
        file = get_child_text(tool, "external_loads_file") or "Unassigned"
        bodies = [get_child_text(tool, f"external_loads_body{number}") for number in (1, 2)]
        if file != "Unassigned" and not file.endswith(".xml"):
            bodies_text = " and ".join(body for body in bodies if body) or "no body"
            draft.record_change(
                tool,
                lost=f"external_loads_file {file} acts on {bodies_text}: write a file of ExternalLoads and name it instead",
            )


def move_first_trial(draft: Draft) -> None:
    """Move the settings of the first trial of inverse kinematics to the tool."""
    for tool in draft.find_tagged("InverseKinematicsTool"):
        trials = tool.find("IKTrialSet")
        result = [] if trials is None else trials.findall("objects/IKTrial")
        if trials is None or not result:
            # OpenSim accepts a tool that is the root of its file.
            # The root has no old counterpart if a new program wrote it.
            if draft.numbers[tool]:
                draft.record_refusal(
                    tool,
                    tool,
                    "an InverseKinematicsTool without an IKTrialSet, which old versions had",
                )
            continue
        for child in list(result[0]):
            if is_element(child):
                draft.move(child, tool)
            else:
                # Comments move with their trial.
                tool.append(child)
        for surplus_trial in result[1:]:
            draft.record_change(
                tool, location=surplus_trial, lost=f"the trial '{surplus_trial.get('name', '')}'"
            )
        draft.add(tool, "constraint_weight", "20", source=trials)
        # Defaults of the old version, which differ from the present ones.
        draft.add(tool, "accuracy", "1e-05" if draft.version == 10500 else "0.0001", source=trials)
        optimizer = tool.find("optimizer_algorithm")
        if optimizer is not None:
            draft.remove(optimizer)
        draft.remove(trials)
        draft.record_change(tool)


def convert_inverse_dynamics(draft: Draft) -> None:
    """Turn an AnalyzeTool with the analysis InverseDynamics into an InverseDynamicsTool."""
    for tool in draft.find_tagged("InverseDynamicsTool"):
        if draft.numbers[tool]:
            draft.record_refusal(
                tool, tool, "an InverseDynamicsTool, which old versions called AnalyzeTool"
            )
    for tool in draft.find_tagged("AnalyzeTool"):
        analyses = tool.find("AnalysisSet/objects")
        analysis = None if analyses is None else analyses.find("InverseDynamics")
        if analyses is None or analysis is None:
            continue
        uses_forces = is_true(get_child_text(analysis, "use_model_force_set") or "false")
        # Times without a value have the old defaults.
        times = " ".join(
            get_child_text(tool, tag) or default
            for tag, default in (("initial_time", "0"), ("final_time", "1"))
        )
        for child in list_elements(analysis):
            if child.tag not in (*_ANALYSIS_TAGS, "use_model_force_set"):
                draft.move(child, tool)
        for child in list_elements(tool):
            if child.tag in _ABSTRACT_TOOL_TAGS:
                draft.remove(child)
        draft.add(tool, "time_range", times, source=analysis)
        # The old analysis computed moments without muscles unless it was told otherwise.
        draft.add(tool, "forces_to_exclude", "" if uses_forces else "Muscles", source=analysis)
        draft.add(
            tool,
            "output_gen_force_file",
            f"{tool.get('name', '')}_InverseDynamics.sto",
            source=analysis,
        )
        for other in list_elements(analyses):
            if other is not analysis:
                draft.record_change(
                    tool,
                    location=other,
                    lost=f"the analysis {other.tag}, which needs a separate tool",
                )
        for analysis_set in tool.findall("AnalysisSet"):
            draft.remove(analysis_set)
        draft.rename(tool, "InverseDynamicsTool")
        draft.record_change(tool)


def convert_geometry_files(draft: Draft) -> None:
    """Turn every file in <geometry_files> into a <Mesh>."""
    for body, visible in find_with_child(draft.find_tagged("Body", "Ground"), "VisibleObject"):
        attached = draft.add(body, "attached_geometry", source=visible)
        files = visible.find("geometry_files")
        source = visible if files is None else files
        scale = get_child_text(visible, "scale_factors") or "1 1 1"
        # OpenSim names the meshes in this way.
        for count, file in enumerate((get_child_text(visible, "geometry_files") or "").split()):
            mesh = draft.add(
                attached, "Mesh", source=source, name=f"{body.get('name', '')}_geom_{count}"
            )
            draft.add(mesh, "socket_frame", "..", source=source)
            draft.add(mesh, "scale_factors", scale, source=source)
            draft.add(mesh, "mesh_file", file, source=source)
        has_transform = any(parse_reals(get_child_text(visible, "transform"), 6) or ())
        draft.record_change(
            body,
            location=visible,
            lost="the position of the shown geometry in the body" if has_transform else None,
        )
        draft.remove(visible)


_IDENTIFIERS = {
    "forceFunctions": "force_identifier",
    "pointFunctions": "point_identifier",
    "torqueFunctions": "torque_identifier",
}


def convert_external_forces(draft: Draft) -> None:
    """Turn each PrescribedForce of ExternalLoads into an ExternalForce in ground."""
    for loads in draft.find_tagged("ExternalLoads"):
        for force in list(list_members(loads)):
            if force.tag != "PrescribedForce":
                draft.record_refusal(
                    loads,
                    force,
                    f"ExternalLoads of versions before 20301 cannot contain the class {force.tag}",
                )
                continue
            body = force.find("body")
            draft.add(
                force, "applied_to_body", "" if body is None else get_text(body), source=force
            )
            for frame in ("force", "point"):
                draft.add(force, f"{frame}_expressed_in_body", "ground", source=force)
            for tag, identifier in _IDENTIFIERS.items():
                functions = _find_functions(force, tag)
                first = (
                    ""
                    if functions is None
                    else next(
                        (function.get("name", "") for function in list_members(functions)), ""
                    )
                )
                # "#" stands for a column by its number.
                if first.startswith("#"):
                    draft.record_change(
                        force,
                        location=functions,
                        lost=f"the columns from {first} on, which have no labels; give them labels",
                    )
                    first = ""
                # The identifier is the label without its last letter, the axis.
                draft.add(force, identifier, first[:-1], source=force)
                if functions is not None:
                    draft.remove(functions)
            if body is not None:
                draft.remove(body)
            draft.record_refusal(
                loads,
                force,
                "a PrescribedForce among ExternalLoads, as old versions wrote them, is refused",
            )
            draft.rename(force, "ExternalForce")
            draft.record_change(force)


def _find_functions(force: Element, name: str) -> Element | None:
    """Return the <FunctionSet> with a name, or None."""
    return next(
        (child for child in force.findall("FunctionSet") if child.get("name") == name), None
    )


def collect_muscle_paths(draft: Draft) -> None:
    """Move the points and wraps of a muscle to its <GeometryPath>."""
    for muscle in draft.find_all("Muscle"):
        # Some version 2 files have paths already.
        if muscle.find("GeometryPath") is not None:
            continue
        parts = [
            part
            for tag in ("PathPointSet", "PathWrapSet")
            if (part := muscle.find(tag)) is not None
        ]
        path = draft.add(muscle, "GeometryPath", source=parts[0] if parts else muscle)
        for part in parts:
            draft.move(part, path)
        draft.record_change(muscle)


def rename_replaced_forces(draft: Draft) -> None:
    """Rename <replace_actuator_set> of a tool to <replace_force_set>."""
    draft.rename_properties("AbstractTool", {"replace_actuator_set": "replace_force_set"})


def rename_force_files(draft: Draft) -> None:
    """Rename <actuator_set_files> of a tool to <force_set_files>."""
    draft.rename_properties("AbstractTool", {"actuator_set_files": "force_set_files"})


def rename_conditional_coordinates(draft: Draft) -> None:
    """Rename <coordinates> of a ConditionalPathPoint to <coordinate>."""
    draft.rename_properties("ConditionalPathPoint", {"coordinates": "coordinate"})


def rename_pennation_angles(draft: Draft) -> None:
    """Rename <pennation_angle> of a muscle to <pennation_angle_at_optimal>."""
    draft.rename_properties("Muscle", {"pennation_angle": "pennation_angle_at_optimal"})


def rename_moving_locations(draft: Draft) -> None:
    """Rename <XAttachment> of a MovingPathPoint to <x_location>, and so for y and z."""
    draft.rename_properties(
        "MovingPathPoint",
        {"XAttachment": "x_location", "YAttachment": "y_location", "ZAttachment": "z_location"},
    )
