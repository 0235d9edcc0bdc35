"""Damage at random, by a seed: to the text of descriptions and run folders, and to artefacts."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from twin.rom.content import ForeignContent, stamp

NUMBERS = (
    "0", "-1", "1e9", "-1e9", "1e200", "-1e-200", "1e400", "nan", "-inf", "9" * 400, "293.15", "0.1", "-0.0", "7",
    "1_000", "0x10", "1,5", "1e", "--1", "",
)  # fmt: skip
TEXTS = (
    "true", "[]", "{}", '""', "[1, 2]", '"x"', '"1 m"', '"-300 degC"', '"1e200 W/K"', '"9^9^9 m"', "1979-05-27", "'''",
    '"\\u0000"', "\x00", "\x1b[2J", "é", "\N{ZERO WIDTH SPACE}", "\r", "'; DROP", "[[", "=", "#", "a" * 5000, "[" * 500,
)  # fmt: skip
_NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")


def damaged_text(text: str, rng: random.Random) -> str:
    """One to three of: another number or word, a line less, twice or elsewhere, an odd character, the end cut off."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        text = rng.choice(_TEXT_DAMAGE)(text, rng)
    return text


def _number(text: str, rng: random.Random) -> str:
    found = list(_NUMBER.finditer(text))
    if not found:
        return text
    one = rng.choice(found)
    return text[: one.start()] + rng.choice(NUMBERS) + text[one.end() :]


def _value(text: str, rng: random.Random) -> str:
    """Of a TOML key, or a cell."""
    found = list(re.finditer(r"(?<== ).+|(?<=,)[^,\n]*", text))
    if not found:
        return text
    one = rng.choice(found)
    return text[: one.start()] + rng.choice(TEXTS + NUMBERS) + text[one.end() :]


def _word(text: str, rng: random.Random) -> str:
    found = list(re.finditer(r"[A-Za-z_]{3,}", text))
    if len(found) < 2:
        return text
    one, other = rng.sample(found, 2)
    return text[: one.start()] + other[0] + text[one.end() :]


def _lines(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    at, to = rng.randrange(len(lines)), rng.randrange(len(lines))
    how = rng.choice(("less", "twice", "elsewhere"))
    if how == "twice":
        lines.insert(to, lines[at])
    else:
        line = lines.pop(at)
        if how == "elsewhere":
            lines.insert(to, line)
    return "\n".join(lines)


def _character(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    return text[:at] + rng.choice(TEXTS) + text[at + rng.randrange(2) :]


def _cut(text: str, rng: random.Random) -> str:
    return text[: rng.randrange(len(text) + 1)]


_TEXT_DAMAGE: tuple[Callable[[str, random.Random], str], ...] = (_number, _number, _value, _value, _word, _lines,
                                                                _character, _cut)  # fmt: skip


def damaged_bytes(content: bytes, rng: random.Random) -> bytes:
    """Some bits flipped, a stretch overwritten, or the end cut off."""
    if rng.random() < 0.1:
        return content[: rng.randrange(len(content))]
    changed = bytearray(content)
    if rng.random() < 0.2:
        at = rng.randrange(len(content))
        changed[at : at + 64] = rng.randbytes(min(64, len(content) - at))
    else:
        for _ in range(rng.choice((1, 1, 2, 8))):
            changed[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def edit_artefact(path: Path, rng: random.Random) -> None:
    """Change something with h5py, as somebody would who then makes the hash anew."""
    with h5py.File(path, "r+") as f:
        names: list[str] = []
        f.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        kind = rng.random()
        if kind < 0.5:
            _edit_json(f, rng.choice(("load_model", "load_model", "parameters", "certificate/json")), rng)
        elif kind < 0.9:
            _edit_numbers(f, rng.choice(names), rng)
        else:
            del f[rng.choice(names)]
    with h5py.File(path, "r+") as f, suppress(ForeignContent):  # refused before the hash is looked at
        stamp(f)


def _edit_numbers(f: h5py.File, name: str, rng: random.Random) -> None:
    values = f[name][()]
    if not isinstance(values, np.ndarray | np.number) or np.asarray(values).dtype.kind not in "if":
        f.attrs["more"] = 1.0
        return
    array = np.array(values)
    how = rng.choice(("scale", "negate", "entry", "type", "shape", "nan"))
    if how == "type":
        array = array.astype(rng.choice(("f4", "i4", "c16", "S8", "f8")))
    elif how == "shape":
        array = array[..., None] if rng.random() < 0.5 else array.reshape(-1)[:-1]
    elif how == "entry" and array.size:
        flat = array.reshape(-1)
        flat[rng.randrange(flat.size)] = rng.choice((0, -1, 7, 1000))
    elif how == "nan" and array.dtype.kind == "f":
        array = array * np.nan
    else:
        array = array * (-1 if how == "negate" else rng.choice((0, 2, 1000)))
    del f[name]
    f[name] = array


def _edit_json(f: h5py.File, name: str, rng: random.Random) -> None:
    """Another value in place of a leaf, an entry less, or an entry more."""
    data = json.loads(f[name].asstr()[()])
    place: Any = data
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        if not keys:
            return
        key = rng.choice(keys)
        if not isinstance(place[key], dict | list) or rng.random() < 0.1:
            break
        place = place[key]
    if rng.random() < 0.1:
        del place[key]
    else:
        place[key] = rng.choice(
            (0, -1, 99, 0.5, 1e200, float("nan"), float("inf"), 10**400, True, None, "", "x", "a\0b", [], {}, [1.0])
        )
    del f[name]
    f[name] = json.dumps(data)
