"""Make the pictures of the section "Before and after" of the gallery: terminals, pages and plots.

    python docs/_compare.py [WORD ...]                   of this clone, into docs/gallery/after
    python docs/_compare.py --clone FOLDER [WORD ...]    of another clone, into docs/gallery/before

Without a WORD all pictures are made, otherwise those whose names contain one. The clone for
"before" is of commit fdb98599; its pictures are tracked and need not be made again. Chromium draws
the pages, 1280 and 400 pixels wide; set OSIMLITE_CHROMIUM to its program if it is not on the PATH.
Terminals have 80 columns. Look at the pictures that you make.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from docs import _screens as screens

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "docs" / "gallery"
MAX_SIZE = (1000, 1100)
"""Largest width and height of a picture, pixels; larger ones are scaled down."""
QUALITY = 72
"""Quality of the WebP files, up to 100."""
WAIT_MS = 3000
"""Time between two checks of a page that is drawing, ms."""
MAX_WAIT_S = 90.0
"""Longest wait for a page, s."""

MAX_COMMAND_S = 120.0
"""Longest run of a command whose output is shown, s."""
MAX_LINES = 300
"""Height of the terminal whose output is shown, lines."""

NOTEBOOK = (
    "import osimlite\nfrom osimlite.models.jumper import jumper\n\nmodel = jumper()",
    "osimlite.simulate(model, to=0.1)",
    "motion = osimlite.simulate(model, to=0.1)\nosimlite.inverse_dynamics(model, motion)",
    "print(osimlite.inverse_dynamics(model, motion))",
)
"""Cells of the notebook."""

MARKUP = """<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40600">
	<Model name="pendulum">
		<BodySet name="bodyset">
			<objects>
				<Body name="rod">
					<mass>-1</mass>
				</Body>
			</objects>
		</BodySet>
		<JointSet name="jointset">
			<objects>
				<PinJoint name="hinge">
					<socket_parent_frame>/ground</socket_parent_frame>
					<socket_child_frame>/bodyset/rodd</socket_child_frame>
				</PinJoint>
			</objects>
		</JointSet>
	</Model>
