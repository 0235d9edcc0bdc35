"""Matrices from files: which is which by its name, Matrix Market, MATLAB and SciPy files.

Two notations are understood, C K x of finite element programs and E A B C of control theory:

    C x' = -(K + sum_k h_k A_k) x + sum_k h_k A_k 1 T_k + B u        E x' = (A - sum_k h_k A_k) x + ...       y = C x
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from twin.errors import DescriptionError

_FILM = re.compile(r"(?:A|H)_?(\d+)(?:_(\w+))?$", re.I)
_ROLES = {"E": "capacity", "M": "capacity", "K": "conduction", "A": "minus conduction", "B": "inputs", "F": "inputs",
          "Y": "outputs", "C": "C"}  # fmt: skip
_TOLD = (
    "names are K or A (= -K), C or E, A1, A2, ... (films, per W/(m^2*K); A1_web names it), B (inputs), and Y (outputs; "
    "C beside E)"
)


@dataclass(frozen=True)
class Matrices:
    """As they were given, K = -A. n unknowns."""

    capacity: sp.csr_matrix  # (n, n) J/K
    conduction: sp.csr_matrix  # (n, n) W/K
    films: dict[str, sp.csr_matrix]  # (n, n) m^2 each
    inputs: np.ndarray  # (n, n_inputs)
    outputs: np.ndarray  # (n_outputs, n)
    given: dict[str, str]  # role -> where it came from, for messages

    @property
    def n(self) -> int:
        return int(self.capacity.shape[0])


def read_matrices(paths: Iterable[Path]) -> Matrices:
    """Matrices of files by the names of the files, of MATLAB files by the names of the variables.

    Raises DescriptionError: a file that cannot be read, a name that says nothing, one that is there twice, a matrix
    that is missing, sizes that do not fit.
    """
    found: dict[str, tuple[Any, str]] = {}
    for path in paths:
        for name, matrix in _read(path):
            where = f"{path}: {name}" if path.suffix.lower() == ".mat" else str(path)
            role = _role(name, where)
            if role in found:
                raise DescriptionError(f"the same matrix as {found[role][1]}", where, f"give it once; {_TOLD}")
            found[role] = (matrix, where)
    return _sorted(found)


def _read(path: Path) -> list[tuple[str, Any]]:
    if not path.is_file():
        raise DescriptionError("no such file", str(path), "check the spelling")
    kind = path.suffix.lower()
    try:
        if kind == ".mtx":
            return [(path.stem, scipy.io.mmread(path))]
        if kind == ".npz":
            return [(path.stem, sp.load_npz(path))]
        if kind == ".mat":
            return [(k, v) for k, v in scipy.io.loadmat(path).items() if not k.startswith("__")]
    except NotImplementedError as e:
        raise DescriptionError("a MATLAB file of version 7.3", str(path), "write it with save(..., '-v7')") from e
    except Exception as e:  # what readers raise of damaged files has no common type
        raise DescriptionError(f"cannot be read: {e}", str(path), "export it again as Matrix Market (.mtx)") from e
    remedy = "give Matrix Market (.mtx), MATLAB (.mat) or SciPy (.npz) files"
    if kind == ".full":
        remedy = "write its matrices from APDL: *SMAT,K,D,IMPORT,FULL,file.full,STIFF and *EXPORT,K,MMF,K.mtx"
    raise DescriptionError("no format of matrices", str(path), remedy)


def _role(name: str, where: str) -> str:
    if film := _FILM.match(name):
        return f"film {film[2] or 'film_' + film[1]}"
    if name.upper() in _ROLES:
        return _ROLES[name.upper()]
    raise DescriptionError(f"which matrix is '{name}'?", where, _TOLD)


def _sorted(found: dict[str, tuple[Any, str]]) -> Matrices:
    given = {role: where for role, (_, where) in found.items()}
    values = {role: _numbers(matrix, where) for role, (matrix, where) in found.items()}
    if "C" in values:  # heat capacity beside K, outputs beside E
        role = "outputs" if "capacity" in values else "capacity"
        values[role], given[role] = values.pop("C"), given.pop("C")
    if "minus conduction" in values:
        if "conduction" in values:
            raise DescriptionError("A and K are both there", given["conduction"], "A = -K: give one of them")
        values["conduction"] = -values.pop("minus conduction")
        given["conduction"] = given.pop("minus conduction")
    for role, what in (("capacity", "C (or E), the heat capacity"), ("conduction", "K (or A = -K), the conduction")):
        if role not in values:
            raise DescriptionError(f"{what}, is missing", ", ".join(given.values()) or "no files", _TOLD)
    n = values["capacity"].shape[0]
    films = {role[5:]: m for role, m in values.items() if role.startswith("film ")}
    for role, matrix in values.items():
        wanted = {"inputs": (n, matrix.shape[1]), "outputs": (matrix.shape[0], n)}.get(role, (n, n))
        if matrix.shape != wanted:
            raise DescriptionError(
                f"{matrix.shape[0]} x {matrix.shape[1]}, where {wanted[0]} x {wanted[1]} is needed", given[role], _TOLD
            )
    none = sp.csr_matrix((0, n))
    return Matrices(
        values["capacity"], values["conduction"], films,
        np.asarray(values.get("inputs", none.T).todense()), np.asarray(values.get("outputs", none).todense()), given,
    )  # fmt: skip


def _numbers(matrix: Any, where: str) -> sp.csr_matrix:
    try:
        found = sp.csr_matrix(matrix)
        if np.iscomplexobj(found.data) and not np.any(found.data.imag):
            found = found.real
        found = found.astype(float, casting="same_kind" if found.dtype.kind == "c" else "unsafe")
    except (TypeError, ValueError) as e:
        raise DescriptionError("is no real matrix", where, "export real numbers") from e
    if not np.isfinite(found.data).all():
        raise DescriptionError("holds numbers that are not finite", where, "look at the export")
    return found
