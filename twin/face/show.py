"""The page of a machine as it is described, before anything is built."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from twin.face.machine import Machine, load


@dataclass(frozen=True)
class Shown:
    """The page that was written, and what it says is uncovered or wrong."""

    path: Path
    uncovered: tuple[str, ...]  # one line per part
    problems: tuple[str, ...]  # of surfaces without a use or with two

    def __str__(self) -> str:
        return "\n".join([*self.problems, *self.uncovered, str(self.path)])


def show(machine: Machine | str | Path, output: str | Path | None = None) -> Shown:
    """Write the page of a description: the machine to turn, with all that is named on it.

    output: NAME.html in the current folder by default. Nothing is assembled. Raises TwinError for a description or
    meshes that cannot be read, and for an output that is no ordinary file or is the description.
    """
    import re

    from twin.atomic import check_file
    from twin.errors import TwinError
    from twin.page.front import DESCRIBED, write_page
    from twin.show.content import described_told

    loaded = load(machine)
    path = Path(re.sub(r"[^\w.-]+", "_", loaded.name) + ".html" if output is None else output)
    check_file(path)
    if path.exists() and path.samefile(loaded.path):
        raise TwinError("would replace the description it shows", str(path), "name another file")
    told = described_told(loaded.description)
    write_page(path, told, DESCRIBED)
    return Shown(path, tuple(told["uncovered"]), tuple(told["problems"]))
