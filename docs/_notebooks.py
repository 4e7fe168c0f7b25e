"""The notebooks of the manual as pages with their outputs, executed when the site is built.

This is a hook of MkDocs. Outputs are inserted into the pages after their conversion to HTML,
because they are no Markdown. An executed notebook is cached until it, osimlite, an installed
package or a model that it needs changes. With the environment variable ``OSIMLITE_MANUAL=quick`` no
notebook is executed, for the checks of every push.
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
"""Folders in which models that notebooks need are searched."""

PACKAGE = Path(__file__).parents[1] / "osimlite"
"""Sources of osimlite."""

KERNELS = 2
"""Number of notebooks that are executed at a time."""

EXECUTE = os.environ.get("OSIMLITE_MANUAL") != "quick"
"""Whether notebooks are executed."""

_outputs: dict[str, str] = {}
"""HTML of outputs, by the placeholder text in the pages."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for each notebook, as an event of MkDocs."""
    paths = sorted(FOLDER.glob("*.ipynb"))
    load = execute_with_cache if EXECUTE else read
    with ThreadPoolExecutor(KERNELS) as pool:
        for path, notebook in zip(paths, pool.map(load, paths), strict=True):
            text = "\n\n".join(convert_cells(path, notebook))
            files.append(File.generated(config, f"notebooks/{path.stem}.md", content=text))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Link the list of notebooks to their pages instead of their files, as an event of MkDocs."""
    if page.file.src_uri != "notebooks.md":
        return markdown
    return re.sub(r"\((notebooks/\w+)\.ipynb\)", r"(\1.md)", markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Replace the placeholders of outputs by their HTML, as an event of MkDocs."""
    return re.sub(r"<p>(output \S+ \d+ \d+)</p>", lambda match: _outputs[match[1]], html)


def read(path: Path) -> Any:
    """Return a notebook without executing it."""
    return nbformat.read(path, as_version=4)


def execute_with_cache(path: Path) -> Any:
    """Return an executed notebook, from the cache if it is there."""
    folder = user_cache_folder()
    if folder is None:
        return execute_notebook(path)
    cached = folder / f"notebook-{compute_key(path)}.ipynb"
    if cached.exists():
        # The cache removes the entries first that were not used for the longest time.
        cached.touch()
        return read(cached)
    notebook = execute_notebook(path)
    write_cached(cached, nbformat.writes(notebook))
    return notebook


def compute_key(path: Path) -> str:
    """Return a digest of everything that the outputs of a notebook depend on."""
    key = sha256(path.read_bytes())
    # Notebooks list the models that they need in their metadata.
    for name in read(path).metadata.get("needs", []):
        for folder in MODELS:
            if (folder / name).exists():
                key.update((folder / name).read_bytes())
    key.update(list_sources().encode())
    return key.hexdigest()[:32]


@cache
def list_sources() -> str:
    """Return the versions of Python and all packages, and digests of the files of osimlite."""
    versions = sorted(f"{each.name} {each.version}" for each in distributions())
    # Compiled kernels and byte code follow from the sources.
    files = sorted(
        file
        for file in PACKAGE.rglob("*")
        if file.is_file() and file.suffix != ".so" and "__pycache__" not in file.parts
    )
    digests = [f"{file} {sha256(file.read_bytes()).hexdigest()}" for file in files]
    return "\n".join([sys.version, *versions, *digests])


def execute_notebook(path: Path) -> Any:
    """Execute a notebook in a temporary folder with the models that it needs.

    Args:
        path: file of the notebook.

    Returns:
        The notebook, without outputs if a model is missing.
    """
    notebook = read(path)
    needed = notebook.metadata.get("needs", [])
    models = [folder / name for name in needed for folder in MODELS if (folder / name).exists()]
    if len(models) == len(needed):
        # Without this variable, a kernel shows plots as pictures in the notebook.
        environment = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}
        # `!osimlite` in a cell runs the command of this environment, also where the environment is
        # not activated.
        environment["PATH"] = os.pathsep.join(
            [sysconfig.get_path("scripts"), environment.get("PATH", os.defpath)]
        )
        with TemporaryDirectory() as folder:
            for file in models:
                shutil.copy(file, folder)
            client = nbclient.NotebookClient(
                notebook,
                timeout=120,
                kernel_name="python3",
                resources={"metadata": {"path": folder}},
                extra_arguments=["--log-level=ERROR"],
            )
            client.execute(env={**environment, "NO_COLOR": "1"})
    return notebook


def convert_cells(path: Path, notebook: Any) -> Iterator[str]:
    """Convert a notebook to Markdown, and save the HTML of its outputs.

    Args:
        path: file of the notebook.
        notebook: its content, with outputs if it was executed.

    Yields:
        Markdown of each cell, and a placeholder for each output.
    """
    for number, cell in enumerate(notebook.cells):
        if cell.cell_type == "markdown":
            yield cell.source
        else:
            language = "sh" if cell.source.startswith("!") else "python"
            yield f"```{language}\n{cell.source.removeprefix('!')}\n```"
        for index, output in enumerate(cell.get("outputs", [])):
            html = _format_output(output)
            if html:
                key = f"output {path.stem} {number} {index}"
                _outputs[key] = f"<div>{html}</div>"
                yield key
        if number == 0:
            yield f"This page is [a notebook]({path.name}), executed when the manual was built."
    if not any(cell.get("outputs") for cell in notebook.cells):
        needed = notebook.metadata.get("needs", [])
        reason = f", since it needs {', '.join(needed)}" if needed else ""
        yield f"*It was not executed this time{reason}.*"


def _format_output(output: Any) -> str:
    """Return the HTML of an output as in Jupyter, empty for standard error."""
    data = output.get("data", {})
    if "text/html" in data:
        # A shadow root keeps the styles of the page away from the output.
        return f"<template shadowrootmode='open'>{data['text/html']}</template>"
    if "image/png" in data:
        return f'<img alt="" src="data:image/png;base64,{data["image/png"].strip()}">'
    text = (
        data.get("text/plain", "")
        if output.output_type != "stream" or output.name == "stderr"
        else output.text
    )
    return f"<pre>{escape(text)}</pre>" if text else ""
