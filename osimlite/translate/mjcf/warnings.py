"""Warnings of MuJoCo while osimlite works with it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def collect_warnings(mujoco: Any) -> Iterator[list[str]]:
    """Yield a list to which MuJoCo's warnings are added.

    Without a handler MuJoCo writes them into MUJOCO_LOG.TXT in the current folder.

    Args:
        mujoco: MuJoCo's module.
    """
    texts: list[str] = []
    previous = mujoco.get_mju_user_warning()
    # The handler is global in MuJoCo, and is restored afterwards.
    mujoco.set_mju_user_warning(lambda text: texts.append(str(text)))
    try:
        yield texts
    finally:
        mujoco.set_mju_user_warning(previous)
