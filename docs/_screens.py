"""Record what a terminal of 80 columns shows while slow commands work.

    python docs/_screens.py [WORD ...]               all commands, or those whose names contain a WORD
    python docs/_screens.py --page                   all commands, into the manual's page screens.md
    python docs/_screens.py --picture FILE NAME ...  draw the screens of the commands of these rows

Each command runs at a terminal that this program emulates. The screen is read after 0.5, 2 and 5
seconds, and then Ctrl-C is sent. The command also runs until Ctrl-C after 0.5 s and after 2 s. The
table has one row for each command: the time of its first output, the last line on the screen at the
three times, and the longest time between Ctrl-C and the end. "finished" means that the command
ended before. Run this after a change of what commands print while they work.

On a busy machine, set SCREENS_CLOCK=processor (Linux only): the times are then the processor time
that the command has used, which is nearly the time on an idle machine.
"""

from __future__ import annotations

import fcntl
import gzip
import os
import pty
import select
import shutil
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import pyte

from osimlite.base.records import dataclass, field

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "screens.md"
"""Page of the manual with the table."""
COLUMNS = 80
LINES = 24
MOMENTS_S = (0.5, 2.0, 5.0)
"""Times after the start of a command at which its screen is read, s."""
MAX_END_S = 20.0
"""Longest wait for the end of a command after Ctrl-C, s."""
MAX_SLOWDOWN = 30.0
"""Largest ratio of time to processor time; after that, the time counts."""
POLL_S = 0.02
"""Interval at which the processor time is read, s."""
REPETITIONS = 60
"""Number of times that a recorded motion is repeated, so that work on it takes seconds."""
MODELS = 40
"""Number of models in the folder of many models."""

FONT_SIZE = 15
"""Height of the letters in pictures, pixels."""

COMMANDS = {
    "build": "build human -o built.osim",
    "validate": "validate many",
    "format": "format many --check",
    "rule": "rule OSIM421",
    "upgrade": "upgrade model.osim -o upgraded.osim",
    "diff": "diff model.osim human.osim",
    "info": "info model.osim",
    "translate": "translate model.osim --to mjcf -o mjcf",
    "translate --check": "translate model.osim --to mjcf --check -o checked",
    "convert": "convert model.osim --motion long.mot -o film.glb",
    "convert, screenshot": "convert model.osim --motion long.mot -o picture.png",
    "view --screenshot": "view model.osim long.mot --screenshot view.png",
    "view --html": "view model.osim long.mot --html view.html",
    "simulate": "simulate jumper.osim --to 60 -o simulated",
    "simulate --plot": "simulate jumper.osim --to 1 --plot -o drawn",
    "simulate --animate": "simulate jumper.osim --to 1 --animate -o drawn",
    "sweep": "sweep walker.osim --vary LHip_rz=-10deg:10deg --samples 4000 -o sweep.parquet",
    "sweep --plot": "sweep walker.osim --vary LHip_rz=-10deg:10deg --samples 1000 --plot"
    " -o sweep.parquet",
    "optimize": "optimize walker.osim --objective distance --vary LHip_rz=-20deg:20deg"
    " --vary RHip_rz=-20deg:20deg",
    "gait": "gait steady-walker --perturb 0.05 --basin -o gait",
    "find-gait": "find-gait walker.osim --vary LHip_rz=-30deg:30deg --vary LHip_rz/speed=-4:4",
    "muscles": "muscles model.osim --coordinate knee_angle_r --plot --points 400",
    "modify": "modify model.osim --replace paths=polynomial -o modified.osim",
    "scale": "scale model.osim long.trc --mass 72 --place -o scaled.osim",
    "fit": "fit model.osim long.trc -o fitted",
    "ik": "ik model.osim long.trc -o ik",
    "ik --plot": "ik model.osim long.trc --plot -o ik",
    "kinematics": "kinematics model.osim long.mot --trc -o kinematics",
    "inverse-dynamics": "inverse-dynamics model.osim long.mot -o moments",
    "static-optimization": "static-optimization model.osim long.mot --forces reserves.xml -o forces",
    "static-optimization --plot": "static-optimization model.osim long.mot --plot -o so",
    "run, scaling": "run scale.xml -o run",
    "run, IK": "run ik_long.xml -o run",
    "run, ID": "run id_long.xml -o run",
    "run, static optimization": "run so_long.xml -o run",
    "run, forward": "run forward_long.xml -o run",
    "run, RRA": "run rra.xml -o run",
    "run, CMC": "run cmc.xml -o run",
    "run, Moco": "run walks.omoco -o run",
    "run --report": "run so_long.xml -o run --report report.html",
    "check-trial": "check-trial .",
    "scone": "scone human-walks",
    "doctor": "doctor",
    "demo": "demo -o demo",
}
"""Arguments of the commands, by the name of the row."""


