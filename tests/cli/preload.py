"""Import everything that commands import, in the process whose copies run them (see `tests.scripts`)."""

from __future__ import annotations

import ast
from contextlib import suppress
from importlib import import_module
from math import inf
from pathlib import Path

import osimlite.cli
from osimlite.cli import _progress


def load_commands() -> None:
    """Import the modules of all commands, and those that are imported inside their functions."""
    for name in osimlite.cli.COMMANDS:
        path = Path(osimlite.cli.__file__).with_name(f"{name.replace('-', '_')}.py")
        osimlite.cli.load_command(name)
        for line in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            # An optional package may be absent; the command that needs it reports that.
            with suppress(ImportError):
                for module in [line.module] if isinstance(line, ast.ImportFrom) else []:
                    import_module(module or "")
    # Pictures need Matplotlib and its list of fonts, which it creates anew for each empty cache;
    # help needs Typer.
    drawing = "matplotlib.figure", "matplotlib.backends.backend_agg", "matplotlib.font_manager"
    for module in (*drawing, "typer.main", "typer.rich_utils"):
        with suppress(ImportError):
            import_module(module)


load_commands()
# Do not print progress on standard error: on a busy machine all work may exceed the time after
# which it appears.
_progress.LONG_S = inf
