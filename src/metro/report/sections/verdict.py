"""The verdict in words that an engineer understands, and the first page."""

from __future__ import annotations

from metro.report.content import Facts, Item, Paragraph, Picture, Section, Table
from metro.report.figures import verdicts as figures
from metro.report.figures.comparison import coordinate, overlay
from metro.report.figures.verdicts import Change
from metro.report.numbers import listing, number, percent, probability, quantity, with_interval, words
from metro.report.parameters import effect_words
from metro.report.phrases import plain, rest_words
from metro.report.results import Results, heading, title
from metro.report.sections import findings
from metro.report.sections.measured import count_of, measured_words
from metro.units import JSON, printed

MOST_DRAWN = 2  # verdicts beside which a first page has room for a run
STATUS = {
    "clean": "clean",
    "explained": "explained",
    "partly_explained": "partly explained",
    "undetermined": "undetermined",
    "unexplained": "unexplained",
    "insufficient": "insufficient data",
}


def sentence(observable: str, entry: JSON, left: str = "") -> str:
    """Say the verdict on an observable in a few sentences, with its numbers and what is ``left``."""
    start, status = heading(observable), str(entry.get("status"))
    floor = entry.get("noise_floor")
    noise = f" (noise floor {number(floor)}{_unit(entry)})" if floor is not None else ""
    found = listing([effect_words(effect) for effect in entry.get("effects") or []])
    says = {
        "clean": f"{start}: the base model holds. What it leaves on held-out runs is within the "
        f"noise{noise} or the declared accuracy of the model; nothing was added.",
        "explained": f"{start}: the difference from the base model is traced to {found}. {_fall(entry)} "
        f"What is left is within the noise{noise}.",
        "partly_explained": f"{start}: part of the difference is traced to {found}. {_fall(entry)} "
        f"A significant rest remains{noise}. {_rest(entry, left)}",
        "undetermined": f"{start}: something is missing from the base model; these data cannot tell what. "
        f"{_rivals(entry)}{_fall(entry)}",
        "unexplained": f"{start}: the base model leaves a significant error{noise}, and no effect of the "
        f"library accounts for it. {_rest(entry, left)}",
        "insufficient": f"{start}: too few runs to tell. {_fall(entry)}",
    }
    return says.get(status, f"{start}: {words(status)}.").strip()


def error_text(error: JSON | None, unit_name: str | None) -> str:
    """Write an error of the verdict: rms with its interval, where it has one, and unit."""
    if not error or error.get("rms") is None:
        return "–"
    text = with_interval(error["rms"], known_interval(error))
    shown = printed(unit_name)
    return f"{text} {shown}" if shown else text


def known_interval(error: JSON) -> list[float | None] | None:
    """Return the interval of an error; None where one condition, which has no scatter, makes it a point."""
    low, high = error.get("ci95") or (None, None)
    return [low, high] if low is not None and high is not None and high > low else None


def change(label: str, entry: JSON) -> Change | None:
    """Errors relative to the signal (%), before and after, for the figures; None where they are not known."""
    before, after = entry.get("before") or {}, entry.get("after") or {}
    if before.get("nrmse") is None or after.get("nrmse") is None or _dimensionless(entry):
        return None
    scale = 100 * before["nrmse"] / before["rms"] if before.get("rms") else None
    floor = entry.get("noise_floor")
    return Change(
        label,
        100 * before["nrmse"],
        100 * after["nrmse"],
        _scaled(before),
        _scaled(after),
        floor * scale if floor is not None and scale is not None else None,
    )


def _scaled(error: JSON) -> tuple[float, float] | None:
    ci95, rms = known_interval(error), error.get("rms")
    if not ci95 or not rms:
        return None
    scale = 100 * error["nrmse"] / rms
    return scale * ci95[0], scale * ci95[1]


def _dimensionless(entry: JSON) -> bool:
    """Tell whether the value is a probability, whose error has no signal to be relative to."""
    return entry.get("unit") == "1"


