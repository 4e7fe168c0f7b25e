"""Requirements of the tests of sweeps."""

from __future__ import annotations

import pytest

pytest.importorskip("pyarrow", reason="needs pyarrow (extra 'sweep')")
pytest.importorskip("scipy", reason="needs scipy (extra 'sweep')")
