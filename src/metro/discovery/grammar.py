"""The grammar: every term that may be missing in a batch, each with units that follow and a bounded size.

A term is a quantity that it acts in times functions of one or two circumstances. Admitted are those whose
circumstances vary over the runs; what is alike in all teeth unless it names a tooth; and what vanishes with
its size, so that the model without it is one of its cases.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from metro.discovery.blueprint import Blueprint, Given
from metro.discovery.entry import Entry
from metro.discovery.facts import Fact, rounded
from metro.discovery.parameters import length, size, symbol, unit_of
from metro.effects.effect import EffectParameter
from metro.observables.force.shapes import CIRCUMSTANCES, Shape
from metro.observables.force.terms import AlongArc, Bend, Depth, Factor, Lag, Layer, Push, Tooth, Wave
from metro.units import MM, MS, UM

GROUPS: Mapping[str, tuple[tuple[str, ...], str, str]] = {
    "shear": (("ktc", "krc", "kac"), "shear force", "K_c"),
    "edge": (("kte", "kre", "kae"), "edge force", "K_e"),
    "whole": (("ktc", "krc", "kac", "kte", "kre", "kae"), "whole force", "K"),
    "tangential": (("ktc", "kte"), "tangential force", "K_t"),
    "radial": (("krc", "kre"), "radial force", "K_r"),
    "axial": (("kac", "kae"), "axial force", "K_a"),
}
LENGTHS = (0.1, 0.4)  # of the range of a circumstance, at which its exponentials are tried
LAYERS_MM = (0.2, 0.4, 0.8)
PRELOADS = (0.0, 0.2, 0.5)  # of the largest reading of an axis
WAVES = (1, 2, 3)  # per revolution of the spindle
ALONG = {
    "constant": ("1", "is as large everywhere in the arc"),
    "cosine": ("cos φ", "has opposite signs where a tooth enters and leaves a slot"),
    "ends": ("cos² φ", "is largest where a tooth enters and leaves a slot"),
}
SECOND_ORDER = 0.7  # damping of a low pass of second order that is flat


@dataclass(frozen=True)
class Function:
    """A function of a circumstance that a term may have.

    ``shape`` builds it; ``length``: the parameter inside, None: there is none. ``largest``: of its values.
    ``symbol``, ``words`` and ``name`` say what it is.
    """

    form: str
    variable: str
    shape: Blueprint
    length: EffectParameter | None
    largest: float
    symbol: str
    words: str
    name: str


@dataclass(frozen=True)
class Setting:
    """What the grammar needs to know of a batch: what varies, teeth, largest readings (N) by axis."""

    facts: Mapping[str, Fact]
    teeth: int
    alike: bool
    readings: Mapping[str, float]


def functions(name: str, fact: Fact) -> Iterator[Function]:
    """Go through the functions of a circumstance that are admitted."""
    if name in ("speed", "feed", "depth", "arc"):
        yield _function("logarithm", name, fact)
        return
    if name == "up":
        yield _function("sign", name, fact)
        return
    yield _function("linear", name, fact)
    for share in LENGTHS:
        yield _function("saturating" if name == "travel" else "decay", name, fact, share * fact.span)
    if name == "path":
        yield _function("square", name, fact)
    if name in ("travel", "time"):
        for place in fact.places(within=name == "time"):
            yield _function("step", name, fact, place)


def _function(form: str, variable: str, fact: Fact, long: float = 0.0) -> Function:
    known, long = CIRCUMSTANCES[variable], rounded(long)
    inner = length(variable, long, fact.span) if form in ("saturating", "decay") else None
    arguments: dict[str, Any] = {"form": form, "variable": variable}
    reference = fact.middle if form in ("linear", "square", "logarithm") else 0.0
    arguments |= {"reference": reference} if reference else {}
    arguments |= {"length": Given(inner.name) if inner else long} if form in ("step",) or inner else {}
    values = Shape(**{**arguments, "length": long or 1.0}).of_values(fact.values)
    unit = "" if known.unit == "1" else f" {known.unit}"
    words = {
        "linear": f"in proportion to the {known.words}",
        "square": f"with the square of the {known.words}",
        "logarithm": f"as a power of the {known.words}",
        "saturating": f"with the {known.words}, fast at first and then less and less",
        "decay": f"by a part that fades with the {known.words}",
        "step": f"at once where the {known.words} exceeds {long:g}{unit}",
        "sign": "by as much more in up cuts as less in down cuts",
    }[form]
    suffix = variable + ("" if form in ("linear", "logarithm", "sign") else f"_{form}")
    at = symbol(form, variable, reference, inner.name if inner else long)
    return Function(
        form, variable, Blueprint.of(Shape, **arguments), inner, float(abs(values).max()), at, words, suffix
    )


def grammar(batch: Setting) -> list[Entry]:
    """Return every term that a batch admits."""
    single = [one for name, fact in batch.facts.items() for one in functions(name, fact)]
    travel = [one for one in single if one.variable == "travel"]
    entries: list[Entry] = []
    for group in GROUPS:
        entries += [_factor(group, (one,)) for one in single]
    odd = [one for one in single if one.form == "sign"]
    fading = [one for one in single if one.form in ("linear", "decay") and one.variable in ("travel", "time")]
    entries += [_factor(group, (one, up)) for group in ("shear", "edge") for one in fading for up in odd]
    entries += [_depth(one) for one in single if one.variable in ("travel", "path")]
    entries += [_layer(thick, top=top) for thick in LAYERS_MM for top in (True, False)]
    if batch.teeth > 1:
        for tooth in range(1 if batch.alike else batch.teeth):
            entries += [_tooth(tooth, None), *(_tooth(tooth, one) for one in travel if one.form == "step")]
        entries += [_wave(order) for order in WAVES if order % batch.teeth]
    entries += [_along_arc(form) for form in ALONG]
    slow = [one for one in travel if one.form != "saturating"]
    slow += [one for one in single if one.variable == "time"]
    entries += [_push(axis, one) for axis in "xyz" for one in slow]
    for axis, largest in batch.readings.items():
        entries += [_bend(axis, sign, rounded(share * largest)) for sign in (1.0, -1.0) for share in PRELOADS]
    entries += [_lag(axes, 0.0) for axes in ("xyz", "x", "y", "z")] + [_lag("xyz", SECOND_ORDER)]
    return entries


def _sized(quantity: str, base: str, functions: tuple[Function, ...], typical: float, most: float) -> Any:
    """Return the size of a term and its place in a formula; the unit follows from the functions."""
    factors = tuple((one.form, one.variable) for one in functions)
    unit, largest = unit_of(quantity, factors), 1.0
    for one in functions:
        largest *= one.largest
    name = base + unit[len(quantity) :].replace("/", "_per_")
    return size(name, unit, typical / largest, most / largest)


def _lengths(functions: tuple[Function, ...]) -> tuple[EffectParameter, ...]:
    return tuple(one.length for one in functions if one.length)


def _product(functions: tuple[Function, ...]) -> str:
    return " · ".join(one.symbol for one in functions)


def _factor(group: str, functions: tuple[Function, ...]) -> Entry:
    columns, words, letter = GROUPS[group]
    power = functions[0].form == "logarithm"
    amount = _sized("1", "exponent" if power else "change", functions, 0.05, 3.0 if power else 2.0)
    if power:
        amount = size("exponent", "1", 0.05, 2.0)
    plan = Blueprint.of(
        Factor,
        columns=columns,
        shapes=tuple(one.shape for one in functions),
        size=Given(amount.name),
        **({"power": True} if power else {}),
    )
    x, reference = functions[0].symbol[3:-1].split(" / ") if power else ("", "")
    formula = (
        f"{letter} → {letter} · ({x} / {reference})^{amount.name}"
        if power
        else f"{letter} → {letter} · (1 + {amount.name} · {_product(functions)})"
    )
    return Entry(
        name="_".join([group, "force", *(f"by_{one.name}" for one in functions)]),
        plan=plan,
        quantity=words,
        variables=tuple(one.variable for one in functions),
        form=" × ".join("power" if one.form == "logarithm" else one.form for one in functions),
        sizes=(amount,),
        lengths=_lengths(functions),
        formula=formula,
        words=f"The {words} changes {' and '.join(one.words for one in functions)}.",
    )


def _depth(one: Function) -> Entry:
    amount = _sized("um", "depth_um", (one,), 20.0, 1000.0)
    plan = Blueprint.of(Depth, shapes=(one.shape,), size=Given(amount.name, UM))
    formula = f"a → a + {amount.name} · {one.symbol}"
    words = f"The true axial depth changes {one.words}."
    return Entry(
        f"depth_by_{one.name}", plan, "axial depth", (one.variable,), one.form, (amount,), _lengths((one,)),
        formula, words,
    )  # fmt: skip


def _layer(thick: float, *, top: bool) -> Entry:
    amount = size("change", "1", 0.05, 5.0, -0.9)
    inner = EffectParameter("thick_mm", "mm", 0.02, 5.0, 0.1 * thick, starts=(thick,), neutral=thick)
    plan = Blueprint.of(Layer, thick=Given("thick_mm", MM), size=Given("change"), top=top)
    place = "uppermost thick_mm of the cut" if top else "lowest thick_mm of the cut"
    return Entry(
        f"{'top' if top else 'bottom'}_layer", plan, "shear force", ("height",), "step", (amount,), (inner,),
        f"K_c → K_c · (1 + change) in the {place}",
        f"The shear force differs in a layer at the {'top' if top else 'tip'} of the cut.",
    )  # fmt: skip


def _tooth(tooth: int, one: Function | None) -> Entry:
    amount = size("change", "1", 0.05, 3.0, -0.95)
    shapes = (one.shape,) if one else ()
    columns = GROUPS["whole"][0]
    plan = Blueprint.of(Tooth, tooth=tooth, columns=columns, shapes=shapes, size=Given("change"))
    variables = ("tooth", one.variable) if one else ("tooth",)
    factor = f" · {one.symbol}" if one else ""
    return Entry(
        f"tooth_{tooth}" + (f"_by_{one.name}" if one else ""), plan, "force of one tooth", variables,
        one.form if one else "constant", (amount,), (),
        f"force of tooth {tooth} → force · (1 + change{factor})",
        f"The force of one tooth differs from that of the others{f' {one.words}' if one else ''}.",
    )  # fmt: skip


def _along_arc(form: str) -> Entry:
    symbol, words = ALONG[form]
    sizes = tuple(size(name, "1", 0.05, 1.5) for name in ("tangential", "radial"))
    plan = Blueprint.of(AlongArc, form=form, tangential=Given("tangential"), radial=Given("radial"))
    return Entry(
        f"force_along_arc_{form}", plan, "force of each tooth", ("immersion angle",), form, sizes, (),
        f"F_t → F_t + tangential · K_tc · f · {symbol}, F_r → F_r + radial · K_tc · f · {symbol}",
        f"Each tooth has a force in proportion to the feed beside that of its chip, which {words}.",
    )  # fmt: skip


def _wave(order: int) -> Entry:
    sizes = tuple(size(name, "1", 0.02, 1.0) for name in ("cosine", "sine"))
    plan = Blueprint.of(Wave, order=order, cosine=Given("cosine"), sine=Given("sine"))
    return Entry(
        f"shear_wave_order_{order}", plan, "shear force", ("spindle angle",), f"order {order}", sizes, (),
        f"K_c → K_c · (1 + cosine · cos {order}α + sine · sin {order}α)",
        f"The shear force swings {order} times per revolution of the spindle.",
    )  # fmt: skip


def _push(axis: str, one: Function) -> Entry:
    amount = _sized("N", "push_n", (one,), 2.0, 300.0)
    plan = Blueprint.of(Push, axis=axis, shapes=(one.shape,), size=Given(amount.name))
    return Entry(
        f"push_{axis}_by_{one.name}", plan, f"force of its own along {axis}", (one.variable,), one.form,
        (amount,), _lengths((one,)), f"F_{axis} → F_{axis} + {amount.name} · {one.symbol}",
        f"A force along {axis} that does not depend on the cut changes {one.words}.",
    )  # fmt: skip


def _bend(axis: str, sign: float, preload: float) -> Entry:
    amount = size("share", "1", 0.02, 0.95)
    side, of = ("positive", f"F_{axis}") if sign > 0 else ("negative", f"−F_{axis}")
    most = max(4.0 * preload, 100.0)
    inner = EffectParameter(
        "preload_n",
        "N",
        0.0,
        most,
        0.05 * most,
        starts=(preload,),
        neutral=preload,
        nothing_below=True,
        nothing_above=True,
    )
    plan = Blueprint.of(Bend, axis=axis, sign=sign, preload=Given("preload_n"), share=Given("share"))
    return Entry(
        f"bent_{side}_reading_{axis}", plan, f"reading of {axis}", (f"force along {axis}",),
        "beyond a preload", (amount,), (inner,), f"{of} → {of} − share · max({of} − preload_n, 0)",
        f"The reading of {axis} has another slope where the force is {side} and beyond a preload.",
    )  # fmt: skip


def _lag(axes: str, damping: float) -> Entry:
    amount = size("time_ms", "ms", 0.02, 3.0, 0.0)
    plan = Blueprint.of(
        Lag, axes=axes, time=Given("time_ms", MS), **({"damping": damping} if damping else {})
    )
    which = "all axes" if len(axes) == 3 else axes
    order, response = ("second", "(1 + 2ζiωT − ω²T²)") if damping else ("first", "(1 + iωT)")
    where = "" if len(axes) == 3 else f"_{axes}"
    return Entry(
        f"lag_of_{order}_order{where}", plan, f"reading of {which}", ("frequency",), f"{order} order in time",
        (amount,), (), f"F(ω) → F(ω) / {response}, T = time_ms" + (f", ζ = {damping:g}" if damping else ""),
        f"The reading of {which} lags behind the force like a low pass of {order} order.",
    )  # fmt: skip
