"""What comes first on page one: data that contradict the batch, and a model that misses half of them."""

from __future__ import annotations

from dataclasses import replace

from metro.report.content import Item, Paragraph, Section
from metro.report.numbers import percent
from metro.report.results import Results, heading

# What to look at where a model misses half of the signal and no contradiction was found.
USUAL = {
    "force": "the dynamometer's axes, reads and sensitivities, the number of teeth, speed and feed",
    "joint_force": "signs and order of the joint torques, the geometry of the arm, axes of the dynamometer",
    "deformation": "the scale and the side of the profiles, load tests, the place of the work",
    "waviness": "the scale and the side of the profiles, load tests, the place of the work",
    "flatness": "which scan belongs to which run, its unit, the directions of the path, the work's place",
}


def with_contradictions(first: Section, results: Results) -> Section:
    """Return the first page with what makes its results doubtful in front of everything else."""
    slips = results.verdict.get("contradictions") or []
    texts = [str(slip["words"]) for slip in slips if slip["observables"]]
    doubts = [Paragraph(f"To be checked: {slip['words']}") for slip in slips if not slip["observables"]]
    spoiled = {name for slip in slips for name in slip["observables"]}
    for name, entry in results.verdicts().items():
        if name not in spoiled and entry.get("misses"):
            texts.append(_misses_half(name, entry["misses"]))
    if not texts:
        return replace(first, items=[*first.items, *doubts]) if doubts else first
    head = "Correct this first. No cause is given where the data contradict what the batch declares."
    items: list[Item] = [Paragraph(head, "warning"), *(Paragraph(text, "warning") for text in texts)]
    return replace(first, items=[*items, *doubts, *first.items])


def _misses_half(name: str, missed: float) -> str:
    check = USUAL.get(name, "units, signs and the run table")
    return (
        f"{heading(name)}: the model misses {percent(missed)} of the signal on held-out runs. A model of "
        f"this cut does not: look for a mistake in the batch before a cause in the machine. Check {check}."
    )
