"""The error of what cannot be run."""

from __future__ import annotations

from osimlite.errors import UnsupportedError


class NotRunnable(UnsupportedError):
    """A document, or a part of it, is not what can be run."""

    exit_code = 2
