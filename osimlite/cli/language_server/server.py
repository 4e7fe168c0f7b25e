"""The server: open files, and which feature answers which question of an editor."""

from __future__ import annotations

import asyncio
import time
import typing
from collections.abc import Iterable
from typing import Any

from lsprotocol import types
from pygls.exceptions import (
    FeatureRequestError,
    JsonRpcException,
    JsonRpcInvalidParams,
    JsonRpcParseError,
)
from pygls.lsp.server import LanguageServer
from pygls.uris import to_fs_path

from osimlite import __version__
from osimlite.cli.language_server.analysis import Analysis, Target
from osimlite.cli.language_server.completion import completions
from osimlite.cli.language_server.findings import actions, diagnostics
from osimlite.cli.language_server.hover import hover
from osimlite.cli.language_server.navigation import folds, outline
from osimlite.cli.language_server.project import Project
from osimlite.cli.language_server.protocol import (
    NO_JSON,
    Protocol,
    keep_log_plain,
    strict_converter,
)
from osimlite.cli.language_server.text import Text
from osimlite.errors import OsimliteError
from osimlite.io.document.printer import format_document as formatted_text
from osimlite.lint.settings import load_settings

PAUSE = 0.02
"""A check begins when nothing has been typed for so long, s."""
LONG_PAUSE = 0.4
"""And that of what depends on what is typed, s."""
LONGEST_PAUSE = 2.0
"""Of a file whose check takes long, s."""
MEASURING_PAUSE = 1.0
"""Paths and muscles are measured, in another thread, when nothing has been typed for so long, s."""


class Asked(typing.Protocol):
    """A question about a place in a file."""

    text_document: types.TextDocumentIdentifier
    position: types.Position


class Server(LanguageServer):
    """The server, with the files that are open."""

    def __init__(self) -> None:
        super().__init__(
            "osimlite",
            __version__,
            text_document_sync_kind=types.TextDocumentSyncKind.Incremental,
            protocol_cls=Protocol,
            converter_factory=strict_converter,
        )
        self.project = Project()
        self._checks: dict[str, asyncio.Task[None]] = {}
        self._took: dict[str, float] = {}

    def report_server_error(self, error: Exception, source: Any) -> None:
        """Tell the editor what nobody asked for; what is no JSON may be a question, and gets an answer."""
        if isinstance(error, NO_JSON) and source is JsonRpcException:
            assert isinstance(self.protocol, Protocol)
            self.protocol.refuse(JsonRpcParseError(f"this is no JSON: {error}"))
        else:
            super().report_server_error(error, source)

    def show(self, uri: str, text: Text) -> Analysis:
        """Take a new version of a file."""
        result = self.project.open[uri] = Analysis(text, to_fs_path(uri) or uri, recalls=True)
        return result

    def check(self, uri: str, pause: float = PAUSE) -> None:
        """Check a file as soon as nobody types."""
        self.forget(uri)
        self._checks[uri] = asyncio.get_running_loop().create_task(self._check(uri, pause))

    def check_again(self, uris: Iterable[str], pause: float = PAUSE) -> None:
        """Check files whose text is the same, but not what they depend on."""
        for uri in uris:
            self.show(uri, self.project.open[uri].text)
            self.check(uri, pause)

    def forget(self, uri: str) -> None:
        """Give up a check that has not begun."""
        task = self._checks.pop(uri, None)
        if task is not None:
            task.cancel()

    async def _check(self, uri: str, pause: float) -> None:
        # Nothing else is answered meanwhile: what takes long is not begun at every key.
        await asyncio.sleep(max(pause, self._took.get(uri, 0.0)))
        analysis = self.project.open[uri]
        began = time.monotonic()
        try:
            result = diagnostics(analysis)
        except OsimliteError as error:
            # The settings of the project make no sense; the file itself is checked when they do.
            self.window_show_message(types.ShowMessageParams(types.MessageType.Error, str(error)))
            return
        except Exception as error:
            # Nobody waits for this task: what goes wrong in it would be told to no one.
            self.report_server_error(error, FeatureRequestError)
            return
        self._took[uri] = min(time.monotonic() - began, LONGEST_PAUSE)
        self._publish(uri, result)
        if analysis.is_certain:
            self.project.known[uri] = analysis
            if self.project.hold(analysis):
                self.check_again(self.project.depending_on(analysis), LONG_PAUSE)
        if analysis.is_to_be_measured:
            await self._measure(uri, analysis)

    async def _measure(self, uri: str, analysis: Analysis) -> None:
        await asyncio.sleep(MEASURING_PAUSE)
        try:
            report = await asyncio.to_thread(analysis.measured)
        except Exception as error:
            self.report_server_error(error, FeatureRequestError)
            return
        analysis.report = report
        self._publish(uri, diagnostics(analysis))

    def _publish(self, uri: str, found: list[types.Diagnostic]) -> None:
        document = self.workspace.text_documents.get(uri)
        version = None if document is None else document.version
        self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, found, version))

    def at(self, place: Asked) -> tuple[Analysis, int]:
        """The file that a question is about, and the offset in it.

        Raises:
            JsonRpcInvalidParams: the file is not open.
        """
        analysis = self.of(place.text_document)
        return analysis, analysis.text.offset(place.position)

    def of(self, document: types.TextDocumentIdentifier) -> Analysis:
        """The file that a question is about; JsonRpcInvalidParams if it is not open."""
        analysis = self.project.open.get(document.uri)
        if analysis is None:
            raise JsonRpcInvalidParams(f"{document.uri} is not open")
        return analysis

    def target(self, place: Asked) -> Target | None:
        """What a question about a name is about."""
        analysis, offset = self.at(place)
        return analysis.target_at(offset)


