"""Search paths of programs and libraries as they were before any test imported OpenSim.

OpenSim's import adds its folder to these environment variables. Child processes would then load
OpenSim's CasADi instead of the installed one. This module must be imported before OpenSim.
"""

from __future__ import annotations

import os

_PATHS_AT_START = {
    name: os.environ.get(name)
    for name in ("PATH", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "SIMBODY_HOME")
}


def restore_search_paths() -> None:
    """Set the search paths in the environment of this process to their values before OpenSim's import."""
    for name, value in _PATHS_AT_START.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value
