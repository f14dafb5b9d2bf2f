"""All that a report is written from: a batch's description, tables, and what the stages found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import pandas as pd

from metro.batch.batch import Batch
from metro.observables.catalogue import names, title
from metro.units import JSON


@dataclass(frozen=True)
class Results:
    """What the stages before wrote about one batch.

    Attributes
    ----------
    batch : its description.
    tables : processed tables by name; a table that is absent or has no rows is not there.
    identified, verdict, loop : content of the JSON files of the same names.
    sources : SHA-256 by source file.
    stages : of each stage its ``settings``, and ``code``, the hash of its code.
    packages : version by package that the results were made with.
    """

    batch: Batch
    tables: Mapping[str, pd.DataFrame]
    identified: JSON
    verdict: JSON
    loop: JSON
    sources: Mapping[str, str] = field(default_factory=dict)
    stages: Mapping[str, JSON] = field(default_factory=dict)
    packages: Mapping[str, str] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """The batch's title, or its name."""
        return str(self.batch.manifest.get("title") or self.batch.name)

    def verdicts(self) -> dict[str, JSON]:
        """Verdict by observable, in the contract's order; of one held-out condition without intervals."""
        shown_verdict = without_lone_intervals(with_facts(self.verdict, self.loop), self.batch.runs)
        entries = shown_verdict.get("observables") or {}
        return {
            name: entries[name]
            for name in [*names(), *sorted(set(entries) - set(names()))]
            if name in entries
        }

    def loop_record(self, observable: str) -> JSON:
        """Return what the loop recorded of an observable; empty where it recorded nothing."""
        entry: JSON = (self.loop.get("observables") or {}).get(observable) or {}
        return entry

    def compared(self, observable: str) -> pd.DataFrame | None:
        """Rows of the comparison table of an observable that have a measured and a predicted value."""
        table = self.tables.get("comparison")
        if table is None:
            return None
        rows = table[
            (table["observable"] == observable) & table["measured"].notna() & table["before"].notna()
        ]
        return None if rows.empty else rows.fillna({"after": rows["before"]}).reset_index(drop=True)


def without_lone_intervals(verdict: JSON, runs: pd.DataFrame) -> JSON:
    """Return the content of verdict.json without intervals over held-out runs that are of one condition.

    Parts of runs that were held out have intervals of their own.
    """
    known = runs["condition"].to_dict() if "condition" in runs else {}

    def shown(entry: JSON) -> JSON:
        held = {known.get(run, run) for run in entry.get("held_out_runs") or []}
        if "held_out" in entry or len(held) > 1:
            return entry
        errors = {when: {**error, "ci95": None} for when in ("before", "after") if (error := entry.get(when))}
        return {**entry, **errors}

    entries = {name: shown(entry) for name, entry in (verdict.get("observables") or {}).items()}
    return {**verdict, "observables": entries}


def with_facts(verdict: JSON, loop: JSON) -> JSON:
    """Return the content of verdict.json, each effect with what ``effects`` of loop.json says of it."""
    facts = loop.get("effects") or {}
    entries = {
        name: {**entry, "effects": [with_own(effect, "effect", facts) for effect in entry["effects"]]}
        for name, entry in (verdict.get("observables") or {}).items()
        if entry.get("effects")
    }
    return {**verdict, "observables": {**(verdict.get("observables") or {}), **entries}}


def with_own(entry: JSON, key: str, facts: JSON) -> JSON:
    """Return an entry with the facts about the effect that ``key`` of it names.

    Meaning and remedy are those of the form whose parameters the entry has.
    """
    own = facts.get(str(entry[key])) or {}
    form: JSON = {}
    for one, several in (("meaning", "meanings"), ("remedy", "remedies")):
        known = own.get(several) or {}
        of_form = [known[name] for name in entry.get("parameters") or {} if name in known]
        form[one] = of_form[0] if of_form else own.get(one, "")
    return {**own, **form, **entry}


def heading(observable: str) -> str:
    """Name of an observable as it starts a line."""
    name = title(observable)
    return name[0].upper() + name[1:]
