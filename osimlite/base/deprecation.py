"""Former names of methods and properties, which warn and lead to the present ones."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

from osimlite.errors import DeprecatedWarning


def make_deprecated_method(name: str) -> Callable[..., Any]:
    """Return a method that warns and calls the method with the present name.

    Args:
        name: present name of the method.
    """

    def call(self: Any, *arguments: Any, **options: Any) -> Any:
        warnings.warn(f"use {name}", DeprecatedWarning, stacklevel=2)
        return getattr(self, name)(*arguments, **options)

    call.__doc__ = f"Deprecated name of :meth:`{name}`."
    return call


def make_deprecated_property(name: str) -> property:
    """Return a property that warns and returns the attribute with the present name.

    Args:
        name: present name of the attribute.
    """

    def get(self: Any) -> Any:
        warnings.warn(f"use {name}", DeprecatedWarning, stacklevel=2)
        return getattr(self, name)

    return property(get, doc=f"Deprecated name of `{name}`.")
