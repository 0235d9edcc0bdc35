"""A machine as its description tells it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from twin.errors import TwinError

if TYPE_CHECKING:
    from twin.machine.description import Machine as Description


@dataclass(frozen=True)
class Machine:
    """A description that was read and cross-checked; its meshes are read when it is built."""

    path: Path  # the file
    text: str = field(repr=False)  # what it holds, instances written out
    description: Description = field(repr=False)  # the same as types, SI

    @property
    def name(self) -> str:
        return self.description.machine.name

    @property
    def bodies(self) -> dict[str, tuple[str, ...]]:
        """Bodies and their members: parts joined by fixed contacts; nodes and bars of a lumped machine."""
        from twin.machine.bodies import bodies_of

        return {body.name: tuple(body.parts) for body in bodies_of(self.description)}

    @property
    def parameters(self) -> dict[str, float]:
        """What measurements may correct, by dotted path: nominal values, SI."""
        from twin.machine.parameters import parameters

        return {p.path: p.nominal for p in parameters(self.description)}

    def edited(self, values: Mapping[str, float], path: str | Path) -> Machine:
        """This description with other values of `parameters` (SI), written to the file `path`.

        Comments, order and units stay. Meshes are looked for beside the new file.
        Raises DescriptionError for paths that are no parameters and values out of bounds, TwinError where it would
        replace this description.
        """
        from twin.atomic import atomic_path
        from twin.machine.edit import edited

        path = Path(path)
        if path.exists() and path.samefile(self.path):
            raise TwinError("would replace the description it starts from", str(path), "name another file")
        text = edited(self.text, values)
        with atomic_path(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
        return load(path)

    def unchanged(self) -> Path:
        """The file, for who reads it again. Raises DescriptionError where it is not what was loaded."""
        from twin.errors import DescriptionError
        from twin.machine.instances import written_out
        from twin.machine.load import read_text

        if written_out(read_text(self.path)) != self.text:
            raise DescriptionError("has changed since it was loaded", str(self.path), "load it again: twin.load(PATH)")
        return self.path


def load(machine: Machine | str | Path) -> Machine:
    """The machine described by a file, or by machine.toml in a folder; a machine that is loaded already, as it is.

    Raises DescriptionError with one problem per mistake, each with file, key, line and remedy.

    >>> import twin
    >>> machine = twin.load("tests/machines/spindle")
    >>> machine.name
    'spindle'
    >>> list(machine.description.sources)
    ['front', 'rear', 'motor', 'nut']
    >>> machine.parameters["contacts.flange.total"]  # W/K
    8.0
    """
    from twin.machine.instances import written_out
    from twin.machine.load import load_machine, read_text

    if isinstance(machine, Machine):
        return machine
    path = Path(machine)
    path = path / "machine.toml" if path.is_dir() else path
    text = read_text(path)
    description = load_machine(path, text)
    return Machine(path, written_out(text), description)


def sound(machine: Machine | str | Path) -> tuple[Machine, list[str]]:
    """A machine without errors in description and meshes, and the warnings of `twin.check` about it, in words.

    Raises TwinError with all errors, by file, key and line: no certificate would show a wrong unit.
    """
    from twin.build.check_meshes import check_meshes
    from twin.machine.check import check_machine
    from twin.machine.load import located

    loaded = load(machine)
    found = [*check_machine(loaded.description), *check_meshes(loaded.description).problems]
    problems = located(loaded.path, found)
    if errors := [p for p in problems if not p.warning]:
        raise TwinError.collect(errors)
    return loaded, [str(p) for p in problems]


def warn(machine: Machine | str | Path) -> Machine:
    """The same, its warnings told on standard error."""
    import sys

    loaded, warnings = sound(machine)
    for warning in warnings:
        print(warning, file=sys.stderr)
    return loaded
