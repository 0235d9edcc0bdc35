"""A machine of one's own, begun from a template: a description whose comments teach, a run, a schema for editors."""

from __future__ import annotations

import re
import shutil
from dataclasses import dataclass
from pathlib import Path

from twin.errors import DescriptionError
from twin.nearest import did_you_mean

FOLDER = Path(__file__).parents[1] / "templates"
TEMPLATES = ("box", "three_axis", "lumped")
SCHEMA = "machine.schema.json"


@dataclass(frozen=True)
class Begun:
    """A folder with a machine that builds, and what to do with it."""

    folder: Path

    def __str__(self) -> str:
        artefact, run = f"{self.folder}.h5", self.folder / "runs" / "first"
        return "\n".join(
            [
                f"wrote {self.folder / 'machine.toml'}, {SCHEMA} for editors, and {run}",
                f"next: twin check {self.folder} && twin build {self.folder} -o {artefact} && twin verify {artefact}"
                f" && twin run {artefact} {run} -o {self.folder}_first",
            ]
        )


def from_template(template: str, output: str | Path) -> Begun:
    """Begin a machine in a new folder: machine.toml, a schema that editors find, runs/first.

    template: one of TEMPLATES. The machine is called as the folder.
    Raises DescriptionError for an unknown template, a folder that holds something, a name that is none.
    """
    from twin.atomic import atomic_folder
    from twin.machine.load import write_schema

    if template not in TEMPLATES:
        remedy = did_you_mean(template, TEMPLATES, "templates")
        raise DescriptionError(f"no template '{template}'", "--template", remedy)
    target = Path(output)
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise DescriptionError("is there already", str(target), "choose a new folder")
    name = target.resolve().name
    if not re.fullmatch(r"[\w.-]+", name):
        raise DescriptionError(f"'{name}' is no name of a machine", str(target), "use letters, digits, _ . and -")
    with atomic_folder(target) as folder:
        shutil.copytree(FOLDER / template, folder, dirs_exist_ok=True)
        path = folder / "machine.toml"
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace("#:schema SCHEMA", f"#:schema ./{SCHEMA}").replace("NAME", name), encoding="utf-8")
        write_schema(folder / SCHEMA)
    return Begun(target)
