"""Print docs/numerics.md: certified digits of the loop's fits on NIST's reference data.

``python benchmarks/strd.py > docs/numerics.md``; needs the reference data (METRO_REAL_DATA).
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests/loop"))

from importlib import import_module

HEAD = """# Numbers

What the fits of the loop reach on the statistical reference datasets of NIST (StRD), by the routines that
the models use: for the linear sets the first estimate of the base parameters (`loop/least_squares.py`:
columns of one length, QR, refined residuals), for the nonlinear ones the Gauss–Newton descent
(`loop/descent.py`) from NIST's two starts, followed to its end (`polish`). Made by
`python benchmarks/strd.py > docs/numerics.md`. Eleven digits are certified of the nonlinear sets, up to 15
of the linear ones; the count is of the parameter where fewest agree.

A fit says three things of itself: what another step would gain (`Fit.ahead`, in units of twice the
log-likelihood; more than 0.1 is not converged), the condition of its scaled columns (`Fit.condition`; beyond
3·10⁴ a parameter is taken as not determined, and its variance is infinite), and how many parameters it
determines (`Fit.rank`). An end that is not converged or not determined is *refused* here.
"""
TAIL = """
The descent of a search ends where a step gains less than 0.01 in twice the log-likelihood, a tenth of a
standard error; the table above follows it on.

## What each fit does with a bad end

| fit | rank and condition | convergence |
| --- | --- | --- |
| `loop/fit.py` | `Fit.condition`, `Fit.rank`; infinite variance of what is not determined | `Fit.converged` |
| `robot/stiffness.py` | `seen`; refused where no joint is told apart | refused at the limit of its steps |
| `robot/friction.py` | NaN for a coefficient that the log does not determine | linear |
| `surface/plane.py` | refused: fewer than three points, points on a line | linear |
| `dynamics/modal.py` | modes that the data do not need are removed | at most 30 steps; it does not say |
"""


def row(strd, name, problem, starts):
    """Return a row of a table: digits from each start, or that it was refused."""
    found = [told(strd, problem, start) for start in starts]
    return f"| {name} | " + " | ".join(found) + " |"


def told(strd, problem, start):
    """Return what came of one start, in words."""
    end = strd.reached(problem, start)
    if not end.usable and start is not None:
        return "refused"
    mark = "" if end.usable else " (not determined)"
    return f"{end.digits:.1f}{mark}"


def main():
    """Print the page."""
    strd = import_module("strd")
    print(HEAD)
    print("| linear | digits |\n| --- | --- |")
    for name in strd.LINEAR:
        print(row(strd, name.capitalize(), strd.linear(name), [None]))
    print("\nThe powers of Filip's x, rounded to double precision, allow no more than these digits.\n")
    print("| nonlinear | digits, start 1 | digits, start 2 |\n| --- | --- | --- |")
    for name in strd.names():
        problem = strd.nonlinear(name)
        print(row(strd, name, problem, problem.starts))
    print(TAIL.rstrip())


if __name__ == "__main__":
    main()
