"""Print docs/numerics.md: certified digits of the loop's fits on NIST's reference data.

``python benchmarks/strd.py > docs/numerics.md``; needs the reference data (METRO_REAL_DATA).
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests/loop"))

from importlib import import_module

from metro.loop.fitting.least_squares import least_squares

HEAD = """# Numbers

What the fits of the loop reach on the statistical reference datasets of NIST (StRD), by the routines that
the models use: for the linear sets the first estimate of the base parameters
(`loop/fitting/least_squares.py`: columns of one length, QR, refined residuals), for the nonlinear ones the
descent (`loop/fitting/descent.py`: Gauss–Newton, then damped by Levenberg and Marquardt where no share of a
step leads down) from NIST's two starts, followed to its end (`polish`).

Made by `python benchmarks/strd.py > docs/numerics.md`. Eleven digits are certified of the nonlinear sets,
up to 15 of the linear ones; the count is of the parameter where fewest agree.

A fit says three things of itself: how far another step would move a parameter (`Fit.step`, in its
standard deviations; 0.5 or more is not converged), the condition of its scaled columns (`Fit.condition`;
beyond 10⁶ the normal matrix of the columns, in double precision, no longer determines a parameter: it is
taken as not determined, and its variance is infinite), and how many parameters it determines
(`Fit.rank`). An end that is not converged or not determined is *refused* here.
"""
LINEAR = """
*Allowed* are the digits of the exact solution, in whole fractions, of the same columns: what the rounding
of the data to double precision leaves. *Solver* are the digits in which the routine agrees with that
solution.

The columns of Filip are the first ten powers of x; rounded, they allow no more than 7.6 digits to whoever
is given them, and as their condition is 5·10⁹ a fit of the loop refuses them. Longley's columns, which are
not centred, have a condition of 4.3·10⁴: they are determined, and so are the *deviations*.
"""
TAIL = """
A start is refused where the first steps lead to a place at which the model no longer depends on a parameter
(an exponential that has died away), or overflows.

The descent of a search ends where a step gains less than 0.01 in twice the log-likelihood, a tenth of a
standard error; the table above follows it on.

## What each fit does with a bad end

| fit | rank and condition | convergence |
| --- | --- | --- |
| `loop/fitting/fit.py` | infinite variance of what is not determined | `Fit.converged`; else no verdict |
| `robot/stiffness.py` | `seen`; refused where no joint can be separated | refused at the limit of its steps |
| `robot/friction.py` | NaN for a coefficient that the log does not determine | linear |
| `surface/plane.py` | refused: fewer than three points, points on a line | linear |
| `dynamics/modal.py` | modes that are not needed are removed | refused where it still falls after 90 steps |

The likelihood of the loop has several maxima in its noise: a small misfit with a large scatter of the
coefficients, or the other way round. A model is at least as likely as one that it contains. Where a fit
is not, it is done again from the end of the smaller one (`parted` in `loop/search/trial.py`).

In one of ten tuning batches of the cutting force an effect that was there had been dropped for lack of
this: 100 in log-likelihood were missing, the held-out error was 4.4 N and is 3.4 N.

## What must not matter

`tests/invariants` draws cases (hypothesis) and compares each with an equivalent statement of itself.

- **Cutting force**: in another unit of length; with another tooth called the first; the depth in two slices;
  up for down milling in a mirror.
- **Stability lobes**: in other units of time and force; in a turned frame; modes and speeds in another order;
  a speed alone.
- **Flatness**: in a turned and moved frame; in another unit; points in another order and in pieces, several
  times over, with points between them.
- **Joint force**: in a turned work frame; in other units of length and force; joints and places in another
  order; more samples of the same.
- **Evidence of the loop**: in another unit; runs in another order; under other names of runs, conditions and
  axes; samples of a run that begin elsewhere, in another order.
"""


def row(strd, name, problem, starts):
    """Return a row of a table: digits from each start, or that it was refused."""
    found = [told(strd, problem, start) for start in starts]
    return f"| {name} | " + " | ".join(found) + " |"


def told(strd, problem, start):
    """Return what came of one start, in words."""
    end = strd.reached(problem, start)
    return f"{end.digits:.1f}" if end.usable else "refused"


def linear_row(strd, exact_least_squares, name):
    """Return a row of the linear table: digits of values, those allowed, the solver's, and of deviations."""
    problem = strd.linear(name)
    end, exact = strd.reached(problem), exact_least_squares(problem.function, problem.y)
    solver = strd.agreeing(least_squares(problem.function, problem.y), exact)
    allowed = strd.agreeing(exact, problem.value)
    deviations = "none: no noise" if problem.rss == 0 else f"{end.sd_digits:.1f}" if end.usable else "refused"
    return f"| {name.capitalize()} | {end.digits:.1f} | {allowed:.1f} | {solver:.1f} | {deviations} |"


def main():
    """Print the page."""
    strd, exact = import_module("strd"), import_module("strd_exact")
    print(HEAD)
    print("| linear | digits | allowed | solver | deviations |\n| --- | --- | --- | --- | --- |")
    for name in strd.LINEAR:
        print(linear_row(strd, exact.exact_least_squares, name))
    print(LINEAR)
    print("| nonlinear | digits, start 1 | digits, start 2 |\n| --- | --- | --- |")
    for name in strd.names():
        problem = strd.nonlinear(name)
        print(row(strd, name, problem, problem.starts))
    print(TAIL.rstrip())


if __name__ == "__main__":
    main()