@dataclass
class Recording:
    """Screens of a terminal while a command worked.

    Attributes:
        first: time of the first output, s; None without any.
        screens: lines of the screen by the time at which it was read, s.
        ended: time after the start at which the command ended by itself, s; None if it did not.
        stopping: time between Ctrl-C and the end, s.
        status: exit code.
        last: lines of the screen at the end.
    """

    first: float | None = None
    screens: dict[float, list[str]] = field(default_factory=dict)
    ended: float | None = None
    stopping: float = 0.0
    status: int = 0
    last: list[str] = field(default_factory=list)


def record_command(
    arguments: list[str],
    folder: Path,
    columns: int = COLUMNS,
    clone: Path = ROOT,
    moments: Sequence[float] = MOMENTS_S,
    height: int = LINES,
) -> Recording:
    """Run osimlite at an emulated terminal, read its screen at several times, and send Ctrl-C.

    Args:
        arguments: arguments of osimlite.
        folder: current folder of the command.
        columns: width of the terminal.
        clone: clone of the repository whose osimlite runs.
        moments: times at which the screen is read, s; the last one is that of Ctrl-C.
        height: height of the terminal.

    Returns:
        Recording of the screens and of the end.
    """
    started = time.monotonic()
    child, terminal = pty.fork()
    if child == 0:
        os.chdir(folder)
        # A shell starts jobs in the background with Ctrl-C ignored.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        environment = {**os.environ, "TERM": "xterm-256color", "PYTHONPATH": str(clone)}
        # This variable would take precedence over the size of the terminal.
        environment.pop("COLUMNS", None)
        os.execve(sys.executable, [sys.executable, "-m", "osimlite", *arguments], environment)
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", height, columns, 0, 0))
    screen = pyte.Screen(columns, height)
    stream = pyte.ByteStream(screen)
    recording = Recording()
    clock = _make_clock(child, started)

    def notice_output() -> None:
        if recording.first is None:
            recording.first = clock()

    for moment in moments:
        is_open = _feed_until(terminal, stream, moment, clock, notice_output)
        if not is_open:
            recording.ended = time.monotonic() - started
            break
        recording.screens[moment] = _read_lines(screen)
    if recording.ended is None:
        stopped = time.monotonic()
        # The terminal interrupts all processes in its foreground, as when a key is pressed.
        os.write(terminal, b"\x03")
        if _feed_until(terminal, stream, MAX_END_S, lambda: time.monotonic() - stopped):
            os.kill(child, signal.SIGKILL)
        recording.stopping = time.monotonic() - stopped
    _, status = os.waitpid(child, 0)
    os.close(terminal)
    recording.status = os.waitstatus_to_exitcode(status)
    recording.last = _read_lines(screen)
    return recording


def _make_clock(process: int, started: float) -> Callable[[], float]:
    """Return a function that returns the time or the processor time of a process (s)."""
    if os.environ.get("SCREENS_CLOCK") != "processor":
        return lambda: time.monotonic() - started

    def read_processor_time() -> float:
        # Fields 14 and 15 are the times in the program and in the kernel, in ticks. The name of the
        # program before them may have blanks, and ends with the last bracket.
        status = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2]
        fields = status.split()
        processor_time = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        # A process that waits for its child processes uses no time itself.
        return max(processor_time, (time.monotonic() - started) / MAX_SLOWDOWN)

    return read_processor_time


