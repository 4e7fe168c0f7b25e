"""OSIM851 and OSIM854: tasks to which a pose is fitted."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

from osimlite.base.text import join_words
from osimlite.lint.posture import find_angles
from osimlite.lint.registry import ERROR, INFO, WARNING, FindingCollector, rule
from osimlite.lint.setup import Setup, select_members
from osimlite.lint.words import describe_object
from osimlite.schema.tree import is_a


@rule("OSIM851", "task-weight", severity=ERROR, about="document")
def report_task_weight(setup: Setup, report: FindingCollector) -> None:
    """The weights of tasks are invalid.

    Checks for negative weights, for tasks without weight (the default is 0), for markers and
    coordinates with two tasks, and for sets in which all tasks are disabled.

    OpenSim rejects negative weights. It does not track a task without weight, but counts it in the
    reported error. An explicit weight of 0 may be intended, and is an info. If all tasks are
    disabled, all markers have equal weight.

    ```setup
      <IKTaskSet name="tasks">
    -     <objects> <IKMarkerTask name="asis"> <weight>-5</weight> </IKMarkerTask> </objects>
    +     <objects> <IKMarkerTask name="asis"> <weight>5</weight> </IKMarkerTask> </objects>
      </IKTaskSet>
    ```
    """
    for tasks in setup.find_by_class("IKTaskSet"):
        applied = [task for task in select_members(tasks, "IKTask") if task.apply]
        if tasks.objects and not applied:
            report(
                "all tasks of this set are disabled: OpenSim uses all markers, each with the weight 1",
                tasks,
                severity=WARNING,
            )
        task_counts: Counter[tuple[str, str]] = Counter()
        for task in applied:
            task_counts[type(task).__name__, task.name] += 1
            # One finding at the second task, whatever the number of further ones.
            if task_counts[type(task).__name__, task.name] == 2:
                report(
                    f"'{task.name}' has two tasks: only one of them counts",
                    task,
                    attribute="name",
                    severity=WARNING,
                )
            if task.weight < 0:
                report(
                    f"the weight of {describe_object(task)} is {task.weight:g}: OpenSim rejects it",
                    task,
                    tag="weight",
                )
            elif task.weight == 0:
                # OpenSim's default is 0 as well, so that only the text tells whether the user meant
                # it.
                is_explicit = setup.element_of(task, "weight") is not None
                problem = (
                    "has the weight 0" if is_explicit else "has no weight, and the default is 0"
                )
                report(
                    f"{describe_object(task)} {problem}: it is not tracked",
                    task,
                    tag="weight",
                    severity=INFO if is_explicit else WARNING,
                )
            if (
                is_a(task, "IKCoordinateTask")
                and task.value_type == "manual_value"
                # More than a full turn in radians: the value is probably in degrees.
                and abs(task.value) > 6.3
            ):
                report(
                    f"the value of {describe_object(task)} is {task.value:g}, expected radians or "
                    "metres",
                    task,
                    tag="value",
                    severity=WARNING,
                )


@rule("OSIM854", "unreachable-task", severity=WARNING, about="document")
def report_unreachable_task(setup: Setup, report: FindingCollector) -> None:
    """A coordinate of a task cannot move, or cannot reach its value.

    Checks for tasks of locked coordinates, and for tasks whose values are mostly outside the range
    of a clamped coordinate. Also checks for locked coordinates that move in the file of values.

    Inverse kinematics keeps a locked coordinate at its default value, and a clamped one in its
    range, without a message. Knees stay straight, for example, and other joints bend instead.

    ```setup
      <InverseKinematicsTool name="ik">
          <model_file>clamped.osim</model_file>
          <marker_file>leg.trc</marker_file>
          <output_motion_file>ik.mot</output_motion_file>
          <IKTaskSet>
              <objects>
                  <IKMarkerTask name="asis"> <weight>1</weight> </IKMarkerTask>
                  <IKMarkerTask name="knee_marker"> <weight>1</weight> </IKMarkerTask>
                  <IKCoordinateTask name="knee_angle">
    -                 <weight>1</weight> <value_type>manual_value</value_type> <value>1</value>
    +                 <weight>1</weight> <value_type>manual_value</value_type> <value>-1</value>
                  </IKCoordinateTask>
              </objects>
          </IKTaskSet>
      </InverseKinematicsTool>
    ```
    """
    coordinates: dict[str, Any] = (
        {} if setup.tree is None else setup.tree.find_by_class("Coordinate")
    )
    angles = find_angles(setup)
    for user in setup.find_having("ik_task_set", "coordinate_file"):
        table = setup.read_table(user.coordinate_file)
        values_by_column: dict[str, list[float]] = {}
        for index, column in enumerate(table.columns if table is not None else (), 1):
            # OpenSim takes this file to be in degrees, even if its header says radians.
            radians_per_unit = math.pi / 180.0 if column in angles else 1.0
            rows = table.rows.samples if table is not None else []
            values_by_column[column] = [
                row[index] * radians_per_unit
                for row in rows
                if index < len(row) and row[index] == row[index]
            ]
        for task in user.ik_task_set.objects:
            coordinate = coordinates.get(task.name)
            if coordinate is None or not is_a(task, "IKCoordinateTask") or not task.apply:
                continue
            values = {
                "manual_value": [task.value],
                "from_file": values_by_column.pop(task.name, []),
            }.get(task.value_type, [])
            low, high = coordinate.range
            outside_count = sum(not low - 0.01 <= value <= high + 0.01 for value in values)
            if coordinate.locked:
                report(
                    f"{describe_object(coordinate)} is locked: the task has no effect; unlock the "
                    "coordinate, or delete the task",
                    task,
                    attribute="name",
                )
            elif coordinate.clamped and 2 * outside_count > len(values):
                report(
                    f"most values for {describe_object(coordinate)} are outside the range from "
                    f"{low:.4g} to {high:.4g} that it is clamped to",
                    task,
                    attribute="name",
                )
        moving_locked = [
            name
            for name, values in values_by_column.items()
            if values
            and name in coordinates
            and coordinates[name].locked
            and max(values) - min(values) > 0.1
        ]
        if moving_locked:
            report(
                f"{join_words(moving_locked)} {'is' if len(moving_locked) == 1 else 'are'} locked in the model, but "
                f"{'moves' if len(moving_locked) == 1 else 'move'} in '{user.coordinate_file}'",
                user,
                tag="coordinate_file",
            )
