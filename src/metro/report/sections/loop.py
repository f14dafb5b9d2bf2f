"""The closed loop: noise, candidates with their outcome, added effects, residual, undetectable effects."""

from __future__ import annotations

from collections.abc import Callable

from metro.report.content import Bullets, Heading, Item, Paragraph, Picture, Section, Table, abreast
from metro.report.figures import verdicts as figures
from metro.report.numbers import listing, number, percent, probability, words
from metro.report.parameters import parameter_name, parameter_value
from metro.report.phrases import plain
from metro.report.results import Results, heading
from metro.report.sections import findings
from metro.report.sections.verdict import STATUS, error_text, left_words, next_words, verdict_words
from metro.units import JSON, printed

LONGEST = 16


def loop(results: Results) -> Section:
    """Write the loop of each observable that has a verdict."""
    items: list[Item] = []
    pictures: list[Picture] = []
    for observable, entry in results.verdicts().items():
        name, record = heading(observable), results.loop_record(observable)
        items.append(Heading(f"{name}: {STATUS.get(str(entry.get('status')), '–')}"))
        items += _observable(observable, entry, record, left_words(results, observable))
        pictures += [*_runs(name, record, entry.get("unit")), *_signature(name, record)]
    if not items:
        nothing = "No residual was traced, because no held-out run has both a measurement and a prediction."
        return Section("The closed loop", [Paragraph(nothing)])
    drawn = [Heading("Residuals by run and by pattern"), *abreast(pictures)] if pictures else []
    return Section("The closed loop", [*items, *drawn])


def _observable(observable: str, entry: JSON, record: JSON, left: str) -> list[Item]:
    shown = entry.get("unit") or record.get("unit")
    noise = record.get("noise") or {}
    story = str(record.get("words") or "")
    items: list[Item] = [Paragraph(story or verdict_words(observable, entry, left))]
    if noise:
        items.append(Paragraph(_noise_words(noise, shown)))
    if record.get("strained"):
        items.append(Paragraph(str(record["strained"])))
    if "held_out" in entry:
        items.append(Paragraph("Effects with their values, and what was tried: “The arm by measured poses”."))
    else:
        items += _added(entry)
        items += _candidates(record.get("candidates") or entry.get("candidates") or [], shown)
    items += _path(record.get("path") or [], entry, shown)
    return [*items, *_residual_items(entry, record, left)]


def _runs(name: str, record: JSON, shown: str | None) -> list[Picture]:
    drawn = ("identify", "validate")  # load tests are evidence too, but no runs
    blocks = [
        b for b in record.get("blocks") or [] if b.get("role") in drawn and b.get("rms_before") is not None
    ]
    if not blocks:
        return []
    alt = f"rms residual of {len(blocks)} runs before and after, in the order of cutting."
    named, floor = shown or record.get("unit") or "", (record.get("noise") or {}).get("floor")
    caption = f"{name}. {findings.above_floor(blocks, floor, named)} Residual of every run."
    return [Picture(figures.runs(blocks, named, floor), caption, alt)]


def _signature(name: str, record: JSON) -> list[Picture]:
    """Draw the residual by pattern, if there are several, and say how many places are significant."""
    entries = record.get("signature") or []
    if len({e["label"] for e in entries}) < 2 or not any(e.get("relative") for e in entries):
        return []
    full = [f"{e.get('axis') or ''} {e['label']}".strip() for e in entries if e.get("significant")]
    significant_places = (
        f"{len(full)} of {len(entries)} parts exceed the noise by more than chance"
        if full
        else f"None of {len(entries)} parts exceeds the noise by more than chance"
    )
    bars = " (full bars)" if full else ""
    caption = f"{name}: residual by pattern and axis. {significant_places}{bars}."
    alt = "Significant: " + (", ".join(full[:6]) if full else "nothing") + "."
    return [Picture(figures.signature(entries), caption, alt)]


def _noise_words(noise: JSON, shown: str | None) -> str:
    floor = f"{number(noise.get('floor'))} {printed(shown)}".strip()
    return f"Noise floor {floor}. {noise.get('words') or ''}".strip()


def _added(entry: JSON) -> list[Item]:
    rows = [
        [
            words(str(effect["effect"])) if i == 0 else "",
            parameter_name(name, value),
            parameter_value(effect, value),
            probability(effect.get("probability")) if i == 0 else "",
        ]
        for effect in entry.get("effects") or []
        for i, (name, value) in enumerate((effect.get("parameters") or {"": {"value": None}}).items())
    ]
    if not rows:
        return []
    header = ["effect added", "parameter", "value", "probability"]
    return [
        Table(header, rows, "Effects added to the model, with 95 % intervals.", [1.5, 1.5, 2, 1], numeric=[3])
    ]


