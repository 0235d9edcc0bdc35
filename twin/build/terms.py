"""Terms of a body's thermal model that one coefficient of the load model multiplies: of a film or of a joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp


@dataclass(frozen=True)
class Term:
    """A coefficient [W/(m^2 K)], and what it multiplies at a body's n temperatures; n: nodes."""

    coefficient: int  # number among films, then joints of the load model
    matrix: sp.csr_array  # (n, n) m^2
    area: np.ndarray  # (n,) m^2 that sees an environment; zero for joints
    moment: np.ndarray  # (n,) m^3, area times height


def joint_term(coefficient: int, matrix: sp.csr_array) -> Term:
    """Heat from one place of a body to another: no environment sees it."""
    none = np.zeros(matrix.shape[0])
    return Term(coefficient, matrix, none, none)


def columns(found: Sequence[np.ndarray], n: int) -> np.ndarray:
    """Vectors (n,) side by side: (n, len(found)), also of none."""
    return np.column_stack(found) if len(found) else np.zeros((n, 0))
