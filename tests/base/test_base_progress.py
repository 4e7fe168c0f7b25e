"""Tests of progress reports of the library, and of the division of work into calls of kernels."""

from __future__ import annotations

import pytest

from osimlite.base.progress import (
    FIRST_ROWS,
    divide_rows,
    listen_to_progress,
    mute_progress,
    watch_items,
)


@pytest.mark.parametrize("count", [0, 1, FIRST_ROWS, 1000])
def test_slices_cover_all_rows_once(count: int) -> None:
    rows = [*range(count)]
    assert [row for part in divide_rows("walking", count) for row in rows[part]] == rows


def test_a_kernel_is_called_once_without_rows() -> None:
    assert [*divide_rows("walking", 0)] == [slice(0, 0)]


def test_listeners_receive_the_last_row() -> None:
    reports = []
    with listen_to_progress(lambda *report: reports.append(report)):
        for _ in divide_rows("walking", 1000, " steps"):
            pass
        assert [*watch_items("drawing", "abc", " pages")] == ["a", "b", "c"]
        assert [*divide_rows("a single pose", 1)]
    assert ("walking", 1000, 1000, " steps") in reports
    assert reports[-3:] == [("drawing", number, 3, " pages") for number in (1, 2, 3)]


def test_steps_of_work_that_reports_itself_are_muted() -> None:
    reports = []
    with listen_to_progress(lambda *report: reports.append(report)):
        for _ in watch_items("fitting", "ab", " steps"):
            with mute_progress():
                assert [*watch_items("drawing", "abc", " pages")]
    assert reports == [("fitting", number, 2, " steps") for number in (1, 2)]
