"""The campaign's memory in words, tables and figures: changes from batch to batch, and recurring effects."""

from __future__ import annotations

from collections.abc import Sequence

from metro.observables.catalogue import title
from metro.report.content import Bullets, Heading, Item, Paragraph, Picture, Section, Table
from metro.report.figures import memory as figures
from metro.report.numbers import listing, number, percent, probability, quantity, with_interval, words
from metro.units import JSON, printed

PANELS, MOST_FIGURES = 6, 4
LONGEST = 40
COURSE = {
    "steady": "no change shown",
    "too few": "too few batches to ask",
    "trend": "trend",
    "step": "step",
    "levels off": "changes, then levels off",
    "accelerates": "changes faster and faster",
}


def memory_section(memory: JSON) -> list[Section]:
    """Return the section on the courses over the batches; none if no parameter has a history."""
    series, pooled = memory.get("series") or [], memory.get("pooled") or []
    items = [
        *_courses(series),
        *_pooled(pooled),
        *_recurring(memory.get("recurring") or []),
        *_undecided(memory.get("undecided") or []),
    ]
    return [Section("Over the batches", items)] if items else []


def _courses(series: Sequence[JSON]) -> list[Item]:
    if not series:
        return []
    ranked = sorted(series, key=_rank)
    changing = [row for row in ranked if row["course"] not in {"steady", "too few"}]
    sentences = [Bullets([_sentence(row) for row in changing])] if changing else []
    asked = sum(row["p_value"] is not None for row in series)
    intro = (
        f"{len(series)} parameters were followed over batches of the same cell, tool and work; of {asked} "
        f"there are enough batches to ask whether they change, and {len(changing) or 'none'} of these "
        f"{'does' if len(changing) == 1 else 'do'} (false discovery rate 5 %, against the order of batches "
        f"drawn anew). {_order(series)}"
    )
    rows = [
        [
            row["owner"],
            _name(row),
            printed(row["unit"]) or "1",
            str(len(row["batches"])),
            quantity(row["mean"], with_unit=False),
            COURSE[row["course"]],
            probability(row["q_value"]),
            with_interval(row["next"]["value"], row["next"]["ci95"]),
        ]
        for row in ranked[:LONGEST]
    ]
    header = ["of", "parameter", "unit", "batches", "mean", "course", "q", "next batch"]
    left = f" The {len(ranked) - LONGEST} least changing are in memory.json." if len(ranked) > LONGEST else ""
    caption = (
        "Parameters over the batches: mean with its 95 % interval (scatter between batches included), and "
        "what the next batch is to measure if it is as precise as these." + left
    )
    table = Table(header, rows, caption, [1.6, 1.6, 0.7, 0.75, 1.25, 1.2, 0.6, 1.25])
    return [Paragraph(intro), *sentences, *_pictures(changing or ranked[:PANELS]), table]


def _order(series: Sequence[JSON]) -> str:
    """Say how the batches were ordered."""
    timed = [row["clock"] != "batches" for row in series]
    if all(timed):
        return "The batches are in the order in which their first runs started."
    names = "in the order of their names, because started_at is not given for all of them"
    if not any(timed):
        return f"The batches are {names}."
    return (
        f"Batches are in the order in which their first runs started, those of {timed.count(False)} {names}."
    )


def _rank(row: JSON) -> tuple[float, str, str, str]:
    q = row["q_value"]
    return (2.0 if q is None else q, row["owner"], row["effect"], row["quantity"])


def _pictures(rows: Sequence[JSON]) -> list[Item]:
    items: list[Item] = []
    for first in range(0, min(len(rows), PANELS * MOST_FIGURES), PANELS):
        part = rows[first : first + PANELS]
        several = len({row["owner"] for row in rows}) > 1
        cells = [f"{row['owner'].split(',')[0]}: " if several else "" for row in part]
        names = [cell + _name(row) for cell, row in zip(cells, part, strict=True)]
        alt = "; ".join(
            f"{name}: {COURSE[row['course']]}, next {number(row['next']['value'])}"
            for name, row in zip(names, part, strict=True)
        )
        caption = (
            f"{alt[0].upper()}{alt[1:]}. Each batch's estimate with its own 95 % interval, the course "
            "through them, and what the next batch is to measure (95 %)."
        )
        items.append(Picture(figures.courses(part, names), caption, alt))
    return items


