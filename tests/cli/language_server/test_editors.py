"""Tests of Neovim and Emacs, as packaged, with the files in editors/: findings, highlighting, formatting."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("pygls", reason="needs pygls (extra 'lsp')")

TEXT = """\
<?xml version="1.0"?>
<OpenSimDocument Version="40600">
<Model name="m"><gravty>0 0 0</gravty><gravity>0 -9.8   0</gravity></Model></OpenSimDocument>
"""

OTHERS = {
    "ik.xml": '<OpenSimDocument Version="40600">\n<InverseKinematicsTool name="ik"/></OpenSimDocument>\n',
    "pom.xml": "<project/>\n",
    "m.mot": "m\nversion=1\nnRows=1\nnColumns=2\ninDegrees=true\nendheader\ntime\ta\n0\t1\n",
}

NEOVIM = """
vim.wait(60000, function() return #vim.diagnostic.get(0) > 0 end, 50)
for _, found in ipairs(vim.diagnostic.get(0)) do print("finding " .. found.code) end
print("tag " .. vim.fn.synIDattr(vim.fn.synID(2, 3, 1), "name"))
if vim.lsp.buf.format then vim.lsp.buf.format({ timeout_ms = 60000 }) else vim.lsp.buf.formatting_sync(nil, 60000) end
vim.cmd("write")
for _, name in ipairs({ "ik.xml", "m.mot" }) do
  vim.cmd("edit " .. name)
  vim.wait(60000, function() return #vim.diagnostic.get(0) > 0 end, 50)
  print(name .. " finding " .. vim.diagnostic.get(0)[1].code)
end
vim.cmd("edit pom.xml")
print("pom.xml clients " .. vim.tbl_count(vim.lsp.buf_get_clients(0)))
"""

EMACS = """
(package-initialize)
(unless (require 'eglot nil t) (message "no eglot") (kill-emacs))
(require 'osim-mode)
(find-file "m.osim")
(call-interactively #'eglot)
(let ((end (+ (float-time) 60)))
  (while (and (< (float-time) end) (not (progn (flymake-start) (flymake-diagnostics))))
    (accept-process-output nil 0.1)))
(dolist (found (flymake-diagnostics)) (message "finding %s" (flymake-diagnostic-text found)))
(font-lock-ensure)
(goto-char (point-min))
(search-forward "<Model")
(message "tag %S" (get-text-property (1- (point)) 'face))
(eglot-format-buffer)
(save-buffer)
(dolist (name '("ik.xml" "m.mot" "pom.xml")) (find-file name) (message "%s is %s" name major-mode))
"""


@pytest.fixture
def edited(tmp_path: Path):
    """Return a function that opens a file in an editor; it returns the editor's output and the file's text afterwards."""
    if os.name == "nt":
        pytest.skip("the program that editors start here is a shell's")
    for name, text in {"m.osim": TEXT, **OTHERS}.items():
        (tmp_path / name).write_text(text)
    # The editors start `osimlite` from the PATH: let that be the one of this environment.
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "osimlite").write_text(
        f'#!/bin/sh\nexec "{sys.executable}" -m osimlite "$@"\n'
    )
    (tmp_path / "bin" / "osimlite").chmod(0o755)

    def run(editor: str, *words: str) -> tuple[str, str]:
        if shutil.which(editor) is None:
            pytest.skip(f"needs the editor {editor} on the PATH")
        repo = str(Path(__file__).parents[3])
        paths = {"PATH": f"{tmp_path / 'bin'}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": repo}
        homes = dict.fromkeys(
            ("HOME", "XDG_CONFIG_HOME", "XDG_STATE_HOME", "XDG_DATA_HOME"), str(tmp_path)
        )
        done = subprocess.run(
            [editor, *words], cwd=tmp_path, env={**os.environ, **paths, **homes}, capture_output=True, text=True,
            timeout=200, stdin=subprocess.DEVNULL,
        )  # fmt: skip
        return done.stdout + done.stderr, (tmp_path / "m.osim").read_text()

    return run


def test_neovim(edited, repo, tmp_path):
    (tmp_path / "ask.lua").write_text(NEOVIM)
    settings = str(repo / "editors" / "neovim" / "osimlite.lua")
    said, text = edited(
        "nvim", "--headless", "-u", settings, "m.osim", "-c", "luafile ask.lua", "-c", "qa!"
    )
    assert "finding OSIM101" in said and "tag xmlTagName" in said, said
    assert (
        "ik.xml finding OSIM821" in said
        and "m.mot finding OSIM8" in said
        and "pom.xml clients 0" in said
    ), said
    assert "\t\t<gravity>0 -9.8 0</gravity>\n" in text


def test_emacs(edited, repo, tmp_path):
    (tmp_path / "ask.el").write_text(EMACS)
    said, text = edited("emacs", "--batch", "-L", str(repo / "editors" / "emacs"), "-l", "ask.el")
    if "no eglot" in said:
        pytest.skip("needs eglot: Emacs 29, or the package eglot")
    assert "OSIM101" in said and "tag (nxml-element-local-name)" in said, said
    assert (
        "ik.xml is osim-mode" in said
        and "m.mot is osim-table-mode" in said
        and "pom.xml is nxml-mode" in said
    ), said
    assert "\t\t<gravity>0 -9.8 0</gravity>\n" in text
