"""The TCP displacement at any axis position: by the elastic structure where the model has it, else between poses.

    w(position) = sum over bodies of Z_b(position) W_b x_b,        G_b(position) = Z_b(position) W_b

W_b x_b are the elastic inputs of a body (`twin.rom.model`): a pose costs one dense system of the size of the springs,
whatever the number of states, so positions are computed exactly where they are asked for, each once. G has kinks
wherever a pad passes a station of its rail: interpolation between the poses of a grid converges slowly, and is left for
artefacts without a structure.

Positions are (m, n_axes) [m] in the order of `pose_axes`, or (m, n_axes + n_turning) with the angles [rad] of the
rotary axes of the structure (`MachineModel.turning`) behind them; without, these stand at zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.errors import ModelError
from twin.rom.elastic_structure import ElasticStructure
from twin.rom.lumped_structure import LumpedStructure
from twin.rom.model import MachineModel
from twin.rom.poses import Kind, pose_weights

SAME = 1e-6  # of the largest TCP row: far above rounding, far below what any spring or guide adds
MOST = 1000  # different positions of which a model keeps all rows: some 10 MB each part, and a second or two
THERE = 1e-9  # m, from a position that a row is known of


def is_exact(model: MachineModel) -> bool:
    """Whether the model knows its TCP displacement at every position, not at the poses of its grid alone."""
    return model.structure is not None and all(body.W is not None for body in model.bodies)


def refuse_other_structure(model: MachineModel) -> None:
    """Raises KeyError where the structure does not give the TCP rows that the model has at the first pose of its grid:
    something in it is damaged."""
    if not is_exact(model) or not len(model.poses):
        return
    try:
        rows = [Z[0] @ inputs(model, b) for b, Z in enumerate(elastic_rows(model, model.poses[:1]))]
        if model.turning:
            elastic_rows(model, np.append(model.poses[0], np.ones(len(model.turning)))[None])
    except (ModelError, ValueError, LookupError, ArithmeticError, np.linalg.LinAlgError) as e:
        raise KeyError(f"'structure' cannot be solved: {e}") from e
    size = max(float(np.abs(body.G).max(initial=0.0)) for body in model.bodies)
    if any(
        not np.abs(own - body.G[0]).max(initial=0.0) <= SAME * size
        for own, body in zip(rows, model.bodies, strict=True)
    ):
        raise KeyError("'structure' is not that of the TCP rows 'G'")


def elastic_rows(model: MachineModel, positions: np.ndarray) -> tuple[np.ndarray, ...]:
    """Z_b (m, 3, p_b) per body at positions (m, n_axes) [m], axes in the order of `pose_axes`.

    Raises ValueError for a model without structure, or another number of axes.
    """
    structure = model.structure
    if structure is None:
        raise ValueError("the model has no elastic structure")
    if isinstance(structure, LumpedStructure):
        each = [structure.rows(p) for p in positions]
        sizes = [rows.shape[1] for rows in structure.constant]
        return tuple(np.array([rows[b] for rows in each]).reshape(-1, 3, n) for b, n in enumerate(sizes))
    Z = [np.zeros((len(positions), 3, len(inputs(model, b)))) for b in range(len(model.bodies))]
    for i, position in enumerate(positions):
        for all_rows, ports in zip(Z, structure.rows(position), strict=True):
            all_rows[i, :, : ports.shape[1]] = ports  # what scales read follows the ports
        for b, at, growth in structure.system.scale_rows(position):
            Z[b][i][:, at] += growth
        if structure.cut is not None and (turned := structure.turned_rows(position)):
            for b, at, ports in zip(structure.cut.owners, structure.cut.inputs, turned, strict=True):
                Z[b][i][:, at] += ports
    return tuple(Z)


def tcp_rows(model: MachineModel, positions: np.ndarray) -> tuple[np.ndarray, ...]:
    """G_b (m, 3, n_b) [m/K] per body at positions (m, n_axes) [m]: the TCP displacement is sum_b G_b x_b.

    Exact where the model has a structure (`is_exact`), interpolated between the poses of its grid otherwise; with the
    values of the nearest point of the grid for positions outside it. For full and reduced models.
    """
    different, which = _distinct(_within_grid(model, positions))
    if not is_exact(model):
        weights, _ = row_weights(model, different)
        return tuple(np.tensordot(weights, body.G, 1)[which] for body in model.bodies)
    rows = elastic_rows(model, different)
    return tuple((Z @ inputs(model, b))[which] for b, Z in enumerate(rows))


def at_positions(model: MachineModel, positions: np.ndarray) -> MachineModel:
    """The model with the TCP rows of positions (m, n_axes) [m] within its grid besides those of its poses.

    Its own where it has no structure or no axes, or where there are none or more than MOST different positions.
    """
    different, _ = _distinct(_within_grid(model, positions))
    if not is_exact(model) or not model.pose_axes or not 0 < len(different) <= MOST:
        return model
    bodies = []
    for b, (body, Z) in enumerate(zip(model.bodies, elastic_rows(model, different), strict=True)):
        members = body.G_members
        if members is not None and body.W_members is not None:
            members = np.concatenate([members, np.einsum("pcw,mwn->mpcn", Z, body.W_members)], axis=1)
        bodies.append(replace(body, G=np.concatenate([body.G, Z @ inputs(model, b)]), G_members=members))
    poses = np.concatenate([_with_angles(model, model.poses), _with_angles(model, different)])
    return replace(model, bodies=tuple(bodies), poses=poses, scattered=len(different))


def row_weights(model: MachineModel, positions: np.ndarray, kind: Kind = "lagrange") -> tuple[np.ndarray, np.ndarray]:
    """Weights (m, n_poses) of the model's TCP rows at positions (m, n_axes) [m], and which lie outside its grid (m,).

    One where a pose of its own is there (`at_positions`), interpolated between the poses of the grid elsewhere. That is
    at angles zero: other angles are outside.
    """
    n = len(model.pose_axes)
    weights, beyond = pose_weights(model.pose_grid, positions[:, :n], kind)
    outside = beyond | positions[:, n:].any(axis=1)
    if model.scattered and len(positions):
        weights = np.hstack([weights, np.zeros((len(positions), model.scattered))])
        own = _with_angles(model, model.poses[-model.scattered :])
        apart = np.abs(_with_angles(model, positions)[:, None, :] - own).max(axis=2)
        there = apart.min(axis=1) < THERE
        outside[there] = beyond[there]
        weights[there] = np.eye(weights.shape[1])[apart[there].argmin(axis=1) - model.scattered]
    return weights, outside


def tcp_at(model: MachineModel, x: Sequence[np.ndarray], positions: np.ndarray) -> np.ndarray:
    """TCP displacements (m, 3) [m] of states x_b (m, n_b) or (n_b,) per body at positions (m, n_axes) [m].

    One state per position, or one for all. `by_body` makes them of whole states. Exact or interpolated as `tcp_rows`.
    """
    different, which = _distinct(_within_grid(model, positions))
    exact = is_exact(model)
    if exact:
        rows = elastic_rows(model, different)
    else:
        weights, _ = row_weights(model, different)
    w = np.zeros((len(which), 3))
    for b, (body, states) in enumerate(zip(model.bodies, x, strict=True)):
        if exact:
            read = states @ inputs(model, b).T
            w += np.einsum("mcp,p->mc" if read.ndim == 1 else "mcp,mp->mc", rows[b][which], read)
        else:
            at_poses = np.tensordot(states, body.G, (-1, 2))
            w += np.einsum("mp,pc->mc" if at_poses.ndim == 2 else "mp,mpc->mc", weights[which], at_poses)
    return w


def tcp_over(model: MachineModel, x: Sequence[np.ndarray], positions: np.ndarray) -> np.ndarray:
    """TCP displacements (k, m, 3) [m] of k states x_b (k, n_b) per body, each at all positions (m, n_axes) [m]."""
    positions = _within_grid(model, positions)
    if not is_exact(model):
        weights, _ = row_weights(model, positions)
        at_poses = sum(np.tensordot(states, body.G, (1, 2)) for body, states in zip(model.bodies, x, strict=True))
        return np.einsum("mp,kpc->kmc", weights, at_poses)
    rows = elastic_rows(model, positions)
    parts = [np.tensordot(states @ inputs(model, b).T, rows[b], (1, 2)) for b, states in enumerate(x)]
    return np.asarray(np.sum(parts, axis=0))


def tilt_at(model: MachineModel, x: Sequence[np.ndarray], positions: np.ndarray) -> np.ndarray | None:
    """Rotations (m, 3) [rad] of the tool against the work at states x_b (n_b,) and positions (m, n_axes) [m].

    About x, y, z of the machine. None of models that do not know it: lumped ones, and those without structure.
    """
    if not isinstance(model.structure, ElasticStructure) or not is_exact(model):
        return None
    tilt = np.zeros((len(positions), 3))
    read = [inputs(model, b) @ states for b, states in enumerate(x)]
    for i, position in enumerate(_within_grid(model, positions)):
        for ports, displacement in zip(model.structure.tilt_rows(position), read, strict=True):
            tilt[i] += ports @ displacement[: ports.shape[1]]  # what scales read follows the ports
        if model.structure.cut is not None and (turned := model.structure.turned_tilt_rows(position)):
            for b, at, ports in zip(model.structure.cut.owners, model.structure.cut.inputs, turned, strict=True):
                tilt[i] += ports @ read[b][at]
    return tilt


def places(model: MachineModel, position: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Positions as this module takes them, of positions (m, n_axes) [m] and angles (m, n_rotary) [rad] of a drive."""
    order = [[axis.name for axis in model.load_model.axes].index(name) for name in model.pose_axes]
    return np.hstack([position[:, order], angle]) if model.turning else position[:, order]


