"""Faults of channels with names and units of their own (TDMS, MATLAB), and variants of DynoWare's text."""

import corpus_batches as batches
import corpus_writers as writers
import numpy as np
from corpus_case import Case
from corpus_matlab import matlab73
from corpus_tdms import lead_in, segment
from corpus_text import SAMPLES

# Kind → a channel of it, its column, an expected unit, and one that is of another quantity.
CHANNELS = {
    "dynamometer": ("fx", "fx_n", "N", "V"),
    "robot_log": ("tau2", "tau2_nm", "Nm", "A"),
    "hammer record": ("force", "force_n", "N", "V"),
}


def cases():
    """Return the cases of all formats of channels, and those of DynoWare."""
    pairs = [*(("dynamometer", form) for form in FORMS), ("robot_log", "TDMS"), ("hammer record", "MAT v7")]
    found = [case for kind, form in pairs for case in _faults(kind, form)]
    return found + _tdms() + _matlab() + _response() + _dynoware()


def _tdms_file(path, content):
    named = {
        name: (values, {"unit_string": unit} if unit else {}) for name, (unit, values) in content.items()
    }
    path.write_bytes(segment(named))


def _mat_file(path, content):
    from scipy.io import savemat

    units = {name: unit for name, (unit, _) in content.items() if unit}
    savemat(path, {"record": {name: each for name, (_, each) in content.items()}, "units": units})


def _mat_hdf5(path, content):
    units = {name: unit for name, (unit, _) in content.items() if unit}
    matlab73(path, {"record": {name: each for name, (_, each) in content.items()}, "units": units})


FORMS = {"TDMS": _tdms_file, "MAT v7": _mat_file, "MAT v7.3": _mat_hdf5}


def _content(kind):
    """Return the sound channels of the file that is broken: name → unit and values."""
    return {name: (unit, each.to_numpy()) for name, unit, each in writers.named(batches.RECORDING[kind](2))}


def _change(kind, form, change):
    """Return the fault that writes a file anew with other channels; None leaves one out."""

    def apply(folder):
        content = _content(kind)
        content |= change(content)
        present = {name: each for name, each in content.items() if each is not None}
        FORMS[form](folder / batches.victim(kind, form), present)

    return apply


def _faults(kind, form):
    name, column, unit, wrong = CHANNELS[kind]
    time = "t"

    def case(fault, change, how="refused", says=()):
        return Case(kind, form, fault, _change(kind, form, change), how, tuple(says))

    return [
        case("a channel is missing", lambda _: {name: None}, says=[column, "lacks", "expected"]),
        case(
            "a channel of another name",
            lambda found: {name: None, "Channel 7": found[name]},
            says=[column, "channel_7", "expected"],
        ),
        case(
            "a unit of another quantity",
            lambda found: {name: (wrong, found[name][1])},
            says=[column, repr(wrong), unit, "expected"],
        ),
        case(
            "no unit, in the name or beside it",
            lambda found: {name: ("", found[name][1])},
            says=[column, "unit ''", unit, "expected"],
        ),
        case(
            "a unit that contradicts the name",
            lambda found: {name: None, column: (f"k{unit}", found[name][1])},
            says=[column, f"'k{unit}'", f"expected {unit}", "correct"],
        ),
        case(
            "a unit a thousand times as large, and values to it",
            lambda found: {name: (f"k{unit}", found[name][1] / 1000)},
            "read",
        ),
        case("times in ms, and said so", lambda found: {time: ("ms", found[time][1] * 1000)}, "read"),
        case(
            "a channel appears twice",
            lambda found: {column: ("", found[name][1])},
            says=[column, "2 times", "expected once"],
        ),
        case(
            "a channel at another rate",
            lambda found: {name: (unit, found[name][1][::2])},
            says=[column, "values", "expected", "one rate"],
        ),
        case(
            "no values",
            lambda found: {k: (u, v[:0]) for k, (u, v) in found.items()},
            says=["0 rows", "expected"],
        ),
        case(
            "NaN in a channel",
            lambda found: {
                name: (unit, np.where(np.arange(len(found[name][1])) == 9, np.nan, found[name][1]))
            },
            *(
                ("flagged", ["sample 10", column, "lack a value"])
                if kind in SAMPLES
                else ("refused", ["sample 10", column, "NaN", "expected"])
            ),
        ),
        case(
            "repeated time",
            lambda found: {time: ("s", np.repeat(found[time][1][::2], 2)[: len(found[time][1])])},
            says=["sample 2", "t_s", "expected"],
        ),
        case(
            "a channel of text",
            lambda found: {name: (unit, np.zeros(len(found[name][1]), "V16"))},
            says=[column, "no real numbers", "expected"],
        )
        if form == "TDMS"
        else case(
            "a matrix in place of a vector",
            lambda found: {name: (unit, np.outer(found[name][1], [1.0, 2.0]))},
            says=[column, "expected a vector"],
        ),
    ]


