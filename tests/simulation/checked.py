"""Kernels as Python on vectors with bounds, where machine code would access other memory."""

from __future__ import annotations

from typing import Any

import numpy as np

from osimlite.simulation.engines import linking


class Bounded(np.ndarray[Any, Any]):
    """Vector that rejects negative indices, which numpy would count from the end."""

    def __getitem__(self, place: Any) -> Any:
        return super().__getitem__(_inside(place))

    def __setitem__(self, place: Any, value: Any) -> None:
        super().__setitem__(_inside(place), value)


def _inside(place: Any) -> Any:
    if type(place) is int and place >= 0:
        # This function is called millions of times, so test the common case first.
        return place
    ends = (place.start, place.stop) if isinstance(place, slice) else (place,)
    if any(isinstance(end, int | np.integer) and end < 0 for end in ends):
        raise IndexError(f"the place {place} is before the vector")
    return place


class Checked(linking.PythonCode):
    """Kernels as Python on bounded vectors."""

    def get_entry(self, function: str) -> Any:
        kernel = super().get_entry(function)
        return lambda *parts: kernel(*map(bounded, parts))

    def bind_entry(self, function: str, *arrays: Any) -> Any:
        return super().bind_entry(function, *map(bounded, arrays))


def bounded(part: Any) -> Any:
    return part.view(Bounded) if isinstance(part, np.ndarray) else part
