"""Decorator that runs thousands of short cases in one test, because pytest adds more time per test than they take."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any


def of_each(
    cases: Iterable[Any], name: Callable[[Any], str] = str
) -> Callable[[Callable[[Any], None]], Any]:
    """Return a decorator that makes one test of the test of one case.

    Args:
        cases: arguments of the test, one per case.
        name: function that describes a case in the report.

    Returns:
        Decorator; its test runs all cases and then raises all failures together, each with the name
        of its case.
    """

    def made(test: Callable[[Any], None]) -> Callable[[], None]:
        def tests() -> None:
            failures = []
            for case in cases:
                try:
                    test(case)
                except Exception as error:
                    error.add_note(name(case))
                    failures.append(error)
            if failures:
                raise ExceptionGroup(f"{len(failures)} of {test.__name__}", failures)

        tests.__name__, tests.__doc__, tests.__module__ = (
            test.__name__,
            test.__doc__,
            test.__module__,
        )
        return tests

    return made
