"""Language server: the open files, and the features that an editor can request."""

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
from osimlite.cli.language_server.analysis import DocumentAnalysis, Target
from osimlite.cli.language_server.completion import list_completions
from osimlite.cli.language_server.findings import list_code_actions, list_diagnostics
from osimlite.cli.language_server.hover import describe_cursor
from osimlite.cli.language_server.navigation import list_folding_ranges, list_symbols
from osimlite.cli.language_server.project import Project
from osimlite.cli.language_server.protocol import (
    JSON_ERRORS,
    Protocol,
    create_strict_converter,
    shorten_protocol_errors_in_log,
)
from osimlite.cli.language_server.text import Text
from osimlite.errors import OsimliteError
from osimlite.io.document.printer import format_document as format_source
from osimlite.lint.settings import load_settings

CHECK_DELAY_S = 0.02
"""Time without typing after which a changed file is checked, s."""
DEPENDENT_CHECK_DELAY_S = 0.4
"""Time without typing after which files that depend on a changed one are checked, s."""
MAX_CHECK_DELAY_S = 2.0
"""Longest delay of the next check of a file whose last check was slow, s."""
MEASURING_DELAY_S = 1.0
"""Time without typing after which paths and muscles are measured in another thread, s."""


class DocumentPosition(typing.Protocol):
    """Parameters of a request that name a position in a document."""

    text_document: types.TextDocumentIdentifier
    position: types.Position


class Server(LanguageServer):
    """Language server with the project of its open files."""

    def __init__(self) -> None:
        super().__init__(
            "osimlite",
            __version__,
            text_document_sync_kind=types.TextDocumentSyncKind.Incremental,
            protocol_cls=Protocol,
            converter_factory=create_strict_converter,
        )
        self.project = Project()
        self._pending_checks: dict[str, asyncio.Task[None]] = {}
        self._check_durations: dict[str, float] = {}

    def report_server_error(self, error: Exception, source: Any) -> None:
        """Send an error to the editor, as an answer if it may belong to a request.

        Args:
            error: exception that was raised.
            source: class of errors that pygls assigns it to.
        """
        # pygls only logs malformed JSON, but an editor may be waiting for an answer.
        if isinstance(error, JSON_ERRORS) and source is JsonRpcException:
            assert isinstance(self.protocol, Protocol)
            self.protocol.send_error(JsonRpcParseError(f"the message is not valid JSON: {error}"))
        else:
            super().report_server_error(error, source)

    def analyse(self, uri: str, text: Text) -> DocumentAnalysis:
        """Replace the analysis of an open file by one of a new text.

        Args:
            uri: URI of the open file.
            text: present text of the file.

        Returns:
            Analysis of the new text.
        """
        result = self.project.open[uri] = DocumentAnalysis(
            text, to_fs_path(uri) or uri, use_cached_measures=True
        )
        return result

    def check(self, uri: str, pause: float = CHECK_DELAY_S) -> None:
        """Schedule a check of a file; a new call replaces one that has not started.

        Args:
            uri: URI of the open file.
            pause: time without typing before the check starts, s.
        """
        self.cancel_check(uri)
        self._pending_checks[uri] = asyncio.get_running_loop().create_task(self._check(uri, pause))

    def check_again(self, uris: Iterable[str], pause: float = CHECK_DELAY_S) -> None:
        """Schedule checks of files whose dependencies have changed, but not their text.

        Args:
            uris: URIs of the open files.
            pause: time without typing before the checks start, s.
        """
        for uri in uris:
            self.analyse(uri, self.project.open[uri].text)
            self.check(uri, pause)

    def cancel_check(self, uri: str) -> None:
        """Cancel the scheduled check of a file."""
        task = self._pending_checks.pop(uri, None)
        if task is not None:
            task.cancel()

    async def _check(self, uri: str, pause: float) -> None:
        # A check blocks all other requests, so a file whose last check was slow waits longer after a
        # key press.
        await asyncio.sleep(max(pause, self._check_durations.get(uri, 0.0)))
        analysis = self.project.open[uri]
        start_time = time.monotonic()
        try:
            result = list_diagnostics(analysis)
        except OsimliteError as error:
            # The settings of the project are invalid. The file is checked as soon as they are corrected.
            self.window_show_message(types.ShowMessageParams(types.MessageType.Error, str(error)))
            return
        except Exception as error:
            # No caller awaits this task, so asyncio would drop the exception.
            self.report_server_error(error, FeatureRequestError)
            return
        self._check_durations[uri] = min(time.monotonic() - start_time, MAX_CHECK_DELAY_S)
        self._publish(uri, result)
        # Completion and names use the last readable version while the text is half typed.
        if analysis.is_readable:
            self.project.last_readable[uri] = analysis
            if self.project.publish_unsaved(analysis):
                self.check_again(self.project.list_dependents(analysis), DEPENDENT_CHECK_DELAY_S)
        if analysis.needs_measuring:
            await self._measure(uri, analysis)

    async def _measure(self, uri: str, analysis: DocumentAnalysis) -> None:
        await asyncio.sleep(MEASURING_DELAY_S)
        try:
            report = await asyncio.to_thread(analysis.measure_report)
        except Exception as error:
            self.report_server_error(error, FeatureRequestError)
            return
        analysis.report = report
        self._publish(uri, list_diagnostics(analysis))

    def _publish(self, uri: str, result: list[types.Diagnostic]) -> None:
        document = self.workspace.text_documents.get(uri)
        version = None if document is None else document.version
        self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, result, version))

    def get_position(self, position: DocumentPosition) -> tuple[DocumentAnalysis, int]:
        """Return the analysis and the character offset that a request names.

        Args:
            position: parameters of the request.

        Returns:
            The analysis of the open file, and the offset in its text in characters.

        Raises:
            JsonRpcInvalidParams: the file is not open.
        """
        analysis = self.get_analysis(position.text_document)
        return analysis, analysis.text.offset(position.position)

    def get_analysis(self, document: types.TextDocumentIdentifier) -> DocumentAnalysis:
        """Return the analysis of an open document.

        Raises:
            JsonRpcInvalidParams: the file is not open.
        """
        analysis = self.project.open.get(document.uri)
        if analysis is None:
            raise JsonRpcInvalidParams(f"{document.uri} is not open")
        return analysis

    def find_target(self, position: DocumentPosition) -> Target | None:
        """Return the object or file that the name at a position refers to; None without one."""
        analysis, offset = self.get_position(position)
        return analysis.find_target(offset)


