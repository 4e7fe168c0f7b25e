"""Machine code in files: loaded in a moment, without the compiler that made it.

A file holds one entry in the object format of the system. It is good for one version of the sources and of the compiler
and for one kind of processor, which its name stands for. A checksum tells damage; who wrote a file is told by who can
write there: what others can change is not run.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import re
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import llvmlite  # type: ignore[import-untyped]
import llvmlite.binding as llvm  # type: ignore[import-untyped]

from osimlite.errors import OsimliteError
from osimlite.simulation.engines.private_files import read_private, write_private

_log = logging.getLogger(__name__)

FOLDER = "NUMBA_CACHE_DIR"
"""Environment variable that may name the only folder for the files; numba uses it likewise."""

TESTED = ">=0.62,<0.69"
"""The versions of numba with whose internals `compiler.py` was tried; pyproject.toml asks for one of them."""

LONGEST = 300.0
"""What a process has left behind after so long (s) is from one that was ended."""

_kept: list[Any] = []
"""Machine code stays where it is as long as this does."""


def load(name: str, digest: str) -> int | None:
    """Address of an entry from its file, None if there is none that only the user can have written.

    Args:
        name: of the entry.
        digest: of the sources.
    """
    for folder in _folders():
        head, _, code = (read_private(folder / _file(name, digest)) or b"").partition(b"\n")
        match _parsed(head):
            case {"symbol": str(symbol), "sha256": str(checksum)} if checksum == hashlib.sha256(code).hexdigest():
                return _link(code, symbol) or None
    return None


def _parsed(head: bytes) -> object:
    try:
        return json.loads(head)
    except (ValueError, RecursionError):
        return None


def translated(text: str) -> bytes:
    """Code in the object format of the system from the intermediate language of LLVM.

    Code that raises nothing names functions of numba's runtime, but never calls them: in their place it gets some that
    end the process. So what is in a file needs nothing of numba.
    """
    module = llvm.parse_assembly(text)
    for name in [part.name for part in module.functions if part.is_declaration and part.name.startswith("numba_")]:
        module.link_in(llvm.parse_assembly(NEVER_CALLED.format(name)))
        module.get_function(name).linkage = "internal"
    return machine().emit_object(module)


NEVER_CALLED = "declare void @llvm.trap() define void @{}() {{ call void @llvm.trap() unreachable }}"


def keep(name: str, digest: str, code: bytes, symbol: str) -> int:
    """Keep code in a file, if there is a folder for that; returns the address of the entry.

    Args:
        name: of the entry.
        digest: of the sources.
        code: in the object format of the system.
        symbol: what the entry is called there.
    """
    told = {"symbol": symbol, "sha256": hashlib.sha256(code).hexdigest()}
    refusals = []
    for folder in _folders():
        try:
            write_private(folder / _file(name, digest), json.dumps(told).encode() + b"\n" + code)
            break
        except OsimliteError as error:
            refusals.append(str(error))
    else:
        _tell_once(f"machine code is compiled anew in every run, since it can be kept nowhere: {'; '.join(refusals)}")
    return _link(code, symbol)


@cache
def _tell_once(sentence: str) -> None:
    _log.warning(sentence)


def _link(code: bytes, symbol: str) -> int:
    """Make code ready to run; returns the address of a symbol in it."""
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    _kept.append(engine)
    return engine.get_function_address(symbol)


def machine() -> Any:
    """This processor."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    cpu, features = _processor()
    return llvm.Target.from_default_triple().create_target_machine(cpu=cpu, features=features, opt=3, jit=True)


@cache
def _processor() -> tuple[str, str]:
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def _file(name: str, digest: str) -> str:
    """What a file is called."""
    return f"{name}-{hashlib.sha256(f'{digest} {_makers()}'.encode()).hexdigest()[:16]}.code"


@cache
def _makers() -> str:
    """What made the code, and for what."""
    return repr((numba_version(), llvmlite.__version__, sys.platform, *_processor()))


@cache
def numba_version() -> str:
    """Of numba, which is not loaded to find out; importlib.metadata alone takes as long to load as all machine code."""
    spec = find_spec("numba")
    told = Path(spec.origin).with_name("_version.py").read_text("utf-8") if spec is not None and spec.origin else ""
    result = re.search(r'"version": "(.+)"', told)
    if result is not None:
        return result[1]
    from importlib.metadata import version

    return version("numba")


@contextmanager
def alone() -> Iterator[bool]:
    """Whether no other process of the user makes code where nobody waits for it."""
    for folder in _folders():
        place = folder / "compiling"
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if place.exists() and time.time() - place.stat().st_mtime > LONGEST:
                place.unlink()
            os.close(os.open(place, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        except FileExistsError:
            break
        except OSError:
            continue
        try:
            yield True
        finally:
            place.unlink(missing_ok=True)
        return
    yield False


def _folders() -> Iterator[Path]:
    """Where files may be, the best place first."""
    if os.environ.get(FOLDER):
        yield Path(os.environ[FOLDER])
        return
    yield Path(__file__).parents[2] / "kernels" / "__pycache__"
    home: str | Path | None = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME")
    # A relative path would lead into whatever folder the program is started in.
    if not home or not os.path.isabs(home):
        try:
            home = Path.home() / ".cache"
        except RuntimeError:
            # The system knows no home of this user, as in some containers.
            return
    yield Path(home) / "osimlite"
