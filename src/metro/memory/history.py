"""Which parameter was found in which batches of one cell, tool or work, and how large: series over batches.

An effect that was tried in a batch has an estimate there whether it was claimed or not. A series has them
all, where it can: with those alone that passed the gates it would have only the large ones.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from metro.units import JSON, Array

# Verdicts in which an effect that was not claimed has an estimate that counts.
SETTLED = {"clean", "explained"}
CLAIMED = {"explained", "partly_explained"}
HOUR, DAY = 3600.0, 86400.0
NORMAL = 1.959963984540054  # half width of a 95 % interval; by Student's t it is longer, so this is cautious
_COEFFICIENT = "cutting coefficient "


@dataclass(frozen=True)
class Record:
    """One batch as the campaign remembers it.

    Attributes
    ----------
    manifest : batch.yaml, validated. started : seconds since 1970 of its first run, None where no run says.
    verdict, loop, identified : content of verdict.json, loop.json and identified.json; ``effects`` of
        loop.json says what each effect belongs to.
    """

    name: str
    manifest: JSON
    started: float | None
    verdict: JSON
    loop: JSON
    identified: JSON

    @property
    def cell(self) -> str:
        """The cell's name."""
        return str(self.manifest.get("cell") or "")

    def owner(self, *kinds: str) -> str:
        """Name what a parameter belongs to: the cell, and of ``kinds`` the tool and the work.

        A batch has one machine and one set of instruments: both are named by its cell.
        """
        tool, work = self.manifest.get("tool") or {}, self.manifest.get("work") or {}
        words = {"tool": _tool(tool), "work": str(work.get("material") or "work of unknown material")}
        return ", ".join([self.cell, *(name for kind, name in words.items() if kind in kinds)])


@dataclass(frozen=True)
class Entry:
    """A parameter in one batch.

    ``less_neutral``: less the value at which the effect changes nothing. ``claimed``: by its verdict.
    ``sensitivity``: relative change of the prediction per sd. ``budget``: what a model may get wrong, as a
    part of what it predicts.
    """

    batch: str
    value: float
    sd: float
    less_neutral: float = math.nan
    claimed: bool = False
    sensitivity: float = math.nan
    budget: float = math.nan


@dataclass(frozen=True)
class Series:
    """A parameter over batches, in their order.

    Attributes
    ----------
    owner : what it belongs to. observable : whose verdicts it is from; "" of an identified quantity.
    effect, quantity : names; ``effect`` is "" of an identified quantity. unit : of the contract.
    signed : estimates of an effect that is not there scatter about zero.
    t : (n,) time or place in the order. clock : "hours", "days" or "batches".
    """

    owner: str
    observable: str
    effect: str
    quantity: str
    unit: str
    signed: bool
    entries: tuple[Entry, ...]
    t: Array = field(repr=False)
    clock: str

    @property
    def claimed_in(self) -> list[str]:
        """Batches in which the effect was claimed."""
        return [entry.batch for entry in self.entries if entry.claimed]

    def column(self, name: str) -> Array:
        """Return one number of every entry (n,)."""
        return np.array([getattr(entry, name) for entry in self.entries])


def histories(records: Sequence[Record]) -> list[Series]:
    """Return every parameter that at least two batches estimate.

    Batches are ordered by the time their first run started, where all of a series state it and no two are the
    same; else by their names, numbers in them counted as numbers.
    """
    known = {record.name: record for record in records}
    gathered: dict[tuple[str, str, str, str], list[tuple[Entry, str, bool]]] = {}
    for record in sorted(records, key=lambda record: natural(record.name)):
        for key, entry, unit, signed in (*_effects(record), *_quantities(record)):
            gathered.setdefault(key, []).append((entry, unit, signed))
    series = []
    for (owner, observable, effect, quantity), rows in sorted(gathered.items()):
        if len(rows) < 2:
            continue
        order, t, clock = _clock([known[entry.batch].started for entry, _, _ in rows])
        entries = tuple(rows[i][0] for i in order)
        signed = all(each for _, _, each in rows)
        series.append(Series(owner, observable, effect, quantity, rows[0][1], signed, entries, t, clock))
    return series


