"""Plain text in figures of matplotlib."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from osimlite.base.require import require


@contextmanager
def plain_lettering() -> Iterator[None]:
    """Draw names as plain text: ``$`` begins no formula, and missing letters are empty boxes."""
    matplotlib = require("matplotlib", extra="plot", purpose="drawing")
    with matplotlib.rc_context({"text.parse_math": False}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph", UserWarning)
        yield