def _share(error: JSON) -> str:
    """Write an error as a share of the signal, and why it has no interval where it has none."""
    point = error.get("rms") is not None and known_interval(error) is None
    return f"{percent(error.get('nrmse'))} of the signal{'; one condition: no interval' if point else ''}"


def _unit(entry: JSON) -> str:
    shown = printed(entry.get("unit"))
    return f" {shown}" if shown else ""


def _fall(entry: JSON) -> str:
    before, after = entry.get("before") or {}, entry.get("after") or {}
    if before.get("rms") is None or after.get("rms") is None:
        return ""
    runs = entry.get("held_out_runs") or []
    where = (
        f"On held-out {'run' if len(runs) == 1 else 'runs'} {listing([str(r) for r in runs])}"
        if 0 < len(runs) <= 6
        else (f"On {len(runs)} held-out runs" if runs else "On held-out runs")
    )
    old, new = error_text(before, entry.get("unit")), error_text(after, entry.get("unit"))
    share_before, share_after = percent(before.get("nrmse")), percent(after.get("nrmse"))
    if before["rms"] == after["rms"]:
        share = "" if _dimensionless(entry) else f" ({share_before} of the signal)"
        return f"{where} the error is {old}{share}."
    share = "" if _dimensionless(entry) else f" ({share_before} → {share_after} of the signal)"
    return f"{where} the error goes from {old} to {new}{share}."


def _rest(entry: JSON, left: str) -> str:
    rest = entry.get("unexplained") or {}
    if not rest.get("signature"):
        return ""
    size = f" ({number(rest['rms'])}{_unit(entry)} rms)" if rest.get("rms") is not None else ""
    return f"What is left{size}: {left or plain(str(rest['signature']))}."


def left_words(results: Results, observable: str) -> str:
    """Say what an observable's loop left over, as an engineer would; empty where that is not known."""
    teeth = int((results.batch.manifest.get("tool") or {}).get("teeth") or 0)
    return rest_words(results.told(observable).get("signature") or [], teeth)


def _rivals(entry: JSON) -> str:
    groups = [
        " or ".join(words(str(name)) for name in group) for group in entry.get("indistinguishable") or []
    ]
    return f"It may be {'; or '.join(groups)}. " if groups else ""


def summary(results: Results) -> Section:
    """Write the first page: what was measured, the verdicts, the key numbers."""
    items: list[Item] = [Paragraph(measured_words(results))]
    verdicts = results.verdicts()
    items += [
        Paragraph(sentence(name, entry, left_words(results, name)), "verdict")
        for name, entry in verdicts.items()
    ]
    nexts = [
        f"{title(n)}: {plain(e['next_experiment'])}" for n, e in verdicts.items() if e.get("next_experiment")
    ]
    if nexts:
        items.append(Paragraph("Measure next: " + "; ".join(nexts).rstrip(".") + "."))
    if not verdicts:
        nothing = "No held-out measurement could be compared with a prediction in this batch: no verdict."
        items.append(Paragraph(f"{nothing} {_identified_words(results.identified)}".strip(), "verdict"))
    items += advice(results.identified)
    items += print_check(results) + _key_numbers(verdicts)
    told = [c for c in (change(title(name), entry) for name, entry in verdicts.items()) if c is not None]
    if told:
        items.append(
            Picture(
                figures.changes(told, "error on held-out runs (% of the signal)"),
                f"{findings.changed(told)} Errors with 95 % intervals, and the noise floor.",
                "; ".join(f"{c.label}: {c.before:.2g} % before, {c.after:.2g} % after" for c in told),
            )
        )
    return Section("Summary", [*items, *(_one_run(results) if len(verdicts) <= MOST_DRAWN else [])])


