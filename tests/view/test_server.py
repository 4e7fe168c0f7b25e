"""Tests of the page's server with clients that violate the protocol."""

from __future__ import annotations

import json
import logging
import math
import socket

import pytest

import osimlite
from osimlite.mechanics.multibody import build_mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.view import server as module
from osimlite.view.server import HOST, PageServer

HEAD = "POST /assemble HTTP/1.1\r\nHost: 127.0.0.1\r\n"


@pytest.fixture(scope="module")
def running():
    """Yield a server with a short timeout, for a model with a constraint."""
    model = dynamic_walker()
    coupled = osimlite.CoordinateCouplerConstraint(
        name="coupled",
        coupled_coordinates_function=osimlite.LinearFunction(coefficients=(1.0, 0.0)),
        independent_coordinate_names=["RHip_rz"],
        dependent_coordinate_name="LHip_rz",
    )
    model.constraint_set.objects.append(coupled)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "IDLE_TIMEOUT_S", 0.2)
        with PageServer("<p>page</p>", build_mechanism(model)) as server:
            yield server


@pytest.fixture
def server(running, capfd, caplog):
    """Yield the server; then check that it still works and printed nothing."""
    caplog.set_level(logging.DEBUG, "osimlite.view.server")
    yield running
    assert (
        said(running, b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")[0] == 200
    )
    told = capfd.readouterr()
    assert (told.out, told.err) == ("", "")
    failures = [record.exc_info[1] for record in caplog.records if record.exc_info]
    assert [failure for failure in failures if not isinstance(failure, ConnectionError)] == []


def said(server: PageServer, question: bytes) -> tuple[int, bytes]:
    """Send a request, and read until the server closes the connection.

    Returns:
        Status and body; the status is 0 for an answer without a head, as in HTTP 0.9.
    """
    with socket.create_connection((HOST, server.server.server_address[1]), timeout=20) as line:
        line.sendall(question)
        parts = []
        while part := line.recv(65536):
            parts.append(part)
    head, _, body = b"".join(parts).partition(b"\r\n\r\n")
    return int(head.split()[1]) if head.startswith(b"HTTP") else 0, body


def asked(server: PageServer, body: bytes, length: str | None = None) -> tuple[int, dict]:
    head = (
        HEAD
        + f"Content-Length: {len(body) if length is None else length}\r\nConnection: close\r\n\r\n"
    )
    status, answer = said(server, head.encode() + body)
    return status, json.loads(answer)


def test_a_pose_is_found(server):
    status, result = asked(server, json.dumps({"values": [0.1] * 8}).encode())
    assert status == 200 and len(result["values"]) == 8


@pytest.mark.parametrize(
    "body",
    [
        b"", b"{}", b"[]", b"null", b"7", b'"values"', b"\xff", b"{", b'{"values": 5}', b'{"values": "1"}',
        b'{"values": {}}', b'{"values": [1]}', b'{"values": [[1]]}', b'{"values": ["1"]}', b'{"values": [null]}',
        b"[" * 100_000, b'{"values": ' + b"[" * 100_000, b'{"values": [' + b"9" * 400 + b"]}",
        b'{"values": [' + b"9" * 5000 + b"]}",
    ],
)  # fmt: skip
def test_what_is_no_question_is_a_bad_request(server, body):
    status, result = asked(server, body)
    assert status == 400 and result["error"]


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e308", "-1e300", "1e999"])
def test_numbers_that_no_pose_has(server, number):
    """JSON has neither NaN nor infinity, so the answer is an error or finite numbers."""
    status, result = asked(server, f'{{"values": [{", ".join([number] * 8)}]}}'.encode())
    assert status == 200
    assert "error" in result or all(map(math.isfinite, result["values"]))


@pytest.mark.parametrize(
    "length", ["abc", "-1", "+2", "1.5", "0x2", "", "٣", "9" * 30, "1_0", "2, 2"]
)
def test_lengths_that_are_none(server, length):
    assert asked(server, b"{}", length)[0] == 400


def test_too_long_a_question_is_not_read(server):
    assert asked(server, b"{}", "1000001")[0] == 413
    head = HEAD + "Transfer-Encoding: chunked\r\nConnection: close\r\n\r\n2\r\n{}\r\n0\r\n\r\n"
    assert said(server, head.encode())[0] == 400


@pytest.mark.parametrize(
    "part",
    [
        "",
        "GE",
        "GET / HTTP/1.1\r\n",
        "GET / HTTP/1.1\r\nHost: x",
        HEAD + "Content-Length: 10\r\n\r\n{",
    ],
)
def test_half_a_question_is_given_up(server, part):
    assert said(server, part.encode()) == (0, b"")


def test_one_who_hangs_up_does_no_harm(server):
    for part in (b"", b"GET / HTTP/1.1\r\n", HEAD.encode() + b"Content-Length: 10\r\n\r\n{"):
        with socket.create_connection((HOST, server.server.server_address[1])) as line:
            line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            line.sendall(part)


@pytest.mark.parametrize(
    ("head", "status"),
    [
        ("nonsense", 0), ("GET /", 0), ("GET / HTTP/9.9", 0), ("BREW / HTTP/1.1", 501),
        ("GET /" + "x" * 70_000 + " HTTP/1.1", 414), ("GET /%2e%2e/etc/passwd HTTP/1.1", 404),
        ("GET / HTTP/1.1\r\n" + "".join(f"x{n}: y\r\n" for n in range(200)), 431),
    ],
)  # fmt: skip
def test_heads_that_are_none(server, head, status):
    text = f"{head}\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"
    assert said(server, text.encode())[0] == status
