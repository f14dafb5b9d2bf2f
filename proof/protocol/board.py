"""The board: the newest rows of the log as a page, and the reliability of stated probabilities drawn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from metro.units import JSON
from proof.protocol import log
from proof.protocol.curve import drawn
from proof.tables import KINDS, number
from virtual_cell.blind import RECIPES

OURS = "metro"
HEAD = """# Board

<!-- Made from protocol-log.jsonl by `python -m proof board`: change nothing here. -->

The newest judgement of each observable by [the protocol](protocol.md), with the bad figures, and what three
plain programs (and those of others) reach on the same batches. A figure is followed by its 95 % interval and
the number of cases; bold: what is demanded is missed. Effects count from a size of 1 × the noise
([measures](proof.md#the-measures)).
"""
NONE = "\nNothing was judged yet: `make proof` does.\n"
# The figures that tell how the judgements went, in the table of all of them.
COURSE = {
    "none: one added": "nothing hidden: an effect is added",
    "one: named": "one effect: named, alone or first of declared rivals",
    "one: wrong, p > 0.9": "one effect: a wrong one named with p > 0.9",
    "two: both": "two effects: both named",
    "outside: admitted": "outside the library: a rest is admitted",
    "outside: wrong": "outside the library: wrong attribution",
}


def write(logged: Path, page: Path) -> None:
    """Write the page beside the log, and its figures in ``figures``."""
    found = log.newest(logged)
    for observable, programs in found.items():
        drawn(programs, page.parent / figure(observable))
    page.write_text(text(found, log.rows(logged)), encoding="utf-8")


def text(found: dict[str, dict[str, JSON]], every: Sequence[JSON]) -> str:
    """Return the page: ``found`` are the newest rows by observable and program, ``every`` is the log."""
    parts = [_section(name, found[name], every) for name in RECIPES if OURS in found.get(name, {})]
    return "\n".join([HEAD, *(parts or [NONE])])


def figure(observable: str) -> str:
    """Return the file of an observable's curve, relative to the page."""
    return f"figures/protocol-{observable}.svg"


def _section(observable: str, programs: dict[str, JSON], every: Sequence[JSON]) -> str:
    ours = programs[OURS]
    rows = [ours, *(row for name, row in programs.items() if name != OURS)]
    return "\n".join(
        [
            f"## {observable}\n",
            _suite(ours),
            _figures(rows, [one["label"] for one in ours["figures"] if "demand" in one]),
            "### Behind these\n",
            _figures(rows, [one["label"] for one in ours["figures"] if "demand" not in one]),
            "### Stated probabilities\n",
            _reliability(observable, rows),
            "### Parameters\n",
            _parameters(ours),
            "### Nothing hidden: are p-values uniform?\n",
            _null(rows),
            "### All judgements\n",
            _course([row for row in every if row["observable"] == observable and row["program"] == OURS]),
        ]
    )


def _suite(row: JSON) -> str:
    seen = ", ".join(
        f"{row['counts'][name]['batches']} {words}"
        + (f" ({row['counts'][name]['seen']} visible)" if name != "none" else "")
        for name, words in KINDS.items()
    )
    return (
        f"Commit `{row['commit'][:12]}`, {row['date']}: {row['batches']} batches of style "
        f"{row['style']}: {seen}, of {row['outside_kinds']} kinds. Sealed as `{row['seal']}`. "
        f"A batch that took more than {row['limit_s']:g} s of processor time has failed.\n{_failures(row)}"
    )


def _failures(row: JSON) -> str:
    """Say which batches failed, and why; rows before this was written down do not say."""
    lines = [
        f"\n- {batch} failed: {reason or 'the reason is not known'}."
        for batch, reason in row.get("failures", {}).items()
    ]
    return "".join([*lines, "\n"]) if lines else ""


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return "\n".join(f"| {' | '.join(line)} |" for line in [header, ["---"] * len(header), *rows]) + "\n"


def _figures(rows: Sequence[JSON], labels: Sequence[str]) -> str:
    by_label = [{one["label"]: one for one in row["figures"]} for row in rows]
    lines = [
        [label, _demand(by_label[0][label]), *(_cell(figures.get(label)) for figures in by_label)]
        for label in labels
    ]
    asked = any(line[1] for line in lines)
    header = ["figure", "demanded", *(_program(row, rows[0]) for row in rows)]
    return _table(*((header, lines) if asked else (_without(header), [_without(line) for line in lines])))


def _without(cells: Sequence[str]) -> list[str]:
    return [cells[0], *cells[2:]]


def _program(row: JSON, ours: JSON) -> str:
    """Name a program; say so where it answered about another suite."""
    name = f"**{row['program']}**" if row is ours else str(row["program"])
    return name if row["seal"] == ours["seal"] else f"{name} (suite of `{row['commit'][:12]}`)"


def _cell(one: JSON | None) -> str:
    if one is None or not one["count"] or one["value"] is None:
        return "–"
    low, high = one["ci95"]
    interval = "" if None in (low, high) or low == high else f"{_plain(low, one)}–{_plain(high, one)}; "
    failed = one.get("met") is False
    value = number(one["value"], one["unit"])
    return f"{'**' if failed else ''}{value}{'**' if failed else ''} ({interval}{one['count']})"


def _plain(value: float, one: JSON) -> str:
    return number(value, one["unit"]).removesuffix(" %").removesuffix(f" {one['unit']}")


def _demand(one: JSON) -> str:
    if "demand" not in one:
        return ""
    bounds = zip(("≥", "≤"), one["demand"], strict=True)
    return ", ".join(f"{sign} {number(bound, one['unit'])}" for sign, bound in bounds if bound is not None)


def _reliability(observable: str, rows: Sequence[JSON]) -> str:
    lines = [
        [
            f"{one['from']:g} to {one['to']:g}",
            str(one["count"]),
            f"{one['stated']:.3f}",
            f"{one['came_true']:.3f} ({one['ci95'][0]:.3f}–{one['ci95'][1]:.3f})",
        ]
        for one in rows[0]["tried"]["bins"]
    ]
    errors = [[_program(row, rows[0]), *(_error(row[which]) for which in ("named", "tried"))] for row in rows]
    return "\n".join(
        [
            _table(("stated", "effects", "mean stated", "came true"), lines),
            _table(("expected calibration error", "of effects named", "of all that were tried"), errors),
            f"![Reliability of stated probabilities]({figure(observable)})\n",
        ]
    )


def _error(calibration: JSON) -> str:
    value = calibration["calibration_error"]
    return "–" if value is None else f"{value:.3f} ({calibration['count']})"


def _parameters(row: JSON) -> str:
    over, lines = row["over_floor"], []
    for one in row["parameters"]:
        covered = "–"
        if one["covered"] is not None:
            low, high = one["ci95"]
            covered = f"{100 * one['covered']:.0f} % ({100 * low:.0f}–{100 * high:.0f}; {one['count']})"
        lines.append([f"{one['effect']}: {one['parameter']}", covered])
    table = (
        _table(("parameter", "95 % interval holds the truth"), lines) if lines else "No effect was named.\n"
    )
    if not over["count"]:
        return table
    low, high = over["quartiles"]
    spread = (
        f"Held-out error over the noise, where effects are visible: median {over['median']:.2f}, half of "
        f"{over['count']} from {low:.2f} to {high:.2f}, one in ten above {over['ninth_decile']:.2f}.\n"
    )
    return f"{table}\n{spread}"


def _null(rows: Sequence[JSON]) -> str:
    lines = [
        [
            _program(row, rows[0]),
            str(null["count"]),
            f"{null['distance']:.2f}" if null["count"] else "–",
            f"{null['p_value']:.2g}" if null["count"] else "–",
        ]
        for row in rows
        for null in [row["nothing_hidden"]]
    ]
    return _table(("program", "p-values", "distance (Kolmogorov-Smirnov)", "p of that distance"), lines)


def _course(every: Sequence[JSON]) -> str:
    lines = []
    for row in reversed(every):
        figures = {one["label"]: one for one in row["figures"]}
        cells = [_cell(figures.get(label)) for label in COURSE.values()]
        lines.append([f"`{row['commit'][:12]}`", row["date"], str(row["batches"]), *cells])
    return _table(("commit", "date", "batches", *COURSE), lines)
