"""Parameters of a scenario: names, initial distributions, and files of their values (.par)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from osimlite.base.files import read_file
from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.errors import DocumentError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.studies.reflexes.settings import SettingNode, parse_finite

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
"""Pattern of a decimal number without names such as inf and nan."""
_FORM = compile_later(
    rf"(?P<mean>{_NUMBER})?(?:~(?P<std>{_NUMBER})?)?(?:<(?P<low>{_NUMBER}),(?P<high>{_NUMBER})>)?$"
)
"""Pattern of `mean~std<low,high>`, where each part may be missing."""
AUTO_STD_FACTOR = 0.1
"""Standard deviation over the absolute mean of a parameter that states none."""


class Parameter(NamedTuple):
    """Free number of a scenario, with the distribution from which a search starts.

    Attributes:
        name: name with the prefixes of the parts that it belongs to, for example `S00011.vasti.KF`.
        mean: mean of the initial distribution.
        std: standard deviation of the initial distribution.
        low: lower bound, -inf for none.
        high: upper bound, inf for none.
    """

    name: str
    mean: float
    std: float
    low: float
    high: float


class Parameters:
    """Values of the parameters of some candidates, and a register of the parameters that were read.

    Args:
        values: value of each parameter by name: one for all candidates, or an array (w,) with one
            for each. A parameter that is not named has its mean.
        count: number of candidates w.

    Attributes:
        requested: parameters that a scenario has read, by name.
        values_used: numbers of the first candidate that a scenario has read, by name, including
            fixed ones.
        auto_std_factor: ratio of the standard deviation to the absolute mean for a parameter that
            states no deviation.
    """

    def __init__(self, values: Mapping[str, Array | float], count: int = 1) -> None:
        self.values = values
        self.count = count
        self.requested: dict[str, Parameter] = {}
        self.auto_std_factor = AUTO_STD_FACTOR
        self.values_used: dict[str, float] = {}

    def get_number(self, node: SettingNode, key: str, default: float, name: str = "") -> Array:
        """Return a number of each candidate (w,), literal or the value of a parameter.

        Args:
            node: node that the number is a part of.
            key: key of the part.
            default: number if there is no such part.
            name: name of the parameter; the key if empty.

        Raises:
            DocumentError: the part is neither a number nor a parameter.
        """
        number_node = node.get(key)
        numbers = (
            np.full(self.count, default)
            if number_node is None
            else self.parse_number(number_node, name or key)
        )
        self.values_used[name or key] = float(numbers[0])
        return numbers

    def parse_number(self, number_node: SettingNode, name: str) -> Array:
        """Return a number of each candidate (w,) from its own node.

        Values of parameters are clipped to their bounds.

        Args:
            number_node: node of the number.
            name: name of the parameter.

        Raises:
            DocumentError: the node is neither a number nor a parameter, or the mean is out of
                bounds.
        """
        # A parameter is `1~0.5<0,2>`, `~1<0,2>`, or a block of mean, std, min and max.
        if number_node.parts:
            defaults = ("mean", None), ("std", np.nan), ("min", -np.inf), ("max", np.inf)
            return self._request_parameter(
                number_node, name, *(number_node.number(key, value) for key, value in defaults)
            )
        text = number_node.value
        match = _FORM.match(text)
        if match is None or not text:
            raise number_node.error(
                f"'{name}' must be a number or a parameter such as 1~0.1<0,2>, not '{text}'"
            )
        if "~" not in text and match["low"] is None:
            return np.full(self.count, float(text))
        mean, std = match["mean"], match["std"]
        # In `~1<0,2>` the number is the mean, and the standard deviation follows from it.
        if mean is None:
            mean, std = std, None
        if mean is None:
            raise number_node.error(f"the parameter '{name}' has no mean")
        lower, upper = (
            float(match[end]) if match[end] is not None else limit
            for end, limit in (("low", -np.inf), ("high", np.inf))
        )
        return self._request_parameter(
            number_node, name, float(mean), np.nan if std is None else float(std), lower, upper
        )

    def _request_parameter(
        self,
        number_node: SettingNode,
        name: str,
        mean: float,
        std: float,
        lower: float,
        upper: float,
    ) -> Array:
        """Return the values (count,) of a parameter, and note its definition."""
        if not lower <= mean <= upper:
            raise number_node.error(
                f"the parameter '{name}' has the initial value {mean:g}, outside its range of {lower:g} to {upper:g}"
            )
        # NaN stands for a parameter that states no standard deviation.
        std = self.auto_std_factor * abs(mean) if np.isnan(std) else std
        # Both legs of a symmetric controller read one parameter; its first definition counts.
        self.requested.setdefault(name, Parameter(name, mean, std, lower, upper))
        # Values of a file or of a caller may be beyond the bounds.
        value = self.values.get(name, mean)
        return np.clip(np.broadcast_to(np.asarray(value, dtype=float), (self.count,)), lower, upper)


def format_par_line(parameter: Parameter, best_value: float) -> str:
    """Return a line of a .par file as SCONE writes it: name, best value, mean, standard deviation.

    Args:
        parameter: parameter with mean and standard deviation.
        best_value: best value so far.
    """
    numbers = "\t".join(f"{number:.17g}" for number in (best_value, parameter.mean, parameter.std))
    return f"{parameter.name:<32}\t{numbers}\n"


def read_par(path: str | Path) -> dict[str, tuple[float, float, float]]:
    """Read a .par file.

    Returns:
        Best value, mean and standard deviation of each parameter, by name.

    Raises:
        MissingFileError: there is no such file.
        DocumentError: a line does not consist of a name and three finite numbers.
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
        fields = line.split()
        if not fields:
            continue
        try:
            best_value, mean, std = (parse_finite(field) for field in fields[1:4])
        except ValueError:
            raise DocumentError(
                "expected four words: name, best value, mean and standard deviation",
                file=str(path),
                line=number,
            ) from None
        result[fields[0]] = best_value, mean, std
    return result
