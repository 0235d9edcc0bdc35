"""A run on a model: loads in, temperatures, TCP error and heat balance out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from twin.errors import TwinError
from twin.face.inputs import Quantity, name_of, positive, quantity, run_of
from twin.progress import Progress, reporter

if TYPE_CHECKING:
    import numpy as np

    from twin.face.model import Model
    from twin.face.result import Result
    from twin.logs.run import Run


@dataclass(frozen=True)
class Checkpoints:
    """States on disk, so that an interrupted run goes on with exactly the same numbers; needs an output folder."""

    checkpoint: int = 1440  # steps between them
    resume: bool = False  # take up what is there, else start afresh


def run(
    model: Model | str | Path,
    run: Run | str | Path,
    output: str | Path | None = None,
    *,
    dt: Quantity = "60 s",
    substeps: int | None = None,
    initial: Result | np.ndarray | Quantity | None = None,
    checkpoints: Checkpoints | None = None,
    progress: Progress | bool | None = None,
) -> Result:
    """Step a model through the loads of a run; `model.run(RUN)` is the same.

    output: folder for result.h5, temperatures.csv, tcp.csv and summary.json. dt: of a step, taken in so many `substeps`
    of the integrator; by default as many as the model is certified with. initial: temperature at the start ("20 degC"),
    or what to go on from: a result, its final state (N,), or the path of a result.h5; by default the run's own, else
    that of the air around it.
    Raises LogError for missing signals and bad times, TwinError for results and checkpoints of another model.

    >>> import twin
    >>> model = twin.build("tests/machines/spindle", options=twin.BuildOptions(held_out=4))
    >>> result = twin.run(model, "tests/machines/spindle/runs/warm_up")
    >>> result.temperatures.sel(sensor="front").max().round(1).item()  # degC
    39.3
    >>> result.tcp.dims, result.tcp.attrs["units"]
    (('time', 'x', 'component'), 'm')
    """
    from twin.run.replay import replay  # isort: skip  first: it prepares JAX before NumPy is loaded

    from twin import __version__
    from twin.atomic import check_folder
    from twin.face.model import read
    from twin.face.result import Result
    from twin.run.checkpoint import CheckpointFolder
    from twin.run.results import refuse_run_folder

    loaded = read(model)
    step = positive("dt", dt, "s")
    start = _start(loaded, initial)
    kept = None
    if output is not None:
        folder = Path(output)
        check_folder(folder)
        refuse_run_folder(folder)
        how = checkpoints or Checkpoints()
        kept = CheckpointFolder(folder / "checkpoints", how.checkpoint, how.resume)
    elif checkpoints is not None:
        raise TwinError("checkpoints have no folder to lie in", "checkpoints", "name the folder: output='out/run'")
    numbers = replay(loaded.artefact, run_of(run), step, substeps, start, kept, reporter(progress))
    facts = {
        "machine": loaded.name,
        "artefact": loaded.source,
        "run": name_of(run),
        "initial": initial
        if isinstance(initial, str | float | int)
        else "from the run"
        if initial is None
        else "given",
        "twin": __version__,
    }
    result = Result(loaded, numbers, facts)
    if output is not None:
        result.save(output)
    if kept is not None:
        kept.clear()  # the results hold all of it
    return result


def _start(model: Model, initial: Result | np.ndarray | Quantity | None) -> float | np.ndarray | None:
    """The temperature [degC] or state (N,) that `initial` means."""
    from twin.face.result import Result
    from twin.run.results import read_final_state
    from twin.units import machine_temperature

    if isinstance(initial, Result):
        if initial.numbers.artefact != model.artefact.digest:
            raise TwinError("a result of another model", "initial", "give a result of this one, or a temperature")
        return initial.final_state
    if isinstance(initial, str) and initial.endswith(".h5"):
        return read_final_state(Path(initial), model.artefact.digest)
    if not isinstance(initial, str | float | int):
        return initial
    start = quantity("--initial", initial, "degC")
    try:
        return machine_temperature(start)
    except ValueError as e:
        raise TwinError(f"{initial}: {e}", "--initial", "write --initial '20 degC', for example") from e
