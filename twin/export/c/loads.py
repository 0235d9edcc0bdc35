"""What drives a machine as C arrays and functions: signals, laws, environments, contacts, flags."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twin.export.c.law_code import arguments_of, law_code
from twin.export.c.text import Arrays
from twin.physics.laws import LAWS
from twin.rom.drive import outside_flag
from twin.rom.law_values import states_of
from twin.rom.load_model import Film, LawUse, LoadModel, Source
from twin.rom.turning import off_zero


def put_signals(out: Arrays, load: LoadModel) -> None:
    """Signals and what reads them: axes, environments, joints, films."""
    place = {s.name: k for k, s in enumerate(load.signals)}
    _put_log(out, load)
    _put_axes(out, load, place)
    _put_environments(out, load, place)
    _put_films(out, load)


def _put_log(out: Arrays, load: LoadModel) -> None:
    needed, followed = _needed(load)
    out.names("twin_signal_name", [s.column for s in load.signals])
    out.names("twin_signal_unit", [s.unit for s in load.signals])
    out.reals("signal_low", [s.low for s in load.signals])
    out.reals("signal_high", [s.high for s in load.signals])
    out.reals("signal_margin", [_margin(s.low, s.high) for s in load.signals])
    out.reals("signal_default", [np.nan if s.default is None else s.default for s in load.signals])
    out.reals("signal_factor", [s.factor for s in load.signals])
    out.integers("signal_peak", [s.kind == "peak" for s in load.signals])
    out.integers("signal_needed", [s.name in needed for s in load.signals])
    out.integers("is_followed", [s.name in followed for s in load.signals])


def _needed(load: LoadModel) -> tuple[set[str], set[str]]:
    """Signals that anything reads, and those of laws that follow a temperature."""
    uses = [*(s.use for s in load.sources), *(f.use for f in load.films)]
    needed = {n for use in uses for n in use.signals.values()}
    needed |= (
        {a.position for a in load.axes} | {a.position for a in load.rotary} | {e.signal for e in load.environments}
    )
    needed |= {e.switch for e in load.environments} | {j.switch for j in load.joints} | {p.switch for p in load.pairs}
    return needed, {n for use in uses if states_of(use) for n in use.signals.values()}


def _put_axes(out: Arrays, load: LoadModel, place: Mapping[str, int]) -> None:
    out.names("twin_axis_name", [a.name for a in load.axes])
    out.integers("twin_axis_signal", [place[a.position] for a in load.axes], "const int")
    out.reals("axis_low", [a.low for a in load.axes])
    out.reals("axis_high", [a.high for a in load.axes])
    out.reals("axis_margin", [_margin(a.low, a.high) for a in load.axes])
    out.integers("turn_signal", [place[a.position] for a in load.rotary])
    defaults = {s.name: s.default or 0.0 for s in load.signals}
    out.reals("axis_default", [defaults[a.position] for a in load.axes])


def _put_environments(out: Arrays, load: LoadModel, place: Mapping[str, int]) -> None:
    environments = load.environments
    out.integers("environment_signal", [place[e.signal] if e.signal else -1 for e in environments])
    out.reals("environment_temperature", [e.temperature for e in environments])
    out.reals("environment_offset", [e.offset for e in environments])
    out.integers("environment_switch", [place[e.switch] if e.switch else -1 for e in environments])
    out.reals("environment_switched", [e.switched_offset for e in environments])
    out.integers("joint_switch", [place[j.switch] if j.switch else -1 for j in load.joints])
    out.reals("joint_switched", [j.switched for j in load.joints])
    out.reals("joint_conductance", [j.conductance for j in load.joints])


def _put_films(out: Arrays, load: LoadModel) -> None:
    air = [load.environments[f.environment] for f in load.films]
    out.integers("film_environment", [f.environment for f in load.films])
    out.integers("film_radiant", [f.radiant for f in load.films])
    out.reals("film_emissivity", [f.emissivity for f in load.films])
    out.reals("film_gradient", [e.gradient for e in air])
    out.reals("film_height", [e.height for e in air])
    out.reals("film_low", [f.low for f in load.films])
    out.reals("film_high", [f.high for f in load.films])


def put_contacts(out: Arrays, load: LoadModel, ports: tuple[tuple[int, ...], ...]) -> tuple[int, int]:
    """Pairs and their rails; ports: per body. Returns the numbers of `facing` and `under` entries."""
    _put_pairs(out, load)
    rails = [load.rails[p.rail] for p in load.pairs]
    counts = [len(r.stations) for r in rails]
    starts = np.cumsum([0, *(len(r.stations) for r in load.rails)])
    sources = [[j for j, s in enumerate(load.sources) if s.contact == p.contact] for p in load.pairs]
    under = [len(s) * n for s, n in zip(sources, counts, strict=True)]
    out.reals("station", [s for r in load.rails for s in r.stations])
    out.integers("pair_station", [starts[p.rail] for p in load.pairs])
    out.integers("pair_count", counts)
    out.integers("pair_facing", np.cumsum([0, *counts])[:-1])
    out.integers("pair_under", np.cumsum([0, *under])[:-1])
    out.integers("pair_port", [r.first_port for r in rails])
    out.reals("pair_margin", [_margin(r.stations[0], r.stations[-1]) for r in rails])
    out.integers("pair_sources", [len(s) for s in sources])
    out.integers("pair_source_first", np.cumsum([0, *(len(s) for s in sources)])[:-1])
    out.integers("pair_source", [j for s in sources for j in s])
    out.reals("rail_share", [s.rail_share for s in load.sources])
    if load.pairs:
        _put_owners(out, load, ports)
    return sum(counts), sum(under)


def _put_pairs(out: Arrays, load: LoadModel) -> None:
    place = {s.name: k for k, s in enumerate(load.signals)}
    out.reals("pair_divisor", [sum(q.contact == p.contact for q in load.pairs) for p in load.pairs])
    out.integers("pair_axis", [p.axis for p in load.pairs])
    out.integers("pair_pad", [p.pad_port for p in load.pairs])
    out.reals("pair_at", [p.station for p in load.pairs])
    out.reals("pair_sign", [-1.0 if p.rail_moves else 1.0 for p in load.pairs])
    out.integers("pair_by_segment", [p.assignment == "segment" for p in load.pairs])
    out.reals("pair_conductance", [p.conductance * p.area for p in load.pairs])
    out.integers("pair_switch", [place[p.switch] if p.switch else -1 for p in load.pairs])
    out.reals("pair_switched", [p.switched for p in load.pairs])


def _put_owners(out: Arrays, load: LoadModel, ports: tuple[tuple[int, ...], ...]) -> None:
    """On which body, and which of its ports, rails and pads are."""
    owner = {port: (b, i) for b, of_body in enumerate(ports) for i, port in enumerate(of_body)}
    rails = [load.rails[p.rail] for p in load.pairs]
    out.integers("pair_rail_body", [owner[r.first_port][0] for r in rails])
    out.integers("pair_rail_local", [owner[r.first_port][1] for r in rails])
    out.integers("pair_pad_body", [owner[p.pad_port][0] for p in load.pairs])
    out.integers("pair_pad_local", [owner[p.pad_port][1] for p in load.pairs])


def most_reads(load: LoadModel) -> int:
    """The most signals that one law reads."""
    uses = [*(f.use for f in load.films), *(s.use for s in load.sources)]
    return max((len(use.signals) for use in uses), default=0)


def put_laws(out: Arrays, load: LoadModel) -> None:
    """The laws as functions, and the functions that call them."""
    place = {s.name: k for k, s in enumerate(load.signals)}
    films = [k for k, f in enumerate(load.films) if states_of(f.use)]
    losses = [k for k, s in enumerate(load.sources) if states_of(s.use)]
    out.reals("source_gain", [s.gain for s in load.sources])
    out.reals("film_gain", [f.gain for f in load.films])
    out.integers("following_film", films)
    out.integers("film_alone", [not load.films[k].use.signals for k in films])
    out.integers("following_loss", losses)
    _put_reads(out, "film", [load.films[k].use for k in films], place, most_reads(load))
    _put_reads(out, "loss", [load.sources[k].use for k in losses], place, most_reads(load))
    out.integers("follows", [bool(states_of(s.use)) for s in load.sources])
    of_log, holds = [], []
    for kind, uses in (("source", [s.use for s in load.sources]), ("film", [f.use for f in load.films])):
        for k, use in enumerate(uses):
            out.add(law_code(f"{kind}_{k}", use))
            judged = LAWS[use.law].validity
            if judged:
                out.add(law_code(f"{kind}_{k}_holds", use, holds=True))
            if states_of(use):
                continue
            into = "power" if kind == "source" else "film"
            call = _call(f"{kind}_{k}", use, place, {})
            of_log.append(f"    {into}[{k}] = m->{kind}_gain[{k}] * {call};\n")
            if judged:
                test = _call(f"{kind}_{k}_holds", use, place, {})
                holds.append(f"    raised[flag_of_{kind}_{k}] |= (unsigned char)!{test};\n")
    unused = "    (void)m;\n    (void)v;\n    (void)power;\n    (void)film;\n"
    head = "static void laws_of_log(const twin_machine *m, const real *v, real *power, real *film)\n{\n"
    out.add(head + unused + "".join(of_log) + "}\n")
    out.add("static void laws_hold(const real *v, unsigned char *raised)\n{\n    (void)v;\n    (void)raised;\n"
                     + "".join(holds) + "}\n")  # fmt: skip
    _put_switch(out, "film", films, load.films, place, {"surface": "surface", "ambient": "ambient"})
    _put_switch(out, "loss", losses, load.sources, place, {"temperature": "temperature"})


def _put_reads(out: Arrays, kind: str, uses: list[LawUse], place: dict[str, int], width: int) -> None:
    """Which signals each law that is tabulated reads."""
    out.integers(f"{kind}_reads", [len(use.signals) for use in uses])
    reads = [[place[s] for s in use.signals.values()] for use in uses]
    out.table(f"{kind}_signal", [[*row, *[0] * (width - len(row))] for row in reads], width)


def _put_switch(
    out: Arrays, kind: str, which: list[int], entries: tuple[Film, ...] | tuple[Source, ...], place: dict[str, int],
    states: dict[str, str],
) -> None:  # fmt: skip
    name = "source" if kind == "loss" else "film"
    given = ", ".join(f"real {s}" for s in states)
    unused = "".join(f"    (void){s};\n" for s in ("v", *states))
    for suffix, result in (("", "real"), ("_holds", "int")):
        cases = ""
        for c, k in enumerate(which):
            use = entries[k].use
            if not suffix or LAWS[use.law].validity:
                cases += f"    case {c}: return {_call(f'{name}_{k}{suffix}', use, place, states)};\n"
        otherwise = "1" if suffix else "0"
        out.add(
            f"static {result} {kind}_law{suffix}(int which, const real *v, {given})\n{{\n{unused}"
            f"    switch (which) {{\n{cases}    default: return {otherwise};\n    }}\n}}\n"
        )


def _call(name: str, use: LawUse, place: dict[str, int], states: dict[str, str]) -> str:
    given = [f"v[{place[use.signals[a]]}]" if a in use.signals else states[a] for a in arguments_of(use)]
    return f"{name}({', '.join(given)})"


def flags(load: LoadModel, shortest: float, step: float) -> tuple[dict[str, int], list[str]]:
    """Places of the first flag of each kind, and the names of all, as `twin run` names them."""
    names: list[str] = []
    at: dict[str, int] = {}
    at["flag_signal"] = len(names)
    for s in load.signals:
        names += [f"signals.{s.name} {side} {v:g} {s.unit}" for side, v in (("below", s.low), ("above", s.high))]
    at["flag_missing"] = len(names)
    names += [f"signals.{s.name} missing, last value held" for s in load.signals]
    at["flag_stroke"] = len(names)
    names += [f"axes.{a.name} beyond its stroke" for a in load.axes]
    at["flag_turn"] = len(names)
    names += [off_zero(a.name) for a in load.rotary]
    at["flag_rail"] = len(names)
    names += [f"contacts.{p.contact}: {load.ports[p.pad_port]} beyond the stations of its rail" for p in load.pairs]
    used = [("source", k, s.name, s.use) for k, s in enumerate(load.sources)]
    used += [("film", k, f.name, f.use) for k, f in enumerate(load.films)]
    for kind, k, name, use in used:
        if validity := LAWS[use.law].validity:
            at[f"flag_of_{kind}_{k}"] = len(names)
            names.append(outside_flag(f"{kind}s", name, validity.text))
    at["flag_film"] = len(names)
    for f in load.films:
        names += [f"films.{f.name} {side} {v:g} W/(m^2*K)" for side, v in (("below", f.low), ("above", f.high))]
    at["flag_grid"] = len(names)
    names.append("position outside the pose grid, TCP error of its border")
    at["flag_step"] = len(names)
    names += [f"substep shorter than the certified {shortest:g} s", f"step longer than the certified {step:g} s"]
    return at, names


def _margin(low: float, high: float) -> float:
    """Values at a bound stay inside in spite of rounding, as in `twin.rom.drive`."""
    return 1e-9 * max((abs(v) for v in (low, high) if np.isfinite(v)), default=0.0)
