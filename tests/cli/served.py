"""Commands in processes that are made in a moment: copies of this one, which has imported what commands import.

    python served.py INPUT OUTPUT ERRORS    the numbers of the files that commands read and write

A line of JSON asks for a command: its words, its folder, its environment. The answer is its exit
code.
"""

from __future__ import annotations

import ast
import gc
import json
import os
import sys
from contextlib import suppress
from importlib import import_module
from math import inf
from pathlib import Path

import osimlite.cli
from osimlite.cli import _progress
from tests.leaving import leave


def load() -> None:
    """Import the commands, and all that stands within their functions."""
    for name in osimlite.cli.COMMANDS:
        source = (
            Path(osimlite.cli.__file__)
            .with_name(f"{name.replace('-', '_')}.py")
            .read_text(encoding="utf-8")
        )
        osimlite.cli.load_command(name)
        for line in ast.walk(ast.parse(source)):
            # What is not installed is missed by the command that needs it.
            with suppress(ImportError):
                for module in [line.module] if isinstance(line, ast.ImportFrom) else []:
                    import_module(module or "")
    # Pictures need Matplotlib and the list of fonts that it makes anew for each empty cache, help
    # needs Typer.
    drawing = "matplotlib.figure", "matplotlib.backends.backend_agg", "matplotlib.font_manager"
    for module in (*drawing, "typer.main", "typer.rich_utils"):
        with suppress(ImportError):
            import_module(module)


def keep_quiet() -> None:
    """Leave out of standard error how far long work is: on a busy machine all work may be long."""
    _progress.LONG_S = inf


def become_one() -> bool:
    """Wait for orders, and return in a process that is to be a command whether its interpreter shall end as well."""
    # Collections of garbage would copy the pages of all that is imported.
    gc.freeze()
    for line in sys.stdin:
        order = json.loads(line)
        child = os.fork()
        if not child:
            for number, own in enumerate(map(int, sys.argv[1:])):
                os.dup2(own, number)
            sys.stdin = os.fdopen(0, encoding="utf-8", closefd=False)
            os.environ.clear()
            os.environ.update(order["environment"])
            os.chdir(order["folder"])
            sys.path[0] = order["folder"]
            sys.argv = ["osimlite", *order["words"]]
            return bool(order["ends"])
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
    raise SystemExit


if __name__ == "__main__":
    load()
    keep_quiet()
    ends = become_one()
    try:
        osimlite.cli.main()
    except SystemExit as ended:
        if ends:
            raise
        leave(ended.code)
