"""What others printed: error columns recomputed, errata found, and printed pairs as a residual of their own.

A published batch holds numbers, not signals. What can be done honestly with numbers is done here: every
printed error is recomputed by both conventions, a modal table is checked against itself, load tests at
several loads are compared, and pairs along an axis are treated as evidence on the printed model.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables.problem import Block, Parameter, Problem, Refusal
from metro.observables.published.forces import forces
from metro.observables.published.matrices import matrices
from metro.observables.published.misprints import disorder, impossible_inertia, outlying
from metro.structure import Structure
from metro.units import JSON, MM, UM, Array

ENOUGH_ROWS = 8
POINTS_PER_CONDITION = 5
UNITS = {"N": 1.0, "mm": MM, "um": UM}
# the instrument of the manifest, and its key, that states the noise of an observable's printed measurements
NOISE = {
    "flatness": ("scanner", "sigma_mm", MM),
    "deformation": ("profiler", "sigma_mm", MM),
    "waviness": ("profiler", "sigma_mm", MM),
    "joint_force": ("dynamometer", "noise_n", 1.0),
    "force": ("dynamometer", "noise_n", 1.0),
}
GROUP = ["table", "observable", "quantity", "unit"]


@dataclass(frozen=True)
class PrintedModel:
    """A prediction that was printed: nothing to identify, but the structure that it presumes can be changed.

    Attributes
    ----------
    structure : stiffness of the machine in the cut relative to the one that the print was computed with. It
        acts on displacements only (``elastic``): a printed force does not follow from a stiffness.
    elastic : the printed quantity is proportional to the machine's compliance.
    """

    elastic: bool
    structure: Structure = field(default_factory=Structure)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """There is nothing to identify."""
        return ()

    def nuisance_starts(self, _block: Block) -> Array:
        """Return the one empty set of nonlinear unknowns, shape (1, 0)."""
        return np.zeros((1, 0))

    def design(self, block: Block, _nuisance: Array, _beta: Array | None = None) -> tuple[Array, Array]:
        """Return an empty matrix (n, 0) and the printed prediction (n,), SI, in the structure assumed."""
        printed: Array = block.setting
        offset = self.structure.in_cut(printed) if self.elastic else printed
        return np.zeros((printed.size, 0)), offset


def observe(
    batch: Batch, read: Callable[..., pd.DataFrame], _identified: JSON
) -> dict[str, pd.DataFrame] | Refusal:
    """Return what the printed tables of a published batch say: tables ``published_…`` of the layout."""
    published = read("published")
    if published.empty:
        return Refusal("no published.csv")
    return {
        "published_errors": errors(published),
        "published_modes": modes(published),
        "published_loads": loads(published),
        "published_matrices": matrices(published),
        "published_forces": forces(batch, published),
    }


def errors(published: pd.DataFrame) -> pd.DataFrame:
    """Recompute the error columns of printed pairs and flag what cannot be right.

    Parameters
    ----------
    published : rows of ``published.csv``, all of them; those without a pair are kept with blank errors.

    Returns
    -------
    The rows with ``of_measured_percent`` = (m − p)/m, ``of_predicted_percent`` = (m − p)/p; ``convention``:
    which of the two the print agrees with within the rounding of all three numbers (measured, predicted,
    both, neither, or blank; a sign that the print leaves out is no disagreement); ``flag``: what cannot be
    right.
    """
    table = published.copy()
    measured, predicted = table["measured"].astype(float), table["predicted"].astype(float)
    table["of_measured_percent"] = 100 * (measured - predicted) / measured
    table["of_predicted_percent"] = 100 * (measured - predicted) / predicted
    half = {
        c: _rounding(table, c).groupby([table[g] for g in GROUP]).transform("min")
        for c in ("measured", "predicted")
    }
    half["printed_error_percent"] = _rounding(table, "printed_error_percent")
    table["convention"] = ""
    table["flag"] = disorder(table) + outlying(table, _load(table)) + impossible_inertia(table)
    for row in table.index[table["printed_error_percent"].notna() & predicted.notna()]:
        convention = _convention(table.loc[row], {column: float(h[row]) for column, h in half.items()})
        table.loc[row, "convention"] = convention
        if convention == "neither" and not table.loc[row, "flag"]:
            table.loc[row, "flag"] = "the printed error does not follow from the printed pair"
    return table


def _rounding(table: pd.DataFrame, column: str) -> pd.Series:
    """Half a unit of each value's last digit; trailing zeros are lost: of a group the smallest holds."""
    decimals = table[column].map(lambda x: len(repr(float(x)).partition(".")[2]) if pd.notna(x) else 0)
    return 0.5 * 10.0**-decimals