def create_server() -> Server:
    """Return a server with all its features registered."""
    shorten_protocol_errors_in_log()
    server = Server()
    _register_file_events(server)
    _register_queries(server)
    _register_edits(server)
    return server


def _register_file_events(server: Server) -> None:
    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    async def open_document(_: Server, params: types.DidOpenTextDocumentParams) -> None:
        document = params.text_document
        # UTF-16 is the default of the protocol if editor and server have not agreed on another encoding.
        server.project.unit = server.workspace.position_encoding or types.PositionEncodingKind.Utf16
        server.analyse(document.uri, Text(document.text, server.project.unit))
        server.check(document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    async def change_document(_: Server, params: types.DidChangeTextDocumentParams) -> None:
        uri = params.text_document.uri
        text = server.get_analysis(types.TextDocumentIdentifier(uri)).text
        for change in params.content_changes:
            text = text.apply_change(change)
        # A table may have a million rows, so it is checked when it is saved and not at each key.
        if not server.analyse(uri, text).is_table:
            server.check(uri)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    async def close_document(_: Server, params: types.DidCloseTextDocumentParams) -> None:
        uri = params.text_document.uri
        server.cancel_check(uri)
        analysis = server.project.close(uri)
        server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))
        if analysis is not None:
            server.check_again(server.project.list_dependents(analysis))

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    async def save_document(_: Server, params: types.DidSaveTextDocumentParams) -> None:
        # The saved file may be a settings file, a model or a table that other open files use.
        load_settings.cache_clear()
        files = server.project.open.items()
        server.check_again([uri for uri, file in files if not (file.is_table and file.is_checked)])

    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    async def check_after_file_change(_: Server, params: types.DidChangeWatchedFilesParams) -> None:
        load_settings.cache_clear()
        changed = {change.uri for change in params.changes}
        is_settings = any(uri.endswith(".toml") for uri in changed)
        files = server.project.open.items()
        server.check_again(
            # Tables depend on no other file than the settings.
            [uri for uri, file in files if is_settings or not file.is_table or uri in changed]
        )


