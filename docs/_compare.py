"""Make the pictures of the section "Before and after" of the gallery: screens of a terminal, pages and plots.

    python docs/_compare.py [WORD ...]                     those of this clone, into docs/gallery/after
    python docs/_compare.py --clone FOLDER [WORD ...]      those of another clone, into docs/gallery/before

Without a WORD all pictures are made, otherwise those whose names contain one. The clone of before is of
commit fdb98599; its pictures are tracked and need not be made again. Pages are drawn by Chromium
(OSIMLITE_CHROMIUM names its program if it is not on the PATH), 1280 and 400 pixels wide. Screens of
a terminal have 80 columns. Look at the pictures that you make.
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
"""Largest width and height of a picture, pixels; what is lower is cut off."""
QUALITY = 72
"""Quality of the WebP files, up to 100."""
WAIT_MS = 3000
"""Time between two looks at a page that draws, ms."""
MAX_WAIT_S = 90.0
"""Longest wait for a page, s."""

MAX_COMMAND_S = 120.0
"""Longest run of a command whose output is shown, s."""
MAX_LINES = 300
"""Height of the terminal whose output is shown."""

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
    """Run osimlite of a clone in a folder."""
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
    """Simulate a jump with muscles into the folder `jump`."""
    run_command(clone, folder, "build", "jumper", "-o", "jumper.osim")
    # A file of controls and half a second: the legs push, and the feet leave the ground.
    run_command(clone, folder, "simulate", "jumper.osim", "--to", "0.4", "-o", "jump", *options)


# ------------------------------------------------------------------------------------------------- pictures
def draw_progress(clone: Path, folder: Path) -> Any:
    """What a terminal shows while four commands work, at seconds of processor time."""
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
    """The plot of the states of a jump: its first page."""
    make_jump(clone, folder, "--plot")
    return open_image(folder / "jump" / "states.png")


def draw_report(clone: Path, folder: Path) -> Any:
    """The report of a static optimization, from its second section on."""
    screens.make_inputs(folder)
    run_command(clone, folder, "run", "so.xml", "-o", "results", "--report", "report.html")
    script = "document.querySelectorAll('h2')[1].scrollIntoView()"
    return shoot(folder / "report.html", (1280,), height=1400, script=script)


def draw_viewer(clone: Path, folder: Path) -> Any:
    """The viewer with a jump, at the end of the push-off."""
    make_jump(clone, folder)
    run_command(clone, folder, "view", "jumper.osim", "jump/states.sto", "--html", "page.html")
    return shoot(folder / "page.html", (1280, 400), script="window.osimlite.viewer.setTime(0.25)")


def draw_screenshot(clone: Path, folder: Path) -> Any:
    """The same moment as a picture without a browser."""
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
    """Cells of a notebook with a result."""
    import nbclient
    import nbformat

    cells = [nbformat.v4.new_code_cell(source) for source in NOTEBOOK]
    notebook = nbformat.v4.new_notebook(cells=cells)
    client = nbclient.NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": folder}}
    )
    client.execute(env={**os.environ, "PYTHONPATH": str(clone), "NO_COLOR": "1"})
    (folder / "notebook.html").write_text(format_notebook(notebook), encoding="utf-8")
    return shoot(folder / "notebook.html", (1280, 400), height=1300)


def draw_start(clone: Path, folder: Path) -> Any:
    """The first page of the manual."""
    subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "-q", "-f", clone / "mkdocs.yml", "-d", folder],
        env={**os.environ, "PYTHONPATH": str(clone), "OSIMLITE_MANUAL": "quick"},
        cwd=clone,
        check=True,
        stderr=subprocess.DEVNULL,
    )
    return shoot(folder / "index.html", (1280, 400), height=1100)


def draw_terminal(clone: Path, folder: Path) -> Any:
    """Tables and help at a terminal of 80 columns."""
    screens.make_inputs(folder)
    text = (folder / "walker.osim").read_text(encoding="utf-8")
    wrong = (
        text.replace("/bodyset/LeftShank<", "/bodyset/LeftShnk<")
        .replace("<mass_center>", "<mass_centre>", 1)
        .replace("</mass_center>", "</mass_centre>", 1)
    )
    (folder / "wrong.osim").write_text(wrong, encoding="utf-8")
    lines: list[str] = []
    for command, most in (
        ("validate wrong.osim", 8),
        ("ik model.osim walk.trc -o ik", 12),
        ("simulate walker.osim --to 0.2 -o w", 12),
        ("optimize --help", 24),
    ):
        shown = read_screen(clone, folder, command.split())
        lines += [f"$ osimlite {command}", *shown[:most]]
        lines += [f"... {len(shown) - most} more lines" if len(shown) > most else "", ""]
    return draw_text(lines)


def draw_editor(clone: Path, folder: Path) -> Any:
    """What an editor gets of the language server, and how the server ends."""
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
"""Function of each picture, which takes a clone and an empty folder and returns an image."""


# --------------------------------------------------------------------------------------------------- helpers
def open_image(path: Path) -> Any:
    """Return a picture (pillow image) in colours."""
    from PIL import Image

    with Image.open(path) as image:
        return image.convert("RGB")


def shoot(page: Path, widths: Sequence[int], height: int = 800, script: str = "") -> Any:
    """Return a picture of a page at some widths, side by side.

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
    """Wait until each viewer in a page has drawn its model."""
    drawn = "!window.osimlite || (window.osimlite.viewer?.stage.frames_drawn ?? 0) > 0"
    end = time.monotonic() + MAX_WAIT_S
    window.wait_for_timeout(WAIT_MS)
    while not all(frame.evaluate(drawn) for frame in window.frames):
        if time.monotonic() > end:
            raise TimeoutError("a viewer draws nothing")
        window.wait_for_timeout(WAIT_MS)
    window.wait_for_timeout(WAIT_MS)