def natural(name: str) -> list[tuple[int, str]]:
    """Return a key that sorts b-2 before b-10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name)]


Keyed = tuple[tuple[str, str, str, str], Entry, str, bool]


def _effects(record: Record) -> Iterator[Keyed]:
    """Yield the parameters of every effect that was tried, as far as they can be compared between batches."""
    for observable, outcome in (record.loop.get("observables") or {}).items():
        verdict = (record.verdict.get("observables") or {}).get(observable) or {}
        status = str(verdict.get("status"))
        claims = {str(effect["effect"]) for effect in verdict.get("effects") or []}
        for tried in outcome.get("candidates") or []:
            name = str(tried["effect"])
            facts = (record.loop.get("effects") or {}).get(name) or {}
            claimed = name in claims and status in CLAIMED
            if not facts.get("comparable", True) or not (claimed or _counts(tried, status)):
                continue
            length = math.sqrt(sum((e["less_neutral"] / e["sd"]) ** 2 for e in _known(tried)))
            where = "".join(f" ({k} {v})" for k, v in (tried.get("where") or {}).items())
            for one in _known(tried):
                if not claimed and not one["signed"]:
                    continue
                alone = sum(each["parameter"] == one["parameter"] for each in tried["estimates"]) == 1
                quantity = one["parameter"] + ("" if alone else f" {one['index'] + 1}") + where
                entry = Entry(
                    batch=record.name,
                    value=one["value"],
                    sd=one["sd"],
                    less_neutral=one["less_neutral"],
                    claimed=claimed,
                    sensitivity=float(tried["size"]) / length if length else math.nan,
                    budget=_budget(record, observable),
                )
                owner = record.owner(*(facts.get("belongs_to") or ()))
                yield (owner, observable, name, quantity), entry, one["unit"], one["signed"]


def _known(tried: JSON) -> list[JSON]:
    """Estimates that are no angle and lie within their bounds, with a deviation."""
    return [e for e in tried.get("estimates") or [] if e["sd"] and e["inside"] and not e["angle"]]


def _counts(tried: JSON, status: str) -> bool:
    """Return whether the estimate of an effect that was not claimed counts: no residual, no best of many."""
    return status in SETTLED and tried.get("verdict") == "rejected" and tried.get("chosen_among") == 1


def _quantities(record: Record) -> Iterator[Keyed]:
    """Yield the identified quantities that are of the machine, the tool or the metal, not of a run."""
    force = record.identified.get("force") or {}
    tables: list[tuple[str, str, Mapping[str, object]]] = [
        (
            record.owner("tool", "work"),
            _COEFFICIENT,
            force.get("waveform") or force.get("mean") or {},
        ),
        (record.owner(), "tip compliance ", record.identified.get("tip") or {}),
    ]
    stiffness = (record.identified.get("arm") or {}).get("joint_stiffness") or []
    if isinstance(stiffness, list):
        joints = {str(i): entry for i, entry in enumerate(stiffness, start=1)}
        tables.append((record.owner(), "stiffness of joint ", joints))
    places: dict[str, int] = {}
    for mode in record.identified.get("modes") or []:
        place = f"{mode.get('position')} {mode.get('direction')}"
        places[place] = places.get(place, 0) + 1
        name = f"mode {places[place]} at {place}: "
        tables.append((record.owner("tool"), name, {k: mode.get(k) for k in ("frequency", "damping")}))
    for owner, prefix, table in tables:
        for name, quantity in table.items():
            entry = _entry(record.name, quantity)
            if entry and isinstance(quantity, dict):
                budget = _budget(record, "force") if prefix == _COEFFICIENT else math.nan
                key = owner, "", "", prefix + name
                yield key, replace(entry, budget=budget), str(quantity.get("unit") or ""), False


def _budget(record: Record, observable: str) -> float:
    """Return the declared model-form budget of an observable; NaN where its loop states none."""
    outcome = (record.loop.get("observables") or {}).get(observable) or {}
    return float((outcome.get("noise") or {}).get("budget") or math.nan)


def _entry(batch: str, quantity: object) -> Entry | None:
    if not isinstance(quantity, dict) or not isinstance(quantity.get("value"), int | float):
        return None
    low, high = quantity.get("ci95") or (None, None)
    if low is None or high is None or not high > low:
        return None
    return Entry(batch, float(quantity["value"]), 0.5 * (high - low) / NORMAL)


def _clock(started: Sequence[float | None]) -> tuple[list[int], Array, str]:
    """Return the order of batches, their times from the first, and the unit of these."""
    known = [second for second in started if second is not None]
    if len(set(known)) < len(started):
        return list(range(len(started))), np.arange(1.0, len(started) + 1.0), "batches"
    order = sorted(range(len(known)), key=lambda i: known[i])
    seconds = np.array([known[i] - min(known) for i in order])
    days = seconds[-1] > 3.0 * DAY
    return order, seconds / (DAY if days else HOUR), "days" if days else "hours"


def _tool(tool: JSON) -> str:
    if not tool:
        return "tool that is not described"
    words = [f"{tool['diameter_mm']:g} mm"] if "diameter_mm" in tool else []
    words += [f"{tool['teeth']} teeth"] if "teeth" in tool else []
    words += [f"helix {tool['helix_deg']:g}°"] if "helix_deg" in tool else []
    pitch = tool.get("pitch_deg") or []
    words += ["unequal pitch"] if pitch and max(pitch) - min(pitch) > 0.5 else []
    words += [f"overhang {tool['overhang_mm']:g} mm"] if "overhang_mm" in tool else []
    return " ".join(["tool", *words])