def _feed_until(
    terminal: int,
    stream: pyte.ByteStream,
    end: float,
    clock: Callable[[], float],
    notice_output: Callable[[], None] = lambda: None,
) -> bool:
    """Feed the output of a command to a screen until a time.

    Args:
        terminal: descriptor of the terminal.
        stream: stream of the screen.
        end: time at which reading ends, s.
        clock: function that returns the current time, s.
        notice_output: function that is called at each output.

    Returns:
        Whether the command still runs.
    """
    while (left := end - clock()) > 0.0:
        if select.select([terminal], [], [], min(left, POLL_S))[0]:
            try:
                output = os.read(terminal, 65536)
            except OSError:
                # Linux reports an error when the last program at a terminal has ended.
                return False
            if not output:
                return False
            notice_output()
            stream.feed(output)
    return True


def _read_lines(screen: pyte.Screen) -> list[str]:
    """Return the lines of a screen without empty lines at the end."""
    return "\n".join(line.rstrip() for line in screen.display).rstrip().split("\n")


def make_inputs(folder: Path) -> None:
    """Write models, setups and long motions into a folder."""
    for name in ("setups", "pipelines/walking"):
        for path in (ROOT / "fixtures" / name).iterdir():
            shutil.copy(path, folder)
    model = gzip.decompress((folder / "model.osim.gz").read_bytes())
    (folder / "model.osim").write_bytes(model)
    repeat_rows(folder / "coords.mot", folder / "long.mot", 0)
    repeat_rows(folder / "walk.trc", folder / "long.trc", 1)
    for name in ("ik", "id", "so", "forward"):
        text = (folder / f"{name}.xml").read_text(encoding="utf-8")
        text = text.replace("coords.mot", "long.mot").replace("walk.trc", "long.trc")
        text = text.replace("<time_range>0.5 1</time_range>", "<time_range>0 1000</time_range>")
        text = text.replace("<final_time>", "<final_time>9")
        (folder / f"{name}_long.xml").write_text(text, encoding="utf-8")
    shutil.copy(ROOT / "fixtures/walker/DynamicWalkerModel.osim", folder / "walker.osim")
    many = folder / "many"
    many.mkdir()
    for number in range(MODELS):
        # The linter checks files of equal content only once.
        (many / f"model{number}.osim").write_bytes(model + b"<!-- %d -->\n" % number)
    # The third command also writes a study.
    for name, file in (("human", "human"), ("jumper", "jumper"), ("human-walks", "walks")):
        command = [sys.executable, "-m", "osimlite", "build", name, "-o", f"{file}.osim"]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)


def repeat_rows(source: Path, target: Path, time_column: int) -> None:
    """Write a table with repeated rows, alternately forwards and backwards so that nothing jumps.

    Args:
        source: file of the table.
        target: file to write.
        time_column: index of the time; in a TRC file it is 1, after the number of the frame.
    """
    lines = source.read_text(encoding="utf-8").splitlines()
    # The header ends before the first line with many numbers.
    first = next(
        number
        for number, line in enumerate(lines)
        if len(line.split()) > 6 and all(_is_number(word) for word in line.split()[:6])
    )
    rows = [line.split("\t") for line in lines[first:] if line.strip()]
    step = float(rows[1][time_column]) - float(rows[0][time_column])
    written: list[str] = []
    for turn in range(REPETITIONS):
        for row in rows if turn % 2 == 0 else rows[::-1]:
            cells = [*row]
            cells[time_column] = f"{step * len(written):.8f}"
            if time_column:
                cells[0] = str(len(written) + 1)
            written.append("\t".join(cells))
    # Headers have the number of rows.
    head = [
        line.replace(f"nRows={len(rows)}", f"nRows={len(written)}").replace(
            f"\t{len(rows)}\t", f"\t{len(written)}\t"
        )
        for line in lines[:first]
    ]
    if time_column:
        head[2] = head[2].rsplit("\t", 1)[0] + f"\t{len(written)}"
    target.write_text("\n".join([*head, *written]) + "\n", encoding="utf-8")


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def measure_command(arguments: list[str], inputs: Path) -> Recording:
    """Run a command several times, and stop it after each of `MOMENTS_S`.

    Args:
        arguments: arguments of osimlite.
        inputs: folder of models, setups and motions, which is not changed.

    Returns:
        Recording of the longest run, with the longest time of all runs between Ctrl-C and the end.
    """
    longest = 0.0
    for count in range(1, len(MOMENTS_S) + 1):
        with TemporaryDirectory() as name:
            # Each run starts without the results of the previous one. Commands replace files
            # instead of changing them, so that links are enough.
            folder = shutil.copytree(inputs, Path(name) / "work", copy_function=os.link)
            recording = record_command(arguments, folder, moments=MOMENTS_S[:count])
        # A command that has ended before cannot be interrupted later.
        if recording.ended is not None:
            break
        longest = max(longest, recording.stopping)
    recording.stopping = longest
    return recording


