"""The first page: main results, verdicts, what to trust, what to do next, and a figure."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from metro.observables.catalogue import title
from metro.report.content import Bullets, Facts, Heading, Item, Paragraph, Picture, Section, Table
from metro.report.figures import verdicts as figures
from metro.report.figures.comparison import coordinate, overlay
from metro.report.numbers import listing, number, percent, probability, quantity, words
from metro.report.phrases import sentence
from metro.report.results import Results, heading
from metro.report.sections import findings
from metro.report.sections.areal import first_areal
from metro.report.sections.joint_words import joint_facts, joint_next, joint_words
from metro.report.sections.key_results import key_results
from metro.report.sections.levelling import first_levelled
from metro.report.sections.lobes import boundary_items, tested_boundary
from metro.report.sections.measured import count_of, measured_words
from metro.report.sections.modes import largest_response
from metro.report.sections.poses import first_poses
from metro.report.sections.surface import noise_of_faces
from metro.report.sections.texture import first_traces
from metro.report.sections.trust import static_deflection, trust
from metro.report.sections.verdict import (
    STATUS,
    change,
    error_text,
    known_interval,
    left_words,
    next_words,
    remedies,
    unit_after,
    verdict_words,
)
from metro.units import JSON

MOST_DRAWN = 2  # most verdicts with which the first page has room for the figure of a run
MOST_MODES = 12  # printed frequencies that are listed on the first page


def summary(results: Results) -> Section:
    """Write the first page: results, verdicts with their errors, what to trust, what to do, one figure."""
    verdicts = results.verdicts()
    items = first_words(results)
    drawn = _one_run(results) if len(verdicts) <= MOST_DRAWN else []
    arm = first_poses(results) if set(verdicts) == {"pose"} else []
    return Section("Results", [*items, *(arm or drawn or _changes(verdicts))])


def _changes(verdicts: Mapping[str, JSON]) -> list[Item]:
    """Draw the errors before and after of all observables."""
    rows = [c for c in (change(title(name), entry) for name, entry in verdicts.items()) if c is not None]
    if not rows:
        return []
    caption = f"{findings.changed(rows)} Errors with 95 % intervals, and the noise floor."
    alt = "; ".join(f"{c.label}: {c.before:.2g} % before, {c.after:.2g} % after" for c in rows)
    return [Picture(figures.changes(rows, "error on held-out runs (% of the signal)"), caption, alt)]


def first_words(results: Results) -> list[Item]:
    """Give the results, then the verdicts, what to trust and what to do next."""
    verdicts = results.verdicts()
    texts = [verdict_words(name, entry, left_words(results, name)) for name, entry in verdicts.items()]
    nexts = list(dict.fromkeys(remedy for entry in verdicts.values() for remedy in remedies(entry)))
    nexts += [f"{title(n)}: {words_next}" for n, e in verdicts.items() if (words_next := next_words(e))]
    lacking = (results.identified.get("not_identified") or {}).get("lobes")
    if not verdicts and lacking and results.identified.get("modes"):
        nexts = [f"For a verdict on {title('lobes')}: {lacking}"]
    nexts += list(joint_next(results))
    measure: list[Item] = [Heading("What to do next"), Bullets([sentence(text) for text in nexts])]
    return [
        Paragraph(measured_words(results)),
        *key_results(results),
        *([] if verdicts else _identified(results)),
        *_key_numbers(verdicts),
        *(Paragraph(text, "verdict") for text in texts or [no_verdict(results)]),
        Heading("What to trust"),
        Bullets([*trust(results), *static_deflection(results)]),
        *missing(verdicts),
        *(measure if nexts else []),
        *advice(results.identified),
        *print_check(results),
    ]


def missing(verdicts: Mapping[str, JSON]) -> list[Item]:
    """Say how much of what is unexplained any cause could explain, and of which kind that is."""
    ceilings = {name: (entry.get("unexplained") or {}).get("ceiling") for name, entry in verdicts.items()}
    said = [f"{heading(name)}: {ceiling['words']}" for name, ceiling in ceilings.items() if ceiling]
    return [Heading("What is missing"), Bullets([sentence(text) for text in said])] if said else []


def advice(identified: JSON) -> list[Item]:
    """Name the planned configuration that is predicted to be the flattest."""
    study = identified.get("study") or {}
    advised = (study.get("after_loop") or {}).get("advice") or study.get("advice")
    if not advised:
        return []
    best, count = advised["configurations"][0], len(advised["configurations"])
    text = (
        f"Of {count} planned configurations of faces, none of them cut, {best['configuration']} is predicted "
        f"to be the flattest: X_m {quantity(best['xm_predicted'])}. It is the best of them with probability "
        f"{probability(best['probability_best'])}. These configurations have not been measured."
    )
    return [Paragraph(text)]


def _one_run(results: Results) -> list[Item]:
    """Draw the held-out run with the base model's largest error, of the first observable with curves.

    Where tests of stability are all that was judged: these, on the boundary.
    """
    for name in results.verdicts():
        frame = results.compared(name) if name != "lobes" else None
        if frame is None or not coordinate(frame):
            continue
        square = (frame["measured"] - frame["before"]) ** 2
        run = str(square.groupby(frame["run"]).mean().idxmax())
        caption = f"{heading(name)}. {findings.missed(frame, run)}"
        return [Picture(overlay(frame[frame["run"] == run], title(name)), caption, caption)]
    tests = results.compared("lobes")
    return [*tested_boundary(results, tests)] if tests is not None else []


def _identified(results: Results) -> list[Item]:
    """Give the results of single sections, and the one figure that shows the identification best."""
    shown = [
        *joint_facts(results),
        *first_levelled(results),
        *first_poses(results),
        *first_areal(results),
        *first_traces(results),
        *noise_of_faces(results),
    ]
    pictures = [item for item in shown if isinstance(item, Picture)]
    others = [item for item in shown if not isinstance(item, Picture)]
    return [*others, *[*boundary_items(results), *largest_response(results.tables), *pictures][:1]]


def no_verdict(results: Results) -> str:
    """Say that nothing was compared, and which quantities were identified instead."""
    nothing = (
        "This batch has no verdict, because no held-out measurement could be compared with a prediction."
    )
    if set(results.identified.get("pose") or {}) - {"not_identified"}:
        nothing = "The arm model was fitted to measured poses and tested on others. The batch has no cuts."
    return f"{nothing} {_identified_words(results.identified)}".strip()


def _identified_words(identified: JSON) -> str:
    """Name the identified quantities, for a batch without a verdict."""
    modes = len(identified.get("modes") or [])
    named = [
        f"{modes} mode{'s' if modes > 1 else ''}" if modes else "",
        "cutting coefficients" if identified.get("force") else "",
        "joint stiffness" if (identified.get("arm") or {}).get("joint_stiffness") else "",
        "stiffness by load tests" if identified.get("tip_compliance") else "",
        "flatness of faces" if identified.get("faces") else "",
        *joint_words(identified),
        "flatness by slopes" if set(identified.get("levelling") or {}) - {"not_identified"} else "",
        "the arm by measured poses" if set(identified.get("pose") or {}) - {"not_identified"} else "",
        "surface texture" if set(identified.get("texture") or {}) - {"not_identified"} else "",
        "areal parameters" if identified.get("areal") else "",
    ]
    listed = listing([name for name in named if name])
    return f"Identified: {listed}." if listed else ""


def print_check(results: Results) -> list[Item]:
    """Summarise the check of the printed errors on the first page of a published batch."""
    table = results.tables.get("published_errors")
    if table is None:
        return []
    pairs, flagged = int(table["predicted"].notna().sum()), int((table["flag"].fillna("") != "").sum())
    errata = int(table["note"].fillna("").str.contains("erratum: ").sum())
    text = f"{len(table)} printed values were transcribed"
    if pairs:
        text += f", {pairs} of them with a predicted value; every printed error was recomputed"
    text += f". {f'{flagged} printed values are' if flagged else 'No printed value is'} inconsistent"
    text += f"; {errata} carry an erratum." if errata else "."
    return [Paragraph(text), *_printed_modes(table)]


def _printed_modes(table: pd.DataFrame) -> list[Item]:
    """List the printed frequencies of modes."""
    modes = table[(table["observable"] == "modes") & (table["quantity"] == "frequency")]
    if modes.empty:
        return []
    shown = ", ".join(number(float(value), 5) for value in modes["measured"].head(MOST_MODES))
    more = f" and {len(modes) - MOST_MODES} more" if len(modes) > MOST_MODES else ""
    return [Paragraph(f"{len(modes)} modes, natural frequencies in Hz: {shown}{more}.")]


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
                        held_out_words(entry),
                    ),
                    (
                        "error before",
                        error_text(before, entry.get("unit")),
                        _share(before, entry),
                    ),
                    (
                        "error after",
                        error_text(after, entry.get("unit")),
                        _share(after, entry),
                    ),
                    (
                        "noise floor",
                        _floor(entry),
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
            unit_after(entry).strip() or "1",
            listing(list(dict.fromkeys(words(str(e["effect"])) for e in entry.get("effects") or [])))
            or "none",
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


def held_out_words(entry: JSON) -> str:
    """Say what tested a verdict: held-out runs, or measured poses that were left out."""
    poses = (entry.get("held_out") or {}).get("poses")
    return (
        count_of(len(entry.get("held_out_runs") or []), "held-out run")
        if poses is None
        else f"{poses} poses left out"
    )


def _floor(entry: JSON) -> str:
    floor = entry.get("noise_floor")
    return "not stated" if floor is None else f"{number(floor)}{unit_after(entry)}"


def _share(error: JSON, entry: JSON) -> str:
    """Write an error as a share of the signal, with the reason if it has no interval.

    A position has no size that its error could be a share of.
    """
    if "held_out" in entry:
        return f"rms in a {entry['held_out'].get('of', 'coordinate')}"
    point = error.get("rms") is not None and known_interval(error) is None
    return f"{percent(error.get('nrmse'))} of the signal{'; one condition: no interval' if point else ''}"
