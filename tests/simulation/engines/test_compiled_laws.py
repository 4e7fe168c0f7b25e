"""Tests of laws that are compiled individually: private cache files are ignored if damaged or of other sources."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys

import pytest

from osimlite.mechanics.codegen.toolchain import CompilationError, find_compiler
from osimlite.simulation.engines import compiled_laws, result_cache
from osimlite.simulation.engines.compiled_laws import compile_function, load_function

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C++ compiler is installed")


def answer(x: int) -> int:
    """Return six times x; this function compiles faster than any law."""
    return 6 * x


def other_answer(x: int) -> int:
    """Return seven times x; the body differs from that of `answer`."""
    return 7 * x


def untranslatable(x: int) -> int:
    """Use a construct that kernels do not support."""
    return len([x])


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return the folder of the cache, which does not exist yet."""
    monkeypatch.setattr(compiled_laws, "cache_folders", lambda: [tmp_path / "new" / "folder"])
    return tmp_path / "new" / "folder"


def run(address):
    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(address)(8)


def test_a_compiled_function_is_found_again(folder):
    assert load_function("answer", answer, 0) is None
    assert run(compile_function("answer", answer, 0)) == 48
    assert run(load_function("answer", answer, 0)) == 48
    assert all(path.stat().st_mode & 0o077 == 0 for path in (folder, *folder.iterdir()))


def test_an_edited_function_is_compiled_anew(folder):
    compile_function("answer", answer, 0)
    assert load_function("answer", other_answer, 0) is None
    assert run(compile_function("answer", other_answer, 0)) == 56


def test_another_processor_gets_its_own_files(folder, monkeypatch):
    compile_function("answer", answer, 0)
    monkeypatch.setattr(
        compiled_laws, "describe_machine", lambda: ("linux", "x86_64", "new_instructions")
    )
    assert load_function("answer", answer, 0) is None


def test_a_damaged_file_is_not_loaded(folder):
    compile_function("answer", answer, 0)
    library = next(path for path in folder.iterdir() if path.suffix != ".sha256")
    # The loaded library remains; the damaged library is another file.
    content = library.read_bytes()
    for damaged in (content[:-8], b"", content[:99] + b"x" + content[100:]):
        library.unlink()
        library.write_bytes(damaged)
        library.chmod(0o600)
        assert load_function("answer", answer, 0) is None
    assert run(compile_function("answer", answer, 0)) == 48
    assert run(load_function("answer", answer, 0)) == 48


@pytest.mark.skipif(sys.platform == "win32", reason="who may write is not told by bits there")
def test_code_that_others_could_have_written_is_neither_loaded_nor_kept(folder, caplog):
    """Others who can write to the folder could also write a valid checksum."""
    compile_function("answer", answer, 0)
    for mode in (0o775, 0o1777, 0o757):
        folder.chmod(mode)
        assert load_function("answer", answer, 0) is None
    compiled_laws.warn_first_time.cache_clear()
    for path in folder.iterdir():
        path.unlink()
    assert run(compile_function("answer", answer, 0)) == 48
    assert not list(folder.iterdir()) and f"'{folder}' can be written by others" in caplog.text


def test_without_a_folder_the_code_lasts_for_the_process(tmp_path, monkeypatch, caplog):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    monkeypatch.setattr(compiled_laws, "cache_folders", lambda: [blocked / "inside"])
    compiled_laws.warn_first_time.cache_clear()
    for _ in range(2):
        assert run(compile_function("answer", answer, 0)) == 48
    (message,) = caplog.messages
    assert "compiled again in every run" in message and str(blocked) in message


def test_folders(monkeypatch, tmp_path):
    """The cache is in the folder that a variable names, or in the package's folder and then in the user's."""
    monkeypatch.setenv(result_cache.CACHE_VARIABLE, str(tmp_path / "named"))
    assert list(result_cache.cache_folders()) == [tmp_path / "named"]
    monkeypatch.delenv(result_cache.CACHE_VARIABLE)
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    first, last = result_cache.cache_folders()
    assert (first.parent.name, last) == ("kernels", tmp_path / "home" / "osimlite")


def test_a_user_without_a_home(monkeypatch):
    """This happens in a container that runs under a user id without an account."""
    for name in (result_cache.CACHE_VARIABLE, "LOCALAPPDATA", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)

    def nowhere():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(compiled_laws.Path, "home", nowhere)
    (only,) = result_cache.cache_folders()
    assert only.parent.name == "kernels"


def test_a_function_that_cannot_be_translated_is_named(folder):
    with pytest.raises(CompilationError, match="'untranslatable' cannot be compiled"):
        compile_function("untranslatable", untranslatable, 0)


def test_without_a_compiler(folder, monkeypatch):
    monkeypatch.setattr(compiled_laws, "find_compiler", lambda: None)
    with pytest.raises(CompilationError, match=r"no C\+\+ compiler"):
        compile_function("answer", answer, 0)


@pytest.mark.full
def test_a_second_process_compiles_nothing(tmp_path):
    """The files of one process serve the next process, which has no compiler."""
    program = (
        "import sys\n"
        "from osimlite.simulation.engines import machine_code\n"
        "machine_code.prepare_laws(['wrap_sphere'])\n"
        "print(machine_code.is_ready('wrap_sphere'), 'numba' in sys.modules)\n"
    )
    kept = {
        **os.environ,
        "OSIMLITE_KERNELS": "compiler",
        result_cache.CACHE_VARIABLE: str(tmp_path),
    }
    for compiler in ({}, {"CXX": "no-such-compiler"}):
        done = subprocess.run(
            [sys.executable, "-c", program],
            capture_output=True,
            text=True,
            env={**kept, **compiler},
            check=False,
        )
        assert done.stdout.split() == ["True", "False"], done.stderr
