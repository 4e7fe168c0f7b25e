"""Build hook of hatchling: compiles the library of kernels where a C++ compiler is found.

A wheel gets one library for each level of processors, and a tag of this platform; without a
compiler it is pure Python. An editable installation gets a library for this very processor, inside
the source tree. The source distribution contains the C++ text, from which its wheel is built. The
environment variable OSIMLITE_LIBRARY=no leaves it out.
"""

from __future__ import annotations

import importlib.util
import os
import sysconfig
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface  # type: ignore[import-not-found]

TEXTS = "native"
"""Folder of the C++ text in a source distribution."""

SWITCH = "OSIMLITE_LIBRARY"
"""Environment variable: "no" builds no library."""

PLATFORM = "OSIMLITE_PLATFORM"
"""Environment variable: the platform of a wheel, such as manylinux_2_17_x86_64, that CXX compiles for."""


class KernelLibraryHook(BuildHookInterface):  # type: ignore[misc]
    """Adds the library of kernels to a wheel, and its text to a source distribution."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile the kernel library and add it to the build.

        Args:
            version: "editable" or "standard".
            build_data: what hatchling is told.
        """
        tools = load_tools(Path(self.root))
        self._folder = tempfile.TemporaryDirectory()
        work = Path(self._folder.name)
        texts = Path(self.root) / TEXTS
        if self.target_name == "sdist":
            if not texts.is_dir():
                texts = work / TEXTS
                tools.write_texts(texts)
            build_data["force_include"][str(texts)] = TEXTS
            return
        if os.environ.get(SWITCH, "").lower() in ("no", "0", "false"):
            self._say("the library of kernels is left out")
            return
        try:
            if version == "editable":
                self._say(tools.build_in_place())
                return
            platform = os.environ.get(PLATFORM)
            find = tools.toolchain.find_cross_compiler
            compiler = find(platform) if platform else tools.toolchain.find_compiler()
            if compiler is None:
                self._say(tools.NO_COMPILER)
                return
            if not texts.is_dir():
                texts = work / TEXTS
                tools.write_texts(texts)
            libraries = tools.compile_libraries(
                texts, work / "libraries", compiler, compiler.targets
            )
        except (OSError, tools.toolchain.CompilationError) as error:
            # The package works without the library, only slower.
            self.app.display_warning(f"the library of kernels is left out: {error}")
            return
        for library in libraries:
            build_data["force_include"][str(library)] = f"osimlite/native/{library.name}"
        build_data["pure_python"] = False
        # ctypes needs nothing of Python's binary interface: one wheel serves all versions.
        platform = platform or sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["tag"] = f"py3-none-{platform}"
        self._say(f"compiled the library of kernels ({compiler.version})")

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove temporary files."""
        self._folder.cleanup()

    def _say(self, sentence: str) -> None:
        self.app.display_info(sentence)


def load_tools(root: Path) -> ModuleType:
    """Return the module that compiles the library, which is beside this one and no package."""
    path = root / "packaging" / "kernel_library.py"
    spec = importlib.util.spec_from_file_location("osimlite_kernel_library", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
