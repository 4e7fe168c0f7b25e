"""``osimlite lsp``: the language server."""

from __future__ import annotations

from typing import Annotated

from osimlite.cli._command import Option, command


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
    from osimlite.cli.language_server.server import create_server

    create_server().start_io()