def _convention(row: pd.Series, half: Mapping[str, float]) -> str:
    """Name the definition that the printed error agrees with, for some values that round to those printed."""
    m, p, printed = (float(row[c]) for c in ("measured", "predicted", "printed_error_percent"))
    ratio, agreeing = p / m, []
    slack = {
        "measured": abs(ratio) * (half["measured"] / abs(m) + half["predicted"] / abs(p)),
        "predicted": abs(1 / ratio) * (half["measured"] / abs(m) + half["predicted"] / abs(p)),
    }
    for name, error in (("measured", 1 - ratio), ("predicted", 1 / ratio - 1)):
        off = min(abs(100 * error - printed), abs(abs(100 * error) - printed))
        if off <= 100 * slack[name] + half["printed_error_percent"] + 1e-9:
            agreeing.append(name)
    return "both" if len(agreeing) == 2 else agreeing[0] if agreeing else "neither"


def modes(published: pd.DataFrame) -> pd.DataFrame:
    """Check a printed modal table against itself: frequency against √(k/m)/2π, undamped and damped.

    Returns
    -------
    One row per mode with frequency, damping ratio (%), stiffness (N/m) and mass (kg) all printed: ``table,
    row, axis, printed_hz, undamped_hz, damped_hz`` (undamped·√(1 − ζ²)) and ``agrees_with``
    (undamped, damped or neither, within 1e-4).
    """
    columns = ["table", "row", "axis", "printed_hz", "undamped_hz", "damped_hz", "agrees_with"]
    needed = ["frequency", "damping", "stiffness", "mass"]
    rows = published[published["quantity"].isin(needed)]
    if not set(needed) <= set(rows["quantity"]):
        return pd.DataFrame(columns=columns)
    wide = rows.pivot_table(index=["table", "row", "axis"], columns="quantity", values="measured", sort=False)
    wide = wide.dropna(subset=needed).reset_index()
    undamped = np.sqrt(wide["stiffness"] / wide["mass"]) / (2 * math.pi)
    damped = undamped * np.sqrt(1 - (wide["damping"] / 100) ** 2)
    near = [
        [name for name, f in (("undamped", u), ("damped", d)) if abs(f / p - 1) < 1e-4]
        for p, u, d in zip(wide["frequency"], undamped, damped, strict=True)
    ]
    wide = wide.assign(printed_hz=wide["frequency"], undamped_hz=undamped, damped_hz=damped)
    return wide.assign(agrees_with=[" and ".join(names) or "neither" for names in near])[columns]


def loads(published: pd.DataFrame) -> pd.DataFrame:
    """Return the compliance of printed load tests: mean and scatter of displacement over load.

    Rows count whose quantity reads ``displacement under <load> N``; columns ``table, quantity, axis, load_n,
    points, compliance_um_n, sd_um_n`` (over the points). A linear structure has one compliance per axis.
    A value that stands out of its column as a misprint would is left out.
    """
    load = _load(published)
    rows = published.assign(load_n=load)[load.notna() & (outlying(published, load) == "")]
    rows = rows.assign(compliance_um_n=1e3 * rows["measured"] / rows["load_n"])
    grouped = rows.groupby(["table", "quantity", "axis", "load_n"], sort=False)["compliance_um_n"]
    table = grouped.agg(points="size", mean="mean", sd="std").reset_index()
    return table.rename(columns={"mean": "compliance_um_n", "sd": "sd_um_n"})


