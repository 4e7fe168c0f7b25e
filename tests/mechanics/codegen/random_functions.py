"""Random functions in the restricted Python of kernels, from a seed.

They contain all constructs except those whose results differ between the languages by intent:
powers of floats, which compiled code computes as products, and the sign of an integer zero, which
exists in JavaScript.
"""

from __future__ import annotations

import linecache
import math
import random
from contextlib import contextmanager
from typing import Any, NamedTuple

from osimlite.mechanics.kernels.pointers import Floats, Ints, at

# Constants in random expressions.
FLOATS = "0.5", "-1.25", "2.0", "1e-3", "7.75", "0.0", "-0.5", "3.0", "1e3"
DEPTH = 3
"""Largest depth of expressions."""


class Record(NamedTuple):
    """Named tuple that the functions create and read."""

    size: float
    number: int
    arm: tuple[float, float]


WEIGHTS = 0.25, -1.5, 3.0
CODES = 2, -3, 5, 0


class Writer:
    """Writer of one kernel and of the functions that it calls."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.seed = seed
        self.lines: list[str] = []
        self.indent = 1
        self.scope: dict[str, str] = {}
        self.vectors: list[str] = []
        self.loops = 0
        self.names = 0
        self.helpers: list[tuple[str, list[str], str]] = []
        self.may_write = False

    # ------------------------------------------------------------------------------------------------ helpers
    def pick(self, *choices: Any) -> Any:
        """Return one of several options at random."""
        return self.rng.choice(choices)

    def chance(self, part: float) -> bool:
        """Return true with a probability."""
        return self.rng.random() < part

    def variables(self, kind: str) -> list[str]:
        """Return the variables of a type that have a value at this point."""
        return [name for name, own in self.scope.items() if own == kind]

    def new_name(self) -> str:
        """Return the name of a new variable."""
        self.names += 1
        return f"{self.pick('a', 'b', 'new', 'int64_t', 'let', 'temporary_', 'k')}{self.names}"

    def write(self, line: str) -> None:
        """Add a line."""
        self.lines.append(f"{'    ' * self.indent}{line}")

    @contextmanager
    def block(self, head: str) -> Any:
        """Add a compound statement; variables that are first set in it are unknown after it."""
        self.write(head)
        before, self.indent = dict(self.scope), self.indent + 1
        size = len(self.lines)
        yield
        if len(self.lines) == size:
            self.write("pass")
        self.indent -= 1
        self.scope = {name: kind for name, kind in self.scope.items() if name in before}

    # -------------------------------------------------------------------------------------------- expressions
    def number(self, depth: int = DEPTH) -> str:
        """Return an expression of a float."""
        names = self.variables("float")
        if depth == 0 or self.chance(0.15):
            leaves = [self.pick(*FLOATS), *names, *names]
            if self.vectors:
                leaves += [f"{self.pick(*self.vectors)}[{self.index(0)} % 4]" for _ in range(2)]
            leaves += [f"{name}[{self.rng.randint(-2, 1)}]" for name in self.variables("pair")]
            leaves += [
                f"{name}{self.pick('.size', '.arm[1]', '[0]')}" for name in self.variables("record")
            ]
            return self.pick(*leaves)
        a, b = self.number(depth - 1), self.number(depth - 1)
        choices = [
            f"{a} + {b}", f"({a} - {b})", f"({a} + {b}) * {self.number(0)}", f"({a}) * 0.5 - {b}", f"-({a})",
            f"({a}) / (abs({b}) + 0.5)", f"({a}) // (abs({b}) + 0.75)", f"({a}) % (abs({b}) + 0.25)",
            f"min({a}, {b})", f"max({a}, {b}, {self.number(0)})", f"abs({a})", f"sqrt(abs({a}))",
            f"({a} if {self.truth(depth - 1)} else {b})", f"float({self.index(depth - 1)})",
            f"({a} and {b})", f"({a} or {b})", f"{self.index(depth - 1)} * {self.number(0)}",
            f"({self.index(depth - 1)}) / 4", f"WEIGHTS[{self.index(0)} % 3]", f"floor({self.small(a)}) * 0.5",
            f"({a}, {b})[{self.index(0)} % 2]",
        ]  # fmt: skip
        for name, kinds, result in self.helpers:
            call = f"{name}({', '.join(self.argument(kind, depth - 1) for kind in kinds)})"
            if result == "float" and ("vector" not in kinds or self.may_write):
                choices += [call] * 4
            elif result == "pair":
                choices += [f"{call}[{self.pick(0, 1)}]", f"add_two(*{call})"]
        return self.pick(*choices)

    def argument(self, kind: str, depth: int) -> str:
        """Return an expression of a type."""
        if kind == "vector":
            return f"at({self.pick(*self.vectors)}, {self.index(0)} % 3)"
        if kind == "function":
            return self.pick("add_two", "take_two")
        return {"float": self.number, "int": self.index, "bool": self.truth, "pair": self.pair}[
            kind
        ](max(depth, 0))

    @staticmethod
    def small(text: str) -> str:
        """Return an expression that is limited to -99 to 99."""
        return f"max(-99.0, min(99.0, {text}))"

    def index(self, depth: int = DEPTH) -> str:
        """Return an expression of an integer."""
        if depth <= 0 or self.chance(0.2):
            leaves = [
                str(self.rng.randint(-5, 9)),
                *self.variables("int") * 2,
                f"s[{self.rng.randint(0, 3)}]",
            ]
            return (
                f"({self.pick(*leaves, *[f'{name}.number' for name in self.variables('record')])})"
            )
        a, b = self.index(depth - 1), self.index(depth - 1)
        return self.pick(
            f"({a} + {b})", f"({a} - {b})", f"({a} * {self.rng.randint(-3, 3)})", f"({a} // {self.pick(2, 3, -4)})",
            f"({a} % {self.pick(2, 5, -3)})", f"-{a}", f"abs({a})", f"min({a}, {b})", f"max({a}, {b})",
            f"int({self.small(self.number(depth - 1))})", f"({a} if {self.truth(depth - 1)} else {b})",
            f"ceil({self.small(self.number(depth - 1))})", f"({a} % 7) ** 2", f"CODES[{a} % 4]", f"({a} and {b})",
            f"({self.truth(depth - 1)} + {a})", f"({a} & 3)",
        )  # fmt: skip

    def truth(self, depth: int = DEPTH) -> str:
        """Return an expression of a truth value."""
        if depth <= 0 or self.chance(0.2):
            return (
                f"({self.number(0)} {self.pick('<', '<=', '>', '>=', '==', '!=')} {self.number(0)})"
            )
        a, b = self.truth(depth - 1), self.truth(depth - 1)
        number, index = self.number(depth - 1), self.index(depth - 1)
        return self.pick(
            f"({a} and {b})", f"({a} or {b})", f"(not {a})", f"({number} < {self.number(0)} <= {self.number(0)})",
            f"({index} == {self.index(0)})", f"({index} in (1, {self.index(0)}, 4))", f"({index} not in (0, 2))",
            f"bool({number})", f"({index} <= {self.index(0)} != {self.index(0)})", f"({a} == {b})",
            f"({number} > 0.25)", *self.variables("bool"),
        )  # fmt: skip

    def pair(self, depth: int = DEPTH) -> str:
        """Return an expression of a tuple of two floats."""
        a, b = self.number(depth - 1 if depth else 0), self.number(0)
        choices = [f"({a}, {b})", *self.variables("pair")]
        if depth > 0:
            choices += [f"({self.pair(0)} if {self.truth(depth - 1)} else {self.pair(0)})"]
            choices += [f"(*({a}, {b}),)"]
        return self.pick(*choices)

    # --------------------------------------------------------------------------------------------- statements
    def statements(self, count: int, depth: int) -> None:
        """Add statements."""
        for _ in range(count):
            self.statement(depth)

    def statement(self, depth: int) -> None:
        """Add one statement."""
        kinds = ["assign"] * 4 + ["augment", "swap", "store", "record"]
        kinds += (["if"] * 2 + ["for", "while"]) * (depth > 0) + ["leave"] * (self.loops > 0)
        kind = self.pick(*kinds)
        if kind == "store" and not self.may_write:
            kind = "assign"
        getattr(self, f"write_{kind}")(depth)

    def target(self, kind: str) -> str:
        """Return a variable that may be assigned."""
        names = [name for name in self.variables(kind) if not name.startswith("loop")]
        name = self.pick(*names) if names and self.chance(0.6) else self.new_name()
        return name

    def write_assign(self, depth: int) -> None:
        """Add an assignment."""
        kind = self.pick("float", "float", "float", "int", "int", "bool", "pair")
        if kind == "float":
            value = self.small(self.number()) if self.chance(0.7) else self.number()
        elif kind == "int":
            value = f"{self.index()} % 17 - 5"
        else:
            value = self.truth() if kind == "bool" else self.pair()
        names = [self.target(kind) for _ in range(1 + self.chance(0.15))]
        self.write(f"{' = '.join(names)} = {value}")
        self.scope |= dict.fromkeys(names, kind)

    def write_augment(self, depth: int) -> None:
        """Add an augmented assignment to a variable or an item."""
        names = [name for name in self.variables("float") if not name.startswith("loop")]
        place = self.pick(*names) if names else ""
        if self.may_write and (not place or self.chance(0.5)):
            place = f"out[{self.index(1)} % 8]"
        if place:
            self.write(f"{place} {self.pick('+=', '-=')} {self.small(self.number(2))}")
            self.write(f"{place} *= {self.pick('0.5', '-1.5', '2')}")

    def write_swap(self, depth: int) -> None:
        """Add an assignment of several values."""
        names = [name for name in self.variables("float") if not name.startswith("loop")]
        if len(names) < 2:
            return
        a, b = self.rng.sample(names, 2)
        values = self.pick(f"{b}, {self.small(self.number(1))}", f"{b}, {a}", self.pair(1))
        self.write(f"{a}, {b} = {values}")

    def write_store(self, depth: int) -> None:
        """Add an assignment to items of vectors."""
        if self.chance(0.3):
            self.write(f"s[{self.index(1)} % 4] = {self.index()} % 11")
            return
        places = [f"out[{self.index(1)} % 8]" for _ in range(self.pick(1, 1, 2))]
        values = [self.small(self.number()) for _ in places]
        self.write(f"{', '.join(places)} = {', '.join(values)}")

    def write_record(self, depth: int) -> None:
        """Create a named tuple, or unpack one."""
        names = self.variables("record")
        if names and self.chance(0.5):
            a, b, c, d = (self.new_name() for _ in range(4))
            self.write(f"{a}, {b}, ({c}, {d}) = {self.pick(*names)}")
            self.scope |= {a: "float", b: "int", c: "float", d: "float"}
            return
        name = self.target("record")
        self.write(
            f"{name} = Record({self.small(self.number(2))}, {self.index(1)} % 9, {self.pair(1)})"
        )
        self.scope[name] = "record"

    def write_if(self, depth: int) -> None:
        """Add a branch."""
        with self.block(
            f"if {self.pick(self.truth(), self.truth(), self.index(1), self.number(1))}:"
        ):
            self.statements(self.rng.randint(1, 3), depth - 1)
        if self.chance(0.3):
            with self.block(f"elif {self.truth()}:"):
                self.statements(self.rng.randint(1, 2), depth - 1)
        if self.chance(0.5):
            with self.block("else:"):
                self.statements(self.rng.randint(1, 3), depth - 1)

    def write_for(self, depth: int) -> None:
        """Add a loop."""
        name = f"loop{self.names}" if self.chance(0.7) else self.new_name()
        self.names += 1
        bounds = self.pick(
            f"{self.index(1)} % 4", f"{self.rng.randint(-2, 1)}, {self.rng.randint(0, 4)}", 
            f"{self.index(1)} % 5, 0, -2", f"0, {self.index(1)} % 6, {self.index(0)} % 3 + 1",
        )  # fmt: skip
        is_tuple = self.chance(0.2)
        head = f"({self.number(1)}, {self.number(0)}, 1.5)" if is_tuple else f"range({bounds})"
        self.loops += 1
        with self.block(f"for {name} in {head}:"):
            self.scope[name] = "float" if is_tuple else "int"
            self.statements(self.rng.randint(1, 4), depth - 1)
        self.loops -= 1

    def write_while(self, depth: int) -> None:
        """Add a loop that ends after a few rounds in any case."""
        count = self.new_name()
        self.write(f"{count} = 0")
        self.loops += 1
        with self.block(f"while {count} < {self.rng.randint(1, 4)} and {self.truth(1)}:"):
            self.write(f"{count} += 1")
            self.statements(self.rng.randint(1, 3), depth - 1)
        self.loops -= 1

    def write_leave(self, depth: int) -> None:
        """Add a conditional `break` or `continue`."""
        with self.block(f"if {self.truth(1)}:"):
            self.write(self.pick("break", "continue"))

    # ----------------------------------------------------------------------------------------------- functions
    def helper(self, name: str, kinds: list[str], result: str) -> None:
        """Add a function that the kernel may call."""
        names = [f"p{k}" for k in range(len(kinds))]
        self.scope = dict(zip(names, kinds, strict=True))
        self.vectors = [own for own, kind in self.scope.items() if kind == "vector"]
        self.may_write = False
        before = self.helpers
        # A function without a vector argument cannot use items of vectors.
        self.helpers = []
        start = len(self.lines)
        self.lines.append(f"def {name}({', '.join(names)}):")
        if self.vectors:
            self.write(f"p0[{self.rng.randint(0, 3)}] += 0.25")
        if "function" in kinds:
            self.write(f"own = p{kinds.index('function')}({self.number(1)}, {self.number(0)})")
            self.scope["own"] = "float"
        self.statements(self.rng.randint(0, 3), 1)
        if self.chance(0.5):
            with self.block(f"if {self.truth(1)}:"):
                self.write(
                    f"return {self.small(self.number(1)) if result == 'float' else self.pair(1)}"
                )
        self.write(f"return {self.small(self.number(2)) if result == 'float' else self.pair(2)}")
        # The integer vector of the kernel is not visible here: replace it by constants.
        self.lines[start:] = [line.replace("s[", "CODES[") for line in self.lines[start:]]
        self.helpers = [*before, (name, kinds, result)]

    def kernel(self) -> str:
        """Complete the text, and return the name of the kernel."""
        prefix = f"random_{self.seed}"
        self.lines += [
            "def add_two(a, b):",
            "    return a + b",
            "def take_two(a, b):",
            "    return a - 2 * b",
        ]
        self.helper(f"{prefix}_pure", ["float", "int"], "float")
        self.helper(f"{prefix}_pair", ["float", "float", "pair"], "pair")
        self.helper(f"{prefix}_writes", ["vector", "float", "int"], "float")
        self.helper(f"{prefix}_calls", ["float", "function", "bool"], "float")
        self.lines.append(
            f"def {prefix}(s: 'Ints', x: 'Floats', out: 'Floats', count: 'int') -> 'int':"
        )
        self.scope, self.vectors, self.may_write = {"count": "int"}, ["x", "out"], True
        self.statements(self.rng.randint(5, 9), 2)
        for k, name in enumerate(self.variables("float")[:8]):
            self.write(f"out[{8 + k}] = {name}")
        self.write(f"return {self.index()} % 1000")
        return prefix


def make_function(seed: int) -> Any:
    """Compile a random kernel with integers, floats, results and a count as arguments."""
    writer = Writer(seed)
    name = writer.kernel()
    source = "\n".join(writer.lines) + "\n"
    file = f"<{name}>"
    linecache.cache[file] = (len(source), None, source.splitlines(keepends=True), file)
    scope = {
        "Ints": Ints, "Floats": Floats, "at": at, "sqrt": math.sqrt, "floor": math.floor, "ceil": math.ceil,
        "Record": Record, "WEIGHTS": WEIGHTS, "CODES": CODES, "__name__": f"osimlite.random{seed}",
    }  # fmt: skip
    exec(compile(source, file, "exec", dont_inherit=True), scope)
    return scope[name]


def make_inputs(seed: int, count: int) -> list[tuple[tuple[int, ...], tuple[float, ...], int]]:
    """Return random integers, floats and counts for calls of a kernel.

    Args:
        seed: seed of the random numbers.
        count: number of calls.
    """
    rng = random.Random(-seed)

    def number() -> float:
        return rng.choice(
            (rng.gauss(0.0, 1.0), rng.uniform(-9.0, 9.0), float(rng.randint(-2, 2)), 0.0, -0.0)
        )

    return [
        (
            tuple(rng.randint(-4, 9) for _ in range(4)),
            tuple(number() for _ in range(8)),
            rng.randint(0, 6),
        )
        for _ in range(count)
    ]
