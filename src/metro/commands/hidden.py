"""What ``metro simulate`` can hide: the effects of each kind of batch, with what says how large they are.

The simulator shares no code with this package: it is another program, and is asked what it can hide.
"""

from __future__ import annotations

import functools
import importlib.util
import json
import math
import re
import subprocess
import sys
from collections.abc import Iterator
from enum import StrEnum
from typing import Any

from metro.batch.findings import ContractError, Finding
from metro.commands.calls import CallError, wrong_call
from metro.spelling import suggestion

PROGRAM = "virtual_cell"
ENTRY = re.compile(r"(\w+)(\S*)")


class Style(StrEnum):
    """How a simulated batch is measured."""

    a = "a"
    b = "b"
    c = "c"
    d = "d"


@functools.cache
def simulated() -> dict[str, dict[str, str]]:
    """Return what the simulator says that each kind of batch can hide: by effect its parameters.

    They are parted by blanks. Behind a name: ``[3]`` a list of three numbers, ``[]`` one for each tooth,
    ``=x|y`` one of these words, ``?`` not needed.

    Raises
    ------
    ContractError
        The simulator is not there, or fails.
    """
    if importlib.util.find_spec(PROGRAM) is None:
        message = "the simulator is not installed: it comes with metro-machining; install that package again"
        raise ContractError([Finding("error", PROGRAM, message)])
    content: dict[str, dict[str, str]] = json.loads(simulator("could not say what it can hide", "effects"))
    return content


def simulator(fault: str, *arguments: str) -> str:
    """Call the simulator, and return what it prints.

    Raises
    ------
    ContractError
        It fails: with ``fault`` and the last line of what it says.
    """
    command = [sys.executable, "-m", PROGRAM, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        said = (done.stderr.strip() or "it failed without a word").splitlines()[-1]
        raise ContractError([Finding("error", PROGRAM, f"{fault}: {said}")])
    return done.stdout


def hidden(words: str, kind: str) -> list[str]:
    """Read an effect as a call gives it; return it as the simulator is given it.

    Parameters
    ----------
    words : ``NAME`` or ``NAME:PARAMETER=VALUE,…``.
    kind : of the batch, a key of :func:`simulated`.

    Raises
    ------
    CallError
        There is no such effect of that kind, or no such parameter; one is missing, or is not a number.
    """
    name, _, settings = words.partition(":")
    if name not in simulated()[kind]:
        raise _no_effect(name, kind)
    # Only a comma before the next parameter parts: a list of numbers has commas, too.
    given = dict(_pair(name, one) for one in re.split(r",(?=\s*[a-z_]+=)", settings) if settings)
    known = dict(parameters(name, kind))
    for parameter in given:
        if parameter not in known:
            hint = suggestion(parameter, known) or f", expected {', '.join(known)}"
            raise wrong_call(f"--effect {name}", f"{parameter}: is no parameter of it{hint}")
    read = [f"{one}={_value(name, one, known[one], value)}" for one, value in given.items()]
    missing = [one for one, shape in known.items() if not shape.endswith("?") and one not in given]
    if given and missing:
        message = f"{', '.join(missing)}: missing. Give all parameters, or none: they are drawn then"
        raise wrong_call(f"--effect {name}", message)
    return [name, *read]


def parameters(name: str, kind: str) -> Iterator[tuple[str, str]]:
    """Yield the parameters of an effect, each with its shape, as :func:`simulated` has it behind the name."""
    yield from ENTRY.findall(simulated()[kind][name])


def _no_effect(name: str, kind: str) -> CallError:
    can = simulated()
    others = [other for other, known in can.items() if name in known]
    hint = f"; it is one of --kind {others[0]}" if others else suggestion(name, can[kind])
    expected = hint or f", expected one of: {', '.join(can[kind])}"
    return wrong_call("--effect", f"no effect {name!r} in a batch of --kind {kind}{expected}")


def _pair(name: str, setting: str) -> tuple[str, str]:
    parameter, equals, value = setting.partition("=")
    if not equals:
        raise wrong_call(f"--effect {name}", f'found "{setting}", expected PARAMETER=VALUE')
    return parameter.strip(), value.strip()


def _value(name: str, parameter: str, shape: str, text: str) -> str:
    """Return a value as JSON, as the simulator reads it."""
    if shape.startswith("="):
        choices = shape.strip("=?").split("|")
        expected, sound = f"one of: {', '.join(choices)}", text.strip('"') in choices
        value: Any = text.strip('"')
        value = int(value) if value.isdigit() else value
    else:
        value, count = _read(text), shape.strip("[]?")
        many = shape.startswith("[")
        expected = f"{count or 'some'} numbers, as [1.5,2,…]" if many else "a number, as 12.5"
        sound = _numbers(value, count) if many else _number(value)
    if not sound:
        raise wrong_call(f"--effect {name}", f'{parameter}: found "{text}", expected {expected}')
    return json.dumps(value)


def _read(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return None


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _numbers(value: Any, count: str) -> bool:
    right = isinstance(value, list) and len(value) > 0 and all(map(_number, value))
    return right and (not count or len(value) == int(count))
