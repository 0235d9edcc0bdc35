"""From a description to a certified reduced model."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from twin.face.machine import Machine, warn
from twin.face.model import Model, read, refuse_other_files
from twin.progress import Progress, reporter

if TYPE_CHECKING:
    from twin.build.pipeline import BuildOptions


def build(
    machine: Machine | str | Path,
    output: str | Path | None = None,
    options: BuildOptions | None = None,
    progress: Progress | bool | None = None,
) -> Model:
    """Reduce a machine to a compact model and certify it against the rich model on held-out scenarios.

    output: artefact to write; without it the model is in memory only, see `Model.save`. Whether the certificate keeps
    the machine's limits is told by `model.certificate.passed`. Warnings about the machine go to standard error.
    Raises TwinError with everything that `twin.check` calls an error.

    >>> import twin
    >>> machine = twin.load("tests/machines/spindle")
    >>> model = twin.build(machine, options=twin.BuildOptions(held_out=4))
    >>> model.states
    22
    >>> model.certificate.passed
    True
    """
    from twin.build.pipeline import BuildOptions
    from twin.build.product import build_artefact

    options, report = options or BuildOptions(), reporter(progress)
    if output is not None:
        refuse_other_files(Path(output))
    path = warn(machine).unchanged()
    if output is not None:
        build_artefact(path, Path(output), options, report)
        return read(output)
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "model.h5"
        build_artefact(path, target, options, report)
        return Model(read(target).artefact)
