"""JSON values as the dataclasses they were written from, every type checked: text is no number, and 1e200 is no length.

Python would take the JSON of a damaged artefact as it comes, and the mistake would show much later, as a wrong number.
"""

from __future__ import annotations

import math
import types
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from twin.rom.names import has_control_characters
from twin.units import LARGEST


def filled(kind: Any, value: Any, where: str) -> Any:
    """The value of type `kind` that a JSON value stands for; `where` is its place, for messages.

    kind: a dataclass, a tuple or dict of types, a type or None, a literal, a numpy array (its shape and its numbers in
    C order), float, int, bool or str. Keys of dataclasses may lack where there is a default; unknown keys are refused.
    Raises TypeError for another type, ValueError for a number that is not finite or beyond LARGEST, and for control
    characters.
    """
    origin = get_origin(kind)
    if kind is np.ndarray:
        return _array(value, where)
    if is_dataclass(kind) and isinstance(kind, type):
        return _dataclass(kind, value, where)
    if origin is tuple:
        return _tuple(get_args(kind), value, where)
    if origin is dict:
        own = get_args(kind)[1]
        return {filled(str, k, where): filled(own, v, f"{where}.{k}") for k, v in _of(dict, value, where).items()}
    if origin in (Union, types.UnionType):
        (own,) = (a for a in get_args(kind) if a is not types.NoneType)
        return None if value is None else filled(own, value, where)
    if origin is Literal:
        if value not in get_args(kind):
            raise TypeError(f"'{where}': {_shown(value)} is none of {', '.join(map(str, get_args(kind)))}")
        return value
    return _number(value, where) if kind is float else _plain(kind, value, where)


def _dataclass(kind: Any, value: Any, where: str) -> Any:
    given, hints = _of(dict, value, where), get_type_hints(kind)
    known = {field.name: field for field in fields(kind)}
    unknown = [name for name in given if name not in known]
    missing = [n for n, f in known.items() if n not in given and f.default is MISSING and f.default_factory is MISSING]
    if unknown or missing:
        what = f"has no '{unknown[0]}'" if unknown else f"lacks '{missing[0]}'"
        raise TypeError(f"'{where}': a {kind.__name__} {what}")
    return kind(**{name: filled(hints[name], own, f"{where}.{name}") for name, own in given.items()})


def _tuple(kinds: tuple[Any, ...], value: Any, where: str) -> tuple[Any, ...]:
    entries = _of(list, value, where)
    if kinds[-1] is Ellipsis:
        return tuple(filled(kinds[0], v, f"{where}[{i}]") for i, v in enumerate(entries))
    if len(entries) != len(kinds):
        raise TypeError(f"'{where}' has {len(entries)} entries, not {len(kinds)}")
    return tuple(filled(k, v, f"{where}[{i}]") for i, (k, v) in enumerate(zip(kinds, entries, strict=True)))


def _array(value: Any, where: str) -> np.ndarray:
    """Whole numbers stay whole: indices are told from lengths by how they are written."""
    given = _of(dict, value, where)
    numbers = _of(list, given.get("values"), where)
    for i, number in enumerate(numbers):
        _number(number, f"{where}[{i}]")
    shape = [_plain(int, n, f"{where}.shape") for n in _of(list, given.get("shape"), where)]
    if math.prod(shape) != len(numbers) or any(n < 0 for n in shape):
        raise ValueError(f"'{where}' has {len(numbers)} numbers for the shape {shape}")
    return np.array(numbers, dtype=None if numbers else float).reshape(shape)


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"'{where}': {_shown(value)} is no number")
    if not abs(value) <= LARGEST:  # NaN is no less
        raise ValueError(f"'{where}': {_shown(value)} is beyond all reason")
    return float(value)


def _plain(kind: Any, value: Any, where: str) -> Any:
    if type(value) is not kind:
        raise TypeError(f"'{where}': {_shown(value)} is no {kind.__name__}")
    if kind is int:
        _number(value, where)
    elif kind is str and has_control_characters(value):
        raise ValueError(f"'{where}': {_shown(value)} holds control characters")
    return value


def _of(kind: type, value: Any, where: str) -> Any:
    if not isinstance(value, (list, tuple) if kind is list else kind):  # tuples: what is not yet written
        raise TypeError(f"'{where}': {_shown(value)} is no {'object' if kind is dict else 'list'}")
    return value


def _shown(value: Any) -> str:
    """How a value is shown in a message; Python refuses to print whole numbers of some thousand digits."""
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 64:
        return f"a whole number of {value.bit_length()} bits"
    return repr(value)[:60]
