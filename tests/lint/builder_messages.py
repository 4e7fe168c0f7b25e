"""Messages with which the builder of mechanisms and forces rejects a model, read from its source code."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).resolve().parents[2] / "osimlite"
PARTS = (
    "mechanics/multibody/assembly.py",
    "mechanics/multibody/build.py",
    "mechanics/multibody/constraint_records.py",
    "mechanics/multibody/dynamics.py",
    "mechanics/multibody/formula.py",
    "mechanics/multibody/formula_steps.py",
    "mechanics/multibody/function_tables.py",
    "mechanics/multibody/functions.py",
    "mechanics/multibody/joints.py",
    "mechanics/multibody/motions.py",
    "mechanics/multibody/schema_constraints.py",
    "mechanics/multibody/schema_frames.py",
    "mechanics/multibody/schema_functions.py",
    "mechanics/multibody/schema_joints.py",
    "simulation/elements",
)
"""Modules that build mechanisms and forces from a model."""

ERRORS = {
    "ModelError",
    "UnsupportedError",
    "SimulationError",
    "UnmetConstraintsError",
    "_Impossible",
}


class Message(NamedTuple):
    """Message of the builder: the module that raises it, and its text with `{}` for inserted values."""

    module: str
    text: str

    def matches(self, message: str) -> bool:
        """Return whether a text of the builder is this message."""
        parts = map(re.escape, self.text.split("{}"))
        return re.search(".*?".join(parts), message, re.DOTALL) is not None


@cache
def read_messages() -> list[Message]:
    """Return every message, sorted by module."""
    files: list[Path] = []
    for part in PARTS:
        path = PACKAGE / part
        files += [path] if path.is_file() else sorted(path.rglob("*.py"))
    result: dict[Message, None] = {}
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Name | ast.Attribute)
                and node.args
            ):
                name = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
                text = _template(node.args[-1 if name == "make_unsupported_error" else 0])
                known = name in ERRORS or (name == "make_unsupported_error" and len(node.args) > 1)
                if known and text is not None and len(text.replace("{}", "").strip()) > 3:
                    result[Message(str(file.relative_to(PACKAGE)), text)] = None
    return [*result]


def _template(node: ast.expr) -> str | None:
    """Return the text of a string with `{}` for its variable parts, or None for another expression."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(
            str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values
        )
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        left, right = _template(node.left), _template(node.right)
        return None if left is None else left + (right or "{}")
    return None
