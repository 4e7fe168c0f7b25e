"""C++ compilers: search for an installed one, and build shared libraries of kernels."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from osimlite.base.named_tuples import NamedTuple
from osimlite.errors import OsimliteError
from osimlite.mechanics.codegen.processor import machine_name

# `shutil` and `subprocess` are imported where a compiler runs, because simulations only need the
# names of targets.

PROGRAMS = ("clang++", "g++", "c++", "clang-cl")
"""Compilers in the order of preference: clang compiles kernels faster than g++."""

BASELINE = "baseline"
"""Target: any processor of this architecture."""
X86_64_V3 = "x86-64-v3"
"""Target: x86-64 processors with AVX2 and FMA."""
NATIVE = "native"
"""Target: the processor that compiles."""

COMMON = (
    "-std=c++17", "-fPIC", "-fvisibility=hidden", "-fno-exceptions", "-fno-rtti", "-w",
    # Results are those of Python to the last bit: no fused operations, no rearranged sums.
    "-fno-fast-math", "-ffp-contract=off",
    # Kernels read neither errno nor the floating-point exceptions, and both prevent vectorised
    # loops.
    "-fno-math-errno", "-fno-trapping-math",
)  # fmt: skip
"""Options of all compilers."""

GCC = (
    # With g++'s own limits on inlining an evaluation takes 1.4 to 1.6 times as long.
    "--param=max-inline-insns-single=1000", "--param=max-inline-insns-auto=300",
    "--param=inline-unit-growth=300", "--param=large-function-growth=1000",
    # Vectors of a difference beside a sum (c x - s y, s x + c y) are fused by g++ 12 in spite of
    # -ffp-contract=off.
    "-fno-tree-slp-vectorize",
)  # fmt: skip
"""Options of g++."""

CLANG = (
    # Clang inlines functions with several callers less. With its default limit an evaluation of
    # gait2392 takes 16.1 instead of 13.9 us; compiling takes a tenth longer with this one.
    "-mllvm", "-inline-threshold=500",
)  # fmt: skip
"""Options of clang."""


class CompilationError(OsimliteError):
    """Error of a compiler, or of a kernel that cannot be translated for it."""


class Compiler(NamedTuple):
    """A C++ compiler with the options of the GNU compilers."""

    command: tuple[str, ...]  # program and options that start it
    version: str  # first line of its version message
    is_gcc: bool
    system: str = sys.platform  # system that it compiles for
    machine: str = machine_name()  # kind of processor that it compiles for

    @property
    def name(self) -> str:
        """Program and version, for messages."""
        program = Path(self.command[0]).stem
        # GNU compilers begin the message with their name.
        return (
            self.version if self.version.startswith(f"{program} ") else f"{program}: {self.version}"
        )

    @property
    def targets(self) -> tuple[str, ...]:
        """Targets of a wheel for this kind of processor, best first.

        Returns:
            Names of targets, such as X86_64_V3.
        """
        return (X86_64_V3, BASELINE) if self.machine == "x86_64" else (BASELINE,)

    def flags(self, target: str = NATIVE) -> list[str]:
        """Return the options that determine the machine code."""
        # On x86-64 the baseline is for processors of before 2013: it is compiled in a third of the
        # time.
        is_quick = target == BASELINE and self.machine == "x86_64"
        flags = [*COMMON, "-O2" if is_quick else "-O3"]
        if not is_quick and "ziglang" not in self.command:
            flags += GCC if self.is_gcc else CLANG
        if target == X86_64_V3:
            # Zig has names of its own for processors.
            flags.append("-mcpu=x86_64_v3" if "ziglang" in self.command else "-march=x86-64-v3")
        elif target == NATIVE and self.system != "darwin":
            # On Arm, -mcpu is what g++ and clang both know.
            flags.append("-march=native" if self.machine == "x86_64" else "-mcpu=native")
            if self.is_gcc and self.machine == "x86_64":
                # For AMD's first Zen processors g++ prefers vectors of two numbers. With four,
                # a chain of 80 pins takes 5 % less time, and other models take the same.
                flags.append("-mprefer-vector-width=256")
        return [*flags, *self._list_architectures()]

    def _list_architectures(self) -> list[str]:
        """Return the options that Python's build tools request on macOS, for universal binaries."""
        return shlex.split(os.environ.get("ARCHFLAGS", "")) if self.system == "darwin" else []

    def compile(self, text: Path, result: Path, target: str = NATIVE) -> None:
        """Compile one text to an object file.

        Args:
            text: path of the C++ text; its folder has the header.
            result: path of the object file.
            target: processors that the code is for.

        Raises:
            CompilationError: the compiler failed.
        """
        # Relative names, since the names of files become part of the code.
        flags = self.flags(target)
        self._run_compiler([*flags, "-c", text.name, "-o", str(result.resolve())], text.parent)

    def link(self, objects: Sequence[Path], result: Path) -> None:
        """Link object files to a shared library.

        Args:
            objects: paths of the object files.
            result: path of the library.

        Raises:
            CompilationError: the linker failed.
        """
        flags = ["-shared", *self._list_architectures()]
        if self.system == "linux":
            flags += ["-Wl,--as-needed", "-s"]
        elif self.system == "win32":
            # Two builds of the same text are equal to the last byte.
            if "ziglang" in self.command:
                # Zig refuses the option of GNU's linker since 0.17.
                flags.append("-Wl,-Brepro")
            else:
                flags.append("-Wl,--no-insert-timestamp" if self.is_gcc else "-Wl,/Brepro")
        if not self.is_gcc and (self.system != "win32" or "ziglang" in self.command):
            # Kernels use no C++ standard library, and zig would compile one first.
            flags.append("-nostdlib++")
        folder = objects[0].parent
        names = [os.path.relpath(item, folder) for item in objects]
        self._run_compiler([*flags, *names, "-o", str(result.resolve())], folder)

    def _run_compiler(self, arguments: Sequence[str], folder: Path) -> None:
        import subprocess

        command = [*self.command, *arguments]
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, check=False)
        except OSError as error:
            message = f"the C++ compiler '{self.command[0]}' cannot be run: {error.strerror}"
            raise CompilationError(message) from error
        if done.returncode != 0:
            words = done.stderr.decode(errors="replace").strip().splitlines()
            first = next((line for line in words if "error" in line), words[0] if words else "")
            message = f"the C++ compiler '{self.command[0]}' ended with {done.returncode}: {first}"
            raise CompilationError(message[:500])


