"""Skip the tests of sweeps where pyarrow or SciPy is not installed."""

from __future__ import annotations

import pytest

pytest.importorskip("pyarrow", reason="needs pyarrow (extra 'sweep')")
pytest.importorskip("scipy", reason="needs scipy (extra 'sweep')")
