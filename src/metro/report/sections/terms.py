"""The terms of a report, for those who sign it: the statement of uncertainty, and a glossary."""

from __future__ import annotations

from metro.report.content import Paragraph, Section, Table
from metro.report.results import Results
from metro.report.sections.verdict import STATUS

INTERVALS = (
    "Uncertainty. Every ± is half of a 95 % interval, and “a (b … c)” gives the ends of an asymmetric one; "
    "values are rounded to two digits of the interval. It includes the scatter of the data and the "
    "uncertainties that batch.yaml declares for inputs and instruments. The interval of an error on held-out "
    "runs comes from a bootstrap over whole runs. It is at least that of a mean square of as many "
    "independent "
    "values as these runs contain. A number without an interval is a reading, or its uncertainty is unknown."
)
ALWAYS = {
    "held out": "set aside before any signal was read: no fit and no decision uses it; it verifies the "
    "result. A prediction takes from the run itself only what it needs (speed, start phase, sensor offset, "
    "joint angles; for a wall or a face the measured force)",
    "error": "rms of measured minus predicted; NRMSE: the same divided by the rms of the measured values",
    "noise floor": "error that a correct model would have here: noise, scatter between runs, stated accuracy "
    "of the model",
}
OF_THE_LOOP = {
    "effect": "a cause that the base model does not include, with its own equations and parameters",
    "p, q": "probability of evidence as strong without the effect; q accounts for all effects tried",
    "held-out gain": "log-likelihood gained on conditions that neither fit has used",
    "size": "change of the prediction by the effect, rms over the rms of the signal",
    "weight, probability": "weight among effects that these runs do not distinguish; the probability also "
    "accounts for no effect and for causes outside the library",
}
VERDICTS = {
    "clean": "the base model explains the identification runs",
    "explained": "the model lacked the effects named; with them no significant residual remains",
    "partly_explained": "the effects named are present, and a significant residual remains",
    "undetermined": "several causes explain these runs equally well",
    "unexplained": "a significant residual that no effect of the library explains",
    "insufficient": "too few runs to decide; nothing is claimed",
}
OF_MODES = {
    "frequency, damping": "undamped frequency √(k/m), and ratio of the damping to the critical one",
    "stiffness, mass": "of the mode, at the driving point",
    "receptance": "displacement over force, as a function of frequency",
    "MAC": "modal assurance criterion: 1 where two shapes agree at the measured points",
}
OF_FACES = {
    "X_m, X_a, X_g": "range, arithmetic and geometric mean of the deviations from the least-squares plane",
    "FLTt, FLTp, FLTv, FLTq": "flatness by ISO 12781-1: peak to valley, peak, valley and rms",
}
OF_STABILITY = {
    "P(chatter)": "probability that a cut chatters, from the modes, the forces and the error of the "
    "boundary; "
    "the error of stability is the rms of P minus the outcome (1 chatter, 0 stable)",
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
