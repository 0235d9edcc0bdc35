"""twin simulate: step the full model through a run and write a run folder like a measured one."""

from __future__ import annotations

import click


@click.command(
    epilog="Example: twin simulate models/five_axis/machine.toml models/five_axis/runs/experiment_a -o out/truth "
    "--noise-temperature '0.08 K' --noise-tcp '1 um' --hours 1"
)
@click.argument("machine", type=click.Path())
@click.argument("run", type=click.Path())
@click.option("-o", "--output", required=True, type=click.Path(), help="run folder to write")
@click.option("--size", help="mesh size for new meshes by the model's geometry.py, e.g. '80 mm' (needs the mesh extra)")
@click.option("--dt", default="60 s", show_default=True, help="time step")
@click.option("--substeps", default=4, show_default=True, type=click.IntRange(1), help="implicit Euler steps per step")
@click.option("--hours", type=click.FloatRange(0, min_open=True), help="stop after this time; the whole run by default")
@click.option("--tcp-every", default="30 min", show_default=True, help="TCP rows, where the run has no tcp.csv")
@click.option("--noise-temperature", default="0 K", show_default=True, help="standard deviation at sensors")
@click.option("--noise-tcp", default="0 um", show_default=True, help="standard deviation of TCP rows")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0), help="of the noise")
def command(
    machine: str,
    run: str,
    output: str,
    size: str | None,
    dt: str,
    substeps: int,
    hours: float | None,
    tcp_every: str,
    noise_temperature: str,
    noise_tcp: str,
    seed: int,
) -> None:
    """Step the full model of MACHINE through the loads of RUN; writes temperatures and TCP rows to OUTPUT."""
    from pathlib import Path

    from twin.build.remesh import remesh
    from twin.build.simulate import Noise, simulate_run
    from twin.cli.quantity import positive
    from twin.cli.sound import require_sound
    from twin.errors import LogError
    from twin.logs.write import refuse_to_destroy, write_run
    from twin.machine.load import load_machine
    from twin.progress import bar

    noise = Noise(
        positive("--noise-temperature", noise_temperature, "delta_degC", zero=True),
        positive("--noise-tcp", noise_tcp, "m", zero=True),
        seed,
    )
    mesh_size = positive("--size", size, "m") if size else None
    step, every = positive("--dt", dt, "s"), positive("--tcp-every", tcp_every, "s")
    if Path(output).resolve() == Path(run).resolve():
        raise LogError("is the run that is read", output, "choose another folder with -o")
    refuse_to_destroy(Path(output))  # now, not after hours
    require_sound(Path(machine))
    described = load_machine(Path(machine))
    result, balance = simulate_run(
        described if mesh_size is None else remesh(described, mesh_size),
        Path(run),
        dt=step,
        substeps=substeps,
        hours=hours,
        tcp_every=every,
        noise=noise,
        progress=bar,
    )
    write_run(Path(output), result)
    rows = 0 if result.tcp is None else len(result.tcp.time)
    temperatures = result.temperatures
    counts = (0, 0) if temperatures is None else (len(temperatures.time), len(temperatures.columns))
    click.echo(
        f"{output}: {counts[0]} rows of {counts[1]} temperatures, "
        f"{rows} TCP rows; heat balance closes to {balance:.1e} of the throughput"
    )
