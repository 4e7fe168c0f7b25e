"""Local web server for the page of a model, which computes poses that fulfil the constraints."""

from __future__ import annotations

import json
import logging
import sys
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import numpy as np

from osimlite.base.text import append_clause
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody.mechanism import Mechanism

_log = logging.getLogger(__name__)

# Not reachable from other machines: the page shows models that may not be public.
HOST = "127.0.0.1"
_MAX_REQUEST_BYTES = 1_000_000
IDLE_TIMEOUT_S = 30.0
"""Time without data from the browser after which a connection is closed (s)."""


class PageServer:
    """Server of one page at ``http://127.0.0.1:<port>/``; a context manager that closes it.

    Besides the page it answers ``POST /assemble`` with ``{"values": [...]}`` (coordinate values in
    the mechanism's order). The answer has the nearest values that fulfil the constraints, or is
    ``{"error": sentence}``. Other requests get an HTTP error status.

    Args:
        page: text of the page (HTML).
        mechanism: mechanism whose constraints the poses fulfil.
        port: port to listen at; 0 for any free port.

    Raises:
        OsimliteError: another program listens at the port.
    """

    def __init__(self, page: str, mechanism: Mechanism, port: int = 0) -> None:
        try:
            self.server = _QuietServer(
                (HOST, port), _make_handler(page.encode(), mechanism, IDLE_TIMEOUT_S)
            )
        except (OSError, OverflowError) as error:
            raise OsimliteError(
                append_clause(
                    f"cannot listen at port {port}: {error}", "choose another one by --port"
                )
            ) from None
        self._thread = threading.Thread(target=self.server.serve_forever, daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Address of the page in the browser."""
        return f"http://{HOST}:{self.server.server_address[1]}/"

    def wait(self) -> None:
        """Serve until the program is interrupted."""
        while self._thread.is_alive():
            # In short pieces, since a join without a limit cannot be interrupted on Windows.
            self._thread.join(0.5)

    def close(self) -> None:
        """Stop the server and wait for its thread."""
        self.server.shutdown()
        self.server.server_close()
        self._thread.join()

    def __enter__(self) -> PageServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _QuietServer(ThreadingHTTPServer):
    # On Windows two programs could listen at one port.
    allow_reuse_address = sys.platform != "win32"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Log at debug level only: a browser may close its connection at any time."""
        _log.debug("a request was not answered", exc_info=True)


class _BadRequest(Exception):
    """Request that cannot be answered, with its HTTP status."""

    def __init__(self, status: HTTPStatus, reason: str) -> None:
        super().__init__(reason)
        self.status = status


def _make_handler(
    page: bytes, mechanism: Mechanism, timeout_s: float
) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        timeout = timeout_s

        def do_GET(self) -> None:
            if not self._is_for_us():
                self._respond(HTTPStatus.FORBIDDEN, b"", "text/plain")
            elif self.path == "/":
                self._respond(HTTPStatus.OK, page, "text/html; charset=utf-8")
            else:
                self._respond(HTTPStatus.NOT_FOUND, b"", "text/plain")

        def do_POST(self) -> None:
            try:
                status = HTTPStatus.OK
                result = assemble_pose(mechanism, self._read_request())
            except _BadRequest as problem:
                status = problem.status
                result = {"error": str(problem)}
                # The rest of a refused request is not the next request.
                self.close_connection = True
            self._respond(status, json.dumps(result).encode(), "application/json")

        def _read_request(self) -> bytes:
            """Return the body of a request for a pose.

            Raises:
                _BadRequest: the request is not for a pose, has no valid length, or is too long.
            """
            if not self._is_for_us() or self.path != "/assemble":
                raise _BadRequest(HTTPStatus.FORBIDDEN, "this server answers its own page only")
            length = self.headers.get("Content-Length", "")
            # `int` would also accept signs, underscores and digits of other scripts.
            if not (length.isascii() and length.isdigit() and len(length) < 20):
                raise _BadRequest(HTTPStatus.BAD_REQUEST, "the request has no valid Content-Length")
            if int(length) > _MAX_REQUEST_BYTES:
                raise _BadRequest(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "the request is too long")
            return self.rfile.read(int(length))

        def _is_for_us(self) -> bool:
            # Pages of other origins may reach this port by another host name; they may not read the
            # model.
            return (self.headers.get("Host") or "").partition(":")[0] in (HOST, "localhost")

        def _respond(self, status: HTTPStatus, body: bytes, content_type: str) -> None:
            self.send_response(status)
            self.send_header("Content-Type", content_type)
            self.send_header("Content-Length", str(len(body)))
            # The next run may show another model at the same address.
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: Any) -> None:
            """Write no log of requests."""

    return Handler


def assemble_pose(mechanism: Mechanism, request: bytes) -> dict[str, Any]:
    """Compute the pose nearest to the values of a request that fulfils the constraints.

    Args:
        mechanism: mechanism of the model.
        request: JSON text of the request, with one value per coordinate (rad, m).

    Returns:
        `values` of the coordinates, or `error` with a message.

    Raises:
        _BadRequest: the request is not a list of one number per coordinate.
    """  # noqa: DOC501 - the error is caught here
    try:
        match json.loads(request):
            case {"values": [*values]} if all(isinstance(value, int | float) for value in values):
                q = np.array(values, dtype=float)
            case _:
                raise ValueError
    except (ValueError, OverflowError, RecursionError):
        raise _BadRequest(
            HTTPStatus.BAD_REQUEST, "expected a list of values in the request"
        ) from None
    if len(q) != len(mechanism.coordinates):
        raise _BadRequest(
            HTTPStatus.BAD_REQUEST,
            f"expected one value for each coordinate ({len(mechanism.coordinates)}), got {len(q)}",
        )
    if not np.isfinite(q).all():
        return {"error": "a coordinate value is not a number"}
    try:
        # The page may send any numbers while a user drags; failures are answered below, not logged.
        with np.errstate(all="ignore"):
            result = mechanism.assemble(q)
    except (OsimliteError, ArithmeticError, np.linalg.LinAlgError) as error:
        return {"error": error.message if isinstance(error, OsimliteError) else "no pose was found"}
    return (
        {"values": result.tolist()} if np.isfinite(result).all() else {"error": "no pose was found"}
    )
