"""The settings that make a face flat: factors and interactions, ranking, advice before anything is cut."""

from __future__ import annotations

import math
from collections.abc import Sequence

from metro.report.content import Bullets, Heading, Item, Paragraph, Picture, Section, Table
from metro.report.figures import study as figures
from metro.report.numbers import listing, number, percent, probability, quantity, with_interval
from metro.report.results import Results
from metro.report.sections.surface import ISO, RAW
from metro.units import JSON

INDICES = RAW | ISO
LEVEL = 0.05
LONGEST = 30


def study(results: Results) -> Section | None:
    """Write the factorial study, the ranking and the advice of ``identified.json``; None without."""
    entry = results.identified.get("study") or {}
    items = [*_factors(entry), *_ranking(entry), *_bias(entry), *_advice(entry)]
    return Section("Settings and flatness", items) if items else None


def _factors(entry: JSON) -> list[Item]:
    if not entry.get("terms"):
        return []
    items: list[Item] = [
        Heading("Factors"),
        Paragraph(_words(entry)),
        _terms(entry, "Effects on X_m as factors and in µm of the mean face, with 95 % intervals."),
    ]
    bullets = [*_aliases(entry), *_pooled(entry)]
    items += [Bullets(bullets)] if bullets else []
    rows = entry.get("ranking") or []
    if rows and len(rows[0].get("levels") or {}) > 1:
        caption = (
            f"{_strongest(entry)}Configurations (small) and their geometric means over the other factors "
            "(joined). On this logarithmic axis lines that are not parallel are an interaction."
        )
        items.append(Picture(figures.interactions(rows), caption, caption))
    return items


def _strongest(entry: JSON) -> str:
    """Name the factor with the largest influence on the faces, if any exceeds the scatter."""
    levels = [
        (term["term"], level)
        for term in entry["terms"]
        if (term.get("p_value") or 1.0) < LEVEL
        for level in term.get("levels") or []
    ]
    if not levels:
        return "No factor exceeds the scatter. "
    term, level = max(levels, key=lambda item: abs(math.log(item[1]["factor"]["value"])))
    return (
        f"The largest influence has {term}: {listing(level['level'])} over {level['over']} multiplies X_m by "
        f"{quantity(level['factor'])}. "
    )


def _words(entry: JSON) -> str:
    """Describe the study and its method."""
    source = "X_m as printed" if entry.get("printed") else "X_m less what noise adds to it"
    mean, plates = quantity(entry["mean"]), entry.get("scatter_between_plates")
    between = f"; plates differ by {percent(plates)}, taken as random" if plates is not None else ""
    return (
        f"{source}, of {entry['runs']} runs, on a log scale: the geometric mean over the design is {mean}, "
        f"one run scatters by {percent(entry['scatter'])} about its configuration ({entry['dof']} degrees of "
        f"freedom){between}. X_m is the one index that is judged as it is; the others are tested beside it, "
        "their p-values adjusted for all of these tests (Holm)."
    )


def _terms(entry: JSON, caption: str) -> Table:
    rows: list[list[str]] = []
    strong: list[int] = []
    for term in entry["terms"]:
        others = [
            INDICES.get(name, name)
            for name, p in (term.get("p_holm") or {}).items()
            if p is not None and p < LEVEL
        ]
        significant = (term.get("p_value") or 1.0) < LEVEL
        for place, level in enumerate(_shown(term)):
            if significant:
                strong.append(len(rows))
            first = [term["term"], probability(term.get("p_value")), listing(others) or "–"]
            name, p, significant_others = first if place == 0 else ["", "", ""]
            rows.append([name, _level(level), _factor(level), _difference(level), p, significant_others])
    header = ["term", "level", "factor", "difference", "p", "other indices with p < 0.05"]
    bold = " In bold: p < 0.05." if strong else ""
    return Table(header, rows, caption + bold, [1.6, 1.5, 1.3, 1.3, 0.7, 1.5], strong=strong)


def _shown(term: JSON) -> Sequence[JSON]:
    """Sufficient levels of a term: only the last one of an interaction of factors with two levels each."""
    levels: Sequence[JSON] = term["levels"]
    main = levels[0]["over"] != "mean"
    return levels if main or term["dof"][0] > 1 else levels[-1:]


def _level(level: JSON) -> str:
    name = ", ".join(level["level"])
    return f"{name} over {level['over']}" if level["over"] != "mean" else f"{name} beyond both alone"


def _factor(level: JSON) -> str:
    return f"× {with_interval(level['factor']['value'], level['factor']['ci95'])}"


def _difference(level: JSON) -> str:
    return quantity(level["difference"])


def _aliases(entry: JSON) -> list[str]:
    same = [
        f"{listing([factor['name'], *factor['same_as']])} vary together: their effects cannot be separated."
        for factor in entry.get("factors") or []
        if factor.get("same_as")
    ]
    mixed = [
        f"{alias['term']} cannot be separated from {listing(list(alias['from'])) or 'the mean'}"
        f"{' in part' if alias.get('in_part') else ''}: these runs lack the combinations that would."
        for alias in entry.get("not_separable") or []
    ]
    return [*same, *mixed]


def _pooled(entry: JSON) -> list[str]:
    pooled = entry.get("counted_as_scatter") or []
    return [f"For want of repeats these count as scatter: {listing(list(pooled))}."] if pooled else []


