"""Instruction sets of this processor, which determine what machine code it can run."""

from __future__ import annotations

import ctypes
import platform
import re
import sys
from functools import cache

X86_64_V3 = frozenset({"avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"})
"""Names in Linux of the features that x86-64-v3 adds to x86-64 (its `lzcnt` is `abm` there)."""

WINDOWS_AVX2 = 40
"""PF_AVX2_INSTRUCTIONS_AVAILABLE of the Windows API."""


@cache
def machine_name() -> str:
    """Return the kind of processor, such as "x86_64" or "aarch64".

    Windows and macOS call these "AMD64" and "arm64". Other names are those of the system.
    """
    name = platform.machine().lower()
    return {"amd64": "x86_64", "x64": "x86_64", "arm64": "aarch64"}.get(name, name)


@cache
def processor_features() -> frozenset[str]:
    """Return the names of the instruction sets of this processor.

    The set is empty if the system does not list them.
    """
    system: str = sys.platform
    if system == "linux":
        return read_cpuinfo("/proc/cpuinfo")
    if system == "darwin" and machine_name() == "x86_64":
        return X86_64_V3 if _query_sysctl(b"hw.optional.avx2_0") else frozenset()
    if system == "win32" and machine_name() == "x86_64":
        has_avx2 = getattr(ctypes, "windll").kernel32.IsProcessorFeaturePresent(WINDOWS_AVX2)  # noqa: B009
        return X86_64_V3 if has_avx2 else frozenset()
    return frozenset()


def supports_v3() -> bool:
    """Return whether this processor runs machine code for x86-64-v3."""
    return machine_name() == "x86_64" and processor_features() >= X86_64_V3


def read_cpuinfo(path: str) -> frozenset[str]:
    """Return the features of the first processor that Linux lists."""
    try:
        with open(path, encoding="ascii", errors="replace") as stream:
            # The list repeats for each core, and the first one is enough.
            text = stream.read(8192)
    except OSError:
        return frozenset()
    match = re.search(r"^(?:flags|Features)\s*:(.*)$", text, re.MULTILINE)
    return frozenset(match[1].split()) if match else frozenset()


def _query_sysctl(name: bytes) -> bool:
    """Return whether macOS reports a feature of the processor."""
    value = ctypes.c_int(0)
    size = ctypes.c_size_t(ctypes.sizeof(ctypes.c_int))
    system = ctypes.CDLL(None)
    status = system.sysctlbyname(name, ctypes.byref(value), ctypes.byref(size), None, 0)
    return status == 0 and value.value != 0
