"""The same machine on other meshes: run the model's geometry.py at another size."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from twin.build.cache import folder
from twin.errors import DescriptionError
from twin.machine.description import Machine


def remesh(machine: Machine, size: float) -> Machine:
    """`machine` with every mesh file made anew at `size` [m]; files are kept in the cache folder.

    A model's geometry.py takes `--size METRES -o FOLDER` and writes the mesh files under the names machine.toml uses.
    Raises DescriptionError where there is none or it fails (gmsh missing, say), and for lumped machines.
    """
    if machine.lumped:
        remedy = "leave --size away; more `elements` of its bars are another discretisation"
        raise DescriptionError("a lumped machine has no mesh", "--size", remedy)
    script = machine.folder / "geometry.py"
    if not script.exists():
        raise DescriptionError("this model has no geometry.py", str(script), "leave --size away, or add the script")
    target = folder() / f"mesh-{machine.machine.name.replace(' ', '_')}-{size:g}"
    names = {name: Path(part.mesh).name for name, part in machine.parts.items() if part.mesh is not None}
    if not all((target / file).exists() for file in names.values()):
        done = subprocess.run(
            [sys.executable, str(script.resolve()), "--size", f"{size:g}", "-o", str(target)],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            last = (done.stderr or done.stdout).strip().splitlines()[-1:] or ["no message"]
            raise DescriptionError(
                f"geometry.py failed: {last[0]}", str(script), "install the mesh extra: pip install 'twin[mesh]'"
            )
    parts = {
        name: part.model_copy(update={"mesh": str((target / names[name]).resolve())}) if name in names else part
        for name, part in machine.parts.items()
    }
    return machine.model_copy(update={"parts": parts})
