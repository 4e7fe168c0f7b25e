"""``osimlite lsp``: the language server."""

from __future__ import annotations

import os
import signal
from typing import Annotated, NoReturn

from osimlite.cli._command import Option, command
from osimlite.cli._console import complain


@command
def lsp(
    stdio: Annotated[
        bool,
        Option("--stdio", help="Use standard input and output (the default)."),
    ] = True,
) -> None:
    """Start the language server for editors: findings while you type, completion, hover, definitions, renaming, fixes.

    An editor starts this command and uses the Language Server Protocol over standard input and
    output. docs/editors.md shows how to set up VS Code, Neovim, Helix and Emacs.
    """
    from osimlite.base.require import require

    require("pygls", extra="lsp", purpose="the language server")
    signal.signal(signal.SIGINT, _stop)
    from osimlite.cli.language_server.server import create_server

    create_server().start_io()


def _stop(*_: object) -> NoReturn:
    """End the server; its thread that waits for the editor would not end by itself."""
    complain("interrupted")
    os._exit(130)
