"""twin diagnose: find what the simulation gets wrong, name the cause, extend the model, measure the gain."""

from __future__ import annotations

import click


@click.command(
    epilog="Example: twin diagnose out/five_axis.h5 out/monday out/tuesday --sealed out/wednesday -o out/diagnosis"
)
@click.argument("artefact", type=click.Path(), required=False)
@click.argument("runs", type=click.Path(), nargs=-1)
@click.option(
    "--sealed", multiple=True, type=click.Path(), help="run that is opened last, to measure the gain; repeatable"
)
@click.option("-o", "--output", type=click.Path(), help="folder of the report")
@click.option("--noise", default="0.1 K", show_default=True, help="standard deviation of one temperature reading")
@click.option("--tcp-noise", default="1 um", show_default=True, help="of a TCP deviation, where tcp.csv has no sigma")
@click.option("--exclude", multiple=True, help="sensor to leave out; repeatable")
@click.option("--nulls", default=200, show_default=True, type=click.IntRange(20),
              help="synthetic runs without a cause that thresholds come from; 60 more show errors of form")  # fmt: skip
@click.option("--catalogue", type=click.Path(), help="Python file with entries of your own (FAMILIES)")
@click.option("--machine", type=click.Path(), help="description with its meshes, where it has moved since the build")
@click.option("--no-build", is_flag=True, help="write the extended description, but do not build its artefact")
@click.option("--seed", default=1, show_default=True, type=click.IntRange(0), help="of the bootstrap")
@click.option("--explain", metavar="FAMILY", help="print an entry of the catalogue, or 'all'")
def command(
    artefact: str | None, runs: tuple[str, ...], sealed: tuple[str, ...], output: str | None, noise: str,
    tcp_noise: str, exclude: tuple[str, ...], nulls: int, catalogue: str | None, machine: str | None,
    no_build: bool, seed: int, explain: str | None,
) -> int:  # fmt: skip
    """Say what ARTEFACT gets wrong about the measured RUNS, and what it gains to know.

    Writes OUTPUT/index.html (readable as it is), OUTPUT/report.json, and, where a cause belongs into the description,
    OUTPUT/machine.toml with the effect added and OUTPUT/extended.h5 built from it. What a former diagnosis left in
    OUTPUT is replaced. The artefact stays untouched.
    """
    from dataclasses import replace
    from pathlib import Path

    from twin.diagnose.catalogue import FAMILIES, explained, family, with_own
    from twin.errors import TwinError

    families = with_own(Path(catalogue)) if catalogue else FAMILIES
    if explain is not None:
        chosen = families if explain == "all" else (family(explain, families),)
        click.echo("\n\n".join(explained(entry) for entry in chosen))
        return 0
    if artefact is None or not runs:
        raise TwinError("an artefact and measured runs are needed", "twin diagnose", "see twin diagnose --help")
    if output is None:
        raise TwinError("no folder for the report", "-o", "name one, for example -o out/diagnosis")

    from twin.atomic import check_folder
    from twin.cli.quantity import positive
    from twin.diagnose.diagnose import Settings, diagnose, machine_of
    from twin.diagnose.extension import build_extension, refuse_target, write_extension
    from twin.diagnose.report_page import summary_lines
    from twin.logs.read import read_run
    from twin.progress import bar
    from twin.rom.artefact import read_artefact
    from twin.run.results import refuse_run_folder

    target = Path(output)
    every = [Path(r) for r in (*runs, *sealed)]
    if len({p.resolve() for p in every}) < len(every):
        raise TwinError("a run is given twice", "RUNS, --sealed", "a run that is looked at cannot judge the gain")
    check_folder(target)
    refuse_run_folder(target)
    loaded = read_artefact(Path(artefact))
    unknown = sorted(set(exclude) - set(loaded.model.sensors))
    if unknown:
        raise TwinError(f"no sensor '{unknown[0]}'", "--exclude", f"sensors are: {', '.join(loaded.model.sensors)}")
    settings = Settings(
        positive("--noise", noise, "K"),
        positive("--tcp-noise", tcp_noise, "m"),
        exclude,
        families,
        nulls=nulls,
        seed=seed,
    )
    described = machine_of(loaded, Path(artefact), Path(machine) if machine else None)
    read = [replace(read_run(path), folder=path.resolve()) for path in every]  # "." has a name, too
    refuse_target(target, Path(artefact), described, read)
    result = diagnose(loaded, described, read[: len(runs)], read[len(runs) :], settings, bar)
    diagnosis, said = write_extension(result, loaded, described, read, target, build=False)
    for line in [*summary_lines(diagnosis), *said]:
        click.echo(line)
    if diagnosis.provenance["files"] and not no_build:  # minutes, in which all else is there already
        click.echo(build_extension(target, bar))
    return 0
