"""Functions of time or of coordinates."""

from __future__ import annotations

from typing import Annotated

from osimlite.schema.base import Object
from osimlite.schema.fields import real


class Function(Object, abstract=True):
    """A function of one or several variables."""


class Constant(Function):
    """The same value everywhere."""

    value: Annotated[float, real(legacy=True)] = 0.0
