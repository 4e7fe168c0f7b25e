"""OSIM851 and OSIM854: tasks that a pose is fitted to."""

from __future__ import annotations

from collections import Counter

from osimlite.lint.engine import ERROR, INFO, WARNING, Found, rule
from osimlite.lint.setup import Setup, is_of, members
from osimlite.lint.words import called


@rule("OSIM851", "task-weight", severity=ERROR, about="document")
def task_weight(setup: Setup, found: Found) -> None:
    """The weights of tasks make no sense.

    ## What it does
    Looks for weights that are negative or no number, for tasks without weight (their default is 0), for markers and
    coordinates that have two tasks, and for sets of which no task applies.

    ## Why is this bad
    OpenSim refuses negative weights. A task without weight is not tracked, but counted in the error; a weight of 0 that
    is given may be meant so, and is an information. If no task applies, all markers count the same.

    ## Example
    ```setup
    <OpenSimDocument Version="40600">
        <IKTaskSet name="tasks">
            <objects> <IKMarkerTask name="asis"> <weight>-5</weight> </IKMarkerTask> </objects>
        </IKTaskSet>
    </OpenSimDocument>
    ```

    ## Use instead
    ```setup
    <OpenSimDocument Version="40600">
        <IKTaskSet name="tasks">
            <objects> <IKMarkerTask name="asis"> <weight>5</weight> </IKMarkerTask> </objects>
        </IKTaskSet>
    </OpenSimDocument>
    ```
    """
    for tasks in setup.named("IKTaskSet"):
        applied = [task for task in members(tasks, "IKTask") if task.apply]
        if tasks.objects and not applied:
            found(
                "no task of this set applies: OpenSim takes all markers, each with the weight 1", tasks,
                severity=WARNING,
            )  # fmt: skip
        seen: Counter[tuple[str, str]] = Counter()
        for task in applied:
            seen[type(task).__name__, task.name] += 1
            if seen[type(task).__name__, task.name] == 2:
                found(f"'{task.name}' has a task already: one of them counts", task, attribute="name", severity=WARNING)
            if task.weight < 0:
                found(f"the weight of {called(task)} is {task.weight:g}: OpenSim refuses it", task, tag="weight")
            elif task.weight == 0:
                given = setup.element_of(task, "weight") is not None
                what = "weighs 0" if given else "has no weight, and the default is 0"
                found(
                    f"{called(task)} {what}: it is not tracked", task, tag="weight", severity=INFO if given else WARNING
                )
            if is_of(task, "IKCoordinateTask") and task.value_type == "manual_value" and abs(task.value) > 6.3:
                found(
                    f"the value of {called(task)} is {task.value:g}, and is in radians or metres", task, tag="value",
                    severity=WARNING,
                )  # fmt: skip
