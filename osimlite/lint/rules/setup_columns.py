"""OSIM842: the coordinates and states that a tool looks for in the columns of its tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from osimlite.base.text import join_words
from osimlite.lint.registry import ERROR, WARNING, FindingCollector, rule
from osimlite.lint.setup import Setup, get_content_type, select_members
from osimlite.lint.table import Table
from osimlite.lint.words import find_nearest_name, suggest_names
from osimlite.schema.states import find_variables
from osimlite.schema.tree import is_a


@rule("OSIM842", "missing-column", severity=WARNING, about="document")
def report_missing_column(setup: Setup, report: FindingCollector) -> None:
    """A table of coordinates lacks columns for coordinates of the model.

    Compares the columns of a table of coordinates with the coordinates of the model. OpenSim's
    inverse dynamics accepts plain names only, such as `knee_angle`. Its analyses also accept paths
    such as `/jointset/knee/knee_angle/value`, and `osimlite run` accepts paths of every version. A
    coordinate task that takes its values from a file needs a column in that file. A table of states
    needs a column for every state of the model.

    If a coordinate has no column, OpenSim uses its default value, or 0 in analyses. OpenSim logs a
    line at most, and the motion is wrong.

    ```setup
      <InverseDynamicsTool name="id">
          <model_file>leg.osim</model_file>
    -     <coordinates_file>leg_no_knee.mot</coordinates_file>
    +     <coordinates_file>leg.mot</coordinates_file>
      </InverseDynamicsTool>
    ```
    """
    for item, tag, table in find_motions(setup):
        names = setup.list_names("Coordinate")
        if not names:
            continue
        # OpenSim's inverse dynamics compares whole labels with names, while its analyses also split
        # paths that end with `/value`.
        plain = is_a(item, "InverseDynamicsTool")
        columns = {
            column
            if plain or "/" not in column
            else (parts[-2] if (parts := column.split("/"))[-1] == "value" else "")
            for column in table.columns
        }
        # Locked and coupled coordinates follow from the model, so that a table without them is
        # complete.
        lacking = sorted(name for name in names - columns if not setup.is_bound(name))
        if not names & columns and names & _find_names_in_paths(table):
            consequence = (
                "OpenSim's inverse dynamics does not recognise these and computes the moments of "
                "the default pose"
                if plain
                else "OpenSim looks for names or for paths that end with '/value', and uses 0"
            )
            report(
                f"'{getattr(item, tag)}' names the coordinates by paths: {consequence}; "
                "osimlite accepts them",
                item,
                tag=tag,
            )
        elif not names & columns:
            report(
                f"'{getattr(item, tag)}' has no column for any coordinate of the model",
                item,
                tag=tag,
                severity=ERROR,
            )
        elif lacking:
            report(
                f"'{getattr(item, tag)}' has no column {join_words(map(repr, lacking))}: OpenSim uses "
                f"{'0' if is_a(item, 'AbstractTool') else 'the default value'}{suggest_names(lacking, columns - names)}",
                item,
                tag=tag,
            )
    for item in setup.find_by_class("AbstractTool"):
        states = setup.read_table(getattr(item, "states_file", ""))
        unknown = (
            [column for column in states.columns if not _is_state(setup, column)]
            if states is not None
            else []
        )
        if unknown and setup.tree is not None:
            report(
                f"the model has no state {join_words(map(repr, unknown))} of '{item.states_file}': "
                "OpenSim ignores the column",
                item,
                tag="states_file",
            )
        lacking = (
            _find_missing_states(setup, states) if states is not None and states.labels else []
        )
        if lacking:
            report(
                f"'{item.states_file}' has no column for {join_words(lacking)}: OpenSim uses the "
                "default value",
                item,
                tag="states_file",
            )
    for user in setup.find_having("ik_task_set"):
        for task in select_members(user.ik_task_set, "IKCoordinateTask"):
            if task.apply and task.value_type == "from_file":
                values = setup.read_table(user.coordinate_file)
                if not user.coordinate_file.strip() or user.coordinate_file == "Unassigned":
                    report(
                        f"coordinate_file is not given for '{task.name}': OpenSim rejects it",
                        task,
                        tag="value_type",
                        severity=ERROR,
                    )
                elif values is not None and values.labels and task.name not in values.columns:
                    report(
                        f"'{user.coordinate_file}' has no column '{task.name}': OpenSim rejects it",
                        task,
                        attribute="name",
                        severity=ERROR,
                        suggestion=find_nearest_name(task.name, values.columns),
                    )


def _find_names_in_paths(table: Table) -> set[str]:
    """Return the names of coordinates whose values columns name by paths, as files of states of any age do."""
    paths = [column.split("/") for column in table.columns if "/" in column]
    return {parts[-2] if parts[-1] == "value" else parts[-1] for parts in paths}


def _is_state(setup: Setup, column: str) -> bool:
    """Return whether a label may name a state: by the path of a component, or by its name as in old files."""
    if setup.tree is None:
        return True
    if column.startswith("/"):
        path = column.rpartition("/")[0]
        return (
            setup.tree.walk(path, "", "Component").target is not None
            or path.rpartition("/")[2] in setup.tree.by_name
        )
    # Version 3 named states `<coordinate>`, `<coordinate>_u` and `<muscle>.<state>`.
    return column.partition(".")[0].removesuffix("_u") in setup.tree.by_name


def _find_missing_states(setup: Setup, table: Table) -> list[str]:
    """Return the states of the model that no label of a table names, in any format."""
    columns = set(table.columns)
    # Paths of states begin differently in files of different versions 4, but they end alike.
    ends = {"/".join(column.split("/")[-2:]) for column in columns}
    lacking = []
    for path in find_variables(setup.tree, "state variable") if setup.tree is not None else ():
        owner, state = path.split("/")[-2:]
        old = {"value": owner, "speed": f"{owner}_u"}.get(state, f"{owner}.{state}")
        if f"{owner}/{state}" not in ends and old not in columns:
            lacking.append(path)
    return lacking


def find_motions(setup: Setup) -> Iterator[tuple[Any, str, Table]]:
    """Yield every tool that reads a motion as coordinates, with the property and the table."""
    for item, spec, name, _ in setup.find_named_files("file"):
        table = setup.read_table(name) if get_content_type(spec) == "motion" else None
        if table is not None and table.labels and not table.is_markers:
            yield item, spec.tag, table
