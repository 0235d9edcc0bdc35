"""What steps the machine: one face, two back ends (`engine_c`, `engine_jax`)."""

from __future__ import annotations

from array import array
from typing import Protocol

from twin.errors import TwinError
from twin.live.facts import Facts


class EngineFailure(TwinError):
    """What was computed cannot be: the correction goes to neutral."""

    status = 1


class Engine(Protocol):
    """A machine that is fed rows of a log; s channels. Values hold until the next row, axes move straight to it."""

    facts: Facts

    def start(self, temperature: float) -> None:
        """The whole machine at one temperature [degC], at time zero."""

    def feed(self, times: array[float], rows: array[float]) -> int:
        """Rows (n * s) [SI, as logged; NaN: no value] at increasing times (n,) [s]; how many steps were completed.

        Raises EngineFailure where temperatures or the heat balance are beyond reason.
        """

    @property
    def steps(self) -> int:
        """Complete ones since the start."""

    def sensors(self) -> list[float]:
        """degC at the end of the last step, in the order of `facts.sensors`."""

    def displacements(self) -> list[float]:
        """TCP displacement [m] at the end of the last step, tool minus work: 3 * pose + component."""

    def errors(self) -> list[float]:
        """What offsets are made of [m], per pose c of `Facts.offset_per_error`: these displacements, or of a platform
        by how much each of its struts is too long.
        """

    def states(self) -> list[float]:
        """Coordinates of the artefact at the end of the last step, bodies one after the other."""

    def flags(self) -> list[str]:
        """In what the last step was outside what was certified."""

    def balance(self) -> float:
        """How far the heat balance of the last step is off, as a share of what it exchanged."""

    def saved(self) -> bytes:
        """The state, from which `restore` goes on with the same numbers, bit by bit."""

    def restore(self, saved: bytes) -> None:
        """Raises TwinError for a state of another program."""
