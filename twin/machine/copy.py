"""The files that a description needs, copied beside a changed copy of its text."""

from __future__ import annotations

import shutil
from pathlib import Path

from twin.machine.description import Machine
from twin.machine.extend import changed


def with_files(text: str, machine: Machine, new: Path, mark: str = "found") -> str:
    """Copy meshes and scripts into the folder `new`; a mesh that lies elsewhere is named by its absolute path.

    mark: who changed the text, "found" or "hidden" (`twin.machine.extend.changed`).
    """
    folder = machine.folder.resolve()
    for script in folder.glob("*.py"):
        shutil.copyfile(script, new / script.name)
    for name, part in machine.parts.items():
        if part.mesh is None:
            continue
        mesh = (folder / part.mesh).resolve()
        if not mesh.is_relative_to(folder) or Path(part.mesh).is_absolute():
            text = changed(text, {f"parts.{name}.mesh": str(mesh)}, mark)
            continue
        copy = new / mesh.relative_to(folder)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(mesh, copy)
    return text
