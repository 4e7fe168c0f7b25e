"""OSIM841: markers of a tool compared with the measured ones."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice
from typing import Any

from osimlite.base.text import format_count
from osimlite.lint.registry import ERROR, WARNING, FindingCollector, rule
from osimlite.lint.scan import parse_number
from osimlite.lint.setup import Setup, select_members
from osimlite.lint.table import Table
from osimlite.lint.words import find_nearest_name


def find_marker_users(setup: Setup) -> Iterator[tuple[Any, Table]]:
    """Yield every part of a tool that fits markers, with its data.

    Returns:
        Pairs of a part and its table.
    """
    return setup.iterate_with_tables(setup.find_having("ik_task_set", "marker_file"), "marker_file")


@rule("OSIM841", "marker-not-measured", severity=WARNING, about="document")
def report_marker_not_measured(setup: Setup, report: FindingCollector) -> None:
    """A marker that a tool fits is not in the data.

    Checks whether the data have each marker of the tasks, and of the pairs that measure lengths.
    Both markers of a pair must also be visible in every row over which the tool averages the
    length. The finding is an error if no marker is in both model and data. Also checks whether the
    markers are enough to determine the coordinates of the model.

    OpenSim ignores a missing marker without a message, and crashes if model and data have no marker
    in common. If a marker of a measurement is missing in one row, OpenSim ignores the measurement:
    its bodies keep their size. Coordinates that too few markers determine stay constant, or drift.

    ```setup
      <InverseKinematicsTool name="ik">
          <model_file>leg.osim</model_file>
          <marker_file>leg.trc</marker_file>
          <output_motion_file>ik.mot</output_motion_file>
          <IKTaskSet>
              <objects>
                  <IKMarkerTask name="asis"> <weight>1</weight> </IKMarkerTask>
                  <IKMarkerTask name="knee_marker"> <weight>1</weight> </IKMarkerTask>
    -             <IKMarkerTask name="hip_marker"> <weight>1</weight> </IKMarkerTask>
              </objects>
          </IKTaskSet>
      </InverseKinematicsTool>
    ```
    """
    for user, table in find_marker_users(setup):
        labels = table.columns
        tasks = [
            task
            for task in select_members(user.ik_task_set, "IKMarkerTask")
            if task.apply and task.name
        ]
        model = setup.list_names("Marker")
        usable_tasks = [task for task in tasks if task.name in labels and task.name in model]
        if tasks and model and not usable_tasks:
            report(
                f"no marker of the tasks is in both the model and '{user.marker_file}': OpenSim "
                "crashes",
                user,
                tag="marker_file",
                severity=ERROR,
            )
        if setup.tree is not None and not model:
            # In a setup of the scale tool the markers are usually in a file of their own.
            maker = next(setup.find_by_class("GenericModelMaker"), None)
            tag = "model_file" if maker is None else "marker_set_file"
            report(
                "the model has no markers: OpenSim rejects the tool",
                maker or user,
                tag=tag,
                severity=ERROR,
            )
        free_count = 0
        if setup.tree is not None and usable_tasks:
            free_count = sum(
                not setup.is_bound(name) for name in setup.tree.find_by_class("Coordinate")
            )
        task_count = sum(
            task.apply for task in select_members(user.ik_task_set, "IKCoordinateTask")
        )
        # A marker determines at most three coordinates, a task of a coordinate one.
        if 3 * len(usable_tasks) + task_count < free_count:
            report(
                f"{format_count(len(usable_tasks), 'marker')} and {format_count(task_count, 'coordinate task')} do not "
                f"determine the {format_count(free_count, 'free coordinate')} of the model",
                user.ik_task_set,
            )
        for task in tasks:
            if task.name not in labels:
                report(
                    f"'{user.marker_file}' has no marker '{task.name}': OpenSim ignores the task",
                    task,
                    attribute="name",
                    suggestion=find_nearest_name(task.name, labels),
                )
    for scaler, static in setup.iterate_with_tables(
        setup.find_by_class("ModelScaler"), "marker_file"
    ):
        unseen_markers = _find_unseen_markers(static, scaler.time_range)
        for measurement in (
            select_members(scaler.measurement_set, "Measurement") if scaler.apply else ()
        ):
            for pair in (
                select_members(measurement.marker_pair_set, "MarkerPair")
                if measurement.apply
                else ()
            ):
                for name in pair.markers:
                    if name not in static.columns:
                        report(
                            f"'{scaler.marker_file}' has no marker '{name}': OpenSim ignores the "
                            f"whole measurement '{measurement.name}'",
                            pair,
                            tag="markers",
                            word=str(name),
                            suggestion=find_nearest_name(str(name), static.columns),
                        )
                    elif name in unseen_markers:
                        report(
                            f"'{name}' is missing in some of the averaged rows of "
                            f"'{scaler.marker_file}': OpenSim ignores the whole measurement '{measurement.name}'",
                            pair,
                            tag="markers",
                            word=str(name),
                        )


def _find_unseen_markers(table: Table, span: tuple[float, ...]) -> set[str]:
    """Return the markers that are missing in a row between two times."""
    cells_by_label = list_marker_cells(table)
    return {
        label
        for row in iterate_rows_between(table, span)
        for label, cells in cells_by_label
        if any(map(math.isnan, row[cells]))
    }


def iterate_rows_between(table: Table, span: tuple[float, ...]) -> Iterator[list[float]]:
    """Yield the numbers of the rows between two times, at most 1000."""
    if table.is_markers and len(span) == 2:
        for cells in islice(table.iterate_rows(span[0]), 1000):
            row = [parse_number(cell.strip()) for cell in cells]
            if row[1] > span[1]:
                return
            # In a row that lacks its last cells, OpenSim takes these markers as not seen.
            yield row + [math.nan] * (2 + 3 * len(table.columns) - len(row))


def list_marker_cells(table: Table) -> list[tuple[str, slice]]:
    """Return the markers of a table, each with its cells in a row."""
    return [
        (label, slice(2 + 3 * number, 5 + 3 * number)) for number, label in enumerate(table.columns)
    ]