def _candidates(candidates: list[JSON], shown: str | None) -> list[Item]:
    if not candidates:
        return []
    keys = {key for c in candidates for key in c}
    optional: list[tuple[str, str, Callable[[JSON], str]]] = [
        ("p_value", "p", lambda c: probability(c.get("p_value"))),
        ("q_value", "q", lambda c: probability(c.get("q_value"))),
        ("held_out_gain", "held-out gain", lambda c: number(c.get("held_out_gain"), 2)),
        ("held_out_rms", f"held-out rms ({printed(shown)})", lambda c: number(c.get("held_out_rms"))),
        ("size", "size", lambda c: percent(c.get("size"))),
        ("weight", "weight", lambda c: number(c.get("weight"), 2)),
        ("probability", "probability", lambda c: probability(c.get("probability"))),
    ]
    columns = [(name, write) for key, name, write in optional if key in keys]
    rows = [
        [words(str(c["effect"])), *(write(c) for _, write in columns), _why(c)] for c in candidates[:LONGEST]
    ]
    strong = [i for i, c in enumerate(candidates[:LONGEST]) if c.get("verdict") == "added"]
    header = ["effect tried", *(name for name, _ in columns), "outcome"]
    caption = (
        "Effects that were tried, each fitted together with the base model. Gain: log-likelihood on left-out "
        "conditions; size: share of the signal."
    )
    numeric = list(range(1, len(columns) + 1))
    widths = [1.6, *([0.8] * len(columns)), 3.6]
    return [Table(header, rows, caption, widths, numeric=numeric, strong=strong, small=True)]


def _why(candidate: JSON) -> str:
    """Return the outcome of a candidate, without the p-value that has a column of its own."""
    verdict, why = candidate.get("verdict"), candidate.get("why_not")
    if candidate.get("p_value") is not None:
        why = str(why or "").partition(": p = ")[0]
    return ": ".join(str(x) for x in (verdict, why) if x) or "–"


def _path(path: list[JSON], entry: JSON, shown: str | None) -> list[Item]:
    """Table of the model's growth: the base model, then each added effect, with the errors of each step."""
    if len(path) < 2:
        return []
    tested = "poses left out" if "held_out" in entry else "held-out runs"
    rms = [("before_rms", "rms, identification runs"), ("held_out_rms", f"rms, {tested}")]
    known = [(key, f"{name} ({printed(shown)})") for key, name in rms if any(step.get(key) for step in path)]
    rows = [
        [
            " + ".join(["base model", *(words(str(e)) for e in step.get("added") or [])]),
            *(number(step.get(key)) for key, _ in known),
            percent(step.get("nrmse")),
        ]
        for step in path
    ]
    header = ["model", *(name for _, name in known), "of the signal"]
    caption = f"Error after each added effect. Final held-out error: {error_text(entry.get('after'), shown)}."
    numeric = list(range(1, len(header)))
    return [Table(header, rows, caption, [2.4, *([1.4] * len(known)), 1], numeric=numeric)]


def _residual_items(entry: JSON, record: JSON, left: str) -> list[Item]:
    items: list[Item] = []
    unexplained = entry.get("unexplained") or {}
    if unexplained.get("signature"):
        items.append(Paragraph(f"Unexplained: {left or plain(unexplained['signature'])}.", "warning"))
    if unexplained.get("ceiling"):
        items.append(Paragraph(str(unexplained["ceiling"]["words"])))
    groups = [" and ".join(words(str(n)) for n in group) for group in entry.get("indistinguishable") or []]
    if groups:
        items.append(Paragraph("These runs do not distinguish: " + "; ".join(groups) + "."))
    hidden: dict[str, list[str]] = {}
    for one in record.get("cannot_be_seen") or []:
        hidden.setdefault(str(one.get("why") or ""), []).append(words(str(one["effect"])))
    if hidden:
        alike = [plain(f"{listing(names)}: {why}".rstrip(": ")) for why, names in hidden.items()]
        items += [
            Paragraph("These effects cannot be detected in this batch, or only from a size on:"),
            Bullets(alike),
        ]
    if next_run := next_words(entry):
        items.append(Paragraph(f"What to do next: {next_run}."))
    return items
