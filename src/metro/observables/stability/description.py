"""What is said of the observable ``lobes``: title, assumptions of its model, and its needs."""

from __future__ import annotations

from metro.batch.capabilities import Capability, Stock, capability, missing_roles, plural
from metro.observables.description import Description
from metro.observables.stability import NAME, TABLES


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has and lacks for it."""
    impacts, runs = stock.tables["impacts"], stock.runs
    records = int((impacts["kind"] == "record").sum())
    tests = f"{plural(records, 'hammer record')}, {plural(len(impacts) - records, 'FRF')}"
    modes = capability("modes", tests, [] if len(impacts) else ["impacts.csv"], measured=len(impacts) > 0)
    needs = [*([] if len(impacts) else ["impacts.csv: the modes"]), *stock.missing_coefficients()]
    needs += stock.missing_keys(("tool.diameter_mm", "tool.teeth"))
    needs += [] if len(runs) else ["runs.csv: the immersion and the range of speeds"]
    labelled = runs[(runs["stable"] != "") | (runs["dynamometer"] != "")]
    wishes = (
        missing_roles(labelled)
        if len(labelled)
        else ["stable, or a dynamometer file, in runs.csv to compare with"]
    )
    source = f"modes and coefficients; {len(labelled)} runs to compare with"
    return modes, capability("lobes", source, needs, wishes, measured=len(impacts) > 0)


DESCRIPTION = Description(
    name=NAME,
    title="stability",
    assumes=(
        "Stability is that of the linear delay equation with the identified modes; process damping and "
        "modes that change with speed are not in the base model."
    ),
    tables=TABLES,
    shown=(
        *("lobe_methods", "lobe_islands", "lobe_stations", "chatter_runs", "chatter_records", "lobe_runs"),
        *("frf_used", "stabilisation", "mode_shapes", "mode_mac"),
        *("modes", "mode_tracks", "mode_pickups", "mode_cross", "mode_notes"),
    ),
    drawn=("lobes", "lobe_islands", "frf_used"),
    needs=needs,
)
