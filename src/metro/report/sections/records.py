"""The raw records at a glance: the parts that were used, and the bandwidth of the hammer's hits."""

from __future__ import annotations

from metro.report.content import Item, Picture
from metro.report.figures import records as figures
from metro.report.numbers import listing, number
from metro.report.results import Results
from metro.report.sections.measured import count_of

FADED = -20.0  # dB, force of a hit below which a response hardly exceeds the noise


def record_items(results: Results) -> list[Item]:
    """Draw the force records and the hits, with the part and the band that were used."""
    return [*_force(results), *_hits(results)]


def _force(results: Results) -> list[Item]:
    records, spindle = results.tables.get("force_records"), results.tables.get("spindle")
    if records is None:
        return []
    runs = [str(run) for run in records["run"].unique()]
    used = [] if spindle is None else [run for run in runs if run in set(spindle["run"])]
    unused = [run for run in runs if run not in used]
    finding = f"Of {len(used)} of {count_of(len(runs), 'record')} the steady cut was used"
    finding += f"; of {listing(unused)} nothing was." if unused else "."
    airless = [] if spindle is None else list(spindle.loc[spindle["air_s"] <= 0, "run"].astype(str))
    if airless:
        finding += f" {count_of(len(airless), 'record')} without air: no zero of the sensor is known there."
    recorded = int((results.batch.runs["dynamometer"].fillna("") != "").sum())
    more = f" {len(runs)} of {recorded} records." if recorded > len(runs) else ""
    about = f"{finding} Least and greatest force along each record.{more}"
    return [Picture(figures.force(records, spindle), about, about)]


def _hits(results: Results) -> list[Item]:
    records, fitted = results.tables.get("hit_records"), results.tables.get("frf_used")
    if records is None:
        return []
    band = None
    if fitted is not None:
        band = float(fitted["frequency_hz"].min()), float(fitted["frequency_hz"].max())
    spectrum = records[records["part"] == "spectrum"]
    level = spectrum.groupby("x")["value"].median().rolling(15, center=True, min_periods=1).median()
    faded = level[level < FADED]
    reach = (
        f"down by {-FADED:.0f} dB at {number(float(faded.index[0]))} Hz"
        if len(faded)
        else (f"within {-FADED:.0f} dB up to {number(float(level.index[-1]))} Hz")
    )
    inside = f"; modes were fitted from {number(band[0])} to {number(band[1])} Hz" if band else ""
    hits = count_of(records["hit"].nunique(), "hit")
    about = f"The force of {hits} is {reach}{inside}. Force of the hammer about its peak, and its spectrum."
    return [Picture(figures.hits(records, band), about, about)]
