"""Measure how long after a keystroke the language server underlines an error in a long file.

    python benchmarks/editor.py [--kilobytes 870] [--keystrokes 20]

A real client starts the server as an editor does, and opens a walker with a spring and many markers.
Each keystroke inserts a letter into the name of a contact geometry, or deletes it again. The time
runs from the moment at which the change is sent to the moment at which the findings arrive. The
script prints the median and the longest time; it stops if the wrong text is underlined. OpenSim has
no counterpart.
"""

from __future__ import annotations

import argparse
import asyncio
import statistics
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from lsprotocol import types
from pygls.lsp.client import LanguageClient

import osimlite
from _pair import copy_user_environment
from osimlite.models.dynamic_walker import dynamic_walker

MARKER_BODIES = ("/bodyset/Pelvis", "/bodyset/RightThigh", "/bodyset/LeftShank")
"""Bodies to which the markers belong in turn."""

BYTES_PER_MARKER = 400
"""Upper estimate of the text of a marker, so that the file never becomes much too long."""

CONTACT_NAMES = "RFootContact PlatformContact"
"""Names of the contact geometries of a force in the file."""

TYPED_COLUMN = 2
"""Number of letters of the first name before the inserted letter."""

UNKNOWN_NAME_RULE = "OSIM301"
"""Rule that reports the misspelt name."""


def make_long_model(kilobytes: int) -> str:
    """Return the text of the walker with as many markers as make a file of that size."""
    model = dynamic_walker()
    model.add(osimlite.PathSpring(name="spring0", stiffness=10.0, resting_length=0.2))
    number = 0
    while True:
        # The length of the text is known only after writing it.
        text = osimlite.to_text(model)
        missing = kilobytes * 1000 - len(text)
        if missing <= 0:
            return text
        for _ in range(max(1, missing // BYTES_PER_MARKER)):
            number += 1
            marker = osimlite.Marker(
                name=f"marker{number}",
                socket_parent_frame=MARKER_BODIES[number % 3],
                location=(0.001 * number, 0.1, 0.0),
            )
            model.add(marker)


async def start_server(client: LanguageClient) -> None:
    """Start the language server as an editor does, and wait until it is ready."""
    await client.start_io(sys.executable, "-m", "osimlite", "lsp", env=copy_user_environment())
    await client.initialize_async(types.InitializeParams(capabilities=types.ClientCapabilities()))
    client.initialized(types.InitializedParams())


def make_edit(
    line: int, column: int, *, is_insertion: bool
) -> types.TextDocumentContentChangePartial:
    """Return the change that inserts the letter ``x`` at a position, or that deletes it."""
    start = types.Position(line, column)
    end = types.Position(line, column if is_insertion else column + 1)
    return types.TextDocumentContentChangePartial(
        types.Range(start, end), "x" if is_insertion else ""
    )


async def measure_keystrokes(text: str, keystrokes: int) -> list[float]:
    """Type into a file, and measure when the findings arrive.

    Args:
        text: text of the file.
        keystrokes: number of changes; every other one corrects the name.

    Returns:
        Seconds from each keystroke to its findings.
    """
    client = LanguageClient("benchmark", "1")
    arrivals: asyncio.Queue[tuple[float, list[types.Diagnostic]]] = asyncio.Queue()

    @client.feature(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
    def receive_findings(parameters: types.PublishDiagnosticsParams) -> None:
        # The time is that of the arrival; the queue may be read later.
        arrivals.put_nowait((time.perf_counter(), list(parameters.diagnostics)))

    await start_server(client)
    with TemporaryDirectory() as folder:
        uri = (Path(folder) / "walker.osim").as_uri()
        item = types.TextDocumentItem(uri, "osim", 0, text)
        client.text_document_did_open(types.DidOpenTextDocumentParams(item))
        await arrivals.get()
        # The findings after opening do not count.
        offset = text.index(CONTACT_NAMES) + TYPED_COLUMN
        line = text.count("\n", 0, offset)
        column = offset - text.rfind("\n", 0, offset) - 1
        # The misspelt name has one letter more.
        misspelt_length = len(CONTACT_NAMES.split()[0]) + 1
        misspelt_start = column - TYPED_COLUMN
        misspelt_range = types.Range(
            types.Position(line, misspelt_start),
            types.Position(line, misspelt_start + misspelt_length),
        )
        times = []
        for number in range(keystrokes):
            is_insertion = number % 2 == 0
            edit = make_edit(line, column, is_insertion=is_insertion)
            document = types.VersionedTextDocumentIdentifier(number + 1, uri)
            start = time.perf_counter()
            client.text_document_did_change(types.DidChangeTextDocumentParams(document, [edit]))
            end, findings = await arrivals.get()
            underlined = [
                finding.range for finding in findings if finding.code == UNKNOWN_NAME_RULE
            ]
            assert underlined == ([misspelt_range] if is_insertion else []), underlined
            # A fast answer with wrong findings would not count.
            times.append(end - start)
    await client.shutdown_async(None)
    client.exit(None)
    return times


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--kilobytes", type=int, default=870, help="size of the file, 870 kB by default"
    )
    parser.add_argument(
        "--keystrokes", type=int, default=20, help="number of keystrokes, 20 by default"
    )
    options = parser.parse_args()
    text = make_long_model(options.kilobytes)
    times = [1e3 * t for t in asyncio.run(measure_keystrokes(text, options.keystrokes))]
    line_count = text.count("\n")
    print(f"file: {len(text) / 1000:.0f} kB, {line_count} lines; {len(times)} keystrokes")
    print(
        f"time until the findings arrive: median {statistics.median(times):.0f} ms, "
        f"longest {max(times):.0f} ms"
    )


if __name__ == "__main__":
    main()