def format_notebook(notebook: Any) -> str:
    """Return the cells of an executed notebook as a page like Jupyter's."""
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
    """Return all lines that a command leaves on a terminal of 80 columns."""
    recording = screens.record_command(
        [*arguments], folder, clone=clone, moments=(MAX_COMMAND_S,), height=MAX_LINES
    )
    return recording.last


def draw_text(lines: Sequence[str]) -> Any:
    """Return a picture of lines at a terminal; those that begin with "$" are green."""
    import matplotlib
    from PIL import Image, ImageDraw, ImageFont

    font = ImageFont.truetype(
        str(Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSansMono.ttf"), screens.FONT_SIZE
    )
    width, height = (
        round(font.getlength("m" * screens.COLUMNS)) + 24,
        round(1.3 * screens.FONT_SIZE),
    )
    image = Image.new("RGB", (width, height * len(lines) + 24), "#0d1117")
    draw = ImageDraw.Draw(image)
    for number, text in enumerate(lines):
        color = "#7ee787" if text.startswith("$") else "#e6edf3"
        draw.text((12, 12 + number * height), text, font=font, fill=color)
    return image


def talk_to_server(clone: Path, folder: Path) -> Iterator[str]:
    """Yield lines about a conversation of an editor with the language server."""
    path = folder / "pendulum.osim"
    path.write_text(MARKUP, encoding="utf-8")
    file = {"uri": path.as_uri()}
    server = subprocess.Popen(
        [sys.executable, "-m", "osimlite", "lsp"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(clone)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        # A shell starts jobs in the background with Ctrl-C ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert server.stdin is not None and server.stdout is not None and server.stderr is not None
    to_server, from_server = server.stdin, server.stdout
    findings: list[Any] = []

    def send(method: str, parameters: Any, number: int | None = None) -> None:
        message = {"jsonrpc": "2.0", "method": method, "params": parameters}
        message |= {} if number is None else {"id": number}
        body = json.dumps(message).encode()
        to_server.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
        to_server.flush()

    def receive() -> Any:
        length = 0
        while line := from_server.readline().strip():
            if line.startswith(b"Content-Length:"):
                length = int(line.partition(b":")[2])
        message = json.loads(from_server.read(length))
        if message.get("method") == "textDocument/publishDiagnostics":
            findings[:] = message["params"]["diagnostics"]
        return message

    def ask(method: str, parameters: Any, number: int) -> Any:
        send(method, parameters, number)
        while (message := receive()).get("id") != number:
            pass
        return message.get("result")

    ask("initialize", {"processId": None, "rootUri": folder.as_uri(), "capabilities": {}}, 1)
    send("initialized", {})
    send(
        "textDocument/didOpen",
        {"textDocument": {**file, "languageId": "osim", "version": 1, "text": MARKUP}},
    )
    while not findings:
        receive()
    lines = MARKUP.split("\n")
    number = next(n for n, line in enumerate(lines) if "rodd" in line)
    yield f"$ line {number + 1}: {lines[number].strip()}"
    yield ""
    for name, column in (("at the start", 0), ("at the name", lines[number].index("rodd"))):
        place = {"line": number, "character": column}
        here = [
            each
            for each in findings
            if each["range"]["start"]["line"] <= number <= each["range"]["end"]["line"]
        ]
        actions = ask(
            "textDocument/codeAction",
            {
                "textDocument": file,
                "range": {"start": place, "end": place},
                # An editor sends the findings under the cursor.
                "context": {
                    "diagnostics": [
                        each
                        for each in here
                        if each["range"]["start"]["character"]
                        <= column
                        <= each["range"]["end"]["character"]
                    ]
                },
            },
            2 + column,
        )
        yield f"$ quick fixes with the cursor {name}"
        yield from (f"  {action['title']}"[: screens.COLUMNS] for action in actions or [])
        yield "" if actions else "  (none)"
    column = lines[number].index("<socket")
    edited = lines[number][: column + 1]
    lines[number] = edited
    send(
        "textDocument/didChange",
        {
            "textDocument": {**file, "version": 2},
            "contentChanges": [{"text": "\n".join(lines)}],
        },
    )
    found = ask(
        "textDocument/completion",
        {"textDocument": file, "position": {"line": number, "character": len(edited)}},
        900,
    )
    items = found["items"] if isinstance(found, dict) else found or []
    yield "$ completion after '<' in the joint"
    yield from (f"  {item['label']}" for item in items[:6])
    yield f"  {len(items)} in all" if items else "  (none)"
    yield ""
    yield "$ Ctrl-C"
    started = time.monotonic()
    server.send_signal(signal.SIGINT)
    try:
        _, errors = server.communicate(timeout=5.0)
        said = errors.decode(errors="replace").strip().split("\n")
        yield f"  exit code {server.returncode} after {time.monotonic() - started:.1f} s"
        yield from (f"  {line}"[: screens.COLUMNS] for line in said[-6:] if line)
    except subprocess.TimeoutExpired:
        server.kill()
        server.communicate()
        yield "  still running after 5 s"


def save(image: Any, path: Path) -> None:
    """Write a picture as a small WebP file."""
    width, height = image.size
    # Taller pictures than this are shown in full, but narrower, so that their shape is seen.
    scale = min(1.0, MAX_SIZE[0] / width, MAX_SIZE[1] / height)
    image = image.resize((max(1, round(scale * width)), max(1, round(scale * height))))
    path.parent.mkdir(parents=True, exist_ok=True)
    image.save(path, "WEBP", quality=QUALITY, method=6)


def write_pictures(clone: Path, target: Path, words: Sequence[str]) -> None:
    """Make the pictures whose names contain one of the words, or all, from a clone."""
    for name, draw in DRAW.items():
        if not words or any(word in name for word in words):
            with TemporaryDirectory() as parent:
                # Reports are titled by the name of the folder.
                folder = Path(parent) / "walk"
                folder.mkdir()
                save(draw(clone, folder), target / f"{name}.webp")
            size = (target / f"{name}.webp").stat().st_size
            print(f"wrote {target / name}.webp ({size / 1000.0:.0f} kB)", flush=True)


if __name__ == "__main__":
    given = sys.argv[1:]
    if given[:1] == ["--clone"]:
        write_pictures(Path(given[1]).resolve(), FOLDER / "before", given[2:])
    else:
        write_pictures(ROOT, FOLDER / "after", given)
