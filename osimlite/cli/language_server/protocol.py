"""Every question gets an answer: one that is not what the protocol says gets an error, where pygls says nothing."""

from __future__ import annotations

import logging
from typing import Any

from cattrs import Converter
from pygls.exceptions import JsonRpcException, JsonRpcInvalidParams, JsonRpcInvalidRequest
from pygls.protocol import LanguageServerProtocol, default_converter

VERSION = LanguageServerProtocol.VERSION

NO_JSON = ValueError | RecursionError
"""How JSON that is none, or is too deep, shows itself."""


class Protocol(LanguageServerProtocol):
    """The Language Server Protocol for editors that may not keep to it."""

    def structure_message(self, data: dict[str, Any]) -> Any:
        """A message of what a JSON object says; the object itself if that is no message."""
        if not isinstance(data.get("method", ""), str):
            return data
        try:
            return super().structure_message(data)
        except JsonRpcException:
            return data

    def handle_message(self, message: Any) -> None:
        """Do what a message asks for, and answer what is none."""
        if getattr(message, "jsonrpc", None) == VERSION:
            super().handle_message(message)
            return
        said = message if isinstance(message, dict) else {}
        number, method = said.get("id", getattr(message, "id", None)), said.get("method")
        if said.get("jsonrpc") == VERSION and isinstance(method, str):
            error: JsonRpcException = JsonRpcInvalidParams(
                f"the parameters of {method} are not what the protocol says"
            )
            if "id" not in said:
                # Nobody waits for an answer.
                self._server.report_server_error(error, JsonRpcException)
                return
        else:
            error = JsonRpcInvalidRequest(f"this is no message of JSON-RPC {VERSION}")
        self.refuse(error, number)

    def refuse(self, error: JsonRpcException, number: object = None) -> None:
        """Answer a question, of which the number may be unknown, by an error."""
        # Without a number the type of pygls leaves out the `id`, which has to be there and null.
        body = {"code": error.code, "message": error.message}
        self._send_data(
            {
                "jsonrpc": VERSION,
                "id": number if isinstance(number, int | str) else None,
                "error": body,
            }
        )


def keep_log_plain() -> None:
    """What an editor asks wrongly is told to the editor; in the log it is a line, and no failure of the program."""

    def plain(record: logging.LogRecord) -> bool:
        if record.exc_info and isinstance(record.exc_info[1], NO_JSON | JsonRpcException):
            record.exc_info = None
        return not record.getMessage().startswith("Unable to deserialize message")

    for name in ("pygls.protocol.json_rpc", "pygls.server"):
        logging.getLogger(name).addFilter(plain)


def strict_converter() -> Converter:
    """What makes messages of JSON, but no text of what is none: of null, cattrs makes the word None."""

    def text(value: Any, _: type) -> str:
        if not isinstance(value, str):
            raise ValueError(f"{value!r} is no text")
        return value

    converter: Converter = default_converter()  # type: ignore[no-untyped-call]
    converter.register_structure_hook(str, text)
    return converter