</OpenSimDocument>
"""
"""Document that is open in the editor, with a wrong name in line 15."""


def run_command(clone: Path, folder: Path, *arguments: str) -> None:
    """Run a command of osimlite.

    Args:
        clone: clone whose osimlite runs.
        folder: working folder.
        *arguments: arguments of the command.
    """
    environment = {**os.environ, "PYTHONPATH": str(clone)}
    subprocess.run(
        [sys.executable, "-m", "osimlite", *arguments],
        cwd=folder,
        env=environment,
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def make_jump(clone: Path, folder: Path, *options: str) -> None:
    """Simulate a jump with muscles, and write the results into the subfolder `jump`.

    Args:
        clone: clone whose osimlite runs.
        folder: working folder.
        *options: further options of the simulation.
    """
    run_command(clone, folder, "build", "jumper", "-o", "jumper.osim")
    # In this time the legs push off, and the feet leave the ground.
    run_command(clone, folder, "simulate", "jumper.osim", "--to", "0.4", "-o", "jump", *options)


# ----------------------------------------------------------------------------------------- pictures
def draw_progress(clone: Path, folder: Path) -> Any:
    """Draw a terminal while four commands work, at several seconds of processor time."""
    # With processor time, the picture does not depend on other work on the machine.
    os.environ["SCREENS_CLOCK"] = "processor"
    screens.make_inputs(folder)
    commands = (
        "muscles model.osim --coordinate knee_angle_r --plot --points 400",
        "run cmc.xml -o run",
        "fit model.osim long.trc -o fitted",
        "kinematics model.osim long.mot --trc -o kinematics",
    )
    recordings = {
        f"osimlite {command}": screens.record_command(command.split(), folder, clone=clone)
        for command in commands
    }
    screens.draw_screens(recordings, folder / "screens.png")
    return open_image(folder / "screens.png")


def draw_plots(clone: Path, folder: Path) -> Any:
    """Draw the first page of the plot of the states of a jump."""
    make_jump(clone, folder, "--plot")
    return open_image(folder / "jump" / "states.png")


def draw_report(clone: Path, folder: Path) -> Any:
    """Draw the report of a static optimization, from its second section on."""
    screens.make_inputs(folder)
    run_command(clone, folder, "run", "so.xml", "-o", "results", "--report", "report.html")
    script = "document.querySelectorAll('h2')[1].scrollIntoView()"
    return capture_page(folder / "report.html", (1280,), height=1400, script=script)


def draw_viewer(clone: Path, folder: Path) -> Any:
    """Draw the viewer with a jump, at the end of the push-off."""
    make_jump(clone, folder)
    run_command(clone, folder, "view", "jumper.osim", "jump/states.sto", "--html", "page.html")
    return capture_page(
        folder / "page.html", (1280, 400), script="window.osimlite.viewer.setTime(0.25)"
    )


def draw_screenshot(clone: Path, folder: Path) -> Any:
    """Draw the end of the push-off without a browser."""
    make_jump(clone, folder)
    run_command(
        clone,
        folder,
        "view",
        "jumper.osim",
        "jump/states.sto",
        "--at",
        "0.25",
        "--screenshot",
        "picture.png",
    )
    return open_image(folder / "picture.png")


def draw_notebook(clone: Path, folder: Path) -> Any:
    """Draw cells of a notebook with results."""
    import nbclient
    import nbformat

    cells = [nbformat.v4.new_code_cell(source) for source in NOTEBOOK]
    notebook = nbformat.v4.new_notebook(cells=cells)
    client = nbclient.NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": folder}}
    )
    client.execute(env={**os.environ, "PYTHONPATH": str(clone), "NO_COLOR": "1"})
    (folder / "notebook.html").write_text(format_notebook(notebook), encoding="utf-8")
    return capture_page(folder / "notebook.html", (1280, 400), height=1300)


def draw_start(clone: Path, folder: Path) -> Any:
    """Draw the first page of the manual."""
    subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "-q", "-f", clone / "mkdocs.yml", "-d", folder],
        # The first page needs no executed notebooks.
        env={**os.environ, "PYTHONPATH": str(clone), "OSIMLITE_MANUAL": "quick"},
        cwd=clone,
        check=True,
        stderr=subprocess.DEVNULL,
    )
    return capture_page(folder / "index.html", (1280, 400), height=1100)


def draw_terminal(clone: Path, folder: Path) -> Any:
    """Draw tables and help at a terminal of 80 columns."""
    screens.make_inputs(folder)
    text = (folder / "walker.osim").read_text(encoding="utf-8")
    # A misspelt socket and a misspelt property, as users write them.
    wrong = (
        text.replace("/bodyset/LeftShank<", "/bodyset/LeftShnk<")
        .replace("<mass_center>", "<mass_centre>", 1)
        .replace("</mass_center>", "</mass_centre>", 1)
    )
    (folder / "wrong.osim").write_text(wrong, encoding="utf-8")
    lines: list[str] = []
    for command, max_lines in (
        ("validate wrong.osim", 8),
        ("ik model.osim walk.trc -o ik", 12),
        ("simulate walker.osim --to 0.2 -o w", 12),
        ("optimize --help", 24),
    ):
        shown = read_screen(clone, folder, command.split())
        omitted = len(shown) - max_lines
        lines += [f"$ osimlite {command}", *shown[:max_lines]]
        lines += [f"... {omitted} more lines" if omitted > 0 else "", ""]
    return draw_text(lines)


def draw_editor(clone: Path, folder: Path) -> Any:
    """Draw the answers of the language server to an editor, and the end of the server."""
    return draw_text(list(talk_to_server(clone, folder)))


DRAW: dict[str, Callable[[Path, Path], Any]] = {
    "progress": draw_progress,
    "plots": draw_plots,
    "report": draw_report,
    "viewer": draw_viewer,
    "screenshot": draw_screenshot,
    "results": draw_notebook,
    "start": draw_start,
    "terminal": draw_terminal,
    "editor": draw_editor,
}
"""Functions that draw the pictures; each takes a clone and an empty folder."""


# ------------------------------------------------------------------------------------------ helpers
def open_image(path: Path) -> Any:
    """Return the image of a file, in RGB."""
    from PIL import Image

    with Image.open(path) as image:
        return image.convert("RGB")


def capture_page(page: Path, widths: Sequence[int], height: int = 800, script: str = "") -> Any:
    """Return an image of a page at several widths, next to each other.

    Args:
        page: HTML file.
        widths: widths of the window, pixels.
        height: height of the window, pixels.
        script: JavaScript that runs in the page before the picture is taken.
    """
    from PIL import Image
    from playwright.sync_api import sync_playwright

    from tests.browser import BROWSERS, FLAGS

    program = os.environ.get("OSIMLITE_CHROMIUM") or next(filter(None, map(shutil.which, BROWSERS)))
    pictures = []
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=FLAGS)
        for width in widths:
            window = browser.new_page(viewport={"width": width, "height": height})
            window.goto(page.resolve().as_uri())
            wait_for_viewers(window)
            if script:
                window.evaluate(script)
                # The page may move or draw because of the script.
                window.wait_for_timeout(WAIT_MS)
            pictures.append(Image.open(io.BytesIO(window.screenshot(timeout=60_000))))
            window.close()
        browser.close()
    gap = 24
    sheet = Image.new("RGB", (sum(widths) + gap * (len(widths) - 1), height), "#8b949e")
    left = 0
    for picture in pictures:
        sheet.paste(picture, (left, 0))
        left += picture.width + gap
    return sheet


def wait_for_viewers(window: Any) -> None:
    """Wait until each viewer in a page has drawn its model.

    Raises:
        TimeoutError: a viewer has drawn nothing for too long.
    """
    drawn = "!window.osimlite || (window.osimlite.viewer?.stage.frames_drawn ?? 0) > 0"
    end = time.monotonic() + MAX_WAIT_S
    window.wait_for_timeout(WAIT_MS)
    while not all(frame.evaluate(drawn) for frame in window.frames):
        if time.monotonic() > end:
            raise TimeoutError("a viewer draws nothing")
        window.wait_for_timeout(WAIT_MS)
    window.wait_for_timeout(WAIT_MS)


def format_notebook(notebook: Any) -> str:
    """Return the HTML page of an executed notebook, similar to that of Jupyter."""
    parts = [
        "<!doctype html><meta charset='utf-8'><style>body{font:14px sans-serif;margin:1em;max-width:1100px}"
        "pre{white-space:pre-wrap;overflow-wrap:anywhere;margin:.3em 0}.in{background:#f5f5f5;border:1px solid #ddd;"
        "padding:.4em .6em}.out{margin:.6em 0 1.2em}</style>"
    ]
    for cell in notebook.cells:
        parts.append(f"<pre class='in'>{escape(cell.source)}</pre>")
        for output in cell.outputs:
            data = output.get("data", {})
            text = data.get("text/html") or (
                f"<pre>{escape(output.get('text') or data.get('text/plain', ''))}</pre>"
            )
            parts.append(f"<div class='out'>{text}</div>")
    return "".join(parts)


def read_screen(clone: Path, folder: Path, arguments: Sequence[str]) -> list[str]:
    """Return all lines that a command writes to a terminal of 80 columns.

    Args:
        clone: clone whose osimlite runs.
        folder: working folder.
        arguments: arguments of the command.
    """
    recording = screens.record_command(
        [*arguments], folder, clone=clone, moments=(MAX_COMMAND_S,), height=MAX_LINES
    )
    return recording.last


def draw_text(lines: Sequence[str]) -> Any:
    """Return an image of lines at a terminal; those that begin with "$" are green."""
    import matplotlib
    from PIL import Image, ImageDraw, ImageFont

    font = ImageFont.truetype(
        str(Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSansMono.ttf"), screens.FONT_SIZE
    )
    width = round(font.getlength("m" * screens.COLUMNS)) + 24
    height = round(1.3 * screens.FONT_SIZE)
    image = Image.new("RGB", (width, height * len(lines) + 24), "#0d1117")
    draw = ImageDraw.Draw(image)
    for number, text in enumerate(lines):
        color = "#7ee787" if text.startswith("$") else "#e6edf3"
        draw.text((12, 12 + number * height), text, font=font, fill=color)
    return image


class EditorSession:
    """Conversation of an editor with the language server of a clone.

    Args:
        clone: clone whose server runs.
        folder: working folder of the server.
    """

    def __init__(self, clone: Path, folder: Path) -> None:
        self.server = subprocess.Popen(
            [sys.executable, "-m", "osimlite", "lsp"],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(clone)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            # A shell starts jobs in the background with Ctrl-C ignored.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        self.findings: list[Any] = []

    def send(self, method: str, parameters: Any, number: int | None = None) -> None:
        """Send a message to the server.

        Args:
            method: method of the language server protocol.
            parameters: parameters of the method.
            number: number of a request; None for a notification.
        """
        assert self.server.stdin is not None
        message = {"jsonrpc": "2.0", "method": method, "params": parameters}
        message |= {} if number is None else {"id": number}
        body = json.dumps(message).encode()
        self.server.stdin.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
        self.server.stdin.flush()

    def receive(self) -> Any:
        """Return the next message of the server, and save the findings that it publishes."""
        assert self.server.stdout is not None
        length = 0
        while line := self.server.stdout.readline().strip():
            if line.startswith(b"Content-Length:"):
                length = int(line.partition(b":")[2])
        message = json.loads(self.server.stdout.read(length))
        if message.get("method") == "textDocument/publishDiagnostics":
            self.findings = message["params"]["diagnostics"]
        return message

    def request(self, method: str, parameters: Any, number: int) -> Any:
        """Send a request, and return its result.

        Args:
            method: method of the language server protocol.
            parameters: parameters of the method.
            number: number of the request.
        """
        self.send(method, parameters, number)
        # Notifications may come before the response.
        while (message := self.receive()).get("id") != number:
            pass
        return message.get("result")

    def open_document(self, path: Path, text: str) -> None:
        """Open a document, and wait for its findings."""
        capabilities = {"processId": None, "rootUri": path.parent.as_uri(), "capabilities": {}}
        self.request("initialize", capabilities, 1)
        self.send("initialized", {})
        document = {"uri": path.as_uri(), "languageId": "osim", "version": 1, "text": text}
        self.send("textDocument/didOpen", {"textDocument": document})
        while not self.findings:
            self.receive()

    def request_fixes(self, path: Path, line: int, column: int) -> list[Any]:
        """Return the quick fixes at a position of a document.

        Args:
            path: file of the document.
            line: index of the line.
            column: index of the character.
        """
        position = {"line": line, "character": column}
        # An editor sends the findings under the cursor.
        diagnostics = [
            finding
            for finding in self.findings
            if finding["range"]["start"]["line"] <= line <= finding["range"]["end"]["line"]
            and finding["range"]["start"]["character"] <= column
            and column <= finding["range"]["end"]["character"]
        ]
        actions = self.request(
            "textDocument/codeAction",
            {
                "textDocument": {"uri": path.as_uri()},
                "range": {"start": position, "end": position},
                "context": {"diagnostics": diagnostics},
            },
            2 + column,
        )
        return actions or []

    def request_completions(self, path: Path, lines: list[str], line: int) -> list[Any]:
        """Change a document, and return the completions at the end of a line.

        Args:
            path: file of the document.
            lines: new lines of the document.
            line: index of the line.
        """
        file = {"uri": path.as_uri()}
        changes = [{"text": "\n".join(lines)}]
        self.send(
            "textDocument/didChange",
            {"textDocument": {**file, "version": 2}, "contentChanges": changes},
        )
        position = {"line": line, "character": len(lines[line])}
        result = self.request(
            "textDocument/completion", {"textDocument": file, "position": position}, 900
        )
        # The protocol allows a list and an object with a list.
        return result["items"] if isinstance(result, dict) else result or []

    def interrupt(self) -> Iterator[str]:
        """Send Ctrl-C.

        Yields:
            Lines about the end of the server.
        """
        started = time.monotonic()
        self.server.send_signal(signal.SIGINT)
        try:
            _, errors = self.server.communicate(timeout=5.0)
            lines = errors.decode(errors="replace").strip().split("\n")
            yield f"  exit code {self.server.returncode} after {time.monotonic() - started:.1f} s"
            yield from (f"  {line}"[: screens.COLUMNS] for line in lines[-6:] if line)
        except subprocess.TimeoutExpired:
            self.server.kill()
            self.server.communicate()
            yield "  still running after 5 s"


def talk_to_server(clone: Path, folder: Path) -> Iterator[str]:
    """Open the document with a wrong name in an editor, and ask for fixes and completions.

    Args:
        clone: clone whose language server runs.
        folder: working folder.

    Yields:
        Lines about the conversation.
    """
    path = folder / "pendulum.osim"
    path.write_text(MARKUP, encoding="utf-8")
    session = EditorSession(clone, folder)
    session.open_document(path, MARKUP)
    lines = MARKUP.split("\n")
    number = next(n for n, line in enumerate(lines) if "rodd" in line)
    yield f"$ line {number + 1}: {lines[number].strip()}"
    yield ""
    for name, column in (("at the start", 0), ("at the name", lines[number].index("rodd"))):
        actions = session.request_fixes(path, number, column)
        yield f"$ quick fixes with the cursor {name}"
        yield from (f"  {action['title']}"[: screens.COLUMNS] for action in actions)
        yield "" if actions else "  (none)"
    lines[number] = lines[number][: lines[number].index("<socket") + 1]
    items = session.request_completions(path, lines, number)
    yield "$ completion after '<' in the joint"
    yield from (f"  {item['label']}" for item in items[:6])
    yield f"  {len(items)} in all" if items else "  (none)"
    yield ""
    yield "$ Ctrl-C"
    yield from session.interrupt()


def save_image(image: Any, path: Path) -> None:
    """Write an image as a small WebP file."""
    width, height = image.size
    # Large images are scaled down and not cut, so that their complete shape is visible.
    scale = min(1.0, MAX_SIZE[0] / width, MAX_SIZE[1] / height)
    image = image.resize((max(1, round(scale * width)), max(1, round(scale * height))))
    path.parent.mkdir(parents=True, exist_ok=True)
    image.save(path, "WEBP", quality=QUALITY, method=6)


def write_pictures(clone: Path, target: Path, words: Sequence[str]) -> None:
    """Make and write pictures.

    Args:
        clone: clone whose osimlite is shown.
        target: folder of the pictures.
        words: parts of the names of the pictures to make; all pictures if empty.
    """
    for name, draw in DRAW.items():
        if not words or any(word in name for word in words):
            with TemporaryDirectory() as parent:
                # The title of a report is the name of its folder.
                folder = Path(parent) / "walk"
                folder.mkdir()
                save_image(draw(clone, folder), target / f"{name}.webp")
            size = (target / f"{name}.webp").stat().st_size
            print(f"wrote {target / name}.webp ({size / 1000.0:.0f} kB)", flush=True)


if __name__ == "__main__":
    words = sys.argv[1:]
    if words[:1] == ["--clone"]:
        write_pictures(Path(words[1]).resolve(), FOLDER / "before", words[2:])
    else:
        write_pictures(ROOT, FOLDER / "after", words)
