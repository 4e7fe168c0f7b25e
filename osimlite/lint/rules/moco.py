"""OSIM86x: studies of Moco that OpenSim rejects, or cannot solve."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain
from typing import Any

from osimlite.base.quantity import LARGEST_JOINT_ANGLE
from osimlite.base.text import format_count, join_words
from osimlite.lint.posture import coordinate_name, find_angles
from osimlite.lint.registry import ERROR, WARNING, FindingCollector, rule
from osimlite.lint.setup import Setup, select_members
from osimlite.lint.table import Table
from osimlite.lint.words import describe_object, find_nearest_name
from osimlite.schema.base import Component, Unknown
from osimlite.schema.fields import Reference, Value
from osimlite.schema.specs import get_field_specs, get_file_specs, get_member_specs
from osimlite.schema.states import find_variables
from osimlite.schema.tree import Tree, is_a

_ALLOWING_FLAGS = ("allow_unused_references", "kinematics_allow_extra_columns")
"""Properties that allow a table to have columns that nothing tracks."""


@rule("OSIM861", "impossible-bounds", severity=ERROR, about="document")
def report_impossible_bounds(setup: Setup, report: FindingCollector) -> None:
    """Bounds of a study are empty or contradict each other.

    Reports bounds whose first number is larger than the second, initial and final bounds outside
    the bounds of the whole phase, and a phase that ends before it begins. Also reports a state or
    control with two sets of bounds, bounds of an angle that seem to be in degrees, and a time with
    empty bounds.

    The optimizer fails with a message that names neither the bounds nor the variable. If a variable
    has two sets of bounds, OpenSim uses the last one, without a message.

    ```setup
      <MocoPhase name="phase">
          <state_infos>
    -         <MocoVariableInfo name="/jointset/knee/knee_angle/value"> <bounds>0 -2</bounds> </MocoVariableInfo>
    +         <MocoVariableInfo name="/jointset/knee/knee_angle/value"> <bounds>-2 0</bounds> </MocoVariableInfo>
          </state_infos>
      </MocoPhase>
    ```
    """
    for item in chain.from_iterable(
        map(setup.find_by_class, ("MocoBounds", "MocoVariableInfo", "MocoScaleFactor"))
    ):
        # Initial and final bounds are intervals inside the bounds of the phase.
        for tag in ("bounds", "initial_bounds", "final_bounds"):
            ends: tuple[float, ...] = getattr(item, tag, ())
            phase_bounds: tuple[float, ...] = item.bounds
            if len(ends) == 2 and ends[0] > ends[1]:
                report(
                    f"{tag} run from {ends[0]:g} down to {ends[1]:g}: OpenSim fails", item, tag=tag
                )
            # Reversed bounds of the phase have a finding of their own.
            elif (
                ends
                and phase_bounds
                and phase_bounds[0] <= phase_bounds[-1]
                and (ends[-1] < phase_bounds[0] or ends[0] > phase_bounds[-1])
            ):
                report(
                    f"{tag} of {describe_object(item)} are outside its bounds from {phase_bounds[0]:g} "
                    f"to {phase_bounds[-1]:g}: OpenSim fails",
                    item,
                    tag=tag,
                )
    angles = find_angles(setup)
    for phase in setup.find_by_class("MocoPhase"):
        for info in select_members(phase.state_infos, "MocoVariableInfo"):
            bounds = (*info.bounds, *info.initial_bounds, *info.final_bounds)
            largest = max(filter(math.isfinite, map(abs, bounds)), default=0.0)
            if (
                info.name.endswith("/value")
                # Bounds of speeds and of translations may well be larger.
                and coordinate_name(info.name) in angles
                and largest > LARGEST_JOINT_ANGLE
            ):
                report(
                    f"a bound of {largest:g} for the angle '{info.name}' is read in radians: is "
                    "it in degrees?",
                    info,
                    severity=WARNING,
                )
        for bounds in (phase.time_initial_bounds, phase.time_final_bounds):
            # Only a time that the setup writes without bounds; the default of Moco has none either.
            if bounds._index and not bounds.bounds:
                report(
                    "a time without bounds is free: the optimizer seldom converges",
                    bounds,
                    severity=WARNING,
                )
        starts, ends = phase.time_initial_bounds.bounds, phase.time_final_bounds.bounds
        if starts and ends and ends[-1] < starts[0]:
            report(
                f"the phase must end at {ends[-1]:g} s or earlier, but must begin at {starts[0]:g} s or later",
                phase.time_final_bounds,
                tag="bounds",
            )
        for infos in (phase.state_infos, phase.control_infos, phase.input_control_infos):
            for info in _find_repeated(infos):
                report(
                    f"'{info.name}' already has bounds: OpenSim uses these instead",
                    info,
                    attribute="name",
                    severity=WARNING,
                )


def _find_repeated(items: list[Any]) -> Iterator[Any]:
    """Yield the objects whose name an earlier object has."""
    names: set[str] = set()
    for item in items:
        if item.name in names:
            yield item
        names.add(item.name)


_COUNTED = (
    "states",
    "controls",
    "multipliers",
    "derivatives",
    "slacks",
    "parameters",
    "input_controls",
)
"""Types of columns of a trajectory that the header must count; the last one is optional."""


@rule("OSIM862", "study-data", severity=ERROR, about="document")
def report_study_data(setup: Setup, report: FindingCollector) -> None:
    """A table that a study tracks, or uses as initial guess, does not fit its model.

    Checks for missing table names, for motions without `inDegrees`, and for times outside a table.
    Also checks for columns that are not a state, control, generalized force or marker of the model,
    and for states and controls that are missing in an initial guess.

    OpenSim rejects the study.

    ```setup
      <MocoStudy name="study">
          <MocoProblem name="problem">
              <MocoPhase name="phases">
                  <ModelProcessor name="model"> <filepath>leg.osim</filepath> </ModelProcessor>
                  <goals>
                      <MocoStateTrackingGoal name="follow">
    -                     <TableProcessor name="reference"> <filepath>leg.mot</filepath> </TableProcessor>
    +                     <TableProcessor name="reference">
    +                         <filepath>leg.mot</filepath>
    +                         <operators> <TabOpUseAbsoluteStateNames /> </operators>
    +                     </TableProcessor>
                      </MocoStateTrackingGoal>
                  </goals>
              </MocoPhase>
          </MocoProblem>
      </MocoStudy>
    ```
    """
    for processor in setup.find_by_class("ModelProcessor"):
        if not processor.filepath and processor.model is None:
            report(
                f"{describe_object(processor)} names no model: OpenSim rejects the study",
                processor,
                tag="filepath",
            )
    for item in setup.items:
        # Disabled goals are not read.
        for spec in get_member_specs(type(item)) if getattr(item, "enabled", True) else ():
            source = getattr(item, spec.name)
            assert spec.names is not None and spec.accepts is not None
            tag = next((file.tag for file in get_file_specs(spec.accepts, "file")), "")
            name = getattr(source, tag, "").strip()
            if not name and spec.names.required and tag:
                report(f"{describe_object(item)} names no table to track: OpenSim rejects it", item)
            table = setup.read_table(name)
            if table is not None and spec.names.target == "state variable":
                degrees_entry = table.entries.get("inDegrees")
                # Moco accepts only these two spellings.
                if degrees_entry is None or degrees_entry.value.text not in ("yes", "no"):
                    report(
                        f"'{name}' must say inDegrees=yes or inDegrees=no: OpenSim rejects the "
                        "study",
                        source,
                        tag=tag,
                    )
            if table is not None and table.span is not None and is_a(item, "MocoTool"):
                first, last = table.span
                for time in ("initial_time", "final_time"):
                    tool_time = getattr(item, time)
                    if tool_time is not None and not first <= tool_time <= last:
                        report(
                            f"'{name}' has times from {first!r} to {last!r} s, but {time} is {tool_time!r} s: OpenSim "
                            "rejects the tool",
                            item,
                            tag=time,
                        )
            allows_more_columns = any(getattr(item, flag, False) for flag in _ALLOWING_FLAGS)
            for column in (
                []
                if allows_more_columns or table is None
                else _find_unknown_columns(setup, spec.names, source, table)
            ):
                report(
                    f"'{name}' has a column '{column}', which is not in the model: OpenSim "
                    "rejects the study",
                    source,
                    tag=tag,
                )
    # Operators of a ModelProcessor may add muscles and reserves that the guess has columns for.
    if setup.tree is None or any(setup.find_by_class("ModelOperator")):
        return
    for item, guess in setup.iterate_with_tables(setup.find_having("guess_file"), "guess_file"):
        if fault := _describe_guess_fault(setup, setup.tree, guess):
            report(
                f"the guess '{item.guess_file}' {fault}: OpenSim rejects it", item, tag="guess_file"
            )


def _describe_guess_fault(setup: Setup, tree: Tree, guess: Table) -> str:
    """Return the fault in the columns of a trajectory; empty for correct columns."""
    # Parameters are columns of a guess as well.
    expected_columns = set(find_variables(tree, "state or control variable")) | {
        item.name for item in setup.find_by_class("MocoParameter")
    }
    columns = {
        column
        for column in guess.columns
        # Other columns, such as multipliers and slacks, are named without a path.
        if column in expected_columns
        or (column.startswith("/") and "/implicitderiv_" not in column)
    }
    missing, extra_columns = sorted(expected_columns - columns), sorted(columns - expected_columns)
    if missing or extra_columns:
        return (
            f"lacks {join_words(missing)}"
            if missing
            else f"has {join_words(extra_columns)}, which the model does not have"
        )
    counts_by_kind = {
        column_kind: guess.entries[key].value.text
        if (key := f"num_{column_kind}") in guess.entries
        else ""
        for column_kind in _COUNTED
    }
    # A number for input controls was added later, and older files lack it.
    faulty = next(
        (
            column_kind
            for column_kind in _COUNTED[:-1]
            if not counts_by_kind[column_kind].isdecimal()
        ),
        None,
    )
    if faulty is not None:
        return f"must say in its header how many of its columns are {faulty} (num_{faulty}=...)"
    total = sum(int(number) for number in counts_by_kind.values() if number.isdecimal())
    count = len(guess.columns)
    if total != count:
        return (
            f"has {format_count(count, 'column')}, but the counts in its header add up to {total}"
        )
    states = find_variables(tree, "state variable")
    # OpenSim reads the first columns as states, by their number.
    faulty = next(
        (
            column
            for column in guess.columns[: int(counts_by_kind["states"])]
            if column not in states
        ),
        None,
    )
    return (
        ""
        if faulty is None
        else f"has '{faulty}' among its first columns, where OpenSim expects the states"
    )


def _find_unknown_columns(
    setup: Setup, reference: Reference, table_processor: Any, table: Table
) -> list[str]:
    """Return the columns of a table with unknown names."""
    tree = setup.tree
    if tree is None or Unknown in tree.by_class or any(setup.find_by_class("ModelOperator")):
        return []
    if any(
        is_a(operator, "TabOpUseAbsoluteStateNames")
        for operator in getattr(table_processor, "operators", ())
    ):
        return []
    return [
        column
        for column in table.columns
        if tree.lookup(reference, column, tree.model).target is None
    ]


@rule("OSIM863", "study-parts", severity=ERROR, about="document")
def report_study_parts(setup: Setup, report: FindingCollector) -> None:
    """A part of a study has a name or a target that OpenSim rejects.

    Checks for goals, constraints and parameters without a name or with a duplicate name. Also
    checks for parameters whose property does not exist or is not a number, and for goals that track
    a force that the loads do not contain. Reports models with locked coordinates, and models with
    joints whose speeds are not the rates of their coordinates.

    OpenSim rejects the study.

    ```setup
      <MocoPhase name="phases">
          <goals>
    -         <MocoFinalTimeGoal name="goal" />
    -         <MocoControlGoal name="goal" />
    +         <MocoFinalTimeGoal name="time" />
    +         <MocoControlGoal name="effort" />
          </goals>
      </MocoPhase>
    ```
    """
    for phase in setup.find_by_class("MocoPhase"):
        for parts in (phase.goals, phase.parameters, phase.path_constraints):
            for part in parts:
                if not part.name:
                    report(f"{describe_object(part)} has no name: OpenSim rejects it", part)
            for part in _find_repeated([part for part in parts if part.name]):
                report(
                    f"the name '{part.name}' is already used: OpenSim rejects it",
                    part,
                    attribute="name",
                )
    for goal in setup.items:
        if hasattr(goal, "contact_groups") and goal.enabled:
            loads = goal.external_loads or setup.read_document(goal.external_loads_file)
            names = [force.name for force in getattr(loads, "objects", ())]
            # Without readable loads there is nothing to compare.
            for group in goal.contact_groups if names else ():
                if group.external_force_name not in names:
                    report(
                        f"the loads have no force '{group.external_force_name}': OpenSim rejects "
                        "the goal",
                        group,
                        tag="external_force_name",
                        suggestion=find_nearest_name(group.external_force_name, names),
                    )
    tree = setup.tree
    if tree is None:
        return
    for parameter in setup.find_by_class("MocoParameter"):
        for path in parameter.component_paths:
            component = tree.walk(str(path), "", "Component").target
            if component is None or isinstance(component, Unknown):
                continue
            fault = _describe_property_fault(parameter, component)
            if fault:
                report(
                    f"{fault}: OpenSim rejects the study",
                    parameter,
                    tag="property_name",
                    suggestion=find_nearest_name(
                        parameter.property_name, [*get_field_specs(type(component))]
                    ),
                )
    welded = {
        str(path)
        for operator in setup.find_by_class("ModOpReplaceJointsWithWelds")
        for path in operator.joint_paths
    }
    for processor in (
        setup.find_by_class("ModelProcessor")
        if any(map(setup.find_by_class, ("MocoStudy", "MocoTool")))
        else ()
    ):
        # Moco needs speeds that are rates of coordinates (no ball joints), and no locked
        # coordinates.
        for joint in tree.find_by_class("Joint").values():
            faults = [
                f"{describe_object(item)} is locked"
                for item in joint.coordinates
                if getattr(item, "locked", False)
            ]
            if not joint.speeds_are_rates:
                faults.append(
                    f"{describe_object(joint)} has speeds that are not the rates of its coordinates"
                )
            # An operator that replaces the joint by a weld removes both obstacles.
            for fault in faults if tree.path_of(joint) not in welded else ():
                report(f"{fault}: Moco rejects the model", processor, tag="filepath")


def _describe_property_fault(parameter: Any, component: Component) -> str:
    """Return the fault in the property of a parameter; empty for a correct property."""
    name, element = parameter.property_name, parameter.property_element
    spec = get_field_specs(type(component)).get(name)
    if spec is None:
        return f"{describe_object(component)} has no property '{name}'"
    # A MocoParameter optimizes a number, a vector of three, or an inertia of six.
    size = spec.kind.size if isinstance(spec.kind, Value) and spec.kind.scalar == "double" else None
    if size not in (1, 3, 6):
        return f"{name} of {describe_object(component)} is not one, three or six numbers"
    if size == 1:
        return "" if element is None else f"{name} is one number and needs no property_element"
    is_out_of_range = element is None or not 0 <= element < size
    return (
        f"property_element must select one of the {size} numbers of {name}"
        if is_out_of_range
        else ""
    )
