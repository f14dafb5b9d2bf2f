"""The terms of a report, for those who sign it: the statement of uncertainty, and a glossary."""

from __future__ import annotations

from metro.report.content import Paragraph, Section, Table
from metro.report.results import Results
from metro.report.sections.verdict import STATUS

INTERVALS = (
    "Uncertainty. Every ± is half of a 95 % interval, and “a (b … c)” gives the ends of one that is not "
    "symmetric; numbers are rounded to two digits of it. It holds the scatter of the data, and what "
    "batch.yaml declares of inputs and instruments. An error on held-out runs has the interval that drawing "
    "whole runs anew gives (bootstrap), and at least that of a mean square of as many independent values as "
    "the noise leaves these runs. A number without an interval is a reading, or its uncertainty is not known."
)
ALWAYS = {
    "held out": "put aside before any signal was read: no fit, no search and no decision sees it; it "
    "verifies the result. What a prediction needs of the run itself is taken from it (its speed, its start "
    "phase, the zero of the sensor, joint angles; for a wall or a face the force that was measured there)",
    "error": "rms of measured less predicted; NRMSE: the same over the rms of the measured values",
    "noise floor": "error that a right model would still have here: noise, scatter of whole runs, declared "
    "accuracy of a simple model",
}
OF_THE_LOOP = {
    "effect": "a cause that the base model lacks, with its own equations and parameters",
    "p, q": "chance of evidence as strong without the effect; q counts all effects that were tried",
    "held-out gain": "log-likelihood gained on conditions that neither fit has seen",
    "size": "what the effect changes of the prediction, rms over the rms of the signal",
    "weight, probability": "weight among effects that these runs cannot tell apart; probability: against "
    "these, none and what the library lacks",
}
VERDICTS = {
    "clean": "the runs of the identification show nothing that the base model lacks",
    "explained": "the effects named were missing; with them nothing significant is left",
    "partly_explained": "the effects named are there, and something else too",
    "undetermined": "several causes explain these runs equally well",
    "unexplained": "something is there that no effect of the library accounts for",
    "insufficient": "too few runs to tell; nothing is claimed",
}
OF_MODES = {
    "frequency, damping": "undamped frequency √(k/m), and ratio of the damping to the critical one",
    "stiffness, mass": "of the mode, at the driving point",
    "receptance": "displacement over force, as a function of frequency",
    "MAC": "modal assurance criterion: 1 where two shapes are alike at the points that were measured",
}
OF_FACES = {
    "X_m, X_a, X_g": "range, arithmetic and geometric mean of the deviations from the least-squares plane",
    "FLTt, FLTp, FLTv, FLTq": "flatness by ISO 12781-1: peak to valley, peak, valley and rms",
}
OF_STABILITY = {
    "P(chatter)": "probability that a cut chatters, by the modes, the forces and the error of the boundary; "
    "the error of stability is the rms of it less what was found (1 chatter, 0 stable)",
}


def terms(results: Results) -> Section:
    """Write the statement of uncertainty, and the terms that this report uses."""
    verdicts, used = results.verdicts(), dict(ALWAYS)
    used |= OF_THE_LOOP if verdicts else {}
    statuses = {str(entry.get("status")) for entry in verdicts.values()}
    used |= {STATUS[status]: meaning for status, meaning in VERDICTS.items() if status in statuses}
    used |= OF_MODES if results.identified.get("modes") else {}
    used |= OF_FACES if "flatness" in verdicts or "face_indices" in results.tables else {}
    used |= OF_STABILITY if "lobes" in verdicts else {}
    rows = [[term, meaning] for term, meaning in used.items()]
    table = Table(["term", "meaning"], rows, "Terms of this report.", [1, 4.6], small=True)
    return Section("Terms and uncertainty", [Paragraph(INTERVALS), table])
