"""Tests of the language server with messages that violate the protocol: every request gets an answer."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

pytest.importorskip("pygls", reason="needs pygls (extra 'lsp')")

FILE = {"uri": "file:///walker.osim"}
START = {"line": 0, "character": 0}
EMPTY: tuple[Any, ...] = ({}, None, [], "x", {"textDocument": FILE}, {"position": START})
PARAMETERS, REQUEST, JSON, METHOD = -32602, -32600, -32700, -32601


class Editor:
    """Client of the protocol; it collects the notifications of the server in `remarks`."""

    def __init__(self, server):
        self.server = server
        self.remarks = []

    def send(self, message):
        body = message if isinstance(message, bytes) else json.dumps(message).encode()
        self.server.stdin.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
        self.server.stdin.flush()

    def answer(self):
        """Return the next answer to any request, and collect the notifications before it."""
        while True:
            length = 0
            while line := self.server.stdout.readline().strip():
                if line.startswith(b"Content-Length:"):
                    length = int(line.partition(b":")[2])
            message = json.loads(self.server.stdout.read(length))
            if "method" not in message:
                return message
            self.remarks.append(message)

    def ask(self, method, params, number=1):
        self.send({"jsonrpc": "2.0", "id": number, "method": method, "params": params})
        result = self.answer()
        assert result["id"] == number
        return result


@pytest.fixture(scope="module")
def editor(fixtures, tmp_path_factory):
    log = tmp_path_factory.mktemp("lsp") / "log"
    command = [sys.executable, "-m", "osimlite", "lsp"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with log.open("wb") as stream, subprocess.Popen(command, stderr=stream, **pipes) as server:
        result = Editor(server)
        result.ask("initialize", {"processId": None, "rootUri": None, "capabilities": {}})
        text = (fixtures / "walker" / "DynamicWalkerModel.osim").read_text()
        document = {**FILE, "languageId": "osim", "version": 1, "text": text}
        result.send({"jsonrpc": "2.0", "method": "initialized", "params": {}})
        result.send(
            {
                "jsonrpc": "2.0",
                "method": "textDocument/didOpen",
                "params": {"textDocument": document},
            }
        )
        yield result
        # The server still works after all invalid messages.
        assert "result" in result.ask(
            "textDocument/hover", {"textDocument": FILE, "position": START}
        )
        assert "result" in result.ask("shutdown", None)
        result.send({"jsonrpc": "2.0", "method": "exit"})
        assert result.server.wait(20) == 0
    assert "Traceback" not in log.read_text()


def _at(line: Any, character: Any) -> dict[str, Any]:
    return {"textDocument": FILE, "position": {"line": line, "character": character}}


@pytest.mark.parametrize(
    ("method", "params"),
    [
        *(("hover", params) for params in EMPTY),
        *(("hover", {"textDocument": FILE, "position": place}) for place in (*EMPTY[:3], [0, 0], "0:0")),
        *(("hover", _at(line, 0)) for line in (*EMPTY[:4], -1, 2**31, 10**30)),
        *(("hover", _at(0, character)) for character in (*EMPTY[:4], -1, 2**40)),
        *(("hover", {"textDocument": {"uri": uri}, "position": START}) for uri in (*EMPTY, 5, "file:///not-open")),
        *(("formatting", {"textDocument": FILE, "options": {"tabSize": size, "insertSpaces": True}})
          for size in (*EMPTY[:4], -1)),
        ("formatting", {"textDocument": FILE, "options": {}}),
        ("rename", {**_at(0, 0), "newName": None}),
        ("rename", _at(0, 0)),
        ("references", _at(0, 0)),
        *((method, {}) for method in ("completion", "definition", "codeAction", "prepareRename", "documentSymbol",
                                      "foldingRange", "formatting", "rename", "references")),
    ],
)  # fmt: skip
def test_parameters_that_are_none_are_an_error(editor, method, params):
    result = editor.ask(f"textDocument/{method}", params)
    assert result["error"]["code"] == PARAMETERS and "result" not in result
    assert result["error"]["message"] and "data" not in result["error"]


@pytest.mark.parametrize("number", [7, "seven"])
def test_the_answer_has_the_number_of_the_question(editor, number):
    assert editor.ask("textDocument/hover", {}, number)["error"]["code"] == PARAMETERS


@pytest.mark.parametrize(
    ("message", "number", "code"),
    [
        ({"jsonrpc": "2.0", "id": 2, "method": "textDocument/hover"}, 2, PARAMETERS),
        ({"jsonrpc": "2.0", "id": 3, "method": 5, "params": {}}, 3, REQUEST),
        ({"jsonrpc": "2.0", "id": 4, "params": {}}, 4, REQUEST),
        ({"jsonrpc": "1.0", "id": 5, "method": "textDocument/hover", "params": {}}, 5, REQUEST),
        ({"id": 6, "method": "textDocument/hover", "params": _at(0, 0)}, 6, REQUEST),
        ({"jsonrpc": "2.0", "id": 7, "method": "none/such", "params": {}}, 7, METHOD),
        ({"jsonrpc": "2.0", "id": None, "method": "textDocument/hover", "params": {}}, None, PARAMETERS),
        ({"jsonrpc": "2.0", "id": {}, "method": "textDocument/hover", "params": {}}, None, PARAMETERS),
        ([], None, REQUEST), (None, None, REQUEST), (5, None, REQUEST), ("hover", None, REQUEST), ({}, None, REQUEST),
        (b"{", None, JSON), (b"\xff\xfe", None, JSON), (b"[" * 100_000, None, JSON),
        (b'{"jsonrpc": "2.0", "id": ' + b"9" * 5000 + b"}", None, JSON),
    ],
)  # fmt: skip
def test_what_is_no_question_is_answered_too(editor, message, number, code):
    editor.send(message)
    result = editor.answer()
    assert (result["id"], result["error"]["code"]) == (number, code)


@pytest.mark.parametrize(
    "method", ["textDocument/didChange", "textDocument/didClose", "$/cancelRequest"]
)
def test_a_notice_that_is_none_changes_nothing(editor, method):
    before = len(editor.remarks)
    editor.send({"jsonrpc": "2.0", "method": method, "params": {}})
    assert "result" in editor.ask("textDocument/hover", _at(0, 0))
    assert any("do not follow the protocol" in str(remark) for remark in editor.remarks[before:])
