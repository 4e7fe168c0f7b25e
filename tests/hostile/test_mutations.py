"""Check that randomly damaged files cause no traceback, no crash, no hang, and no unexpected file."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.util import find_spec

import pytest

from tests.hostile.mutations import KINDS, Server, run_kind
from tests.suite import choose

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="limits of processes are those of POSIX"
)
NEEDS = {".c3d": "ezc3d", ".scone": "numpy", ".yaml": "yaml", ".omoco": "casadi"}


def skip_without(name: str) -> None:
    """Skip the test if a package is missing.

    The package is not imported, because CasADi cannot be loaded together with OpenSim.
    """
    package = NEEDS.get(name, "numpy")
    if find_spec(package) is None:
        pytest.skip(f"needs the package {package}")


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    """Return one process that serves all kinds of files."""
    result = Server()
    yield result
    result.close()


@pytest.mark.parametrize("name", KINDS)
def test_a_few_mutations(name: str, server: Server) -> None:
    skip_without(name)
    count = choose(3, 6)
    counts, faults = run_kind(name, count, server, seed=2)
    assert counts.total() >= count and not faults, "\n".join(faults)


@pytest.mark.full
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", KINDS)
def test_five_hundred_mutations(name: str, server: Server) -> None:
    skip_without(name)
    counts, faults = run_kind(name, 500, server)
    assert counts.total() >= 500 and not faults, "\n".join(faults)
