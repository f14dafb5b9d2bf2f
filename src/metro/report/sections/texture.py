"""Surface texture: parameters of the traced profiles with their intervals, and the traces."""

from __future__ import annotations

import re
from collections.abc import Sequence

import pandas as pd

from metro.report.content import Bullets, Facts, Item, Paragraph, Picture, Section, Table
from metro.report.figures import texture as figures
from metro.report.numbers import listing, number, with_interval
from metro.report.results import Results
from metro.units import printed

LONGEST = 24
FIRST = ("Ra", "Rz", "RSm", "Pa", "Pt", "PSm")  # on the first page, those that there are
MOST_FACTS = 3
NESTING = re.compile(r"λc = ([\d.]+) mm")
BANDS = {"W": "all waves longer than λc = {} mm", "R": "waves shorter than λc = {} mm"}
TITLES = {"P": "primary profile", "W": "waviness", "R": "roughness"}
FEW = 3  # runs that are columns; of more each is a row
# Of many runs the parameters that drawings and tolerances state come first, in a table of their own: with all
# ten in one, every interval takes three lines.
STATED = ("a", "q", "z", "t", "Sm")
SMALL = ("dq",)  # numbers of many digits


def texture(results: Results) -> Section | None:
    """Write the parameters of the traces; None for a batch without any."""
    table = results.tables.get("profile_parameters")
    items: list[Item] = []
    if table is not None:
        for letter, part in table.groupby("profile", sort=False):
            items += _parameters(part, str(letter))
        notes = table.drop_duplicates("run").groupby("notes", sort=False)["run"].agg(list)
        items.append(Bullets([f"{listing(runs)}: {said}" for said, runs in notes.items()]))
    items += _refused(results)
    drawn = results.tables.get("profile_traces")
    if drawn is not None:
        count = drawn["run"].nunique()
        most = f", the first {figures.MOST} of {count}" if count > figures.MOST else ""
        caption = f"Profiles{most}: P as recorded and levelled, W the part longer than λc."
        items.append(Picture(figures.traces(drawn), caption, caption))
    return Section("Surface texture", items) if items else None


def first_traces(results: Results) -> list[Item]:
    """Give the roughness of the first trace, or its primary profile where no roughness can be stated."""
    table = results.tables.get("profile_parameters")
    if table is None:
        return []
    run = table["run"].iloc[0]
    rows = table[table["run"] == run].set_index("parameter")
    shown = [name for name in FIRST if name in rows.index][:MOST_FACTS]
    facts = [
        (f"{name} of {run}", f"{_text(rows.loc[name])} {_unit(rows.loc[name])}", TITLES[name[0]])
        for name in shown
    ]
    return [Facts(facts)]


def _parameters(part: pd.DataFrame, letter: str) -> list[Item]:
    """Tabulate the parameters of one kind of profile, a row for each, a column for each of few runs."""
    runs = list(dict.fromkeys(part["run"]))
    names = list(dict.fromkeys(part["parameter"]))
    cells = {(row["run"], row["parameter"]): row for _, row in part.iterrows()}
    about = _about(part, letter)
    if len(runs) <= FEW:
        rows = [
            [name, _unit(cells[runs[0], name]), *(_text(cells[run, name]) for run in runs)] for name in names
        ]
        header = ["parameter", "unit", *runs]
        return [Table(header, rows, about, [0.8, 0.5, *([2] * len(runs))], small=True)]
    more = f" The first {LONGEST} of {len(runs)} runs." if len(runs) > LONGEST else ""
    stated = [name for name in names if name[1:] in STATED]
    others = [name for name in names if name not in stated]
    said = f"{_title(letter)}: further parameters, likewise.{more}"
    return [
        Table(
            ["run", *(_header(cells[runs[0], name], name) for name in group)],
            [[run, *(_text(cells[run, name]) for name in group)] for run in runs[:LONGEST]],
            caption,
            [0.5, *(1.3 if name[1:] in SMALL else 1 for name in group)],
            small=True,
        )
        for group, caption in ((stated, about + more), (others, said))
        if group
    ]


def _about(part: pd.DataFrame, letter: str) -> str:
    sources = [source for source in dict.fromkeys(part["source"]) if source]
    intervals = (
        f"95 % intervals by the {listing(sources)}"
        if sources
        else "without intervals: one trace, of which the noise (instruments.profiler.sigma_mm) is not stated"
    )
    return f"{_title(letter)}, {_band(part, letter)}parameters by ISO 21920-2; {intervals}."


def _title(letter: str) -> str:
    return f"{TITLES[letter][0].upper()}{TITLES[letter][1:]}"


def _band(part: pd.DataFrame, letter: str) -> str:
    """Say which waves are in a profile, where all traces are parted at one length; else empty."""
    known = {found[1] for notes in part["notes"] if (found := NESTING.search(str(notes)))}
    if letter not in BANDS or len(known) != 1:
        return ""
    return f"{BANDS[letter].format(known.pop())}, "


def _text(row: pd.Series) -> str:
    known = row["low"] == row["low"]
    return with_interval(row["value"], [row["low"], row["high"]]) if known else number(row["value"], 4)


def _unit(row: pd.Series) -> str:
    return printed(str(row["unit"])) if row["unit"] != "1" else ""


def _header(row: pd.Series, name: str) -> str:
    return f"{name} ({_unit(row)})" if _unit(row) else name


def _refused(results: Results) -> Sequence[Item]:
    reasons = (results.identified.get("texture") or {}).get("not_identified") or {}
    said = [f"{run}: {reason}." for run, reason in reasons.items()]
    return [Paragraph("No parameters of these traces:"), Bullets(said)] if said else []