def _tdms():
    kind, form = "dynamometer", "TDMS"
    file = batches.victim(kind, form)

    def bytes_of(change):
        return lambda folder: (folder / file).write_bytes(change((folder / file).read_bytes()))

    def counts(found):
        path_of = {"unit_string": "N", "NI_Number_Of_Scales": 1, "NI_Scaling_Status": "unscaled"}
        return segment({name: (each, path_of) for name, (_, each) in found.items()})

    def waves(step):
        def apply(folder):
            found = _content(kind)
            time = found.pop("t")[1]
            named = {}
            for name, (unit, each) in found.items():
                wave = {"wf_start_offset": float(time[0]), "wf_increment": step(name)}
                named[name] = each, {"unit_string": unit, **wave}
            (folder / file).write_bytes(segment(named))

        return apply

    def case(fault, apply, how="refused", says=()):
        return Case(kind, form, fault, apply, how, tuple(says))

    return [
        case(
            "raw counts without their scale",
            bytes_of(lambda _: counts(_content(kind))),
            says=["raw", "expected"],
        ),
        case(
            "raw values of DAQmx",
            bytes_of(lambda d: d[:4] + bytes([d[4] | 128]) + d[5:]),
            says=["DAQmx", "save"],
        ),
        case(
            "the recorder stopped while it wrote",
            bytes_of(lambda d: d[:12] + b"\xff" * 8 + d[20:]),
            says=["not closed", "recorder"],
        ),
        case("an unknown version", bytes_of(lambda d: d[:8] + b"\x09" + d[9:]), says=["version", "expected"]),
        case(
            "a segment of values alone that nobody describes",
            bytes_of(lambda d: d + lead_in(8, b"", bytes(7))),
            says=["segment 3", "expected"],
        ),
        case("time as increments of waveforms", waves(lambda _: 1e-3), "read"),
        case(
            "waveforms of two rates",
            waves(lambda name: 1e-3 if name == "fx" else 2e-3),
            says=["fy", "one rate"],
        ),
    ]


def _matlab():
    kind, form = "dynamometer", "MAT v7.3"

    def linked(folder):
        import h5py

        file = folder / batches.victim(kind, form)
        with h5py.File(file.parent / "r1.h5", "w") as other:
            other["fx"] = np.zeros(9)
        with h5py.File(file, "r+") as found:
            del found["record"]["fx"]
            found["record"]["fx"] = h5py.ExternalLink("r1.h5", "fx")

    def old(folder):
        from scipy.io import savemat

        table = batches.RECORDING[kind](2)
        savemat(
            folder / batches.victim(kind, form), {name: table[name].to_numpy() for name in table}, format="4"
        )

    return [
        Case(kind, form, "a link to another file", linked, "refused", ("fx", "link", "expected")),
        Case(kind, form, "MATLAB 4", old, "refused", ("MATLAB", "expected")),
    ]


def _response():
    kind = "hammer record"

    def in_g(found):
        return {"response": ("g", found["response"][1])}

    says = "response", "'g'", "'m/s2'", "impacts.csv", "correct"
    found = [
        Case(kind, form, "another unit than impacts.csv has", _change(kind, form, in_g), "refused", says)
        for form in FORMS
    ]
    return [
        *found,
        *(
            Case(
                kind,
                form,
                "a response in volts",
                _change(kind, form, lambda c: {"response": ("V", c["response"][1])}),
                "refused",
                ("response", "'V'", "expected m/s2"),
            )
            for form in FORMS
        ),
    ]


def _dynoware():
    kind, form = "dynamometer", "DynoWare"
    file = batches.victim(kind, form)

    def edited(edit):
        def apply(folder):
            head, rows = (folder / file).read_text().split("s\tN\tN\tN\n")
            (folder / file).write_text(edit(head, rows))

        return apply

    units = "s\tN\tN\tN\n"

    def first(rows, old, new):
        lines = rows.splitlines(keepends=True)
        return "".join([*lines[:20], lines[20].replace(old, new, 1), *lines[21:]])

    def case(fault, edit, how="refused", says=()):
        return Case(kind, form, fault, edited(edit), how, tuple(says))

    return [
        case("decimal commas between tabs", lambda h, r: h + units + r.replace(".", ","), "read"),
        case(
            "decimal commas between semicolons",
            lambda h, r: (h + units).replace("\t", ";") + r.replace("\t", ";").replace(".", ","),
            "read",
        ),
        case(
            "one decimal point among decimal commas",
            lambda h, r: h + units + first(r.replace(".", ","), ",", "."),
            says=["line 27", "t_s", "expected a number", "decimal commas"],
        ),
        case(
            "one decimal comma among decimal points",
            lambda h, r: h + units + first(r, ".", ","),
            says=["line 27", "t_s", "expected a number", "decimal point"],
        ),
        case(
            "more lines before the channels",
            lambda h, r: h.replace("Cycle", "Note:\tx\n" * 40 + "Cycle") + units + r,
            "read",
        ),
        case(
            "units behind the names",
            lambda h, r: h.replace("Time\tFx\tFy\tFz", "Time [s]\tFx [N]\tFy [N]\tFz [N]") + r,
            "read",
        ),
        case("no line of units", lambda h, r: h + r, says=["t_s", "unit", "expected s or ms"]),
        case(
            "a unit of another quantity",
            lambda h, r: h + "s\tN\tV\tN\n" + r,
            says=["line 6", "fy_n", "'V'", "N or kN"],
        ),
        case(
            "no column of time",
            lambda h, r: (
                h.replace("Time\t", "")
                + "N\tN\tN\n"
                + "".join(line.split("\t", 1)[1] for line in r.splitlines(keepends=True))
            ),
            says=["no line of channels", "time"],
        ),
    ]
