"""Are the matrices of a reduced machine such as the theory makes them, and do its indices cover its ports and sensors?

Every projection keeps the field that is 1 K everywhere, so these hold to rounding whatever the machine: conduction
does not see it, films see their area, sensors and ports read 1 K, a watt fed in is a watt. A Galerkin projection
besides keeps symmetry and definiteness, which make the model stable for every film, conductance and position; an
oblique one does not, and is held to a capacity that can be solved with and to rates that do not grow.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from twin.rom.check_load_model import check_index
from twin.rom.model import AffineBody, MachineModel
from twin.units import machine_temperature

EXACT = 1e-9  # of the terms of a sum: shipped machines are within 1e-13, and a wrong matrix is off by its own size
SLACK = 1e-9  # of the largest entry: a semidefinite matrix has eigenvalues of -1e-17 of it, by rounding
SLOWEST = 1e-12  # 1/s, times the capacity: a rate of 30,000 years is none
SOLVABLE = 1e12  # condition of an oblique capacity: four digits of a solution are left


def check_model(model: MachineModel) -> tuple[str, ...]:
    """One line per body that says what was checked. Raises KeyError for the first thing that cannot be."""
    load = model.load_model
    try:
        machine_temperature(model.reference_temperature)
    except ValueError as e:
        raise KeyError(f"'reference_temperature': {e}") from None
    _indices(model)
    _poses(model)
    joints = [joint.conductance for joint in load.joints]
    ends = [np.array([*(getattr(film, end) for film in load.films), *joints]) for end in ("low", "high")]
    return tuple(_body(body, len(load.films), ends) for body in model.bodies)


def _indices(model: MachineModel) -> None:
    """Ports and sensors belong to one body each, sources of surfaces to one, coefficients to any number."""
    load = model.load_model
    counts = {"theta": len(load.theta_names), "sources": len(load.sources), "ports": len(load.ports)}
    counts["sensors"] = len(model.sensors)
    for body in model.bodies:
        for kind, count in counts.items():
            for index in getattr(body, kind):
                check_index(index, count, f"bodies/{body.name}/{kind}")
    surface = [j for j, source in enumerate(load.sources) if not source.contact]
    for kind, wanted in (
        ("ports", range(counts["ports"])),
        ("sensors", range(counts["sensors"])),
        ("sources", surface),
    ):
        owned = sorted(index for body in model.bodies for index in getattr(body, kind))
        if owned != list(wanted):
            raise KeyError(f"'bodies/*/{kind}' do not name each of the {len(wanted)} {kind} once")
    for name, index in model.ambient_sensors:
        check_index(index, len(load.environments), f"ambient_sensor_environment of {name}")
    for rail in load.rails:
        own = set(range(rail.first_port, rail.first_port + len(rail.stations)))
        if not any(own <= set(body.ports) for body in model.bodies):
            raise KeyError(f"'load_model.rails.{rail.name}' has its segments on several bodies")


def _poses(model: MachineModel) -> None:
    unknown = set(model.pose_axes) - {axis.name for axis in model.load_model.axes}
    if unknown:
        raise KeyError(f"'pose_axis' names '{min(unknown)}', which is no axis")
    for axis, nodes in zip(model.pose_axes, model.pose_grid, strict=True):
        if nodes.ndim != 1 or not len(nodes) or np.any(np.diff(nodes) <= 0.0):
            raise KeyError(f"'pose_grid_{axis}' does not increase")
    grid = np.array(list(itertools.product(*model.pose_grid)), dtype=float)
    if not np.array_equal(model.poses, grid.reshape(len(grid), len(model.pose_axes))):
        raise KeyError("'pose_position' is not that of the grids")


def _body(body: AffineBody, n_films: int, ends: Sequence[np.ndarray]) -> str:
    """ends: coefficients (n_theta,) that the model is certified for."""
    where = f"bodies/{body.name}"
    terms = [body.E, body.A0, *body.A]
    names = ["E", "A0", *(f"A[{k}]" for k in range(len(body.A)))]
    if body.symmetric:
        for name, matrix in zip(names, terms, strict=True):
            if name == "E" or not _nothing(body, matrix):
                _semidefinite(matrix, f"{where}/{name}", strictly=name == "E")
    else:
        _stable(body, ends, where)
    left = body.left_one
    worst = max(
        _equal(body.E.T @ left, body.energy, body.E.T, left, f"{where}/energy", "the heat capacity E of 1 K"),
        0.0
        if _nothing(body, body.A0)
        else _equal(body.A0 @ body.one, 0.0, body.A0, body.one, f"{where}/A0", "free of heat at 1 K everywhere"),
        *(_film(body, k, n_films, where) for k in range(len(body.A))),
        _equal(left @ body.P, 1.0, left, body.P, f"{where}/P", "1 W of 1 W"),
        _equal(left @ body.B, 1.0, left, body.B, f"{where}/B", "1 W of 1 W"),
        _equal(
            body.port_rows @ body.one, 1.0, body.port_rows, body.one, f"{where}/P", "1 K of a body that is 1 K warm"
        ),
        _equal(body.source_rows @ body.one, 1.0, body.source_rows, body.one, f"{where}/B", "1 K of a body 1 K warm"),
        _equal(body.C @ body.one, 1.0, body.C, body.one, f"{where}/C", "1 K of a body that is 1 K warm"),
        *(_shares(body, name, where) for name in ("E", "G", "W")),
    )
    kind = (
        "E symmetric and positive definite, A0, A symmetric and semidefinite"
        if body.symmetric
        else "E solvable, no rate that grows"
    )
    return f"{body.name}: {body.n} states; {kind}; 1 K and 1 W kept to {worst:.0e}"


def _stable(body: AffineBody, ends: Sequence[np.ndarray], where: str) -> None:
    """An oblique body: E can be solved with, and nothing grows at certified coefficients; without its joints it may."""
    if not np.linalg.cond(body.E) < SOLVABLE:
        raise KeyError(f"'{where}/E' cannot be solved with")
    for theta in ends:
        terms = sum((theta[k] * a for k, a in zip(body.theta, body.A, strict=True)), np.zeros_like(body.A0))
        rates = np.linalg.eigvals(np.linalg.solve(body.E, body.A0 + terms))
        if rates.real.min(initial=0.0) < -SLACK * np.abs(rates).max(initial=0.0):
            raise KeyError(f"'{where}/A0' and 'A' let temperatures grow: a rate of {-rates.real.min():.2g} 1/s")


def _film(body: AffineBody, k: int, n_films: int, where: str) -> float:
    """A film takes up, of 1 K everywhere, what its environment gives at 1 K; a joint takes up nothing."""
    wanted = body.M[:, k] if body.theta[k] < n_films else 0.0
    if body.theta[k] >= n_films and body.M[:, k].any():
        raise KeyError(f"'{where}/M' feeds a joint from an environment")
    if body.theta[k] >= n_films and _nothing(body, body.A[k]):
        return 0.0
    return _equal(body.A[k] @ body.one, wanted, body.A[k], body.one, f"{where}/A[{k}]", "the film of M")


def _shares(body: AffineBody, name: str, where: str) -> float:
    whole, shares = getattr(body, name), getattr(body, f"{name}_members")
    if whole is None or shares is None:
        return 0.0
    sizes = np.abs(shares).sum(axis=0).max(initial=0.0)
    return _within(
        np.abs(shares.sum(axis=0) - whole).max(initial=0.0), sizes, f"{where}/{name}_members", f"that {name}"
    )


def _nothing(body: AffineBody, matrix: np.ndarray) -> bool:
    """Whether a conductance is rounding: a body of a single state conducts nothing within itself."""
    return float(np.abs(matrix).max(initial=0.0)) <= SLOWEST * float(np.abs(body.E).max(initial=0.0))


def _semidefinite(matrix: np.ndarray, where: str, strictly: bool) -> None:
    """Symmetric bit by bit but for rounding, and without negative eigenvalues; `strictly` without zero ones."""
    size = float(np.abs(matrix).max(initial=0.0))
    if np.abs(matrix - matrix.T).max(initial=0.0) > EXACT * size:
        raise KeyError(f"'{where}' is not symmetric")
    raised = matrix if strictly else matrix + SLACK * size * np.eye(len(matrix))
    try:
        np.linalg.cholesky(raised)
    except np.linalg.LinAlgError:
        raise KeyError(f"'{where}' is not positive {'definite' if strictly else 'semidefinite'}") from None


def _equal(
    found: np.ndarray, wanted: np.ndarray | float, left: np.ndarray, right: np.ndarray, where: str, what: str
) -> float:
    """How far left @ right is from what is wanted, as a share of the terms of its sums; raises where that is much."""
    terms = np.abs(left).max(initial=0.0) * np.abs(right).sum(axis=0).max(initial=0.0)
    terms = max(float(terms), float(np.abs(wanted).max(initial=0.0) if isinstance(wanted, np.ndarray) else wanted))
    return _within(np.abs(found - wanted).max(initial=0.0), terms, where, what)


def _within(error: float, size: float, where: str, what: str) -> float:
    if not error <= EXACT * size:
        raise KeyError(f"'{where}' is not {what}: off by {error / size if size else np.inf:.1e} of its terms")
    return float(error / size) if size else 0.0
