"""Scheduler of pytest-xdist that continues when a worker dies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from xdist.scheduler import LoadFileScheduling  # type: ignore[import-untyped]

if TYPE_CHECKING:
    from xdist.workermanage import WorkerController  # type: ignore[import-untyped]


class FileScheduling(LoadFileScheduling):  # type: ignore[misc]
    """Distribution of pytest-xdist by files, without three of its faults after the death of a worker.

    Pytest-xdist 3.8 gives the test that killed a worker to the next worker, until eight have died.
    It assigns work to workers that have not collected yet, which is an internal error. It also
    gives a new worker only one file: if one test of that file is left, the worker waits for a
    second test before it runs the first. After the last two faults pytest waits for ever.
    """

    def remove_node(self, node: WorkerController) -> str | None:
        """Remove a dead worker and reschedule the remaining tests of its files.

        Returns:
            Test during which the worker died; None if it had no work left.
        """
        units = self.assigned_work.pop(node)
        left = {
            file: tests
            for file, tests in units.items()
            if not all(completed for completed in tests.values())
        }
        if not left:
            return None
        # The worker ran its tests in this order, so it died in the first that is not completed.
        file, test = next(
            (file, test)
            for file, tests in left.items()
            for test, completed in tests.items()
            if not completed
        )
        left[file][test] = True
        self.workqueue.update(
            {name: tests for name, tests in left.items() if self._pending_of({name: tests})}
        )
        for other in list(self.assigned_work):
            self._reschedule(other)
        return test

    def _reschedule(self, node: WorkerController) -> None:
        if node not in self.registered_collections:
            return
        super()._reschedule(node)
        while not node.shutting_down and self._pending_of(self.assigned_work[node]) <= 2:
            super()._reschedule(node)


def make_scheduler(config: Any, log: Any) -> FileScheduling | None:
    """Return this scheduler for the option ``--dist=loadfile``; pytest-xdist has those of the other options."""
    return FileScheduling(config, log) if config.getoption("dist") == "loadfile" else None