def make_server() -> Server:
    """The server with everything that it answers."""
    keep_log_plain()
    server = Server()
    _add_files(server)
    _add_reading(server)
    _add_writing(server)
    return server


def _add_files(server: Server) -> None:
    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    async def opened(_: Server, params: types.DidOpenTextDocumentParams) -> None:
        document = params.text_document
        server.project.unit = server.workspace.position_encoding or types.PositionEncodingKind.Utf16
        server.show(document.uri, Text(document.text, server.project.unit))
        server.check(document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    async def changed(_: Server, params: types.DidChangeTextDocumentParams) -> None:
        uri = params.text_document.uri
        text = server.of(types.TextDocumentIdentifier(uri)).text
        for change in params.content_changes:
            text = text.apply_change(change)
        # A table may have a million rows: it is checked when it is written.
        if not server.show(uri, text).is_table:
            server.check(uri)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    async def closed(_: Server, params: types.DidCloseTextDocumentParams) -> None:
        uri = params.text_document.uri
        server.forget(uri)
        analysis = server.project.close(uri)
        server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))
        if analysis is not None:
            server.check_again(server.project.depending_on(analysis))

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    async def saved(_: Server, params: types.DidSaveTextDocumentParams) -> None:
        # Settings and files that others name may have changed, of which their texts know nothing.
        load_settings.cache_clear()
        files = server.project.open.items()
        server.check_again([uri for uri, file in files if not (file.is_table and file.is_checked)])

    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    async def watched(_: Server, params: types.DidChangeWatchedFilesParams) -> None:
        load_settings.cache_clear()
        changed = {change.uri for change in params.changes}
        is_settings = any(uri.endswith(".toml") for uri in changed)
        files = server.project.open.items()
        server.check_again(
            [uri for uri, file in files if is_settings or not file.is_table or uri in changed]
        )


def _add_reading(server: Server) -> None:
    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def hovered(_: Server, params: types.HoverParams) -> types.Hover | None:
        return hover(*server.at(params))

    triggers = types.CompletionOptions(trigger_characters=["<", "/", " "])

    @server.feature(types.TEXT_DOCUMENT_COMPLETION, triggers)
    def completed(_: Server, params: types.CompletionParams) -> types.CompletionList:
        analysis, offset = server.at(params)
        known = (
            analysis if analysis.is_certain else server.project.known.get(params.text_document.uri)
        )
        return types.CompletionList(False, completions(analysis, known, offset))

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def defined(_: Server, params: types.DefinitionParams) -> types.Location | None:
        target = server.target(params)
        return None if target is None else server.project.location(target)

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    def referred(_: Server, params: types.ReferenceParams) -> list[types.Location]:
        target = server.target(params)
        if target is None:
            return []
        places = server.project.references(target)
        own = server.project.location(target) if params.context.include_declaration else None
        return [own, *places] if own is not None and own not in places else places

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def outlined(_: Server, params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        return outline(server.of(params.text_document))

    @server.feature(types.TEXT_DOCUMENT_FOLDING_RANGE)
    def folded(_: Server, params: types.FoldingRangeParams) -> list[types.FoldingRange]:
        return folds(server.of(params.text_document))


def _add_writing(server: Server) -> None:
    kinds = types.CodeActionOptions(
        [types.CodeActionKind.QuickFix, types.CodeActionKind.SourceFixAll]
    )

    @server.feature(types.TEXT_DOCUMENT_CODE_ACTION, kinds)
    def acted(_: Server, params: types.CodeActionParams) -> list[types.CodeAction]:
        result = actions(server.of(params.text_document), params.text_document.uri, params.range)
        wanted = params.context.only
        return [
            a
            for a in result
            if not wanted or any((a.kind or "").startswith(kind) for kind in wanted)
        ]

    @server.feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepared(
        _: Server, params: types.PrepareRenameParams
    ) -> types.PrepareRenamePlaceholder | None:
        analysis, offset = server.at(params)
        target = analysis.target_at(offset)
        if target is None or target.item is None or server.project.location(target) is None:
            return None
        spots = [*analysis.references(target)]
        if target.file == analysis.file and target.number is not None:
            spots.append(analysis.place_of(target.number))
        place = next((spot for spot in spots if spot[0] <= offset <= spot[1]), (offset, offset))
        return types.PrepareRenamePlaceholder(analysis.text.range(*place), target.item.name)

    @server.feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
    def renamed(_: Server, params: types.RenameParams) -> types.WorkspaceEdit | None:
        target = server.target(params)
        if target is None or target.item is None:
            return None
        try:
            return types.WorkspaceEdit(server.project.renaming(target, params.new_name))
        except OsimliteError as error:
            raise JsonRpcInvalidParams(error.message) from None

    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    def formatted(_: Server, params: types.DocumentFormattingParams) -> list[types.TextEdit]:
        analysis = server.of(params.text_document)
        if not analysis.is_certain:
            return []
        content = analysis.text.content
        after = formatted_text(analysis.source)
        whole = analysis.text.range(0, len(content))
        return [] if after == content else [types.TextEdit(whole, after)]
