"""OSIM851 and OSIM854: tasks that a pose is fitted to."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

from osimlite.base.text import join_words
from osimlite.lint.posture import angles_of
from osimlite.lint.registry import ERROR, INFO, WARNING, FindingSink, rule
from osimlite.lint.setup import Setup, members
from osimlite.lint.words import called
from osimlite.schema.tree import is_a


@rule("OSIM851", "task-weight", severity=ERROR, about="document")
def task_weight(setup: Setup, report: FindingSink) -> None:
    """The weights of tasks make no sense.

    Looks for weights that are negative or no number, for tasks without weight (their default is 0),
    for markers and coordinates that have two tasks, and for sets of which no task applies.

    OpenSim refuses negative weights. A task without weight is not tracked, but counted in the
    error; a weight of 0 that is given may be meant so, and is an information. If no task applies,
    all markers count the same.

    ```setup
      <IKTaskSet name="tasks">
    -     <objects> <IKMarkerTask name="asis"> <weight>-5</weight> </IKMarkerTask> </objects>
    +     <objects> <IKMarkerTask name="asis"> <weight>5</weight> </IKMarkerTask> </objects>
      </IKTaskSet>
    ```
    """
    for tasks in setup.named("IKTaskSet"):
        applied = [task for task in members(tasks, "IKTask") if task.apply]
        if tasks.objects and not applied:
            report(
                "no task of this set applies: OpenSim takes all markers, each with the weight 1",
                tasks,
                severity=WARNING,
            )
        seen: Counter[tuple[str, str]] = Counter()
        for task in applied:
            seen[type(task).__name__, task.name] += 1
            if seen[type(task).__name__, task.name] == 2:
                report(
                    f"'{task.name}' has a task already: one of them counts",
                    task,
                    attribute="name",
                    severity=WARNING,
                )
            if task.weight < 0:
                report(
                    f"the weight of {called(task)} is {task.weight:g}: OpenSim refuses it",
                    task,
                    tag="weight",
                )
            elif task.weight == 0:
                given = setup.element_of(task, "weight") is not None
                what = "weighs 0" if given else "has no weight, and the default is 0"
                report(
                    f"{called(task)} {what}: it is not tracked",
                    task,
                    tag="weight",
                    severity=INFO if given else WARNING,
                )
            if (
                is_a(task, "IKCoordinateTask")
                and task.value_type == "manual_value"
                and abs(task.value) > 6.3
            ):
                report(
                    f"the value of {called(task)} is {task.value:g}, and is in radians or metres",
                    task,
                    tag="value",
                    severity=WARNING,
                )


@rule("OSIM854", "unreachable-task", severity=WARNING, about="document")
def unreachable_task(setup: Setup, report: FindingSink) -> None:
    """A coordinate that is to be fitted cannot move, or cannot reach its value.

    Looks for tasks of locked coordinates, for values of which most are outside the range of a
    clamped coordinate, and for locked coordinates that move in the file of values.

    Inverse kinematics keeps a locked coordinate where the model has it, and a clamped one in its
    range, without a word: knees stay straight, and other joints bend in their place.

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
    coordinates: dict[str, Any] = {} if setup.tree is None else setup.tree.of_class("Coordinate")
    angles = angles_of(setup)
    for user in setup.having("ik_task_set", "coordinate_file"):
        table = setup.table(user.coordinate_file)
        given: dict[str, list[float]] = {}
        for index, column in enumerate(table.columns if table is not None else (), 1):
            # Whatever the header says, this file is taken to be in degrees.
            turn = math.pi / 180.0 if column in angles else 1.0
            rows = table.rows.samples if table is not None else []
            given[column] = [
                row[index] * turn for row in rows if index < len(row) and row[index] == row[index]
            ]
        for task in user.ik_task_set.objects:
            coordinate = coordinates.get(task.name)
            if coordinate is None or not is_a(task, "IKCoordinateTask") or not task.apply:
                continue
            values = {"manual_value": [task.value], "from_file": given.pop(task.name, [])}.get(
                task.value_type, []
            )
            low, high = coordinate.range
            outside = sum(not low - 0.01 <= value <= high + 0.01 for value in values)
            if coordinate.locked:
                report(
                    f"{called(coordinate)} is locked: the task moves nothing",
                    task,
                    attribute="name",
                )
            elif coordinate.clamped and 2 * outside > len(values):
                report(
                    f"most values for {called(coordinate)} are outside the range from {low:.4g} to {high:.4g} that it "
                    "is clamped to",
                    task,
                    attribute="name",
                )
        still = [
            name
            for name, values in given.items()
            if values
            and name in coordinates
            and coordinates[name].locked
            and max(values) - min(values) > 0.1
        ]
        if still:
            report(
                f"{join_words(still)} {'is' if len(still) == 1 else 'are'} locked in the model, and moves in "
                f"'{user.coordinate_file}'",
                user,
                tag="coordinate_file",
            )
