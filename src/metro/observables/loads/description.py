"""What is said of load tests by themselves: which tables they fill, and what a batch has of them."""

from __future__ import annotations

from metro.batch.capabilities import Capability, Stock, plural
from metro.joint_columns import axes_of
from metro.observables.description import Description
from metro.observables.loads import NAME, TABLES


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has of load tests; nothing where it has none.

    Force and displacement are all that the stiffness at the loaded points takes. That of the joints takes the
    arm, and where its joints were.
    """
    loads = stock.tables["loads"]
    if loads.empty:
        return ()
    wishes = stock.missing_arm()
    axes = axes_of(loads)
    if not len(axes) or not loads[axes.positions].notna().all(axis=1).any():
        wishes.append("the joints' places (q1_deg …) in loads.csv")
    wishes = ["for the stiffness of the joints:", *wishes] if wishes else []
    return (Capability("stiffness at rest", plural(len(loads), "load test"), tuple(wishes)),)


LOADED = Description(
    name=NAME,
    title="stiffness by load tests",
    assumes="",
    tables=TABLES,
    shown=TABLES,
    needs=needs,
)
