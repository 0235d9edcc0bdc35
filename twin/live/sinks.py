"""Where a correction goes: a file, a ring in shared memory, nodes of an OPC UA server; one small interface."""

from __future__ import annotations

import json
import os
import struct
from array import array
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from twin.errors import TwinError
from twin.live.block import Block
from twin.live.facts import Facts
from twin.live.offsets import Form, Values
from twin.live.ring import RingReader, RingWriter

FORMAT = "twin live correction"


@dataclass(frozen=True)
class Sent:
    """A correction as it goes out."""

    count: int  # from one on since the process started: a heartbeat
    written: float  # s, POSIX
    good_until: float  # s, POSIX: later than that, whoever reads it must go to neutral by itself
    mode: str  # of twin.live.publisher.MODES
    words: str  # why
    values: Values  # m
    block: int = -1  # number of the last block that went into the model


class Sink(Protocol):
    """One place that a control reads."""

    name: str

    def last(self) -> Values | None:
        """What stands there, to go on from; None where nothing readable does."""

    def write(self, sent: Sent) -> None:
        """Raises OSError, ConnectionError among them: it is tried again at the next step."""

    def close(self) -> None: ...


def told_of(sent: Sent, facts: Facts, form: Form) -> dict[str, Any]:
    """A correction as JSON values, with all that it takes to evaluate it."""
    return {
        "format": FORMAT,
        "machine": facts.machine,
        "artefact": facts.digest,
        "count": sent.count,
        "block": sent.block,
        "written": sent.written,
        "good_until": sent.good_until,
        "mode": sent.mode,
        "words": sent.words,
        "form": form,
        "unit": "m",
        "pose_grid_m": {a.name: list(g) for a, g in zip(facts.axes, facts.pose_grid, strict=True)},
        "axes": [{"name": a.name, "centre_m": a.centre, "half_range_m": a.half_range, "degree": a.degree}
                 for a in facts.axes],
        "offsets": {a.name: list(v) for a, v in zip(facts.axes, sent.values, strict=True)},
    }  # fmt: skip


def values_in(told: Any, facts: Facts, form: Form) -> Values | None:
    """The offsets in what `told_of` made; None of anything else, of other artefacts and forms."""
    try:
        same = told["format"] == FORMAT and told["artefact"] == facts.digest and told["form"] == form
        return tuple(tuple(float(v) for v in told["offsets"][a.name]) for a in facts.axes) if same else None
    except (ValueError, KeyError, TypeError):
        return None


def _refuse_device(path: Path) -> None:
    """A rename would put a file in its place: /dev/null would be gone."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise TwinError("is a pipe or device, not an ordinary file", str(path), "name a file with --out")


class FileSink:
    """JSON, replaced as a whole: a reader sees the one before or this one."""

    def __init__(self, facts: Facts, form: Form, path: Path):
        """Raises TwinError where the folder cannot be written."""
        self.name, self.facts, self.form, self.path = f"file:{path}", facts, form, path
        self._part = path.with_name(f".{path.name}.part")
        _refuse_device(path)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as e:
            raise TwinError(f"cannot write: {e.strerror or e}", str(path), "choose another --out") from e
        if path.is_dir():
            raise TwinError("is a folder, not a file", str(path), "write --out file:out/correction.json")

    def last(self) -> Values | None:
        try:
            return values_in(json.loads(self.path.read_text(encoding="utf-8")), self.facts, self.form)
        except (OSError, ValueError):
            return None

    def write(self, sent: Sent) -> None:
        self._part.write_text(json.dumps(told_of(sent, self.facts, self.form)), encoding="utf-8")
        os.replace(self._part, self.path)  # no fsync: after a power failure the control is at neutral anyway

    def close(self) -> None:
        return


class RingSink:
    """The newest of a ring of blocks (`twin.live.ring`): one record of mode, good_until, block and all values."""

    def __init__(self, facts: Facts, form: Form, path: Path):
        """Raises TwinError where the ring cannot be made."""
        self.name, self.facts, self.form = f"ring:{path}", facts, form
        _refuse_device(path)
        n = facts.poses if form == "grid" else len(facts.fit)
        self.names = ("mode", "good_until", "block", *(f"{a.name}_{k}" for a in facts.axes for k in range(n)))
        self.units = ("1", "s", "1", *("m" for _ in facts.axes for _ in range(n)))
        self._before = self._read(path)
        self._ring = RingWriter(path, slots=8, slot=4096 + 64 * len(self.names))
        self._stream = struct.unpack("<Q", os.urandom(8))[0]

    def _read(self, path: Path) -> Values | None:
        try:
            reader = RingReader(path)
        except TwinError:
            return None
        try:
            found = reader.newest()
        finally:
            reader.close()
        if found is None or found.names != self.names:
            return None
        values, n = list(found.values)[3:], (len(self.names) - 3) // len(self.facts.axes)
        return tuple(tuple(values[k : k + n]) for k in range(0, len(values), n))

    def last(self) -> Values | None:
        return self._before

    def write(self, sent: Sent) -> None:
        from twin.live.publisher import MODES

        head = [float(MODES.index(sent.mode)), sent.good_until, float(sent.block)]
        values = array("d", [*head, *(v for axis in sent.values for v in axis)])
        block = Block(self._stream, sent.count, sent.written, 1.0, self.names, self.units, values)
        self._ring.write(block)

    def close(self) -> None:
        self._ring.close()