def advice(found: JSON) -> list[Item]:
    """Name the planned configuration that is predicted to be the flattest."""
    study = found.get("study") or {}
    told = (study.get("after_loop") or {}).get("advice") or study.get("advice")
    if not told:
        return []
    best, count = told["configurations"][0], len(told["configurations"])
    text = (
        f"Of {count} planned configurations of faces, none of them cut, {best['configuration']} is predicted "
        f"to be the flattest: X_m {quantity(best['xm_predicted'])}, the best with probability "
        f"{probability(best['probability_best'])}. Nothing was measured of these."
    )
    return [Paragraph(text)]


def _one_run(results: Results) -> list[Item]:
    """Draw the held-out run that the base model misses most, of the first observable that has curves."""
    for name in results.verdicts():
        frame = results.compared(name) if name != "lobes" else None
        if frame is None or not coordinate(frame):
            continue
        square = (frame["measured"] - frame["before"]) ** 2
        run = str(square.groupby(frame["run"]).mean().idxmax())
        caption = f"{heading(name)}. {findings.missed(frame, run)}"
        return [Picture(overlay(frame[frame["run"] == run], title(name)), caption, caption)]
    return []


def _identified_words(found: JSON) -> str:
    """Name what was identified, for a batch that has nothing else to show."""
    modes = len(found.get("modes") or [])
    named = [
        f"{modes} mode{'s' if modes > 1 else ''}" if modes else "",
        "cutting coefficients" if found.get("force") else "",
        "joint stiffness" if (found.get("arm") or {}).get("joint_stiffness") else "",
        "flatness of faces" if found.get("faces") else "",
    ]
    told = listing([name for name in named if name])
    return f"Identified: {told}." if told else ""


def print_check(results: Results) -> list[Item]:
    """Say on the first page of a published batch what became of its printed errors."""
    table = results.tables.get("published_errors")
    if table is None:
        return []
    pairs, flagged = int(table["predicted"].notna().sum()), int((table["flag"].fillna("") != "").sum())
    errata = int(table["note"].fillna("").str.contains("erratum: ").sum())
    text = (
        f"{len(table)} printed values were transcribed, {pairs} of them with a prediction beside them; "
        f"every printed error was recomputed. {f'{flagged} cannot' if flagged else 'All can'} be right as "
        f"printed; for {errata or 'none'} an erratum is stated."
    )
    return [Paragraph(text)]


def _key_numbers(verdicts: dict[str, JSON]) -> list[Item]:
    if len(verdicts) == 1:
        ((_, entry),) = verdicts.items()
        before, after = entry.get("before") or {}, entry.get("after") or {}
        return [
            Facts(
                [
                    (
                        "verdict",
                        STATUS.get(str(entry.get("status")), "–"),
                        count_of(len(entry.get("held_out_runs") or []), "held-out run"),
                    ),
                    (
                        "error before",
                        error_text(before, entry.get("unit")),
                        _share(before),
                    ),
                    (
                        "error after",
                        error_text(after, entry.get("unit")),
                        _share(after),
                    ),
                    (
                        "noise floor",
                        f"{number(entry.get('noise_floor'))}{_unit(entry)}",
                        "rms of the compared value",
                    ),
                ]
            )
        ]
    rows = [
        [
            title(name),
            STATUS.get(str(entry.get("status")), "–"),
            error_text(entry.get("before"), None),
            error_text(entry.get("after"), None),
            number(entry.get("noise_floor")),
            _unit(entry).strip() or "1",
            listing([words(str(e["effect"])) for e in entry.get("effects") or []]) or "none",
        ]
        for name, entry in verdicts.items()
    ]
    header = ["observable", "verdict", "rms before", "rms after", "noise floor", "unit", "effects added"]
    return (
        [
            Table(
                header,
                rows,
                "Errors on held-out runs, with 95 % intervals.",
                [2.1, 1, 1.6, 1.6, 1, 0.5, 1.4],
            )
        ]
        if rows
        else []
    )
