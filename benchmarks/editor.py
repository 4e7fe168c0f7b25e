"""How long after a keystroke the language server underlines a misspelt contact name, in a long file.

OpenSim has no counterpart. A real client starts the server as an editor does, and types into the
file; the time runs from the moment the change is sent until the diagnostics are there.

    python benchmarks/editor.py [--kilobytes 870] [--keystrokes 20]
"""

from __future__ import annotations

import argparse
import asyncio
import os
import statistics
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from lsprotocol import types
from pygls.lsp.client import LanguageClient

import osimlite
from osimlite.models.dynamic_walker import dynamic_walker


def long_walker(kilobytes: int) -> str:
    """The walker with as many markers and springs as make a text of that length."""
    model = dynamic_walker()
    model.add(osimlite.PathSpring(name="spring0", stiffness=10.0, resting_length=0.2))
    bodies = ["/bodyset/Pelvis", "/bodyset/RightThigh", "/bodyset/LeftShank"]
    number = 0
    while True:
        text = osimlite.to_text(model)
        missing = kilobytes * 1000 - len(text)
        if missing <= 0:
            return text
        for _ in range(max(1, missing // 400)):
            number += 1
            place = (0.001 * number, 0.1, 0.0)
            model.add(
                osimlite.Marker(
                    name=f"marker{number}", socket_parent_frame=bodies[number % 3], location=place
                )
            )


async def measure(text: str, keystrokes: int) -> list[float]:
    """Seconds from each of the keystrokes that make and mend a wrong name, to the findings."""
    client, arrived = LanguageClient("benchmark", "1"), asyncio.Queue()  # type: ignore[var-annotated]

    @client.feature(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
    def published(found: types.PublishDiagnosticsParams) -> None:
        arrived.put_nowait((time.perf_counter(), found.diagnostics))

    environment = {
        name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
    }
    await client.start_io(sys.executable, "-m", "osimlite", "lsp", env=environment)
    await client.initialize_async(types.InitializeParams(capabilities=types.ClientCapabilities()))
    client.initialized(types.InitializedParams())
    with TemporaryDirectory() as folder:
        uri = (Path(folder) / "walker.osim").as_uri()
        client.text_document_did_open(
            types.DidOpenTextDocumentParams(types.TextDocumentItem(uri, "osim", 0, text))
        )
        await arrived.get()
        offset = text.index("RFootContact PlatformContact") + 2
        line, column = text.count("\n", 0, offset), offset - text.rfind("\n", 0, offset) - 1
        times = []
        for number in range(keystrokes):
            wrong = number % 2 == 0
            place = types.Range(
                types.Position(line, column), types.Position(line, column + (not wrong))
            )
            change = types.TextDocumentContentChangePartial(place, "x" if wrong else "")
            document = types.VersionedTextDocumentIdentifier(number + 1, uri)
            begun = time.perf_counter()
            client.text_document_did_change(types.DidChangeTextDocumentParams(document, [change]))
            ended, found = await arrived.get()
            underlined = [d.range for d in found if d.code == "OSIM301"]
            expected = types.Range(
                types.Position(line, column - 2), types.Position(line, column + 11)
            )
            assert underlined == ([expected] if wrong else []), underlined
            times.append(ended - begun)
    await client.shutdown_async(None)
    client.exit(None)
    return times


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kilobytes", type=int, default=870)
    parser.add_argument("--keystrokes", type=int, default=20)
    wanted = parser.parse_args()
    text = long_walker(wanted.kilobytes)
    times = [1e3 * t for t in asyncio.run(measure(text, wanted.keystrokes))]
    print(f"file: {len(text) / 1000:.0f} kB, {text.count(chr(10))} lines; {len(times)} keystrokes")
    print(
        f"until underlined: median {statistics.median(times):.0f} ms, longest {max(times):.0f} ms"
    )


if __name__ == "__main__":
    main()
