"""Numbers that a program is written with: where each stands, and what it is called there.

A number is *named* where a constant, a field of a class or an argument is given it and nothing else, or where
it scales the argument of a function that saturates: then it states how large something is.
"""

import ast
import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

SATURATING = {"tanh", "arctan", "erf", "expit"}
COUNTS = 12.0  # of axes, joints, teeth, orders, digits
TURNS = {15.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0, 270.0, 360.0}  # parts of a turn, s/min
GRAVITY = 9.81
UNITS = {"MM": 1e-3, "UM": 1e-6, "MS": 1e-3, "DEG": math.pi / 180.0, "MRAD": 1e-3, "RPM": math.pi / 30.0}
UNITS |= {"N_MM2": 1e6, "N_MM": 1e3, "N_UM": 1e6}


@dataclass(frozen=True)
class Literal:
    """A number in a file: its value without sign, the line, and its name there; empty: it has none.

    Of a name that is given a number times a unit, the value is in SI. ``whole``: written without a point.
    """

    value: float
    file: str
    line: int
    name: str = ""
    whole: bool = False

    @property
    def says_nothing(self) -> bool:
        """Whether two programs share the number whatever they are about.

        They do share small counts, powers of two, parts of a turn and gravity. Named or not, these are left
        out. They share as well numbers of one digit (there are nine between two powers of ten) and halves of
        these (0.25, 1.5), counts, places and seeds: all these count only where they are named.
        """
        value = self.value
        counts = value == int(value) and value <= COUNTS
        doubled = value >= 1.0 and math.log2(value) == int(math.log2(value))
        if counts or doubled or value in {*TURNS, GRAVITY, 0.5}:
            return True
        return not self.name and (self.whole or digits(value) == 1 or digits(2.0 * value) == 1)


def literals(path: Path, top: Path) -> list[Literal]:
    """Return the numbers of a module."""
    tree = ast.parse(path.read_text())
    names = {id(node): name for name, node in _named(tree)}
    factors = dict(_factors(tree))
    file = path.relative_to(top).as_posix()
    return [
        Literal(
            float(node.value) * (factors.get(id(node), 1.0) if id(node) in names else 1.0),
            file,
            node.lineno,
            names.get(id(node), ""),
            isinstance(node.value, int),
        )
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and type(node.value) in (int, float) and math.isfinite(node.value)
    ]


def _factors(tree: ast.Module) -> Iterator[tuple[int, float]]:
    """Go through the numbers that a unit is multiplied by."""
    for node in ast.walk(tree):
        product = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult)
        if product and isinstance(node.right, ast.Name) and node.right.id in UNITS:
            yield id(node.left), UNITS[node.right.id]


def _named(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    """Go through the names of a module that are given one number, or one number and its unit."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                yield from _given(target, node.value)
        elif isinstance(node, ast.AnnAssign) and node.value:
            yield from _given(node.target, node.value)
        elif isinstance(node, ast.FunctionDef):
            given = [*node.args.posonlyargs, *node.args.args]
            defaults = [*zip(reversed(given), reversed(node.args.defaults), strict=False)]
            defaults += [*zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True)]
            for argument, default in defaults:
                if default is not None:
                    yield f"{node.name}({argument.arg})", _plain(default)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2] in SATURATING:
            for argument in node.args:
                for inner in ast.walk(argument):
                    yield ast.unparse(node), inner


def _given(target: ast.expr, value: ast.expr) -> Iterator[tuple[str, ast.expr]]:
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        for one, other in zip(target.elts, value.elts, strict=True):
            yield from _given(one, other)
    elif isinstance(target, ast.Name | ast.Attribute):
        yield ast.unparse(target), _plain(value)


def _plain(value: ast.expr) -> ast.expr:
    if isinstance(value, ast.BinOp) and isinstance(value.right, ast.Name) and value.right.id in UNITS:
        return _plain(value.left)
    return value.operand if isinstance(value, ast.UnaryOp) else value


def digits(value: float) -> int:
    """Count the significant digits."""
    mantissa = f"{abs(value):.12e}".partition("e")[0]
    return len(mantissa.replace(".", "").rstrip("0"))


def shared(ours: list[Literal], theirs: list[Literal]) -> dict[float, tuple[list[Literal], list[Literal]]]:
    """Return the numbers that both have and that say something, with the places in each."""
    sides: tuple[dict[float, list[Literal]], ...] = (defaultdict(list), defaultdict(list))
    for side, places in zip(sides, (ours, theirs), strict=True):
        for place in places:
            if not place.says_nothing:
                side[float(f"{place.value:.6g}")].append(place)
    return {value: (sides[0][value], sides[1][value]) for value in sorted(set(sides[0]) & set(sides[1]))}
