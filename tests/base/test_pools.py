"""Tests of the error that a process pool raises when one of its processes ends."""

from __future__ import annotations

import os
import time

import pytest

from osimlite.base.pools import WorkerLostError, open_process_pool


def end(seconds: float) -> None:
    time.sleep(seconds)
    os._exit(1)


def test_a_process_that_ended_is_told_where_results_are_awaited_and_where_work_is_given() -> None:
    with open_process_pool(end, workers=1) as pool:
        pool.submit("one", 0.0)
        with pytest.raises(WorkerLostError, match="has ended"):
            pool.result(60.0)
        with pytest.raises(WorkerLostError, match="has ended"):
            pool.submit("two", 0.0)
