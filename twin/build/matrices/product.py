"""From matrices to a certified artefact, by the reduction and the certificate of a machine."""

from __future__ import annotations

import hashlib
import importlib.metadata
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from twin import __version__
from twin.build.cached_models import on_rich_bases
from twin.build.compress import Tolerances, balanced, galerkin
from twin.build.fitted_basis import MOST_STATES, fitted_galerkin
from twin.build.frequency_training import drawn_films, responses
from twin.build.matrices.files import read_matrices
from twin.build.matrices.model import MatrixOptions, Output, as_given, model_of, outputs, stem
from twin.build.matrices.self_test import self_test
from twin.build.pipeline import BUILD_SEED, BuildOptions, certificate
from twin.build.scenario import theta_bounds
from twin.machine.description import Limits
from twin.progress import Progress, silent
from twin.rom.artefact import write_artefact
from twin.rom.model import MachineModel

PACKAGES = ("numpy", "scipy", "h5py", "jax")
FULL_SCENARIOS = 2  # that the full model is stepped through
TRAINING_SEED = 5
# Weight of the sides of a difference beside it: with 1 the steel profile's differences have four times the error at 40
# states, with 0 their sides have twice (transfer functions at 20 sets of films).
SIDES = 0.1


@dataclass(frozen=True)
class _Limited:
    limits: Limits


def import_matrices(
    paths: Sequence[Path],
    target: Path,
    matrix: MatrixOptions = MatrixOptions(),
    options: BuildOptions = BuildOptions(),
    progress: Progress = silent,
) -> tuple[str, ...]:
    """Test, reduce and certify matrices, and write the artefact atomically; returns what the self-tests found.

    Compact against rich over held-out scenarios, rich against full over two of them; surroundings of films are drawn
    apart from each other. options.training is the number of films that snapshots are made at.
    Raises DescriptionError for matrices that are not what they are taken for.
    """
    matrices = read_matrices(paths)
    told = self_test(matrices)
    full = model_of(stem(paths), matrices, matrix)
    options = replace(options, air_apart=True)
    rich = on_rich_bases(full, options.rich, matrix.limits, progress)
    compact = reduced(rich, outputs(matrices, matrix), matrix, options)
    result = certificate(
        _Limited(matrix.limits), rich, compact, full, options, BUILD_SEED, FULL_SCENARIOS, progress=progress
    )
    provenance = {
        "matrices": ", ".join(str(p.resolve()) for p in paths),
        "matrices_hash": hashlib.sha256(b"".join(hashlib.sha256(p.read_bytes()).digest() for p in paths)).hexdigest(),
        "twin": __version__,
        **{f"package_{name}": importlib.metadata.version(name) for name in PACKAGES},
        "command": f"twin import --method {options.method} --states {options.states}",
        "full_states": str(full.n),
        "rich_states": str(rich.n),
    }
    write_artefact(target, compact, "", result.to_json(), provenance)
    return told


def reduced(
    rich: MachineModel, watched: Sequence[Output], matrix: MatrixOptions, options: BuildOptions
) -> MachineModel:
    """The rich model compressed to `options.states` states; itself where it has no more than that.

    What is compressed for are the outputs as they were given, with the sides of differences beside them.
    """
    if rich.n <= options.states:
        return rich
    span = matrix.surroundings[1] - matrix.surroundings[0]
    films = drawn_films(*theta_bounds(rich.load_model), options.training, TRAINING_SEED)
    gains = [source.gain for source in rich.load_model.sources]
    heat = max(gains, default=0.0) * matrix.inputs[1] / span  # W per kelvin of surroundings
    (body,) = rich.bodies
    snapshots = [responses(body, films, heat)]
    unit = Tolerances(matrix.limits.temperature, matrix.limits.displacement)
    for_outputs = replace(body, C=np.vstack([as_given(watched, body.C), SIDES * body.C]), F=body.C)
    watching = replace(rich, bodies=(for_outputs,))
    if options.method == "galerkin" and options.states <= MOST_STATES:
        (made,) = fitted_galerkin(watching, snapshots, options.states, unit, films, heat).bodies
    else:
        compress = {"galerkin": galerkin, "balanced": balanced}[options.method]
        (made,) = compress(watching, snapshots, options.states, unit).bodies
    return replace(rich, bodies=(replace(made, C=np.asarray(made.F), F=None),))
