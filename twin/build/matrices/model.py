"""Matrices as a machine of one body: what drives it are the films' coefficients and surroundings, and the inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from twin.build.matrices.files import Matrices
from twin.errors import DescriptionError
from twin.machine.description import Limits
from twin.rom.load_model import EnvironmentWiring, Film, LawUse, LoadModel, Signal, Source
from twin.rom.model import AffineBody, MachineModel


@dataclass(frozen=True)
class MatrixOptions:
    """What matrices do not say."""

    films: tuple[float, float] = (2.0, 40.0)  # W/(m^2 K), certified range: still to moving air
    surroundings: tuple[float, float] = (10.0, 40.0)  # degC, certified range
    inputs: tuple[float, float] = (0.0, 1000.0)  # certified range, in the unit of the inputs: W where B sums to 1
    reference: float = 20.0  # degC
    output_names: Sequence[str] = ()
    input_names: Sequence[str] = ()
    limits: Limits = field(default_factory=Limits)


@dataclass(frozen=True)
class Output:
    """A row of the outputs as sensors: one, or the two sides of a difference, `scale` (warm - cold)."""

    name: str
    sensors: tuple[str, ...]
    rows: np.ndarray  # (1 or 2, n), each sums to 1
    scale: float


def outputs(matrices: Matrices, options: MatrixOptions) -> tuple[Output, ...]:
    """A reduced model keeps 1 K as 1 K, so a difference is kept as two weighted means: NAME_plus and NAME_minus."""
    names = _names("output", len(matrices.outputs), options.output_names)
    found = []
    for name, row in zip(names, matrices.outputs, strict=True):
        if abs(row.sum()) > 0.5:
            found.append(Output(name, (name,), row[None] / row.sum(), 1.0))
        else:
            sides = np.stack([np.maximum(row, 0.0), np.maximum(-row, 0.0)])
            scale = sides.sum(axis=1, keepdims=True)
            found.append(Output(name, (f"{name}_plus", f"{name}_minus"), sides / scale, float(scale.mean())))
    return tuple(found)


def as_given(watched: Sequence[Output], C: np.ndarray) -> np.ndarray:
    """(n_outputs, n): the outputs that were given, of the rows C of their sensors in any coordinates."""
    rows, at = [], 0
    for output in watched:
        sides = C[at : at + len(output.sensors)]
        rows.append(sides[0] if len(sides) == 1 else output.scale * (sides[0] - sides[1]))
        at += len(sides)
    return np.array(rows)


def model_of(name: str, matrices: Matrices, options: MatrixOptions) -> MachineModel:
    """The full model, sparse. The self-tests have passed; what files round is made exact: symmetry, and K 1 = 0.

    Film NAME reads the signals NAME [W/(m^2 K)] and NAME_temperature [degC].
    Raises DescriptionError for ranges that are none, or names that are too few or twice there.
    """
    _ranges(options)
    watched = outputs(matrices, options)
    inputs = _names("input", matrices.inputs.shape[1], options.input_names)
    films = tuple(matrices.films)
    sensors = tuple(s for output in watched for s in output.sensors)
    if twice := sorted({s for s in (*sensors, *inputs, *films) if (*sensors, *inputs, *films).count(s) > 1}):
        raise DescriptionError(f"'{twice[0]}' is there twice", name, "give other names")
    n, one = matrices.n, np.ones(matrices.n)
    totals = matrices.inputs.sum(axis=0)
    E, K, A = _clean(matrices.capacity), _clean(matrices.conduction), [_clean(a) for a in matrices.films.values()]
    body = AffineBody(
        name=name, E=E, A0=(K - sp.diags(K @ one)).tocsr(), A=tuple(A),
        theta=tuple(range(len(films))), M=np.column_stack([a @ one for a in A]),
        B=matrices.inputs / totals, sources=tuple(range(len(inputs))),
        P=np.zeros((n, 0)), ports=(), C=np.vstack([o.rows for o in watched]), sensors=tuple(range(len(sensors))),
        G=np.zeros((1, 3, n)), one=one, energy=E @ one,
    )  # fmt: skip
    load = LoadModel(
        signals=(
            *(Signal(f, f, "W/(m^2*K)", "value", *options.films) for f in films),
            *(Signal(f"{f}_temperature", f"{f}_temperature", "degC", "value", *options.surroundings) for f in films),
            *(Signal(i, i, "W", "value", *options.inputs) for i in inputs),
        ),
        axes=(),
        environments=tuple(EnvironmentWiring(f, f"{f}_temperature", options.reference) for f in films),
        sources=tuple(
            Source(i, LawUse("power_share", {"share": 1.0}, {"power": i}), float(total), "", 0.5)
            for i, total in zip(inputs, totals, strict=True)
        ),
        films=tuple(
            Film(f, LawUse("logged_film", {}, {"coefficient": f}), k, *options.films) for k, f in enumerate(films)
        ),
        joints=(), ports=(), rails=(), pairs=(),
    )  # fmt: skip
    return MachineModel(name, (body,), load, options.reference, sensors, (), (), (), np.zeros((1, 0)))


def _clean(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """Symmetric but for the last digits of the file: symmetric."""
    return ((matrix + matrix.T) / 2.0).tocsr()


def _names(kind: str, count: int, given: Sequence[str]) -> tuple[str, ...]:
    if given and len(given) != count:
        raise DescriptionError(f"{len(given)} names of {count} {kind}s", f"--names {kind}s", "name all of them")
    return tuple(given) or tuple(f"{kind}_{i}" for i in range(1, count + 1))


def _ranges(options: MatrixOptions) -> None:
    low, high = options.films
    if not 0.0 < low < high:
        raise DescriptionError(
            f"{low:g} .. {high:g} is no range of film coefficients", "--range films", "0 < low < high"
        )
    for key in ("surroundings", "inputs"):
        low, high = getattr(options, key)
        if not low < high or (key == "inputs" and low < 0.0):
            remedy = "low < high; inputs are heat, 0 and above"
            raise DescriptionError(f"{low:g} .. {high:g} is no range", f"--range {key}", remedy)


def stem(paths: Sequence[Path]) -> str:
    """A name for what was imported: that of the one MATLAB file, else of the folder."""
    return paths[0].stem if len(paths) == 1 else paths[0].resolve().parent.name or "matrices"
