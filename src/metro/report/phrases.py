"""The residual in an engineer's words: offsets, once per revolution, tooth passing."""

from __future__ import annotations

import re
from collections.abc import Sequence

from metro.report.numbers import listing, percent
from metro.units import JSON

MOST_ORDERS = 6
MOST_KINDS = 4  # of places that are named in a sentence


def residual_words(entries: Sequence[JSON], teeth: int) -> str:
    """Describe the significant places of a signature, the largest kind first; empty if there are none.

    Parameters
    ----------
    entries : ``{"axis", "label", "excess", "relative", "significant"}`` of ``loop.json``; labels are ``all``,
        ``mean`` and ``order <k>`` of the spindle. teeth : of the cutter; 0 if not known.
    """
    kinds: dict[str, list[JSON]] = {}
    for entry in entries:
        if entry.get("significant"):
            kinds.setdefault(_kind(str(entry["label"]), teeth), []).append(entry)
    ranked = sorted(kinds.items(), key=lambda item: -max(_size(entry) for entry in item[1]))
    named = [_kind_words(kind, same_kind) for kind, same_kind in ranked[:MOST_KINDS]]
    smaller = len(ranked) - len(named)
    more = f", and smaller parts of {smaller} other kind{'s' if smaller > 1 else ''}" if smaller > 0 else ""
    return "; ".join(named) + more


def sentence(text: str) -> str:
    """Return a text with a capital at its start and a full stop at its end; a symbol stays as it is."""
    first = text.split(maxsplit=1)[0]
    start = text[0].upper() if first.rstrip(":,").isalpha() and len(first) > 1 else text[0]
    return start + text[1:].rstrip(".") + "."


def plain(text: str) -> str:
    """Return a sentence of ``verdict.json`` with the places of a signature in words.

    The part on what an experiment is to describe is removed, because the report says it next to it.
    """
    text = re.sub(r"(, to characterise the remaining error):.*$", r"\1", text)
    text = re.sub(r"(?<=\d )um\b", "µm", text)
    text = re.sub(r"\bwhole record in (\w+)", r"over the whole record in \1", text)
    text = re.sub(r"\bmean in (\w+)", r"a constant offset in \1", text)
    text = re.sub(r"\border 1 in (\w+)", r"once per revolution in \1", text)
    text = re.sub(r"\border (\d+) in (\w+)", r"\1 times per revolution in \2", text)
    text = text.replace(" % of the signal there)", " %)").replace(" and 1 more places", " and one more place")
    return re.sub(r" and (\d+) more places", r" and smaller parts at \1 more places", text)


def _kind(label: str, teeth: int) -> str:
    steady, slow, how = label.partition(", ")
    if slow:
        return f"{'the mean' if steady == 'mean' else _kind(steady, teeth)}, changing {how}"
    match = re.fullmatch(r"order (\d+)", label)
    if match is None:
        return {"all": "over the whole record", "mean": "a constant offset"}.get(label, label)
    order = int(match[1])
    if teeth > 1 and order % teeth == 0:
        return "at the tooth passing and its harmonics"
    if order == 1:
        return "once per revolution"
    return "between the harmonics of the tooth passing" if teeth > 1 else "at multiples of the spindle speed"


def _kind_words(kind: str, entries: list[JSON]) -> str:
    orders = sorted({int(o[1]) for e in entries if (o := re.fullmatch(r"order (\d+)", str(e["label"])))})
    largest = max(entries, key=_size)
    if len(orders) <= 1:
        axes = [_share(entry) for entry in sorted(entries, key=lambda entry: -_size(entry))]
        return f"{kind} ({listing(axes)} of the signal)"
    named = [str(order) for order in orders[:MOST_ORDERS]]
    more = " …" if len(orders) > MOST_ORDERS else ""
    share = percent(largest.get("relative"))
    most = f"{largest.get('axis') or 'all'}, {share} of the signal at {largest['label']}"
    return f"{kind} (orders {', '.join(named)}{more}; most along {most})"


def _share(entry: JSON) -> str:
    return f"{entry.get('axis') or ''} {percent(entry.get('relative'))}".strip()


def _size(entry: JSON) -> float:
    return float(entry.get("excess") or entry.get("amplitude") or 0.0)