def _register_queries(server: Server) -> None:
    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def show_hover(_: Server, params: types.HoverParams) -> types.Hover | None:
        return describe_cursor(*server.get_position(params))

    # A tag begins with <, its text after >, a name with a quote, and parts of paths with a slash.
    triggers = types.CompletionOptions(trigger_characters=["<", "/", " ", ">", '"', "'"])

    @server.feature(types.TEXT_DOCUMENT_COMPLETION, triggers)
    def complete(_: Server, params: types.CompletionParams) -> types.CompletionList:
        analysis, offset = server.get_position(params)
        readable = (
            analysis
            if analysis.is_readable
            else server.project.last_readable.get(params.text_document.uri)
        )
        # False: the list is complete, and the editor filters it while the user types on.
        return types.CompletionList(False, list_completions(analysis, readable, offset))

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def find_definition(_: Server, params: types.DefinitionParams) -> types.Location | None:
        target = server.find_target(params)
        return None if target is None else server.project.find_location(target)

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    def find_references(_: Server, params: types.ReferenceParams) -> list[types.Location]:
        target = server.find_target(params)
        if target is None:
            return []
        locations = server.project.find_references(target)
        definition = (
            server.project.find_location(target) if params.context.include_declaration else None
        )
        return (
            [definition, *locations]
            if definition is not None and definition not in locations
            else locations
        )

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def show_outline(_: Server, params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        return list_symbols(server.get_analysis(params.text_document))

    @server.feature(types.TEXT_DOCUMENT_FOLDING_RANGE)
    def show_folding_ranges(
        _: Server, params: types.FoldingRangeParams
    ) -> list[types.FoldingRange]:
        return list_folding_ranges(server.get_analysis(params.text_document))


def _register_edits(server: Server) -> None:
    kinds = types.CodeActionOptions(
        [types.CodeActionKind.QuickFix, types.CodeActionKind.SourceFixAll]
    )

    @server.feature(types.TEXT_DOCUMENT_CODE_ACTION, kinds)
    def offer_code_actions(_: Server, params: types.CodeActionParams) -> list[types.CodeAction]:
        result = list_code_actions(
            server.get_analysis(params.text_document), params.text_document.uri, params.range
        )
        requested_kinds = params.context.only
        return [
            action
            for action in result
            if not requested_kinds
            # Kinds form a hierarchy: `source` includes `source.fixAll`.
            or any((action.kind or "").startswith(action_kind) for action_kind in requested_kinds)
        ]

    @server.feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepare_rename(
        _: Server, params: types.PrepareRenameParams
    ) -> types.PrepareRenamePlaceholder | None:
        analysis, offset = server.get_position(params)
        target = analysis.find_target(offset)
        if target is None or target.item is None or server.project.find_location(target) is None:
            return None
        word_ranges = [*analysis.find_references(target)]
        if target.file == analysis.file and target.number is not None:
            word_ranges.append(analysis.find_label_range(target.number))
        word_at_cursor = next(
            (word_range for word_range in word_ranges if word_range[0] <= offset <= word_range[1]),
            (offset, offset),
        )
        return types.PrepareRenamePlaceholder(
            analysis.text.range(*word_at_cursor), target.item.name
        )

    @server.feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
    def rename(_: Server, params: types.RenameParams) -> types.WorkspaceEdit | None:
        target = server.find_target(params)
        if target is None or target.item is None:
            return None
        try:
            return types.WorkspaceEdit(server.project.compute_rename(target, params.new_name))
        except OsimliteError as error:
            raise JsonRpcInvalidParams(error.message) from None

    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    def format_document(_: Server, params: types.DocumentFormattingParams) -> list[types.TextEdit]:
        analysis = server.get_analysis(params.text_document)
        if not analysis.is_readable:
            return []
        content = analysis.text.content
        formatted = format_source(analysis.source)
        full_range = analysis.text.range(0, len(content))
        # An edit without effect would mark the file as changed.
        return [] if formatted == content else [types.TextEdit(full_range, formatted)]
