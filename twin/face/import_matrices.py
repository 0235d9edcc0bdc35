"""Matrices that another program assembled become an artefact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from twin.face.model import Model, read, refuse_other_files
from twin.progress import Progress, reporter

if TYPE_CHECKING:
    from twin.build.matrices.model import MatrixOptions
    from twin.build.pipeline import BuildOptions

FILMS = 24  # that snapshots are made at


@dataclass(frozen=True)
class Imported:
    """The reduced model, and what the self-tests of its matrices found."""

    model: Model
    told: tuple[str, ...]

    def __str__(self) -> str:
        signals = ", ".join(f"{s.column} [{s.unit}]" for s in self.model.artefact.model.load_model.signals)
        wrote = f"wrote {self.model.source}"
        return "\n".join([*self.told, wrote, *self.model.certificate.lines(), f"loads.csv of a run holds {signals}"])


def import_matrices(
    files: Sequence[str | Path],
    output: str | Path,
    matrices: MatrixOptions | None = None,
    options: BuildOptions | None = None,
    progress: Progress | bool | None = None,
) -> Imported:
    """Test matrices of a thermal model, reduce and certify them, and write the artefact (docs/matrices.md).

    files: Matrix Market, MATLAB or SciPy files, which are which by their names.
    Raises DescriptionError with everything that is wrong with them.
    """
    from twin.build.matrices.model import MatrixOptions
    from twin.build.matrices.product import import_matrices as make
    from twin.build.pipeline import BuildOptions

    refuse_other_files(Path(output))
    options = options or BuildOptions(states=100, training=FILMS)
    told = make([Path(f) for f in files], Path(output), matrices or MatrixOptions(), options, reporter(progress))
    return Imported(read(output), told)
