"""Tests of commands in a real environment that has only the base dependencies, without numpy."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.bare import BareEnvironment


def test_optional_packages_are_absent(bare: BareEnvironment, tmp_path: Path) -> None:
    done = bare.call(folder=tmp_path, code="import osimlite, numpy")
    assert done.stderr.splitlines()[-1] == "ModuleNotFoundError: No module named 'numpy'"


def test_a_custom_joint_is_validated(bare: BareEnvironment, fixtures: Path, tmp_path: Path) -> None:
    """Joint functions are evaluated without numpy."""
    models = sorted(
        str(path) for path in fixtures.glob("lint/*/*.osim") if b"<CustomJoint" in path.read_bytes()
    )
    assert len(models) > 20
    done = bare.call("validate", "--no-cache", "--format", "json", *models, folder=tmp_path)
    assert done.returncode == 1 and done.stderr == ""
    assert "OSIM413" in {finding["code"] for finding in json.loads(done.stdout)}


def test_the_language_server_needs_its_own_extra_alone(fixtures: Path, tmp_path: Path) -> None:
    """Editors get findings about a custom joint in an environment with the extra `lsp`, without numpy."""
    pytest.importorskip("pygls", reason="needs pygls (extra 'lsp')")
    environment = BareEnvironment(tmp_path / "environment", ("lsp",))
    text = (fixtures / "lint" / "OSIM413" / "fail-01-example.osim").read_text(encoding="utf-8")
    uri = (tmp_path / "m.osim").as_uri()
    document = {"uri": uri, "languageId": "xml", "version": 1, "text": text}
    messages: list[dict[str, Any]] = [
        {
            "id": 1,
            "method": "initialize",
            "params": {"processId": None, "rootUri": None, "capabilities": {}},
        },
        {"method": "initialized", "params": {}},
        {"method": "textDocument/didOpen", "params": {"textDocument": document}},
    ]
    server = environment.start("lsp", folder=tmp_path)
    assert server.stdin is not None and server.stdout is not None
    try:
        for message in messages:
            body = json.dumps({"jsonrpc": "2.0", **message}).encode()
            server.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        server.stdin.flush()
        received: dict[str, Any] = {}
        while received.get("method") != "textDocument/publishDiagnostics":
            header = server.stdout.readline()
            assert header, "the server has ended"
            if header.lower().startswith(b"content-length:"):
                while server.stdout.readline().strip():
                    pass
                received = json.loads(server.stdout.read(int(header.split(b":")[1])))
        assert "OSIM413" in {finding["code"] for finding in received["params"]["diagnostics"]}
    finally:
        server.kill()
        server.communicate()
