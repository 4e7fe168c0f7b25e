"""JSON-RPC layer that answers malformed requests with an error, where pygls sends nothing."""

from __future__ import annotations

import logging
from typing import Any

from cattrs import Converter
from pygls.exceptions import JsonRpcException, JsonRpcInvalidParams, JsonRpcInvalidRequest
from pygls.protocol import LanguageServerProtocol, default_converter

VERSION = LanguageServerProtocol.VERSION

JSON_ERRORS = ValueError | RecursionError
"""Exceptions that the JSON parser raises for malformed or too deeply nested text."""


class Protocol(LanguageServerProtocol):
    """Language Server Protocol that tolerates editors which violate it."""

    def structure_message(self, data: dict[str, Any]) -> Any:
        """Return the message of a JSON object, or the object itself if it is not a message."""
        if not isinstance(data.get("method", ""), str):
            return data
        try:
            return super().structure_message(data)
        except JsonRpcException:
            return data

    def handle_message(self, message: Any) -> None:
        """Handle a message; answer a malformed request with an error."""
        if getattr(message, "jsonrpc", None) == VERSION:
            super().handle_message(message)
            return
        fields = message if isinstance(message, dict) else {}
        number = fields.get("id", getattr(message, "id", None))
        method = fields.get("method")
        if fields.get("jsonrpc") == VERSION and isinstance(method, str):
            error: JsonRpcException = JsonRpcInvalidParams(
                f"the parameters of {method} do not follow the protocol"
            )
            if "id" not in fields:
                # A notification has no answer; only the log mentions the error.
                self._server.report_server_error(error, JsonRpcException)
                return
        else:
            error = JsonRpcInvalidRequest(f"the message does not follow JSON-RPC {VERSION}")
        self.send_error(error, number)

    def send_error(self, error: JsonRpcException, number: object = None) -> None:
        """Send an error as the answer to a request.

        Args:
            error: error to send.
            number: `id` of the request; null is sent if it is unknown or not an id.
        """
        # Without a number the type of pygls leaves out the `id`, which has to be there and null.
        body = {"code": error.code, "message": error.message}
        self._send_data(
            {
                "jsonrpc": VERSION,
                "id": number if isinstance(number, int | str) else None,
                "error": body,
            }
        )


def shorten_protocol_errors_in_log() -> None:
    """Log malformed requests as one line without a traceback.

    The editor gets an error as an answer. The request is not a failure of the server.
    """

    def plain(record: logging.LogRecord) -> bool:
        if record.exc_info and isinstance(record.exc_info[1], JSON_ERRORS | JsonRpcException):
            record.exc_info = None
        return not record.getMessage().startswith("Unable to deserialize message")

    for name in ("pygls.protocol.json_rpc", "pygls.server"):
        logging.getLogger(name).addFilter(plain)


def create_strict_converter() -> Converter:
    """Return a converter from JSON that rejects other types where a string is required.

    cattrs alone converts null to the string "None".
    """

    def text(value: Any, _: type) -> str:
        if not isinstance(value, str):
            raise ValueError(f"expected a string, found {value!r}")
        return value

    converter: Converter = default_converter()  # type: ignore[no-untyped-call]
    converter.register_structure_hook(str, text)
    return converter
