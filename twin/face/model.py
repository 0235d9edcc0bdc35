"""A reduced model: what `twin build` makes, and everything else starts from."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.errors import TwinError
from twin.face.certificate import Certificate
from twin.face.inputs import Quantity

if TYPE_CHECKING:
    import numpy as np

    from twin.build.pipeline import BuildOptions
    from twin.face.machine import Machine
    from twin.face.result import Result
    from twin.face.run import Checkpoints
    from twin.logs.run import Run
    from twin.progress import Progress
    from twin.rom.artefact import Artefact


@dataclass(frozen=True)
class Model:
    """An artefact, in memory; `source` is the file it came from, "" where it was never saved."""

    artefact: Artefact = field(repr=False)
    source: str = ""

    @property
    def name(self) -> str:
        """Of the machine."""
        return self.artefact.model.name

    @property
    def states(self) -> int:
        """How many the whole machine has."""
        return self.artefact.model.n

    @property
    def bodies(self) -> dict[str, int]:
        """States of each body."""
        return {body.name: body.n for body in self.artefact.model.bodies}

    @property
    def sensors(self) -> tuple[str, ...]:
        """Structural sensors, then those in the air."""
        return self.artefact.model.all_sensors

    @property
    def parameters(self) -> dict[str, float]:
        """What measurements may correct, by dotted path: values, SI."""
        return {p.path: p.nominal for p in self.artefact.parameters}

    @property
    def description(self) -> str:
        """The machine.toml that it was built from, as text."""
        return self.artefact.description

    @property
    def provenance(self) -> dict[str, str]:
        """Hashes of what it was made from, versions, the command."""
        return self.artefact.provenance

    @property
    def certificate(self) -> Certificate:
        """What the model claims about itself."""
        return Certificate(self.artefact.certificate)

    def facts(self) -> dict[str, Any]:
        """What it holds as JSON values: orders, poses, parameters, certified ranges, certificate, provenance."""
        from twin.face.facts import facts

        return facts(self.artefact)

    def save(self, path: str | Path) -> Model:
        """Write the artefact; returns the model of that file.

        Raises TwinError where the file cannot be written, or exists and is no artefact.
        """
        from datetime import datetime

        from twin.rom.artefact import write_artefact

        refuse_other_files(Path(path))
        a = self.artefact
        created = datetime.fromisoformat(a.created) if a.created else None
        write_artefact(
            Path(path), a.model, a.description, a.certificate, a.provenance, a.fields, created, parameters=a.parameters
        )
        return replace(self, source=str(path))

    def run(
        self,
        run: Run | str | Path,
        output: str | Path | None = None,
        *,
        dt: Quantity = "60 s",
        substeps: int | None = None,
        initial: Result | np.ndarray | Quantity | None = None,
        checkpoints: Checkpoints | None = None,
        progress: Progress | bool | None = None,
    ) -> Result:
        """Step the model through the loads of a run: `twin.run`."""
        from twin.face.run import run as step

        return step(
            self, run, output, dt=dt, substeps=substeps, initial=initial, checkpoints=checkpoints, progress=progress
        )

    def verify(
        self,
        machine: Machine | str | Path | None = None,
        *,
        full: int = 2,
        mesh: bool = False,
        options: BuildOptions | None = None,
        progress: Progress | bool | None = None,
    ) -> Model:
        """The model with a certificate over held-out scenarios that it has never seen.

        machine: its description, where it is not where the model was built. full: how many of the scenarios are also
        stepped with the full model; 0: none, the certificate then says nothing about it. mesh: whether
        it states the error of the mesh too, which takes up to some minutes.
        Raises ArtefactError where the machine is gone, or another one, DescriptionError for `mesh` of a lumped one.
        """
        from twin.build.pipeline import BuildOptions as Options
        from twin.build.product import verified
        from twin.face.machine import Machine
        from twin.progress import reporter

        path = machine.path if isinstance(machine, Machine) else machine
        where = None if path is None else Path(path)
        result = verified(self.artefact, where, options or Options(), full, reporter(progress), mesh=mesh)
        return replace(self, artefact=replace(self.artefact, certificate=result.to_json()))


def read(model: Model | str | Path) -> Model:
    """The model in an artefact; one that is read already, as it is.

    Raises ArtefactError where the file is missing, damaged, or no artefact of this program.

    >>> import twin
    >>> twin.build("tests/machines/spindle").save("out/spindle.h5")
    Model(source='out/spindle.h5')
    >>> model = twin.read("out/spindle.h5")
    >>> model.bodies
    {'bearing_front': 8, 'bed': 14}
    """
    from twin.rom.artefact import read_artefact

    if isinstance(model, Model):
        return model
    return Model(read_artefact(Path(model)), str(model))


def check_artefact(path: str | Path) -> tuple[str, ...]:
    """One line per check that the artefact in a file passes, with what was found.

    Raises ArtefactError, or DescriptionError for its laws, at the first that it does not.

    >>> import twin
    >>> from twin.face.model import check_artefact
    >>> twin.build("tests/machines/spindle").save("out/spindle.h5")
    Model(source='out/spindle.h5')
    >>> check_artefact("out/spindle.h5")[-1]
    'laws: 4 losses, 3 films: laws known, arguments given, parameters within bounds'
    """
    from twin.rom.artefact import checked_artefact
    from twin.rom.check_laws import check_laws

    artefact, told = checked_artefact(Path(path))
    return (*told, f"laws: {check_laws(artefact.model.load_model)}")


def refuse_other_files(path: Path) -> None:
    """Raises TwinError where `path` is no place for an artefact: no file, not writable, or a file of another kind."""
    import h5py

    from twin.atomic import check_file

    check_file(path)
    if path.suffix in (".toml", ".msh", ".csv"):
        raise TwinError("would replace an input", str(path), "name an artefact with -o, for example -o out/machine.h5")
    if path.is_file() and path.stat().st_size and not h5py.is_hdf5(path):
        raise TwinError("exists and is no artefact", str(path), "name a new file with -o; it would be replaced")
