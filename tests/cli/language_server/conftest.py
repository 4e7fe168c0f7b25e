"""Fixtures of an editor that talks to the language server over standard input and output."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

pytest.importorskip("pytest_lsp", reason="needs pytest-lsp and pygls (extra 'dev')")

import pytest_asyncio
import pytest_lsp
from lsprotocol import types

OPENED: set[str] = set()
"""URIs of the files that the current test has opened."""


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def server(
    tmp_path_factory: pytest.TempPathFactory,
) -> AsyncIterator[pytest_lsp.LanguageClient]:
    """Yield a client of a server that the tests of a module share, because starting the process dominates their time."""
    cache = str(tmp_path_factory.mktemp("server-cache"))
    client = pytest_lsp.make_test_lsp_client()
    await client.start_io(
        *(sys.executable, "-m", "osimlite", "lsp", "--stdio"),
        env={**os.environ, "XDG_CACHE_HOME": cache, "LOCALAPPDATA": cache},
    )
    capabilities = pytest_lsp.client_capabilities("visual-studio-code")
    await client.initialize_session(types.InitializeParams(capabilities=capabilities))
    yield client
    await client.shutdown_session()
    await client.stop()


@pytest_asyncio.fixture(loop_scope="module")
async def client(server: pytest_lsp.LanguageClient) -> AsyncIterator[pytest_lsp.LanguageClient]:
    """Yield the client, and close the files that the test has opened."""
    OPENED.clear()
    yield server
    for uri in OPENED:
        document = types.TextDocumentIdentifier(uri)
        server.text_document_did_close(types.DidCloseTextDocumentParams(document))
    # Messages arrive in order: all diagnostics of these files come before this answer, none during
    # the next test.
    question = types.HoverParams(types.TextDocumentIdentifier("file:///none"), types.Position(0, 0))
    with pytest.raises(Exception, match="is not open"):
        await server.text_document_hover_async(question)
    assert server.error is None


@pytest.fixture
def editor(client):
    """Return a function that opens a file in an editor, given its path and optionally its text."""
    return functools.partial(File, client)


class File:
    """File that is open in an editor, and the changes that a user makes to it."""

    def __init__(self, client, path: Path, text: str | None = None) -> None:
        self.client, self.uri, self.version = client, path.as_uri(), 1
        self.text = path.read_text() if text is None else text

    @property
    def document(self) -> types.TextDocumentIdentifier:
        return types.TextDocumentIdentifier(self.uri)

    def place(self, text: str, within: int = 0, nth: int = 0) -> types.Position:
        offset = -1
        for _ in range(nth + 1):
            offset = self.text.index(text, offset + 1)
        offset += within
        return types.Position(
            self.text.count("\n", 0, offset), offset - self.text.rfind("\n", 0, offset) - 1
        )

    async def open(self) -> list[types.Diagnostic]:
        item = types.TextDocumentItem(self.uri, "osim", self.version, self.text)
        OPENED.add(self.uri)
        self.client.text_document_did_open(types.DidOpenTextDocumentParams(item))
        return await self.checked()

    async def type(self, old: str, new: str) -> list[types.Diagnostic]:
        """Replace the first `old` by `new`, wait for the diagnostics and return them."""
        self.replace(old, new)
        return await self.checked()

    def replace(self, old: str, new: str) -> None:
        """Replace the first `old` by `new`, and notify the server as an editor does."""
        start, end = self.place(old), self.place(old, len(old))
        change = types.TextDocumentContentChangePartial(types.Range(start, end), new)
        self.text = self.text.replace(old, new, 1)
        self.version += 1
        document = types.VersionedTextDocumentIdentifier(self.version, self.uri)
        self.client.text_document_did_change(types.DidChangeTextDocumentParams(document, [change]))

    def save(self) -> None:
        self.client.text_document_did_save(types.DidSaveTextDocumentParams(self.document))

    async def checked(self) -> list[types.Diagnostic]:
        await self.client.wait_for_notification(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
        return list(self.client.diagnostics[self.uri])

    def after(self, edits: list[types.TextEdit]) -> str:
        lines = self.text.splitlines(keepends=True)

        def offset(position: types.Position) -> int:
            return sum(map(len, lines[: position.line])) + position.character

        text = self.text
        for edit in sorted(edits, key=lambda edit: offset(edit.range.start), reverse=True):
            text = text[: offset(edit.range.start)] + edit.new_text + text[offset(edit.range.end) :]
        return text

    def words(self, place: types.Range) -> str:
        assert place.start.line == place.end.line
        return self.text.splitlines()[place.start.line][place.start.character : place.end.character]
