"""The server: open files, and which feature answers which question of an editor."""

from __future__ import annotations

import asyncio
import typing
from typing import Any

from lsprotocol import types
from pygls.exceptions import FeatureRequestError, JsonRpcException, JsonRpcInvalidParams, JsonRpcParseError
from pygls.lsp.server import LanguageServer
from pygls.uris import to_fs_path

from osimlite import __version__
from osimlite.document.formatting import formatted as formatted_text
from osimlite.errors import OsimliteError
from osimlite.lint.settings import settings_for
from osimlite.lsp.analysis import Analysis
from osimlite.lsp.completion import completions
from osimlite.lsp.findings import actions, diagnostics
from osimlite.lsp.hover import hover
from osimlite.lsp.navigation import folds, outline, renaming
from osimlite.lsp.protocol import NO_JSON, Protocol, keep_log_plain, strict_converter
from osimlite.lsp.text import Text
from osimlite.schema.base import Component

PAUSE = 0.02
"""A check begins when nothing has been typed for so long, s."""


class Asked(typing.Protocol):
    """A question about a place in a file."""

    text_document: types.TextDocumentIdentifier
    position: types.Position


class Server(LanguageServer):
    """The server, with the files that are open.

    Attributes:
        open: the analysis of each open file as it is now, by URI.
        known: of each, the last one that could be read.
    """

    def __init__(self) -> None:
        super().__init__(
            "osimlite",
            __version__,
            text_document_sync_kind=types.TextDocumentSyncKind.Incremental,
            protocol_cls=Protocol,
            converter_factory=strict_converter,
        )
        self.open: dict[str, Analysis] = {}
        self.known: dict[str, Analysis] = {}
        self._checks: dict[str, asyncio.Task[None]] = {}

    def report_server_error(self, error: Exception, source: Any) -> None:
        """Tell the editor what nobody asked for; what is no JSON may be a question, and gets an answer."""
        if isinstance(error, NO_JSON) and source is JsonRpcException:
            assert isinstance(self.protocol, Protocol)
            self.protocol.refuse(JsonRpcParseError(f"this is no JSON: {error}"))
        else:
            super().report_server_error(error, source)

    def show(self, uri: str, text: Text, version: int | None) -> None:
        """Take a new version of a file, and check it as soon as nobody types."""
        self.open[uri] = Analysis(text, to_fs_path(uri) or uri)
        self.forget(uri)
        self._checks[uri] = asyncio.get_running_loop().create_task(self._check(uri, version))

    def forget(self, uri: str) -> None:
        """Give up a check that has not begun."""
        task = self._checks.pop(uri, None)
        if task is not None:
            task.cancel()

    async def _check(self, uri: str, version: int | None) -> None:
        await asyncio.sleep(PAUSE)
        analysis = self.open[uri]
        try:
            found = diagnostics(analysis)
        except OsimliteError as error:
            # The settings of the project make no sense; the file itself is checked when they do.
            self.window_show_message(types.ShowMessageParams(types.MessageType.Error, str(error)))
            return
        except Exception as error:
            # The next keystroke may well be checked again: a server that ends takes everything else with it.
            self.report_server_error(error, FeatureRequestError)
            return
        if analysis.is_certain:
            self.known[uri] = analysis
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
        analysis = self.open.get(document.uri)
        if analysis is None:
            raise JsonRpcInvalidParams(f"{document.uri} is not open")
        return analysis

    def component(self, place: Asked) -> tuple[Analysis, Component | None]:
        """The file, and the component that a question is about."""
        analysis, offset = self.at(place)
        return analysis, analysis.target_at(offset)


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
        unit = server.workspace.position_encoding or types.PositionEncodingKind.Utf16
        server.show(document.uri, Text(document.text, unit), document.version)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    async def changed(_: Server, params: types.DidChangeTextDocumentParams) -> None:
        text = server.of(types.TextDocumentIdentifier(params.text_document.uri)).text
        for change in params.content_changes:
            text = text.changed(change)
        server.show(params.text_document.uri, text, params.text_document.version)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    async def closed(_: Server, params: types.DidCloseTextDocumentParams) -> None:
        uri = params.text_document.uri
        server.forget(uri)
        server.open.pop(uri, None)
        server.known.pop(uri, None)
        server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    async def saved(_: Server, params: object) -> None:
        # Settings, meshes and included files may have changed, of which the text knows nothing.
        settings_for.cache_clear()
        for uri, analysis in list(server.open.items()):
            document = server.workspace.text_documents.get(uri)
            server.show(uri, analysis.text, None if document is None else document.version)


