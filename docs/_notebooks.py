"""The notebooks of the manual as pages with all that they show: executed when the site is built.

A hook of MkDocs. Outputs are put into the pages when these are HTML already: nothing in them is
Markdown. An executed notebook is cached until it, osimlite, an installed package or a model that it
needs changes. The environment variable ``OSIMLITE_MANUAL=quick`` builds the site without executing
anything, for the checks of every push.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import sysconfig
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from hashlib import sha256
from html import escape
from importlib.metadata import distributions
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import nbclient
import nbformat
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from osimlite.base.writing import user_cache_folder, write_cached

FOLDER = Path(__file__).parent / "notebooks"
SHARED = Path(os.environ.get("OSIMLITE_SHARED") or Path(__file__).parents[2] / "shared")
MODELS = (FOLDER, SHARED / "corpus" / "models" / "m0014")
"""Where the models that notebooks need are looked for."""

PACKAGE = Path(__file__).parents[1] / "osimlite"
"""Sources of osimlite."""

KERNELS = 2
"""How many notebooks are executed at a time."""

EXECUTE = os.environ.get("OSIMLITE_MANUAL") != "quick"
"""Whether notebooks are executed."""

_outputs: dict[str, str] = {}
"""HTML of what cells show, by the text that stands for it in the pages."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for each notebook."""
    notebooks = sorted(FOLDER.glob("*.ipynb"))
    with ThreadPoolExecutor(KERNELS) as pool:
        for path, notebook in zip(
            notebooks, pool.map(execute_once if EXECUTE else read, notebooks), strict=True
        ):
            text = "\n\n".join(parts(path, notebook))
            files.append(File.generated(config, f"notebooks/{path.stem}.md", content=text))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let the list of notebooks lead to the pages."""
    if page.file.src_uri != "notebooks.md":
        return markdown
    return re.sub(r"\((notebooks/\w+)\.ipynb\)", r"(\1.md)", markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Put outputs where they belong."""
    return re.sub(r"<p>(output \S+ \d+ \d+)</p>", lambda match: _outputs[match[1]], html)


def read(path: Path) -> Any:
    """Read a notebook."""
    return nbformat.read(path, as_version=4)


def execute_once(path: Path) -> Any:
    """Return a notebook with its outputs, which are cached."""
    folder = user_cache_folder()
    if folder is None:
        return execute(path)
    cached = folder / f"notebook-{compute_key(path)}.ipynb"
    if cached.exists():
        # Entries that were used are kept longest.
        cached.touch()
        return read(cached)
    notebook = execute(path)
    write_cached(cached, nbformat.writes(notebook))
    return notebook


def compute_key(path: Path) -> str:
    """Return a name of all that the outputs of a notebook depend on."""
    key = sha256(path.read_bytes())
    for name in read(path).metadata.get("needs", []):
        for folder in MODELS:
            if (folder / name).exists():
                key.update((folder / name).read_bytes())
    key.update(list_sources().encode())
    return key.hexdigest()[:32]


@cache
def list_sources() -> str:
    """Return the versions of all packages, and digests of the files of osimlite."""
    versions = sorted(f"{each.name} {each.version}" for each in distributions())
    files = sorted(
        file
        for file in PACKAGE.rglob("*")
        if file.is_file() and file.suffix != ".so" and "__pycache__" not in file.parts
    )
    digests = [f"{file} {sha256(file.read_bytes()).hexdigest()}" for file in files]
    return "\n".join([sys.version, *versions, *digests])


def execute(path: Path) -> Any:
    """Return a notebook with its outputs, run in a folder of its own; without them if a model that it needs is missing."""
    notebook = read(path)
    needed = notebook.metadata.get("needs", [])
    found = [folder / name for name in needed for folder in MODELS if (folder / name).exists()]
    if len(found) == len(needed):
        # Pictures are shown by the backend that a kernel chooses where none is asked for.
        environment = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}
        # `!osimlite` in a cell runs the command of this environment, also where the environment is
        # not activated.
        environment["PATH"] = os.pathsep.join(
            [sysconfig.get_path("scripts"), environment.get("PATH", os.defpath)]
        )
        with TemporaryDirectory() as folder:
            for file in found:
                shutil.copy(file, folder)
            client = nbclient.NotebookClient(
                notebook, timeout=120, kernel_name="python3", resources={"metadata": {"path": folder}},
                extra_arguments=["--log-level=ERROR"],
            )  # fmt: skip
            client.execute(env={**environment, "NO_COLOR": "1"})
    return notebook


def parts(path: Path, notebook: Any) -> Iterator[str]:
    """Yield the Markdown of each cell, and a text for each output."""
    for number, cell in enumerate(notebook.cells):
        if cell.cell_type == "markdown":
            yield cell.source
        else:
            language = "sh" if cell.source.startswith("!") else "python"
            yield f"```{language}\n{cell.source.removeprefix('!')}\n```"
        for place, output in enumerate(cell.get("outputs", [])):
            html = _html(output)
            if html:
                key = f"output {path.stem} {number} {place}"
                _outputs[key] = f"<div>{html}</div>"
                yield key
        if number == 0:
            yield f"This page is [a notebook]({path.name}), as it was executed when the manual was built."
    if not any(cell.get("outputs") for cell in notebook.cells):
        needed = notebook.metadata.get("needs", [])
        yield f"*It was not executed this time{', since it needs ' * bool(needed)}{', '.join(needed)}.*"


def _html(output: Any) -> str:
    """What Jupyter shows of an output, but for remarks of programs on standard error."""
    data = output.get("data", {})
    if "text/html" in data:
        # Apart from the page, whose styles are not meant for it.
        return f"<template shadowrootmode='open'>{data['text/html']}</template>"
    if "image/png" in data:
        return f'<img alt="" src="data:image/png;base64,{data["image/png"].strip()}">'
    text = (
        data.get("text/plain", "")
        if output.output_type != "stream" or output.name == "stderr"
        else output.text
    )
    return f"<pre>{escape(text)}</pre>" if text else ""
