"""Thousands of cases of a moment each in a few tests: pytest takes longer for a test than they take."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any


def of_each(
    cases: Iterable[Any], name: Callable[[Any], str] = str
) -> Callable[[Callable[[Any], None]], Any]:
    """Make one test of a test of one case; whatever cases fail are told together, each with its name."""

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
