"""What is taken of a set's results: each function makes one that reads a quantity of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from metro.units import JSON

Found = Mapping[str, Any]


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


def probability(observable: str, name: str) -> Callable[[Found], JSON | None]:
    """Take the probability of an effect that the verdict names."""

    def ours(found: Found) -> JSON | None:
        effects = found["verdict"]["observables"][observable]["effects"]
        return next(({"value": one["probability"]} for one in effects if one["effect"] == name), None)

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


def coefficient(name: str) -> Callable[[Found], JSON | None]:
    """Take a cutting coefficient by the mean forces of all runs."""
    return at("force", "mean_all_runs", name)


def posed(run: str, kind: str, stage: str) -> Callable[[Found], JSON | None]:
    """Take the median distance of poses that were left out from where a fit predicted them."""
    return at("pose", run, "errors", kind, stage, "median")
