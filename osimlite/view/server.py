"""The page of a model served to the browser on this machine, with poses that fulfil the model's constraints."""

from __future__ import annotations

import json
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import numpy as np

from osimlite.errors import OsimliteError
from osimlite.multibody.mechanism import Mechanism

HOST = "127.0.0.1"
_LONGEST = 1_000_000


class PageServer:
    """Serves one page at ``http://127.0.0.1:<port>/`` until it is closed; use it in a ``with`` statement.

    Besides the page it answers ``POST /assemble`` with ``{"values": [...]}``, coordinate values in the mechanism's
    order, by the nearest values that fulfil the constraints, or by ``{"error": sentence}``.

    Args:
        page: text of the page (HTML).
        mechanism: whose constraints count.
        port: to listen at; 0 for any that is free.

    Raises:
        OsimliteError: another program listens at the port.
    """

    def __init__(self, page: str, mechanism: Mechanism, port: int = 0) -> None:
        try:
            self._server = ThreadingHTTPServer((HOST, port), _handler(page.encode(), mechanism))
        except (OSError, OverflowError) as error:
            raise OsimliteError(f"cannot listen at port {port}: {error}; choose another one by --port") from None
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://{HOST}:{self._server.server_address[1]}/"

    def wait(self) -> None:
        """Serve until the program is interrupted."""
        while self._thread.is_alive():
            self._thread.join(0.5)

    def close(self) -> None:
        """Stop serving."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def __enter__(self) -> PageServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _handler(page: bytes, mechanism: Mechanism) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            if not self._is_for_us():
                self._answer(HTTPStatus.FORBIDDEN, b"", "text/plain")
            elif self.path == "/":
                self._answer(HTTPStatus.OK, page, "text/html; charset=utf-8")
            else:
                self._answer(HTTPStatus.NOT_FOUND, b"", "text/plain")

        def do_POST(self) -> None:
            length = int(self.headers.get("Content-Length") or 0)
            if not self._is_for_us() or self.path != "/assemble" or not 0 < length < _LONGEST:
                self.close_connection = True
                self._answer(HTTPStatus.FORBIDDEN, b"", "text/plain")
                return
            found = assembled(mechanism, self.rfile.read(length))
            self._answer(HTTPStatus.OK, json.dumps(found).encode(), "application/json")

        def _is_for_us(self) -> bool:
            # Pages of other origins may reach this port by a name of their own; they are not to read the model.
            return (self.headers.get("Host") or "").partition(":")[0] in (HOST, "localhost")

        def _answer(self, status: HTTPStatus, body: bytes, kind: str) -> None:
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(body)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: Any) -> None:
            """Say nothing of every request."""

    return Handler


def assembled(mechanism: Mechanism, question: bytes) -> dict[str, Any]:
    """The answer to the page's question for a pose that fulfils the constraints."""
    try:
        values = np.array(json.loads(question)["values"], dtype=float)
        if not np.isfinite(values).all():
            return {"error": "a coordinate value is no number"}
        return {"values": mechanism.assemble(values).tolist()}
    except OsimliteError as error:
        return {"error": error.message}
    except (ValueError, KeyError, TypeError):
        return {"error": "the question is no list of values"}