def _add_reading(server: Server) -> None:
    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def hovered(_: Server, params: types.HoverParams) -> types.Hover | None:
        return hover(*server.at(params))

    triggers = types.CompletionOptions(trigger_characters=["<", "/", " "])

    @server.feature(types.TEXT_DOCUMENT_COMPLETION, triggers)
    def completed(_: Server, params: types.CompletionParams) -> types.CompletionList:
        analysis, offset = server.at(params)
        known = analysis if analysis.is_certain else server.known.get(params.text_document.uri)
        return types.CompletionList(False, completions(analysis, known, offset))

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def defined(_: Server, params: types.DefinitionParams) -> types.Location | None:
        analysis, component = server.component(params)
        place = None if component is None else analysis.definition(component)
        return None if place is None else types.Location(params.text_document.uri, analysis.text.range(*place))

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    def referred(_: Server, params: types.ReferenceParams) -> list[types.Location]:
        analysis, component = server.component(params)
        if component is None:
            return []
        places = analysis.references(component)
        own = analysis.definition(component) if params.context.include_declaration else None
        if own is not None and own not in places:
            places.insert(0, own)
        return [types.Location(params.text_document.uri, analysis.text.range(*place)) for place in places]

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def outlined(_: Server, params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        return outline(server.of(params.text_document))

    @server.feature(types.TEXT_DOCUMENT_FOLDING_RANGE)
    def folded(_: Server, params: types.FoldingRangeParams) -> list[types.FoldingRange]:
        return folds(server.of(params.text_document))


def _add_writing(server: Server) -> None:
    kinds = types.CodeActionOptions([types.CodeActionKind.QuickFix, types.CodeActionKind.SourceFixAll])

    @server.feature(types.TEXT_DOCUMENT_CODE_ACTION, kinds)
    def acted(_: Server, params: types.CodeActionParams) -> list[types.CodeAction]:
        found = actions(server.of(params.text_document), params.text_document.uri, params.range)
        wanted = params.context.only
        return [a for a in found if not wanted or any((a.kind or "").startswith(kind) for kind in wanted)]

    @server.feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepared(_: Server, params: types.PrepareRenameParams) -> types.PrepareRenamePlaceholder | None:
        analysis, component = server.component(params)
        if component is None or component._index is None or analysis.name_of(component._index) is None:
            return None
        place = types.Range(params.position, params.position)
        offset = analysis.text.offset(params.position)
        spots = [analysis.name_of(component._index), *analysis.references(component)]
        for spot in spots:
            if spot is not None and spot[0] <= offset <= spot[1]:
                place = analysis.text.range(*spot)
        return types.PrepareRenamePlaceholder(place, component.name)

    @server.feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
    def renamed(_: Server, params: types.RenameParams) -> types.WorkspaceEdit | None:
        analysis, component = server.component(params)
        if component is None:
            return None
        try:
            edits = renaming(analysis, component, params.new_name)
        except OsimliteError as error:
            raise JsonRpcInvalidParams(error.message) from None
        return types.WorkspaceEdit({params.text_document.uri: edits})

    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    def formatted(_: Server, params: types.DocumentFormattingParams) -> list[types.TextEdit]:
        analysis = server.of(params.text_document)
        if not analysis.is_certain:
            return []
        content = analysis.text.content
        after = formatted_text(analysis.source)
        whole = analysis.text.range(0, len(content))
        return [] if after == content else [types.TextEdit(whole, after)]
