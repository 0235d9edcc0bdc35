"""The C back end: the code of `twin export --format c` as a library, called through ctypes; no JAX, no NumPy."""

from __future__ import annotations

import ctypes
from array import array
from pathlib import Path

from twin.errors import TwinError
from twin.live.engine import EngineFailure
from twin.live.facts import Facts

_WHAT = {
    -1: "a signal without a default has no value yet",
    -2: "time does not increase",
    -3: "temperatures are beyond reason",
    -4: "the heat balance is off",
    -5: "a matrix cannot be factored",
}


class CEngine:
    """A machine in a library that `twin.live.prepare` has compiled."""

    def __init__(self, facts: Facts, library: Path):
        """Raises TwinError where the library cannot be loaded."""
        self.facts = facts
        try:
            code = ctypes.CDLL(str(library))
        except OSError as e:
            remedy = "remove its folder: it is compiled again (or compile it on a computer of this kind)"
            raise TwinError(f"cannot be loaded: {e}", str(library), remedy) from e
        real, machine = ctypes.c_double, ctypes.c_void_p

        def function(name: str, result: object, *arguments: object) -> ctypes._NamedFuncPointer:
            found = getattr(code, f"{facts.prefix}_live_{name}")
            found.restype, found.argtypes = result, list(arguments)
            return found

        self._start = function("start", None, machine, real, real)
        self._feed = function("feed", ctypes.c_int, machine, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)
        self._steps = function("steps", ctypes.c_long, machine)
        self._balance = function("balance", real, machine)
        self._sensors = function("sensors", ctypes.POINTER(real), machine)
        self._states = function("states", ctypes.POINTER(real), machine)
        self._state_count = int(function("state_count", ctypes.c_int)())
        self._flags = function("flags", ctypes.POINTER(ctypes.c_ubyte), machine)
        self._poses = function("poses", None, machine, ctypes.POINTER(real))
        self._errors = function("errors", None, machine, ctypes.POINTER(real))
        self._restore = function("restore", None, machine, ctypes.c_char_p)
        self._kept = int(function("saved", ctypes.c_size_t)())
        self._machine = ctypes.create_string_buffer(int(function("size", ctypes.c_size_t)()))
        self._moved = (real * (3 * facts.all_poses))()
        self._wrong = (real * (len(facts.offset_per_error[0]) * facts.all_poses))()

    def start(self, temperature: float) -> None:
        self._start(self._machine, temperature, self.facts.step)

    def feed(self, times: array[float], rows: array[float]) -> int:
        if not times:
            return 0
        done = self._feed(self._machine, len(times), times.buffer_info()[0], rows.buffer_info()[0])
        if done < 0:
            raise EngineFailure(_WHAT.get(done, f"error {done}"), "engine", "look at the log with `twin check`")
        return int(done)

    @property
    def steps(self) -> int:
        return int(self._steps(self._machine))

    def sensors(self) -> list[float]:
        return list(self._sensors(self._machine)[: len(self.facts.sensors)])

    def displacements(self) -> list[float]:
        self._poses(self._machine, self._moved)
        return list(self._moved)

    def errors(self) -> list[float]:
        self._errors(self._machine, self._wrong)
        return list(self._wrong)

    def states(self) -> list[float]:
        return list(self._states(self._machine)[: self._state_count])

    def flags(self) -> list[str]:
        raised = self._flags(self._machine)
        return [name for k, name in enumerate(self.facts.flags) if raised[k]]

    def balance(self) -> float:
        return float(self._balance(self._machine))

    def saved(self) -> bytes:
        return ctypes.string_at(self._machine, self._kept)

    def restore(self, saved: bytes) -> None:
        if len(saved) != self._kept:
            raise TwinError("the state is of another engine", "state", "start afresh with --fresh")
        self._restore(self._machine, saved)
