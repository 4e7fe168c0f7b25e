"""Distribution of tests to workers that goes on when a worker dies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from xdist.scheduler import LoadFileScheduling  # type: ignore[import-untyped]

if TYPE_CHECKING:
    from xdist.workermanage import WorkerController  # type: ignore[import-untyped]


class FileScheduling(LoadFileScheduling):  # type: ignore[misc]
    """The distribution of pytest-xdist by files, without three faults after the death of a worker.

    That of pytest-xdist 3.8 gives the test that has ended a worker to the next one, until eight have
    died. It gives work to workers that have not collected yet, which is an internal error. And a
    new worker gets one file: where that has one test left, the worker waits for another test before
    it runs that one. After the last two pytest waits for ever.
    """

    def remove_node(self, node: WorkerController) -> str | None:
        """Forget a worker, and return the test that it died in; the others of its files are run elsewhere."""
        units = self.assigned_work.pop(node)
        left = {
            file: tests
            for file, tests in units.items()
            if not all(completed for completed in tests.values())
        }
        if not left:
            return None
        # In the order in which the worker has got them.
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
    """Return the distribution for the option ``--dist=loadfile``; pytest-xdist has those for others."""
    return FileScheduling(config, log) if config.getoption("dist") == "loadfile" else None