def _load(published: pd.DataFrame) -> pd.Series:
    text = published["quantity"].astype(str).str.extract(r"^displacement under ([0-9.]+) N", expand=False)
    return text.astype(float).where(published["unit"] == "mm")


def problems(batch: Batch, observed: Mapping[str, pd.DataFrame], _identified: JSON) -> list[Problem]:
    """Return a problem for each group (table × quantity × unit) of printed pairs that is large enough.

    Only rows with an axis count: an index over a whole face (X_m, …) is biased up by the scanner's noise, so
    its difference from a prediction is no residual of the model. Of an observable the largest group is taken.
    """
    table = observed["published_errors"]
    pairs = table[table["predicted"].notna() & (table["axis"].fillna("") != "") & table["unit"].isin(UNITS)]
    pairs = pairs[pairs["measured"].notna() & pairs["observable"].isin(NOISE)]
    largest: dict[str, tuple[Hashable, pd.DataFrame]] = {}
    for key, rows in pairs.groupby(GROUP, sort=False):
        name = str(rows["observable"].iloc[0])
        if len(rows) >= ENOUGH_ROWS and (name not in largest or len(rows) > len(largest[name][1])):
            largest[name] = (key, rows)
    return [_problem(batch, rows) for _, rows in largest.values()]


def _problem(batch: Batch, rows: pd.DataFrame) -> Problem:
    observable, quantity, unit, table = (
        str(rows[c].iloc[0]) for c in ("observable", "quantity", "unit", "table")
    )
    sigma, origin = _sigma(batch, rows)
    places = list(dict.fromkeys(rows["row"].astype(str)))
    count = max(min(3, len(places)), len(places) // POINTS_PER_CONDITION)
    blocks = tuple(
        _block(rows[rows["row"].astype(str).isin(part)], order, sigma)
        for order, part in enumerate(np.array_split(np.array(places), count), start=1)
    )
    notes = (
        f"Measured and predicted are the printed values of table {table} ({quantity}); nothing is fitted.",
        f"{len(rows)} printed pairs form {len(blocks)} conditions of contiguous rows; every second held out.",
        origin,
    )
    model = PrintedModel(elastic=unit != "N")
    return Problem(observable, unit, UNITS[unit], model, blocks, np.zeros(0), notes=notes)


def _sigma(batch: Batch, rows: pd.DataFrame) -> tuple[float, str]:
    """Noise of the printed measurements in SI, and the sentence that says where it is from."""
    instrument, key, si = NOISE[str(rows["observable"].iloc[0])]
    stated = batch.instrument(instrument).get(key)
    if stated is not None:
        return float(stated) * si, f"Noise of a printed value: {instrument}: {key} of batch.yaml."
    rounding = 2 * float(_rounding(rows, "measured").min()) / math.sqrt(12)
    words = (
        f"No noise is stated ({instrument}: {key} in batch.yaml): only the rounding of the print is known."
    )
    return rounding * UNITS[str(rows["unit"].iloc[0])], words


def _block(rows: pd.DataFrame, order: int, sigma: float) -> Block:
    si = UNITS[str(rows["unit"].iloc[0])]
    first, last = str(rows["row"].iloc[0]), str(rows["row"].iloc[-1])
    name = first if first == last else f"{first}–{last}"
    axis = rows["axis"].astype(str).to_numpy()
    return Block(
        run=f"table {rows['table'].iloc[0]}, {name}",
        condition=name,
        role="identify" if order % 2 else "validate",
        order=order,
        measured=rows["measured"].to_numpy(float) * si,
        sigma=np.full(len(rows), sigma),
        setting=rows["predicted"].to_numpy(float) * si,
        axis=axis,
        zeros=np.zeros((len(rows), 0)),
        zero_sd=np.zeros(0),
        coordinates={"axis": axis},
    )
