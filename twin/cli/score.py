"""twin score: an artefact on measured runs, beside naive baselines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from twin.calibrate.score.score import Settings
    from twin.logs.run import Run


@click.command(epilog="Example: twin score out/five_axis.h5 out/truth -o out/score")
@click.argument("artefact", type=click.Path())
@click.argument("runs", nargs=-1, required=True, type=click.Path())
@click.option(
    "--sealed", multiple=True, type=click.Path(), help="run kept back from every fit, scored by itself; repeat"
)
@click.option("--train", multiple=True, type=click.Path(), help="run that baselines learn from, not scored; repeat")
@click.option("--inputs", help="columns that learned baselines read, 't1,t5,spindle_speed'  [default: temperatures]")
@click.option("--restart", is_flag=True, help="segments are tests of their own, each from its own initial state")
@click.option("--hold-interval", default="0 s", show_default=True,
              help="time between the measurements that 'hold last' may use; 0: all of them")  # fmt: skip
@click.option("--tcp-uncertainty", default="1 um", show_default=True, help="standard deviation where tcp.csv has none")
@click.option("--temperature-uncertainty", default="0.1 K", show_default=True, help="standard deviation of a sensor")
@click.option("--dt", default="60 s", show_default=True, help="time step")
@click.option("--substeps", default=4, show_default=True, type=click.IntRange(1), help="implicit Euler steps per step")
@click.option("-o", "--output", type=click.Path(), help="folder for score.json and score.csv")
@click.option("--json", "as_json", is_flag=True, help="print everything as JSON")
def command(
    artefact: str, runs: tuple[str, ...], sealed: tuple[str, ...], train: tuple[str, ...], inputs: str | None,
    restart: bool, hold_interval: str, tcp_uncertainty: str, temperature_uncertainty: str, dt: str, substeps: int,
    output: str | None, as_json: bool,
) -> None:  # fmt: skip
    """Replay every RUN on ARTEFACT and compare with what was measured, beside what needs no model.

    Scored per sensor and axis, per segment and pooled, sealed runs by themselves: rms, largest, p2p in two definitions,
    fit and the share that is computed (docs/scores.md). Baselines: zero, the last measurement held, ridge regression on
    the temperatures, ARX and output-error transfer functions. They learn from the --train runs; without any, from the
    other runs or from what was measured before.
    """
    from twin.run.replay import replay  # noqa: F401  isort: skip  first: it prepares JAX before NumPy is loaded

    import json
    from pathlib import Path

    from twin import __version__
    from twin.atomic import check_folder
    from twin.calibrate.score.files import score_json, write_score
    from twin.calibrate.score.score import Settings, score
    from twin.cli.quantity import positive
    from twin.cli.score_text import score_text
    from twin.progress import bar, silent
    from twin.rom.artefact import read_artefact
    from twin.run.results import refuse_run_folder

    settings = Settings(
        dt=positive("--dt", dt, "s"),
        substeps=substeps,
        restart=restart,
        tcp_sigma=positive("--tcp-uncertainty", tcp_uncertainty, "m"),
        temperature_sigma=positive("--temperature-uncertainty", temperature_uncertainty, "K"),
        interval=positive("--hold-interval", hold_interval, "s", zero=True),
        inputs=tuple(name.strip() for name in inputs.split(",") if name.strip()) if inputs else (),
    )
    if output is not None:
        check_folder(Path(output))
        refuse_run_folder(Path(output))
    loaded = read_artefact(Path(artefact))
    scored, kept, learnt = _read(runs, sealed, train, settings)
    found = score(loaded, scored, kept, learnt, settings, silent if as_json else bar)
    facts = {"machine": loaded.model.name, "artefact": artefact, "model_sha256": loaded.digest, "twin": __version__}
    told = score_json(found, settings, facts)
    if output is not None:
        write_score(Path(output), told, found)
    click.echo(json.dumps(told, indent=1, allow_nan=False) if as_json else score_text(found, artefact))


def _read(
    runs: tuple[str, ...], sealed: tuple[str, ...], train: tuple[str, ...], settings: Settings
) -> list[list[tuple[str, Run]]]:
    """(name, run) of each group. Raises TwinError for a run in two groups and for one without anything measured."""
    from pathlib import Path

    from twin.errors import LogError, TwinError
    from twin.logs.read import read_run

    seen: dict[Path, str] = {}
    groups: list[list[tuple[str, Run]]] = []
    for label, paths in (("RUN", runs), ("--sealed", sealed), ("--train", train)):
        group = []
        for path in paths:
            place = Path(path).resolve()
            if place in seen:
                what = f"is given twice, as {seen[place]} and as {label}"
                raise TwinError(what, path, "score a run once, and never on what the baselines learned from")
            seen[place] = label
            run = read_run(Path(path))
            if run.temperatures is None and run.tcp is None:
                raise LogError("nothing measured", path, "a run to score needs temperatures.csv or tcp.csv")
            if settings.restart and not run.segments:
                remedy = 'write segments = [{ name = "heating", start = "0 h", end = "4 h" }] in its run.toml'
                raise LogError("no segments to restart at", path, f"{remedy}, or leave out --restart")
            group.append((path, run))
        groups.append(group)
    return groups
