"""Tests of `tests.scripts`, which runs scripts in forks of a process."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.scripts import run_script

MODULES = ("json",)


def test_a_script_has_its_folder_words_and_streams(tmp_path: Path) -> None:
    code = "import os, sys\nprint(os.getcwd(), sys.argv[1:])\nprint('no', file=sys.stderr)\nassert not sys.stdin.read()"
    done = run_script(code, "a", 2, folder=tmp_path, modules=MODULES)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{tmp_path} ['a', '2']\n", "no\n")
    # Output of the previous script is not repeated.
    assert run_script("", modules=MODULES).stdout == ""


def test_a_script_that_fails_crashes_or_hangs_is_an_error_and_the_next_runs() -> None:
    done = run_script("import sys; sys.exit(3)", check=False, modules=MODULES)
    assert done.returncode == 3
    crash = "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"
    assert run_script(crash, check=False, modules=MODULES).returncode == -11
    with pytest.raises(subprocess.CalledProcessError) as failed:
        run_script("1 / 0", modules=MODULES)
    assert "ZeroDivisionError" in failed.value.stderr
    with pytest.raises(subprocess.TimeoutExpired):
        run_script("import time; time.sleep(60)", timeout=0.2, modules=MODULES)
    assert run_script("x = 1\nprint(x)", modules=MODULES).stdout == "1\n"


def test_a_script_ends_as_python_does() -> None:
    code = (
        "import atexit, ctypes, sys, threading, time\n"
        "atexit.register(print, 'last')\n"
        "threading.Thread(target=lambda: (time.sleep(0.1), print('thread'))).start()\n"
        "ctypes.CDLL(None).puts(b'in C')\n"
        "sys.exit('words')"
    )
    done = run_script(code, check=False, modules=MODULES)
    assert (done.returncode, done.stderr) == (1, "words\n")
    assert done.stdout.split("\n") in (
        ["thread", "last", "in C", ""],
        ["in C", "thread", "last", ""],
    )
    assert run_script("import sys; sys.exit()", modules=MODULES).returncode == 0
