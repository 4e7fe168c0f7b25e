"""Parameters of a scenario: their names, where they begin, and files of their values (.par)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from osimlite.base.files import read_file
from osimlite.errors import DocumentError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.studies.reflexes.settings import Node, parse_finite

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_FORM = re.compile(
    rf"(?P<mean>{_NUMBER})?(?:~(?P<std>{_NUMBER})?)?(?:<(?P<low>{_NUMBER}),(?P<high>{_NUMBER})>)?$"
)
AUTO = 0.1
"""A standard deviation that nothing tells, as part of the mean."""


class Parameter(NamedTuple):
    """A number that is looked for.

    Attributes:
        name: with what stands above it, as ``S00011.vasti.KF``.
        mean, std: where the search begins, and how wide.
        low, high: bounds.
    """

    name: str
    mean: float
    std: float
    low: float
    high: float


class Parameters:
    """The values of the parameters of some candidates, and which parameters there are.

    Args:
        values: by name, of each candidate (w,), or one for all; those without stand for their
            means.
        count: of candidates.

    Attributes:
        found: all that were asked for.
        told: all numbers that were asked for, of the first candidate.
        auto: standard deviation that is not told, as part of the mean.
    """

    def __init__(self, values: Mapping[str, Array | float], count: int = 1) -> None:
        self.values, self.count, self.found, self.auto = values, count, dict[str, Parameter](), AUTO
        self.told: dict[str, float] = {}

    def of(self, node: Node, key: str, otherwise: float, name: str = "") -> Array:
        """A number of each candidate (w,): what is written, or the parameter that is.

        Args:
            node: that it is part of.
            key: of it.
            otherwise: if it is not given.
            name: of the parameter; the key if empty.

        Raises:
            DocumentError: it is neither a number nor a parameter.
        """
        part = node.get(key)
        found = np.full(self.count, otherwise) if part is None else self.read(part, name or key)
        self.told[name or key] = float(found[0])
        return found

    def read(self, part: Node, name: str) -> Array:
        """As `of`, from the node itself."""
        # ``1~0.5<0,2>``, ``~1<0,2>``, or a block of mean, std, min and max.
        if part.parts:
            wanted = ("mean", None), ("std", np.nan), ("min", -np.inf), ("max", np.inf)
            return self._request_parameter(
                part, name, *(part.number(key, value) for key, value in wanted)
            )
        text = part.value
        match = _FORM.match(text)
        if match is None or not text:
            raise part.error(
                f"'{name}' must be a number or a parameter such as 1~0.1<0,2>, not '{text}'"
            )
        if "~" not in text and match["low"] is None:
            return np.full(self.count, float(text))
        mean, std = match["mean"], match["std"]
        if mean is None:
            mean, std = std, None
        if mean is None:
            raise part.error(f"the parameter '{name}' has no mean")
        low, high = (
            float(match[end]) if match[end] is not None else way
            for end, way in (("low", -np.inf), ("high", np.inf))
        )
        return self._request_parameter(
            part, name, float(mean), np.nan if std is None else float(std), low, high
        )

    def _request_parameter(
        self, part: Node, name: str, mean: float, std: float, low: float, high: float
    ) -> Array:
        if not low <= mean <= high:
            raise part.error(
                f"the parameter '{name}' begins at {mean:g}, which is not from {low:g} to {high:g}"
            )
        std = self.auto * abs(mean) if np.isnan(std) else std
        self.found.setdefault(name, Parameter(name, mean, std, low, high))
        value = self.values.get(name, mean)
        return np.clip(np.broadcast_to(np.asarray(value, dtype=float), (self.count,)), low, high)


def par_line(parameter: Parameter, best: float) -> str:
    """A line of a file of values, as SCONE has it: name, best, mean, standard deviation."""
    numbers = "\t".join(f"{number:.17g}" for number in (best, parameter.mean, parameter.std))
    return f"{parameter.name:<32}\t{numbers}\n"


def read_par(path: str | Path) -> dict[str, tuple[float, float, float]]:
    """The best, the mean and the standard deviation of each parameter of a file.

    Raises:
        MissingFileError: there is no such file.
        DocumentError: a line has no name and three numbers.
    """
    try:
        text = read_file(path).decode()
    except UnicodeDecodeError as error:
        message = (
            f"the file is not UTF-8: byte {error.start + 1} is {error.object[error.start]:#04x}"
        )
        raise DocumentError(message, file=str(path)) from None
    result = {}
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if not words:
            continue
        try:
            best, mean, std = (parse_finite(word) for word in words[1:4])
        except ValueError:
            raise DocumentError(
                "a name, best, mean and standard deviation are wanted", file=str(path), line=number
            ) from None
        result[words[0]] = best, mean, std
    return result
