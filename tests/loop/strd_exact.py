"""Linear least squares in whole fractions: the solution of the very numbers given, without any rounding."""

from fractions import Fraction

import numpy as np


def exact_least_squares(columns, target):
    """Solve the normal equations by Gauss and Jordan's elimination, (p,)."""
    table = [[Fraction(float(value)) for value in row] for row in np.column_stack([columns, target])]
    count = columns.shape[1]
    rows = [[sum(row[i] * row[j] for row in table) for j in range(count + 1)] for i in range(count)]
    for i, pivot in enumerate(rows):
        rows[i] = [value / pivot[i] for value in pivot]
        for j in range(count):
            if j != i:
                rows[j] = [value - rows[j][i] * above for value, above in zip(rows[j], rows[i], strict=True)]
    return np.array([float(row[-1]) for row in rows])