def describe_row(name: str, recording: Recording) -> list[str]:
    """Return the cells of the table for a command."""
    cells = [name, "" if recording.first is None else f"{recording.first:.2f}"]
    for moment in MOMENTS_S:
        lines = recording.screens.get(moment)
        line = "" if lines is None else lines[-1].strip().replace("|", "\\|")
        cells.append("finished" if lines is None else f"`{line}`" if line else "(nothing)")
    cells.append(f"{recording.stopping:.1f}" if recording.stopping else "")
    return cells


def make_table(words: list[str]) -> Iterator[str]:
    """Record commands.

    Args:
        words: parts of the names of the commands; all commands if empty.

    Yields:
        Lines of the table in Markdown.
    """
    yield "| command | first output, s | after 0.5 s | after 2 s | after 5 s | end after Ctrl-C, s |"
    yield "|---|---|---|---|---|---|"
    with TemporaryDirectory() as name:
        inputs = Path(name)
        make_inputs(inputs)
        for row, arguments in COMMANDS.items():
            if not words or any(word in row for word in words):
                cells = describe_row(row, measure_command(arguments.split(), inputs))
                yield f"| {' | '.join(cells)} |"


def write_page() -> None:
    """Write the table of all commands into the page of the manual."""
    # The text before the table is written by hand.
    head = PAGE.read_text(encoding="utf-8").partition("| command |")[0]
    lines = []
    for line in make_table([]):
        print(line, flush=True)
        lines.append(line)
    PAGE.write_text(head + "\n".join(lines) + "\n", encoding="utf-8")


def draw_screens(recordings: dict[str, Recording], path: str | Path) -> None:
    """Draw a terminal with each command, and the last line of its screen at each time.

    Args:
        recordings: recordings by the command line.
        path: PNG file to write.
    """
    import matplotlib
    from PIL import Image, ImageDraw, ImageFont

    lines = []
    for command, recording in recordings.items():
        lines.append((f"$ {command}"[:COLUMNS], "#7ee787"))
        for moment in MOMENTS_S:
            screen = recording.screens.get(moment)
            # Progress is in the last line.
            shown = "(finished)" if screen is None else screen[-1]
            lines.append((f"{moment:>4g} s  {shown}", "#e6edf3"))
        lines.append(("", "#e6edf3"))
    lines.pop()
    font = ImageFont.truetype(
        str(Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSansMono.ttf"), FONT_SIZE
    )
    # The times before the lines need eight columns.
    width = round(font.getlength("m" * (COLUMNS + 8))) + 24
    height = round(1.35 * FONT_SIZE)
    image = Image.new("RGB", (width, height * len(lines) + 24), "#0d1117")
    draw = ImageDraw.Draw(image)
    for number, (text, color) in enumerate(lines):
        draw.text((12, 12 + number * height), text, font=font, fill=color)
    image.save(path)


def draw_picture(path: str, rows: list[str]) -> None:
    """Record commands, and draw their screens.

    Args:
        path: PNG file to write.
        rows: names of the commands.
    """
    with TemporaryDirectory() as name:
        folder = Path(name)
        make_inputs(folder)
        recordings = {
            f"osimlite {arguments}": record_command(arguments.split(), folder)
            for row, arguments in COMMANDS.items()
            if row in rows
        }
    draw_screens(recordings, path)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--picture"]:
        draw_picture(sys.argv[2], sys.argv[3:])
    elif sys.argv[1:] == ["--page"]:
        write_page()
    else:
        for table_line in make_table(sys.argv[1:]):
            print(table_line, flush=True)
