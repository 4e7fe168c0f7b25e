"""What the tests of sweeps need to run."""

from __future__ import annotations

import pytest

pytest.importorskip("pyarrow", reason="needs pyarrow (extra 'sweep')")
pytest.importorskip("scipy", reason="needs scipy (extra 'sweep')")
