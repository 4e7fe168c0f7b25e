"""Functions that the translators must refuse, the texts of the errors, and the numbers of derivative directions."""

# mypy: ignore-errors
from __future__ import annotations

import math

from osimlite.mechanics.kernels.pointers import Floats, Ints


def twice(a: float) -> float:
    return 2.0 * a


def list_numbers(count: int) -> float:
    numbers = [0.0] * count
    return numbers[0]


def repeat_else(count: int) -> float:
    total = 0.0
    for k in range(count):
        total += k
    else:
        total = 1.0
    return total


def call_itself(count: int) -> int:
    return call_itself(count - 1) if count else 0


def end_without_value(count: int) -> float:
    if count > 1:
        return 1.0


def return_nothing(count: int) -> float:
    value = None
    return value


def raise_error(count: int) -> float:
    raise ValueError(count)


def mix_types(count: int) -> float:
    value = (1.0, 2.0) if count else (1.0, 2.0, 3.0)
    return value[0]


def index_by_float(a: float) -> float:
    return (1.0, 2.0)[a]


def index_records(count: int) -> float:
    return (1.0, (2.0, 3.0))[count]


def format_text(count: int) -> float:
    return float(f"{count}")


def call_method(count: int) -> int:
    return count.bit_length()


def ask_library(a: float) -> float:
    return math.lgamma(a)


def take_last(x: Floats) -> float:
    return x[-1]


def take_slice(x: Floats) -> float:
    return x[1:][0]


def store_float(s: Ints, a: float) -> int:
    s[0] = a
    return 0


def use_large(count: int) -> int:
    return 2**70 + 1180591620717411303424


def name_argument(a: float) -> float:
    return twice(a=a)


def call_wrongly(a: float) -> float:
    return twice(a, a)


def never_set(count: int) -> float:
    return value  # noqa: F821


def declare(a) -> float:
    return a


def take_root(a: float) -> float:
    return a // 2.0


# Function: part of the error message, and number of derivative directions with which it is
# translated.
REFUSED = {
    list_numbers: (r"\[0\.0\]", 0),
    repeat_else: ("for k in range", 0),
    call_itself: ("calls itself", 0),
    end_without_value: ("may end without returning a value", 0),
    return_nothing: ("None", 0),
    raise_error: ("raise ValueError", 0),
    mix_types: ("sometimes tuple.double, double. and sometimes tuple", 0),
    index_by_float: ("the index is double", 0),
    index_records: ("depends on the index", 0),
    format_text: ("f'{count}'", 0),
    call_method: ("bit_length", 0),
    ask_library: ("lgamma", 0),
    take_last: ("no last item", 0),
    take_slice: (r"at\(vector, index\)", 0),
    store_float: ("double is stored in a vector of int64_t", 0),
    use_large: ("1180591620717411303424", 0),
    name_argument: ("a=a", 0),
    call_wrongly: ("called with 2 arguments", 0),
    never_set: ("value", 0),
    declare: ("the parameter 'a'", 0),
    take_root: ("it has no derivatives", 3),
}
