"""A machine from a log: run folders, a description, a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from twin.calibrate.members.find import Found, without_model
from twin.calibrate.propose.clean import cleaned
from twin.calibrate.propose.columns import Column, read_log
from twin.calibrate.propose.judge import Figure, Predicted, figures, follows, predictions
from twin.calibrate.propose.network import description
from twin.calibrate.propose.page import column_rows, driver_rows, figure_rows, sentence, text_table, write_page
from twin.errors import LogError
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.logs.write import write_run
from twin.progress import Progress, silent


@dataclass(frozen=True)
class NewOptions:
    """What the log does not say."""

    units: Mapping[str, str] = field(default_factory=dict)  # by column; "" leaves it out
    axes: Mapping[str, str] = field(default_factory=dict)  # "dx", "dy", "dz" -> column


@dataclass(frozen=True)
class New:
    """A proposed machine, and how it was found."""

    folder: Path
    columns: tuple[Column, ...]
    not_used: tuple[str, ...]
    found: Found
    predicted: tuple[Predicted, ...]
    figures: tuple[Figure, ...]

    def __str__(self) -> str:
        parts = [text_table(*column_rows(self.columns))] if self.columns else []
        parts += [f"not used: {line}" for line in self.not_used]
        parts += [sentence(self.found, ()), text_table(*driver_rows(self.found))]
        if self.figures:
            parts.append(text_table(*figure_rows(self.figures)))
        machine = self.folder / "machine.toml"
        parts.append(
            f"wrote {machine} and {self.folder / 'index.html'}; next: twin build {self.folder} -o {self.folder.name}.h5"
        )
        return "\n\n".join(parts)


def from_log(
    logs: Sequence[str | Path],
    output: str | Path,
    sealed: Sequence[str | Path] = (),
    options: NewOptions = NewOptions(),
    progress: Progress = silent,
) -> New:
    """Propose a machine that predicts what a log measured, as a lumped network of what follows what (docs/members.md).

    logs, sealed: CSV or XLSX files, or run folders; sealed ones are scored and never fitted to. output: a new folder
    with machine.toml, runs/ and index.html.

    Raises LogError for logs that cannot be understood, or hold no displacements or nothing to follow.
    """
    target = Path(output)
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise LogError("is there already", str(target), "choose a new folder with -o")
    columns: dict[str, Column] = {}
    runs = [_read(Path(log), options, columns) for log in logs]
    kept = [_read(Path(log), options, columns) for log in sealed]
    runs, told = cleaned(runs)
    used = {name for run in runs for name in _columns(run)}
    kept, also = cleaned(kept) if kept else ([], [])
    found = without_model(runs, progress)
    made = predictions(found, runs, kept)
    rows = figures(made)
    result = New(
        target, tuple(columns.values()), (*told, *(line for line in also if _concerns(line, used))), found, made, rows
    )
    _write(result, runs, kept)
    return result


def _write(new: New, runs: Sequence[Run], sealed: Sequence[Run]) -> None:
    from twin.atomic import atomic_folder

    tried = tuple(m.candidate for m in new.found.members)
    with atomic_folder(new.folder) as folder:
        text = description(new.folder.name, new.found, runs)
        (folder / "machine.toml").write_text(text, encoding="utf-8")
        for run in (*runs, *sealed):
            write_run(folder / "runs" / run.folder.name, run)
        write_page(
            folder / "index.html", new.folder.name, new.columns, new.not_used, new.found, follows(runs, tried),
            new.predicted, new.figures,
        )  # fmt: skip


def _read(path: Path, options: NewOptions, columns: dict[str, Column]) -> Run:
    if path.is_dir():
        return read_run(path)
    run, understood = read_log(path, options.units, options.axes)
    columns |= {c.name: c for c in understood if c.name not in columns}
    return run


def _columns(run: Run) -> list[str]:
    tables = [t for t in (run.loads, run.temperatures) if t is not None]
    return [name for t in tables for name in t.columns]


def _concerns(line: str, used: set[str]) -> bool:
    return "of another time" in line or any(name in line for name in used)
