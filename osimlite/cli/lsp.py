"""``osimlite lsp``: the language server."""

from __future__ import annotations

from typing import Annotated

from osimlite.cli._command import Option, command


@command
def lsp(
    stdio: Annotated[
        bool,
        Option("--stdio", help="Speak over standard input and output: what it does in any case."),
    ] = True,
) -> None:
    """Serve an editor: findings while you type, completion, hover, definitions, renaming, mends, outline, formatting.

    An editor starts it and speaks the Language Server Protocol over its standard input and output.
    How to set up VS Code, Neovim, Helix and Emacs is said in docs/editors.md.
    """
    from osimlite.base.require import require

    require("pygls", extra="lsp", purpose="the language server")
    from osimlite.cli.language_server.server import make_server

    make_server().start_io()
