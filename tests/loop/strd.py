"""The statistical reference datasets of NIST (StRD) as problems of the loop: one block, one model."""

import json
import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from metro.loop.fitting import descent
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import UNDECIDED
from metro.loop.fitting.noise import Noise
from metro.loop.fitting.nuisances import first_beta
from metro.loop.fitting.system import State, ahead, condition, inverse, linearised, normal_equations
from metro.observables.problem import Block, Parameter

REAL = Path(os.environ.get("METRO_REAL_DATA", Path(__file__).parents[3] / "shared/real")) / "reference"
LINEAR = ("pontius", "longley", "wampler 1", "wampler 2", "wampler 3", "wampler 4", "wampler 5", "filip")
STEP = 1e-60  # of complex differentiation: exact to rounding
FUNCTIONS = {"exp": np.exp, "cos": np.cos, "sin": np.sin, "arctan": np.arctan, "pi": np.pi}


@dataclass(frozen=True)
class Problem:
    """Data, a function of the parameters or their columns, starts; certified values, deviations, rest."""

    name: str
    y: np.ndarray
    function: object
    starts: tuple
    value: np.ndarray
    sd: np.ndarray
    rss: float


@dataclass(frozen=True, eq=False)
class Curve:
    """A model that is linear about the parameters."""

    function: object
    count: int

    @property
    def parameters(self):
        return tuple(Parameter(f"b{i}", "1") for i in range(self.count))

    def nuisance_starts(self, _block):
        return np.zeros((1, 0))

    def design(self, _block, _nuisance, beta):
        if isinstance(self.function, np.ndarray):
            return self.function, np.zeros(len(self.function))
        beta = np.zeros(self.count) if beta is None else beta
        with np.errstate(all="ignore"):
            moved = [self.function(beta + STEP * 1j * unit).imag / STEP for unit in np.eye(self.count)]
            here = self.function(beta + 0j).real
        matrix = np.stack(moved, axis=1)
        return matrix, here - matrix @ beta


@dataclass(frozen=True)
class Reached:
    """Where the descent ended: worst digits of values and deviations, and what it says of itself."""

    digits: float
    sd_digits: float
    condition: float
    ahead: float

    @property
    def usable(self):
        return bool(np.isfinite(self.condition) and self.ahead < UNDECIDED)


def reached(problem, start=None):
    """Fit a problem with the routines of the loop: first estimate (linear) or ``start``, then the descent."""
    n, p = len(problem.y), len(problem.value)
    one = np.ones(n)
    block = Block(
        "r", "c", "identify", 0, problem.y, one, None, np.full(n, "y"), np.zeros((n, 0)), np.zeros(0), {}
    )
    noise = Noise(0.0, np.zeros(p), {"c": 1.0})
    candidate = Candidate(Curve(problem.function, p))
    beta = first_beta(candidate, [block], noise) if start is None else np.array(start)
    state = State(np.zeros(0), beta, {"r": np.zeros(0)})
    with np.errstate(all="ignore"):
        try:
            if start is not None:
                state = descent.descend(candidate, [block], noise, state, 500, enough=0.0)[0]
                state = descent.polish(candidate, [block], noise, state)
        except np.linalg.LinAlgError:  # it went where the model overflows
            return Reached(0.0, 0.0, np.inf, np.inf)
        system = linearised(candidate, [block], noise, state)
        normal, right = normal_equations(system)
        if not np.isfinite(normal).all():
            return Reached(0.0, 0.0, np.inf, np.inf)
        variance = system.chi2["r"] / max(n - p, 1)  # of the data, as the rest says
        sd = np.sqrt(np.diag(inverse(normal)) * variance)
        digits = agreeing(state.beta, problem.value)
        sd_digits = agreeing(sd, problem.sd) if problem.rss > 0 else np.nan
        # of data without noise the rest is rounding, and what is ahead of it says nothing
        return Reached(digits, sd_digits, condition(normal), ahead(normal, right) / max(variance, 1e-20))


def agreeing(found, certified):
    """Return the number of digits that agree, of the value where fewest do; 11 are certified, or 15."""
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.abs(found - certified) / np.where(certified == 0, 1.0, np.abs(certified))
        digits = -np.log10(off)
    return float(np.clip(np.nan_to_num(digits, nan=0.0, posinf=15.0), 0.0, 15.0).min())


def linear(name):
    """Return a linear problem; Wampler's five are made by their definition."""
    if name.startswith("wampler"):
        return _wampler(int(name[-1]))
    content = json.loads((REAL / f"strd-linear/{name}_certified.json").read_text())["certified"]
    table = np.genfromtxt(REAL / f"strd-linear/{name}.csv", delimiter=",", names=True)
    value = np.array(content["beta"])
    if name == "longley":
        columns = np.stack([table[key] for key in ("const", *(f"x{i}" for i in range(1, 7)))], axis=1)
    else:
        columns = table["x"][:, None] ** np.arange(len(value))
    return Problem(name, table["y"], columns, (), value, np.array(content["sd"]), content["rss"])


def _wampler(which):
    x = np.arange(21.0)
    columns = x[:, None] ** np.arange(6)
    value = np.ones(6) if which != 2 else 0.1 ** np.arange(6)
    # 3 to 5 add noise of mean zero to the first, tabulated by Wampler (1970), in steps of one size
    delta = [759, -2048, 2048, -2048, 2523, -2048, 2048, -2048, 1838, -2048, 2048]
    delta = np.array([*delta, *delta[-2::-1]], dtype=float)
    factor = {1: 0.0, 2: 0.0, 3: 1.0, 4: 100.0, 5: 10000.0}[which]
    sd = factor * np.array(
        [
            2152.32624678170,
            2363.55173469681,
            779.343524331583,
            101.475507550350,
            5.64566512170752,
            0.112324854679312,
        ]
    )
    y, rss = columns @ value + factor * delta, factor**2 * 83554268.0
    return Problem(f"wampler {which}", y, columns, (), value, sd, rss)


def nonlinear(name):
    """Read a nonlinear problem of NIST's file: model, two starts, certified values, data."""
    text = (REAL / f"strd-nonlinear/{name}.dat").read_text()
    rows = re.findall(r"^ *b\d+ = +(\S+) +(\S+) +(\S+) +(\S+)", text, re.MULTILINE)
    numbers = np.array(rows, dtype=float)
    rss = float(re.search(r"Sum of Squares: +(\S+)", text)[1])
    data = np.array(
        [line.split() for line in text.rpartition("Data:")[2].splitlines()[1:] if line.split()], float
    )
    model = text.partition("Model:")[2].partition("Starting")[0]
    right = re.search(r"(?:y|log\[y\]) += +(.*?)\+ +e\b", model, re.DOTALL)[1]
    code = " ".join(right.split()).replace("[", "(").replace("]", ")")
    y = np.log(data[:, 0]) if "log[y]" in model else data[:, 0]
    names = {f"x{i}": data[:, i] for i in range(1, data.shape[1])} | {"x": data[:, 1]} | FUNCTIONS
    program = compile(code, name, "eval")

    def function(b):
        return eval(program, {}, names | {f"b{i + 1}": value for i, value in enumerate(b)}) + 0 * data[:, 1]

    return Problem(name, y, function, (numbers[:, 0], numbers[:, 1]), numbers[:, 2], numbers[:, 3], rss)


def names():
    """Return the names of the nonlinear problems that are there."""
    return sorted(path.stem for path in (REAL / "strd-nonlinear").glob("*.dat"))
