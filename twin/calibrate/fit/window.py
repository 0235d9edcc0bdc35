"""A small model of one machine in one set of runs, for the hundreds of runs that a fit takes.

The artefact is certified for every load in its box; a fit asks for one load history and the parameters around it. The
window model is the Galerkin projection of the artefact's whole machine on the leading POD modes of trajectories of the
artefact's own runtime: at nominal parameters and at random draws from the priors. It inherits stability (congruence,
`twin.build.project`), keeps all affine terms, contacts and laws, and is stepped by the same laws. How far it is from
the artefact's runtime is measured at a draw it was not made from, and again at the fitted values (`fit`), never
assumed. POD: Sirovich 1987; several parameters: e.g. Benner, Gugercin, Willcox, SIAM Review 57, 2015, section 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg

from twin.errors import TwinError
from twin.rom.model import AffineBody, MachineModel


def require_galerkin(model: MachineModel) -> None:
    """Raises TwinError for oblique artefacts: a projection of them need not be stable."""
    if not all(body.symmetric for body in model.bodies):
        raise TwinError(
            "an artefact of method 'balanced' cannot be fitted", model.name, "build it with --method galerkin"
        )


def merged(model: MachineModel, V: np.ndarray) -> MachineModel:
    """The machine as one body restricted to x = V z; V (N, r), rows of the bodies one after the other.

    V must be orthonormal in E and hold the constant field.
    """
    load = model.load_model
    r, n_theta = V.shape[1], len(load.theta_names)
    E, A0, A = np.zeros((r, r)), np.zeros((r, r)), np.zeros((n_theta, r, r))
    M, H = np.zeros((r, n_theta)), np.zeros((r, n_theta))
    B, P = np.zeros((r, len(load.sources))), np.zeros((r, len(load.ports)))
    C, G = np.zeros((len(model.sensors), r)), np.zeros((len(model.poses), 3, r))
    one, graded = np.zeros(r), any(b.H is not None for b in model.bodies)
    climbs, raised = any(b.raised is not None for b in model.bodies), np.zeros((len(load.axes), r, n_theta))
    members: list[str] = []
    E_members, G_members = [], []
    for body, Vb in zip(model.bodies, np.split(V, np.cumsum([b.n for b in model.bodies])[:-1]), strict=True):
        E += Vb.T @ body.E @ Vb
        A0 += Vb.T @ body.A0 @ Vb
        for column, k in enumerate(body.theta):
            A[k] += Vb.T @ body.A[column] @ Vb
            M[:, k] += Vb.T @ body.M[:, column]
            if body.H is not None:
                H[:, k] += Vb.T @ body.H[:, column]
            if body.raised is not None:
                raised[:, :, k] += body.raised[:, :, column] @ Vb
        B[:, list(body.sources)] += Vb.T @ body.B
        P[:, list(body.ports)] += Vb.T @ body.P
        C[list(body.sensors)] += body.C @ Vb
        G += body.G @ Vb
        one += Vb.T @ body.E @ body.one
        members += body.members
        if body.E_members is not None and body.G_members is not None:
            E_members += [Vb.T @ e @ Vb for e in body.E_members]
            G_members += [g @ Vb for g in body.G_members]
    whole = AffineBody(
        name="window",
        E=(E + E.T) / 2,
        A0=(A0 + A0.T) / 2,
        A=tuple((a + a.T) / 2 for a in A),
        theta=tuple(range(n_theta)),
        M=M,
        B=B,
        sources=tuple(range(len(load.sources))),
        P=P,
        ports=tuple(range(len(load.ports))),
        C=C,
        sensors=tuple(range(len(model.sensors))),
        G=G,
        one=one,
        energy=E @ one,
        H=H if graded else None,
        raised=raised if climbs else None,
        members=tuple(members) if E_members else (),
        E_members=np.array(E_members) if E_members else None,
        G_members=np.array(G_members) if G_members else None,
    )
    return replace(model, bodies=(whole,), structure=None)  # its TCP rows are those at the poses


def window_basis(
    model: MachineModel,
    snapshots: Sequence[np.ndarray],
    fields: np.ndarray,
    noise_temperature: float,
    rows: np.ndarray,
    tail: float,
    largest: int = 160,
) -> np.ndarray:
    """V (N, r), orthonormal in E: the leading modes of all snapshots, with the constant field and `fields` kept.

    snapshots: (N, m) each, states T - T_ref of the artefact; fields (N, f): initial fields that a fit may add.
    tail: share of the squared snapshots that is left out.
    rows (k, N): outputs in units of their noise. A mode counts by what it does to them and, with the noise of one
    sensor over the whole machine, to the stored heat.
    """
    E = scipy.linalg.block_diag(*[b.E for b in model.bodies])
    one = np.concatenate([b.one for b in model.bodies])
    W = E / (one @ E @ one) / noise_temperature**2 + rows.T @ rows / max(1, len(rows))
    L = np.linalg.cholesky((W + W.T) / 2)
    kept = np.column_stack([one, fields])
    kept, _ = np.linalg.qr(np.linalg.cholesky(E).T @ kept)
    kept = np.linalg.solve(np.linalg.cholesky(E).T, kept)
    X = np.column_stack(list(snapshots))
    X = X - kept @ (kept.T @ (E @ X))
    (R,) = scipy.linalg.qr((L.T @ X).T, mode="r", overwrite_a=True, check_finite=False)
    U, s, _ = np.linalg.svd(R[: X.shape[0]].T, full_matrices=False)
    left_out = 1.0 - np.cumsum(s**2) / max(float(np.sum(s**2)), 1e-300)
    r = min(int(np.searchsorted(-left_out, -tail)) + 1, largest, len(s))
    modes = scipy.linalg.solve_triangular(L.T, U[:, :r], lower=False)
    basis = np.column_stack([kept, modes])
    half = np.linalg.cholesky(E).T
    Q, triangle = np.linalg.qr(half @ basis)
    use = np.abs(np.diag(triangle)) > 1e-9 * np.abs(np.diag(triangle)).max()
    return np.asarray(np.linalg.solve(half, Q[:, use]))
