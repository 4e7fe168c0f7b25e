"""OSIM841: the markers of a tool, beside those that were measured."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice
from typing import Any

from osimlite.base.text import format_count
from osimlite.lint.registry import ERROR, WARNING, FindingSink, rule
from osimlite.lint.scan import number_in
from osimlite.lint.setup import Setup, members
from osimlite.lint.table import Table
from osimlite.lint.words import nearest_name


def marker_users(setup: Setup) -> Iterator[tuple[Any, Table]]:
    """Every part of a tool that fits markers, with its data."""
    return setup.with_tables(setup.having("ik_task_set", "marker_file"), "marker_file")


@rule("OSIM841", "marker-not-measured", severity=WARNING, about="document")
def marker_not_measured(setup: Setup, report: FindingSink) -> None:
    """A marker that is to be fitted is not in the data.

    Looks up each marker of the tasks, and of pairs that measure lengths, among the labels of the
    data, and of pairs in each row that is averaged. If none is in both model and data, it is an
    error. Counts whether the markers are enough for the coordinates of the model.

    OpenSim leaves the marker out without a word; with no marker at all in common it crashes. A
    measurement one of whose markers is missing, in one row, does not count: its bodies keep their
    size. Coordinates that too few markers tell of stay where they are, or drift.

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
    for user, table in marker_users(setup):
        labels = table.columns
        tasks = [
            task for task in members(user.ik_task_set, "IKMarkerTask") if task.apply and task.name
        ]
        model = setup.names_of("Marker")
        both = [task for task in tasks if task.name in labels and task.name in model]
        if tasks and model and not both:
            report(
                f"no marker of the tasks is in both the model and '{user.marker_file}': OpenSim crashes",
                user,
                tag="marker_file",
                severity=ERROR,
            )
        if setup.tree is not None and not model:
            maker = next(setup.named("GenericModelMaker"), None)
            tag = "model_file" if maker is None else "marker_set_file"
            report(
                "the model has no markers: OpenSim refuses the tool",
                maker or user,
                tag=tag,
                severity=ERROR,
            )
        free = 0
        if setup.tree is not None and both:
            free = sum(not setup.is_bound(name) for name in setup.tree.of_class("Coordinate"))
        others = sum(task.apply for task in members(user.ik_task_set, "IKCoordinateTask"))
        if 3 * len(both) + others < free:
            report(
                f"{format_count(len(both), 'marker')} and {format_count(others, 'coordinate task')} cannot tell the {free} free "
                "coordinates of the model",
                user.ik_task_set,
            )
        for task in tasks:
            if task.name not in labels:
                report(
                    f"'{user.marker_file}' has no marker '{task.name}': OpenSim leaves the task out",
                    task,
                    attribute="name",
                    suggestion=nearest_name(task.name, labels),
                )
    for scaler, static in setup.with_tables(setup.named("ModelScaler"), "marker_file"):
        gone = _unseen(static, scaler.time_range)
        for measurement in members(scaler.measurement_set, "Measurement") if scaler.apply else ():
            for pair in (
                members(measurement.marker_pair_set, "MarkerPair") if measurement.apply else ()
            ):
                for name in pair.markers:
                    if name not in static.columns:
                        report(
                            f"'{scaler.marker_file}' has no marker '{name}': OpenSim leaves the whole measurement "
                            f"'{measurement.name}' out",
                            pair,
                            tag="markers",
                            word=str(name),
                            suggestion=nearest_name(str(name), static.columns),
                        )
                    elif name in gone:
                        report(
                            f"'{name}' is not seen in every row of '{scaler.marker_file}' that is averaged: OpenSim "
                            f"leaves the whole measurement '{measurement.name}' out",
                            pair,
                            tag="markers",
                            word=str(name),
                        )


def _unseen(table: Table, span: tuple[float, ...]) -> set[str]:
    """The markers that a row between two times lacks."""
    places = cells_of(table)
    return {
        label
        for row in rows_between(table, span)
        for label, place in places
        if any(map(math.isnan, row[place]))
    }


def rows_between(table: Table, span: tuple[float, ...]) -> Iterator[list[float]]:
    """The numbers of the rows between two times, of a long stretch the first ones."""
    if table.is_markers and len(span) == 2:
        for cells in islice(table.rows_from(span[0]), 1000):
            row = [number_in(cell.strip()) for cell in cells]
            if row[1] > span[1]:
                return
            yield row + [math.nan] * (2 + 3 * len(table.columns) - len(row))


def cells_of(table: Table) -> list[tuple[str, slice]]:
    """The markers of a table, each with its cells in a row."""
    return [
        (label, slice(2 + 3 * number, 5 + 3 * number)) for number, label in enumerate(table.columns)
    ]
