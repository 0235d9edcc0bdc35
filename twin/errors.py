"""Errors a user can act on: what is wrong, where, and the remedy.

The command line prints them in one block and exits with their status: 2 where the input is bad, 1 where a check of what
was computed has failed; no traceback.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Problem:
    """One thing wrong with an input."""

    what: str  # "unknown material 'stel'"
    where: str  # "machine.toml: parts.bed.material (line 12)"
    remedy: str  # "did you mean 'steel'? materials are: cast_iron, steel"
    warning: bool = False  # worth a look, but results can be had; `twin check` prints it and still exits with 0

    def __str__(self) -> str:
        kind = "warning: " if self.warning else ""
        where = f"{self.where}: " if self.where else ""
        return f"{kind}{where}{self.what}" + (f"\n    remedy: {self.remedy}" if self.remedy else "")


class TwinError(Exception):
    """An error with a remedy; `problems` holds one entry per independent mistake."""

    status = 2  # of the command

    def __init__(self, what: str, where: str = "", remedy: str = "", problems: tuple[Problem, ...] = ()):
        self.problems = problems or (Problem(what, where, remedy),)
        super().__init__(what)

    def __str__(self) -> str:
        return "\n".join(str(p) for p in self.problems)

    @classmethod
    def collect(cls, problems: list[Problem]) -> TwinError:
        """One error out of all problems found, so that a user fixes them in one go."""
        return cls(f"{len(problems)} problem(s)", problems=tuple(problems))


class DescriptionError(TwinError):
    """The machine description or its meshes are wrong."""


class LogError(TwinError):
    """A run folder is wrong."""


class ArtefactError(TwinError):
    """An artefact cannot be read."""


class FailedCheck(TwinError):
    """What was computed cannot be: it is not given out."""

    status = 1


class ModelError(TwinError):
    """A model cannot be built or solved from otherwise valid input."""