def _ranking(entry: JSON) -> list[Item]:
    rows = entry.get("ranking") or []
    if not rows:
        return []
    after = {row["configuration"]: row for row in (entry.get("after_loop") or {}).get("ranking") or []}
    body = []
    for row in rows[:LONGEST]:
        later = after.get(row["configuration"], {}).get("xm_predicted")
        cells = [quantity(row["xm"], with_unit=False), probability(row.get("probability_best"))]
        cells += [number(row.get("xm_predicted")), *([number(later)] if after else [])]
        body.append([row["configuration"], *cells])
    header = ["configuration", "X_m (µm)", "best with probability", "predicted (µm)"]
    header += ["with effects"] if after else []
    caption = (
        "Configurations from the flattest on, measured once each, so that nothing says how surely."
        if entry.get("printed")
        else "Configurations from the flattest on: X_m with its 95 % interval, scatter pooled over all; the "
        "probability that each is the best of these; X_m as the model predicts it at the points of the path."
    )
    items: list[Item] = [
        Heading("Ranking"),
        Table(
            header, body, caption, [2.6, 1.2, 1, 1, *([1] if after else [])], numeric=[*range(2, len(header))]
        ),
        Picture(
            figures.ranking(rows, list(after.values()), _model(entry)),
            _ranking_caption(entry),
            _ranking_caption(entry),
        ),
    ]
    sentences = [_agreement(name, block) for name, block in _agreements(entry)]
    return [*items, *([Bullets(sentences)] if sentences else [])]


def _model(entry: JSON) -> str:
    return "as printed" if entry.get("printed") else "base model"


def _ranking_caption(entry: JSON) -> str:
    beside = "" if entry.get("printed") else ", with 95 % intervals and the probability of being the best"
    agreed = (entry.get("after_loop") or {}).get("agreement") or entry.get("agreement") or {}
    rank = agreed.get("spearman")
    alike = f" Measured and predicted rank correlate with {quantity(rank)}." if rank else ""
    first = (entry.get("ranking") or [{}])[0].get("configuration")
    best = f"The flattest is {first}.{alike} " if first else ""
    return f"{best}Ranking of the configurations{beside}; beside it the predicted rank over the measured one."


def _agreements(entry: JSON) -> list[tuple[str, JSON]]:
    after = (entry.get("after_loop") or {}).get("agreement")
    both = [
        (f"Prediction, {_model(entry)}", entry.get("agreement")),
        ("Prediction with the effects found", after),
    ]
    return [(name, block) for name, block in both if block]


def _agreement(name: str, block: JSON) -> str:
    sure = block.get("sure_pairs")
    among = (
        f"; of the {sure} whose measured order is sure, {percent(block['sure_alike'])}"
        if sure and block.get("sure_alike") is not None
        else ""
    )
    chance = f"an order drawn at random does as well with probability {probability(block['p_value'])}"
    return (
        f"{name}: rank correlation {_correlation(block['spearman'])} ({chance}); "
        f"{percent(block['alike'])} of {block['pairs']} pairs are ranked as measured{among}."
    )


def _correlation(entry: JSON) -> str:
    low, high = entry["ci95"]
    return number(entry["value"], 2) + (f" ({number(low, 2)} … {number(high, 2)})" if low is not None else "")


def _bias(entry: JSON) -> list[Item]:
    bias = entry.get("bias")
    if not bias:
        return []
    mean = bias["mean"]
    moving = [term["term"] for term in bias["terms"] if (term.get("p_value") or 1.0) < LEVEL]
    carries = (
        f"It depends on {listing(moving)}."
        if moving
        else "No factor moves it significantly: these cases do not determine which one carries the bias."
    )
    text = (
        f"Measured X_m is {with_interval(mean['value'], mean['ci95'])} times the simulated one over all "
        f"cases. {carries} One case scatters by {percent(bias['scatter'])} about this."
    )
    return [
        Heading("Measured over simulated"),
        Paragraph(text),
        _terms(bias, "Effects on the ratio of measured to simulated X_m, with 95 % intervals."),
        Bullets([str(line) for line in entry.get("cannot_tell") or []]),
    ]


def _advice(entry: JSON) -> list[Item]:
    advised = (entry.get("after_loop") or {}).get("advice") or entry.get("advice")
    if not advised:
        return []
    rows = advised["configurations"]
    body = [
        [
            row["configuration"],
            ", ".join(row["runs"]),
            quantity(row["xm_predicted"], with_unit=False),
            probability(row["probability_best"]),
        ]
        for row in rows[:LONGEST]
    ]
    best = rows[0]
    items: list[Item] = [
        Heading("Before cutting"),
        Paragraph(advised["statement"], "warning"),
        Paragraph(
            f"Predicted to be the flattest: {best['configuration']}, X_m {quantity(best['xm_predicted'])}, "
            f"the best of {len(rows)} with probability {probability(best['probability_best'])}."
        ),
        Table(
            ["configuration", "runs", "X_m predicted (µm)", "best with probability"],
            body,
            "Planned configurations from the flattest on, as predicted, with 95 % intervals.",
            [2.4, 1.4, 1.4, 1],
            numeric=[3],
        ),
    ]
    if len(rows) > 1:
        caption = "Predicted X_m of the planned configurations with 95 % intervals; nothing was measured."
        items.append(Picture(figures.advice(rows), caption, caption))
    left = advised.get("left_out") or []
    return [*items, *([Bullets([f"Not predicted, {line}." for line in left])] if left else [])]