def by_body(model: MachineModel, states: np.ndarray) -> list[np.ndarray]:
    """States (..., N) of the machine as (..., n_b) per body."""
    return np.split(states, np.cumsum([body.n for body in model.bodies])[:-1], axis=-1)


def inputs(model: MachineModel, body: int) -> np.ndarray:
    """W (p_b, n_b) of a body. Raises ValueError where it has none."""
    W = model.bodies[body].W
    if W is None:
        raise ValueError(f"body '{model.bodies[body].name}' has no elastic inputs")
    return W


def _with_angles(model: MachineModel, positions: np.ndarray) -> np.ndarray:
    """Positions (m, n_axes + n_turning), angles zero where they have none."""
    missing = len(model.pose_axes) + len(model.turning) - positions.shape[1]
    return np.pad(positions, ((0, 0), (0, missing)))


def _within_grid(model: MachineModel, positions: np.ndarray) -> np.ndarray:
    """Positions, those outside the grid moved to its border: pads may have left their rails there. Angles stay."""
    positions = np.asarray(positions, dtype=float)
    n = len(model.pose_grid)
    if not n:
        return positions
    low, high = ([nodes[k] for nodes in model.pose_grid] for k in (0, -1))
    return np.hstack([np.clip(positions[:, :n], low, high), positions[:, n:]])


def _distinct(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The different ones (k, n_axes) of positions (m, n_axes), and which of them each is (m,)."""
    positions = np.asarray(positions, dtype=float)
    if not positions.shape[1]:
        return positions[:1], np.zeros(len(positions), dtype=int)
    different, which = np.unique(positions, axis=0, return_inverse=True)
    return different, which.reshape(-1)