@cache
def find_compiler() -> Compiler | None:
    """Return the C++ compiler of this machine, None if it has no compiler.

    The variable CXX has priority over compilers of the path.
    """
    import shutil

    command = os.environ.get("CXX")
    if command:
        return _examine_compiler(tuple(shlex.split(command, posix=os.name != "nt")))
    if sys.platform == "darwin" and not has_developer_tools():
        return None
    for program in PROGRAMS:
        path = shutil.which(program)
        # A program in the current folder has not been installed, and is not run.
        if path is not None and os.path.isabs(path):
            options = ("--driver-mode=g++",) if program == "clang-cl" else ()
            compiler = _examine_compiler((path, *options))
            if compiler is not None:
                return compiler
    return None


def find_cross_compiler(platform: str) -> Compiler | None:
    """Return the compiler of the variable CXX for another platform, None if there is no compiler.

    Args:
        platform: platform tag of a wheel, such as "manylinux_2_17_x86_64", "macosx_11_0_arm64" or
            "win_amd64".
    """
    compiler = find_compiler()
    if compiler is None:
        return None
    system = {"macosx": "darwin", "win": "win32"}.get(platform.partition("_")[0], "linux")
    machine = "aarch64" if platform.endswith(("aarch64", "arm64")) else "x86_64"
    return compiler._replace(system=system, machine=machine)


def library_suffix(system: str = sys.platform) -> str:
    """Return the ending of shared libraries of a system."""
    return {"win32": ".dll", "darwin": ".dylib"}.get(system, ".so")


def _examine_compiler(command: tuple[str, ...]) -> Compiler | None:
    """Return the compiler that a command starts, or None if it does not run or is unknown."""
    import subprocess

    try:
        done = subprocess.run([*command, "--version"], capture_output=True, check=False)
    except OSError:
        return None
    words = done.stdout.decode(errors="replace").splitlines()
    if done.returncode != 0 or not words:
        return None
    is_clang = any("clang" in line for line in words)
    return Compiler(command, words[0].strip(), not is_clang)


def has_developer_tools() -> bool:
    """Return whether macOS has its developer tools.

    Without them, `clang++` is a program that asks to install them.
    """
    import subprocess

    try:
        done = subprocess.run(["xcode-select", "-p"], capture_output=True, check=False)
    except OSError:
        return False
    return done.returncode == 0
