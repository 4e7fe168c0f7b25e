"""Description of how kernels run on this machine."""

from __future__ import annotations


def explain_kernels() -> list[str]:
    """Return sentences about what runs the kernels: a library, a compiler, numba or Python."""
    from osimlite.errors import MissingDependency

    try:
        from osimlite.simulation.engines.machine_code import explain_source
    except MissingDependency as error:
        return [f"kernels do not run: {error.message}"]
    return explain_source()
