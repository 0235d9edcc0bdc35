"""From a description to an artefact on disk, and back from an artefact to its certificate."""

from __future__ import annotations

import hashlib
import importlib.metadata
from dataclasses import replace
from pathlib import Path

import numpy as np

from twin import __version__
from twin.build.cache import machine_hash
from twin.build.certificate import MESH, Certificate, known_parts, with_part
from twin.build.full_model import FullModel
from twin.build.import_closure import closure_hash
from twin.build.mesh_error import SCENARIOS, mesh_part, refuse_lumped
from twin.build.pipeline import (
    BUILD_SEED,
    VERIFY_SEED,
    BuildOptions,
    certificate,
    chosen_for_full,
    compact_model,
    full_model,
    held_out,
    rich_model,
)
from twin.build.same_model import same_model
from twin.build.surface_motion import surface_motion
from twin.build.turned_nodes import turned_nodes
from twin.errors import ArtefactError
from twin.machine.description import Machine
from twin.machine.instances import written_out
from twin.machine.load import load_machine, read_text
from twin.machine.parameters import parameters
from twin.progress import Progress, silent
from twin.rom.artefact import Artefact, SurfaceField, read_artefact, write_artefact
from twin.rom.model import MachineModel

PACKAGES = ("numpy", "scipy", "scikit-fem", "h5py", "jax")


def build_artefact(
    machine_path: Path, target: Path, options: BuildOptions = BuildOptions(), progress: Progress = silent
) -> Certificate:
    """Build, certify (compact against rich) and write an artefact atomically.

    Equal input gives an equal file apart from the attribute `created`. The certificate of the build says how far the
    compact model is from the rich one; `verify_artefact` adds how far the rich one is from the full model.
    """
    machine = load_machine(machine_path)
    full = full_model(machine, progress)
    rich = rich_model(machine, full, options.rich, progress)
    compact = compact_model(machine, rich, options, progress)
    result = certificate(machine, rich, compact, None, options, BUILD_SEED, progress=progress)
    fields = surface_fields(machine, full, compact)
    bare = replace(compact, bodies=tuple(replace(b, F=None, V=None) for b in compact.bodies))
    description = Path(machine_path) / "machine.toml" if Path(machine_path).is_dir() else Path(machine_path)
    provenance = {
        "machine": str(description.resolve()),
        "machine_hash": machine_hash(machine),
        "source_hash": closure_hash(__name__),
        "twin": __version__,
        **{f"package_{name}": importlib.metadata.version(name) for name in PACKAGES},
        "command": f"twin build --method {options.method} --states {options.states} --samples {options.rich.samples} "
        f"--training {options.training}" + (f" --substeps {options.substeps}" if options.substeps else ""),
        "full_states": str(full.thermal.n),
        "rich_states": str(rich.n),
        "options_hash": hashlib.sha256(repr(options).encode()).hexdigest(),
    }
    text = written_out(read_text(description))  # who reads it in the artefact knows no templates
    write_artefact(target, bare, text, result.to_json(), provenance, fields, parameters=parameters(machine))
    return result


def surface_fields(machine: Machine, full: FullModel, compact: MachineModel) -> list[SurfaceField]:
    """The surfaces of all bodies, for pictures; how they move where the machine has an elastic structure."""
    bodies = compact.bodies if full.surfaces else ()
    bases = [body.V for body in bodies if body.V is not None]
    motion = surface_motion(machine, full, bases) if machine.has_tcp and bases else (None,) * len(bodies)
    fields = []
    for body, mesh, surface, moved in zip(bodies, full.bodies, full.surfaces, motion, strict=True):
        m = len(surface.points)
        u, f = (None, None) if moved is None else (by.reshape(m, 3, -1) for by in moved)
        turned = turned_nodes(machine, mesh)
        fields.append(SurfaceField(body.name, surface.points, surface.triangles, np.asarray(body.F), u, f, turned))
    return fields


def verify_artefact(
    path: Path,
    machine_path: Path | None = None,
    options: BuildOptions = BuildOptions(),
    full_scenarios: int = 2,
    progress: Progress = silent,
    mesh: bool = False,
) -> Certificate:
    """Certify an artefact on scenarios it has never seen, with the full model in the chain, and store the result in it.

    mesh: with the error of the full model's mesh (`twin.build.mesh_error`), which lumped machines have none of.
    The machine is read from where the artefact was built, or from `machine_path`; it must be the one the artefact was
    built from. Raises ArtefactError otherwise. A calibrated artefact brings its own description, to the meshes of the
    one it started from.
    """
    artefact: Artefact = read_artefact(path)
    result = verified(artefact, machine_path, options, full_scenarios, progress, str(path), mesh)
    write_artefact(
        path, artefact.model, artefact.description, result.to_json(), artefact.provenance, artefact.fields,
        parameters=artefact.parameters,
    )  # fmt: skip
    return result


def machine_of(artefact: Artefact, machine_path: Path | None, where: str) -> Machine:
    """The machine that an artefact was built from, read from there or from `machine_path`.

    where: the artefact's name in messages. Raises ArtefactError where the machine is gone, or another one.
    """
    if "matrices" in artefact.provenance and not machine_path:
        raise ArtefactError(
            "was imported from matrices, and certified against them then",
            where,
            "twin info shows its certificate; twin import makes it again",
        )
    origin = Path(machine_path or artefact.provenance.get("machine", ""))
    if not origin.exists():
        raise ArtefactError(f"its machine description is not at {origin}", where, "name it with --machine")
    calibrated = "calibrated_from" in artefact.provenance and not machine_path
    machine = load_machine(origin, artefact.description if calibrated else None)
    if not calibrated and machine_hash(machine) != artefact.provenance.get("machine_hash"):
        raise ArtefactError(
            f"{origin} is not the machine this artefact was built from (description or meshes differ)",
            where,
            "build again, or name the right description with --machine",
        )
    return machine


def verified(
    artefact: Artefact,
    machine_path: Path | None = None,
    options: BuildOptions = BuildOptions(),
    full_scenarios: int = 2,
    progress: Progress = silent,
    where: str = "",
    mesh: bool = False,
) -> Certificate:
    """The certificate that `verify_artefact` stores; with no full scenarios of compact against rich only.

    where: the artefact's name in messages. mesh: with the error of the mesh, on two of the scenarios.
    """
    machine = machine_of(artefact, machine_path, where or artefact.model.name)
    if mesh:
        refuse_lumped(machine)
    full = full_model(machine, progress)
    rich = rich_model(machine, full, options.rich, progress)
    of_full = full.thermal if full_scenarios else None
    stored = artefact.certificate.get("substeps")
    if stored is not None:  # it runs with these
        options = replace(options, substeps=int(stored))
    # a machine of few states is kept whole: its artefact holds the rich model, which then is stepped once, not twice
    compact = rich if same_model(rich, artefact.model) else artefact.model
    result = certificate(machine, rich, compact, of_full, options, VERIFY_SEED, full_scenarios, progress=progress)
    if not mesh:  # the mesh is what it was when it was asked for
        return replace(result, parts=(*result.parts, *known_parts(artefact.certificate, MESH)))
    chosen = chosen_for_full(rich.load_model, held_out(rich, options, VERIFY_SEED), SCENARIOS)
    positions = np.array(result.positions, dtype=float).reshape(len(result.positions), -1 if result.positions else 0)
    part = mesh_part(machine, full, chosen, result.substeps, positions, progress)
    return with_part(result, part, machine.limits)
