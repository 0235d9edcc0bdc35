"""The C source of a machine: header and file, put together from arrays, laws and the core."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources

import numpy as np

from twin.export.c.correction import put_correction
from twin.export.c.elastic import MESHED, put_elastic
from twin.export.c.loads import flags, most_reads, put_contacts, put_laws, put_signals
from twin.export.c.text import Arrays, identifier, named, quoted
from twin.export.c.thermal import put_thermal
from twin.rom.artefact import Artefact
from twin.rom.law_values import states_of
from twin.rom.model import MachineModel
from twin.rom.tableau import SDIRK2_6
from twin.run.system import Prepared, prepare
from twin.units import _TABLE

_CORE = ("algebra.c", "drive.c", "step.c", "platform.c", "tcp.c", "correction.c")
_HEAD = """#include <math.h>
#include <stddef.h>
#include <string.h>

typedef twin_real real;

"""


@dataclass(frozen=True)
class Source:
    """A machine in C."""

    name: str  # prefix of all public names
    header: str
    code: str
    weights: bytes  # the numbers of its large tables once more, for compilers that take them as bytes (TWIN_WEIGHTS)
    example: str  # a main program that reads loads.csv
    sensors: tuple[str, ...]  # structural ones, then those in the air
    flags: tuple[str, ...]


def source_of(artefact: Artefact, single: bool = False, note: str = "") -> Source:
    """Header and code of a machine; `note` goes into their first lines."""
    model, load = artefact.model, artefact.model.load_model
    prepared = prepare(model)
    certificate = artefact.certificate
    substeps, step = int(certificate.get("substeps", 1)), float(certificate.get("step", 60.0))
    shortest = float(certificate.get("finest_step", step / substeps))
    name = identifier(model.name)
    out = Arrays(single, name)
    layout = prepared.layout
    put_signals(out, load)
    facing, under = put_contacts(out, load, layout.ports)
    at, names = flags(load, shortest, step)
    out.parts += [f"enum {{ {flag} = {place} }};\n" for flag, place in at.items()]
    films = [f for f in enumerate(load.films) if states_of(f[1].use)]
    losses = [s for s in enumerate(load.sources) if states_of(s[1].use)]
    out.integers("flag_film_law", [at.get(f"flag_of_film_{k}", -1) for k, _ in films])
    out.integers("flag_loss_law", [at.get(f"flag_of_source_{k}", -1) for k, _ in losses])
    put_laws(out, load)
    bodies = _sensor_bodies(model)
    out.integers("sensor_body", [*bodies, *(e for _, e in model.ambient_sensors)])
    put_thermal(out, prepared, bodies)
    sizes = put_elastic(out, model, prepared.back) | put_correction(out, artefact)
    sensors = model.all_sensors
    out.names("twin_sensor_name", sensors)
    out.names("twin_flag_name", names)
    out.names("twin_source_name", [s.name for s in load.sources])
    out.names("twin_film_name", [f.name for f in load.films])
    sizes |= _sizes(prepared, model, sizes)
    sizes |= {"FACING": facing, "UNDER": under, "FLAGS": len(names), "SENSORS": len(sensors),
              "SUBSTEPS": substeps, "FOLLOWING_FILMS": len(films), "FOLLOWING_LOSSES": len(losses)}  # fmt: skip
    told = f"/* {_told(artefact)}{note} */\n"
    guard = f"TWIN_{name.upper()}_H"
    header = (
        f"{told}#ifndef {guard}\n#define {guard}\n\n#include <stddef.h>\n\n"
        '#ifdef __cplusplus\nextern "C" {\n#endif\n\n'
        f"typedef {'float' if single else 'double'} twin_real;\n\n"
        + "".join(f"#define TWIN_{key} {value}\n" for key, value in sorted(sizes.items()))
        + f"#define TWIN_STEP {step!r} /* s, certified */\n"
        f"#define TWIN_SHORTEST {shortest!r} /* s, certified substep */\n"
        f"#define TWIN_REFERENCE {model.reference_temperature!r} /* degC */\n"
        "#define TWIN_MOST(n) ((n) > 0 ? (n) : 1)\n\n"
        + _core("runtime.h")
        + "\n#ifdef __cplusplus\n}\n#endif\n#endif\n"
    )
    head = told + f'#include "{name}.h"\n' + _HEAD + _functions(single) + _numbers(artefact, prepared)
    core = "".join(_core(part) for part in _CORE)
    code = named(head, name) + out.text() + named(core, name)
    return Source(name, named(header, name), code, out.weights_as_bytes(), _example(name), sensors, tuple(names))


def _core(name: str) -> str:
    return (resources.files("twin.export.c") / name).read_text(encoding="utf-8")


def _example(name: str) -> str:
    units = [f"{{{quoted(text)}, {factor!r}}}" for row in _TABLE.values() for text, factor in row.items()]
    units += ['{"degC", 1.0}', '{"K", 1.0}']
    text = _core("example.c").replace("TWIN_UNITS", ", ".join(units))
    return named(text.replace("twin_.", f"{name}.").replace("twin_run", f"{name}_run"), name)


def _sensor_bodies(model: MachineModel) -> tuple[int, ...]:
    owner = {int(s): b for b, body in enumerate(model.bodies) for s in body.sensors}
    return tuple(owner[s] for s in range(len(model.sensors)))


def _sizes(prepared: Prepared, model: MachineModel, elastic: dict[str, int]) -> dict[str, int]:
    load, layout = model.load_model, prepared.layout
    sizes, N = layout.sizes, layout.offsets[-1]
    factor = sum(n * (n + 1) // 2 if layout.symmetric else n * n for n in sizes)
    touching = max((2 * n * max(len(p), 1) for n, p in zip(sizes, layout.ports, strict=True)), default=1)
    springs, motions = elastic.get("SPRINGS", 0), 6 * len(sizes)
    tcp = 0
    if elastic["STRUCTURE"] == MESHED:
        tcp = springs * (springs + 1) // 2 + springs * (4 + motions) + motions * (motions + 1) // 2 + 2 * motions
    return {
        "BODIES": len(sizes), "STATES": N, "LARGEST": max(sizes), "FACTOR": factor, "SYMMETRIC": int(layout.symmetric),
        "WORK": max(factor + 9 * N + max(sizes), touching, tcp), "SIGNALS": len(load.signals), "AXES": len(load.axes),
        "TURNS": len(load.rotary),
        "ENVIRONMENTS": len(load.environments), "SOURCES": len(load.sources), "FILMS": len(load.films),
        "JOINTS": len(load.joints), "THETA": len(load.films) + len(load.joints), "PORTS": len(load.ports),
        "PAIRS": len(load.pairs), "READS": most_reads(load), "STRUCTURAL": len(model.sensors),
        "DRIVEN": max(len(load.sources) + len(load.films) + 2 * len(load.environments) + len(load.joints)
                      + len(load.pairs) + len(load.axes), 1),
        "CLIMBING": np.shape(prepared.system.film_moment)[0] - 1,
    }  # fmt: skip


def _functions(single: bool) -> str:
    f = "f" if single else ""
    names = ("exp", "log", "sqrt", "tan", "atan", "cos", "sin", "pow", "fmax", "fmin", "fabs", "expm1", "log1p")
    lines = [f"#define {n.upper()} {n}{f}\n" for n in names]
    number = "#define R(x) x##f\n" if single else "#define R(x) x\n"
    return number + "".join(lines)


def _numbers(artefact: Artefact, prepared: Prepared) -> str:
    """What the core needs besides arrays."""
    t = SDIRK2_6
    weights, ahead = (", ".join(map(repr, row)) for row in (t.weights, t.ahead))
    return (
        f"#define REFERENCE ((real){artefact.model.reference_temperature!r})\n"
        f"#define HEAT_CAPACITY ((real){prepared.heat_capacity!r})\n"
        f"#define BALANCE ((real)(sizeof(real) == 8 ? 1e-6 : 1e-2))\n"
        f"#define TWIN_GAMMA ((real){t.diagonal!r})\n"
        f"#define TWIN_STAGE_WEIGHTS {{{weights}}}\n#define TWIN_STAGE_AHEAD {{{ahead}}}\n"
    ) + _core("interpolated.c")


def _told(artefact: Artefact) -> str:
    from twin import __version__

    c = artefact.certificate
    told = f"{identifier(artefact.model.name)}: thermo-elastic machine, written by twin {__version__} "
    told += f"from model sha256 {artefact.digest}."
    if "max_temperature_error_in_case" in c:
        told += (
            f"\n   Certificate of the model: {float(np.max(c['max_temperature_error_in_case'])):.3g} K, "
            f"{1e6 * float(np.max(c['max_displacement_error_in_case'])):.3g} um."
        )
    return told
