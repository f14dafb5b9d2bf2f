"""What a set of files is, and how a figure of ours is taken from the results of its batch."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from metro.units import JSON

Found = Mapping[str, Any]


@dataclass(frozen=True)
class Known:
    """A figure that is known of a set, and where ours is in the results.

    Attributes
    ----------
    what, unit : in the table. value : what is known; None where only ours is listed. source : who says so.
    ours : takes ``identified`` and ``verdict`` and gives a quantity (value, ci95); None where we have none.
    half : half width of what is known, by its rounding or its own interval.
    """

    what: str
    unit: str
    value: float | None
    source: str
    ours: Callable[[Found], JSON | None]
    half: float = 0.0


@dataclass(frozen=True)
class FieldSet:
    """A set of files.

    Attributes
    ----------
    name : of the batch that it becomes. files : patterns in its folder, in the order of import; none where
        the folder is a batch already. answers : to the questions of the import, options as they are given.
    known : what is compared. refused : words of the refusal, where the right end is one.
    remark : what the figures do not say. folder : beside the real data; "": field and its name.
    """

    name: str
    files: Sequence[str] = ()
    answers: Sequence[str] = ()
    known: Sequence[Known] = ()
    refused: str = ""
    remark: str = ""
    folder: str = ""


def mode(hz: float, key: str = "frequency") -> Callable[[Found], JSON | None]:
    """Take the identified mode that is nearest to a frequency, within a tenth of it."""

    def ours(found: Found) -> JSON | None:
        modes = [one for one in found["identified"].get("modes") or [] if one.get("frequency")]
        nearest = min(modes, key=lambda one: abs(one["frequency"]["value"] - hz), default=None)
        if nearest is None or abs(nearest["frequency"]["value"] - hz) > 0.1 * hz:
            return None
        return dict(nearest[key])

    return ours


def at(*path: str) -> Callable[[Found], JSON | None]:
    """Take the quantity at a path of ``identified``."""

    def ours(found: Found) -> JSON | None:
        here: JSON = found["identified"]
        for name in path:
            here = (here or {}).get(name) or {}
        return here or None

    return ours


def face(key: str) -> Callable[[Found], JSON | None]:
    """Take an index of the only face."""

    def ours(found: Found) -> JSON | None:
        faces: Mapping[str, JSON] = found["identified"].get("faces") or {}
        return next((one.get(key) for one in faces.values()), None)

    return ours


def trace(key: str) -> Callable[[Found], JSON | None]:
    """Take a parameter of the only trace."""

    def ours(found: Found) -> JSON | None:
        traces: Mapping[str, JSON] = found["identified"].get("texture") or {}
        return next((one.get(key) for name, one in traces.items() if name != "not_identified"), None)

    return ours


def texture(source: str, *values: tuple[str, str, float, float]) -> tuple[Known, ...]:
    """Known parameters of a trace: name, unit, value and half width of each."""
    return tuple(Known(name, unit, value, source, trace(name), half) for name, unit, value, half in values)


def printed(value: float) -> Callable[[Found], JSON | None]:
    """Take the printed value of a table of published values that is nearest to one, within a hundredth."""

    def ours(found: Found) -> JSON | None:
        rows: Sequence[JSON] = found["printed"]
        values = [float(row["measured"]) for row in rows if row["measured"]]
        nearest = min(values, key=lambda one: abs(one - value), default=None)
        near = nearest is not None and abs(nearest - value) <= 0.01 * abs(value)
        return {"value": nearest} if near else None

    return ours


def friction(kind: str, joint: int) -> Callable[[Found], JSON | None]:
    """Take the friction of a joint from the log without a load."""

    def ours(found: Found) -> JSON | None:
        runs: Mapping[str, JSON] = (found["identified"].get("joints") or {}).get("runs") or {}
        values = (runs.get("r01") or {}).get(kind) or []
        return dict(values[joint - 1]) if len(values) >= joint else None

    return ours


def effect(observable: str, name: str, parameter: str) -> Callable[[Found], JSON | None]:
    """Take a parameter of an effect that the verdict names."""

    def ours(found: Found) -> JSON | None:
        entry = (found["verdict"].get("observables") or {}).get(observable) or {}
        effects = [one for one in entry.get("effects") or [] if one["effect"] == name]
        return effects[0]["parameters"].get(parameter) if effects else None

    return ours


def held_out(observable: str, when: str = "after") -> Callable[[Found], JSON | None]:
    """Take the error on held-out runs relative to the signal, in %."""

    def ours(found: Found) -> JSON | None:
        entry = (found["verdict"].get("observables") or {}).get(observable) or {}
        error = entry.get(when)
        if not error:
            return None
        scale = 100.0 * error["nrmse"] / error["rms"] if error["rms"] else 0.0
        return {"value": 100.0 * error["nrmse"], "ci95": [scale * end for end in error["ci95"]]}

    return ours


def posed(run: str, kind: str, stage: str) -> Callable[[Found], JSON | None]:
    """Take the median distance of poses that were left out from where a fit predicted them."""
    return at("pose", run, "errors", kind, stage, "median")


def coefficient(name: str) -> Callable[[Found], JSON | None]:
    """Take a cutting coefficient by the mean forces of all runs."""
    return at("force", "mean_all_runs", name)