def _sentence(row: JSON) -> str:
    change = with_interval(row["change"]["value"], row["change"]["ci95"])
    shown = f" {printed(row['unit'])}" if printed(row["unit"]) else ""
    first, last = row["batches"][0], row["batches"][-1]
    what = {
        "trend": f"goes by {change}{shown} from {first} to {last}, steadily",
        "levels off": f"goes by {change}{shown} from {first} to {last}, and levels off",
        "accelerates": f"goes by {change}{shown} from {first} to {last}, faster and faster",
    }
    if row["course"] == "step":
        before, after = row["step_between"]
        said = f"jumps by {change}{shown} between {before} and {after}: what was changed there?"
    else:
        said = what[row["course"]]
    ahead = with_interval(row["next"]["value"], row["next"]["ci95"])
    others = [
        f"{COURSE.get(kind, kind)} {percent(weight)}"
        for kind, weight in row["weights"].items()
        if kind not in {row["course"], "constant"} and weight > 0.1
    ]
    doubt = f" (the course may also be: {listing(others)})" if others else ""
    return f"{row['owner']}: {_name(row)} {said}{doubt}. The next batch is to measure {ahead}{shown}."


def _name(row: JSON) -> str:
    """Name a parameter with its effect, and without the unit at the end of its key."""
    name, shown = str(row["quantity"]), str(row["unit"] or "").replace(" ", "_").lower()
    for per in ("_per_", "_"):
        name = name.replace("_" + shown.replace("/", per), "", 1) if shown else name
    return f"{words(row['effect'])}, {words(name)}" if row["effect"] else words(name)


def _pooled(pooled: Sequence[JSON]) -> list[Item]:
    if not pooled:
        return []
    shown = [row for row in pooled if row["shown"]]
    sentences = [_pooled_sentence(row) for row in shown]
    below = [row for row in pooled if row["below_budget"]]
    if below:
        named = listing(sorted({f"{_name(row)} ({row['owner']})" for row in below}))
        sentences.append(
            "Consistent over the batches, but within the stated model accuracy and therefore not "
            f"attributed: {named}."
        )
    if not sentences:
        sentences = ["All batches together show no effect that none shows alone."]
    rows = [
        [
            row["owner"],
            _name(row),
            quantity(row["estimate"]),
            f"{row['same_sign']} of {len(row['batches'])}",
            percent(row["size"]),
            probability(row["q_value"]),
        ]
        for row in pooled[:LONGEST]
    ]
    header = ["of", "parameter", "all batches together", "same sign", "of the signal", "q"]
    caption = (
        "Effects that no batch claims, their estimates of all batches taken together (weighted, with scatter "
        "between batches). A batch's own verdict is not changed by it."
    )
    strong = [i for i, row in enumerate(pooled[:LONGEST]) if row["shown"]]
    return [
        Heading("What only all batches show"),
        Bullets(sentences),
        Table(header, rows, caption, [1.6, 1.6, 1.6, 0.8, 0.8, 0.6], strong=strong),
    ]


def _pooled_sentence(row: JSON) -> str:
    n = len(row["batches"])
    return (
        f"{row['owner']}: {_name(row)} is {quantity(row['estimate'])} by {n} batches together "
        f"({row['same_sign']} have that sign; the clearest alone is {number(row['best_alone'], 2)} standard "
        f"deviations off; q = {probability(row['q_value'])}), though none claims it: about "
        f"{percent(row['size'])} of the signal."
    )


def _recurring(recurring: Sequence[JSON]) -> list[Item]:
    if not recurring:
        return []
    rows = [
        [
            row["cell"],
            title(row["observable"]),
            words(row["effect"]),
            f"{len(row['found'])} of {len(row['tried'])}",
            " … ".join(percent(end) for end in row["share"]["ci95"]),
            ", ".join(row["found"]) if len(row["found"]) < len(row["tried"]) else "all",
        ]
        for row in recurring
    ]
    header = ["cell", "observable", "effect", "claimed", "share, 95 %", "in"]
    caption = (
        "Effects that were claimed, and in how many of the batches of the cell that could have claimed them."
    )
    return [Heading("What comes back"), Table(rows=rows, header=header, caption=caption)]


def _undecided(undecided: Sequence[JSON]) -> list[Item]:
    sentences = []
    for row in undecided:
        known = [f"{words(name)} in {k} of {n}" for name, (k, n) in row["elsewhere"].items()]
        sentences.append(
            f"{row['batch']}, {title(row['observable'])}: of the causes that it cannot distinguish, other "
            f"batches of the cell identified {listing(known)} batches. Its own verdict is unchanged."
        )
    return [Bullets(sentences)] if sentences else []
