"""Nodes beside parts as states of the first body, after its mesh and its tanks: `twin.machine.free_nodes`.

    C x' = theta_k a (T_k - x) + q

with the area a and the coefficient of their film, and what sources give. Nothing couples them to the mesh: they share
its body so that all that steps, reduces and stores bodies takes them along. Of the TCP they move what [tcp.expansion]
says, at every position alike.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from twin.build.mesh import BodyMesh
from twin.machine.bodies import tanks_on
from twin.machine.description import Machine
from twin.machine.free_nodes import free_nodes
from twin.rom.load_model import LoadModel
from twin.rom.model import AffineBody
from twin.rom.scales import NodeRow


def with_free_nodes(machine: Machine, first: bool, body: AffineBody, load: LoadModel) -> AffineBody:
    """A body of the full model with the free nodes' states at the end, where it is the first; else itself."""
    nodes = free_nodes(machine)
    if not nodes or not first:
        return body
    m, n, names = len(nodes), body.n, list(nodes)
    capacities = np.array([float(node.capacity or 0.0) for node in nodes.values()])
    none = sp.csr_array((m, m))

    def after(matrix: sp.csr_array, own: sp.csr_array = none) -> sp.csr_array:
        return sp.csr_array(sp.block_diag([matrix, own], format="csr"))

    def longer(columns: np.ndarray) -> np.ndarray:
        return np.concatenate([columns, np.zeros((m, columns.shape[1]))])

    films = _areas(machine, load)
    terms = {k: (after(A), column) for k, A, column in zip(body.theta, body.A, longer(body.M).T, strict=True)}
    for k, areas in films.items():
        A, column = terms.get(k, (sp.csr_array((n + m, n + m)), np.zeros(n + m)))
        own = np.concatenate([np.zeros(n), areas])
        terms[k] = (sp.csr_array(A + sp.diags_array(own)), column + own)
    order = sorted(terms)  # films before joints, as everywhere
    heated = {i: names.index(s) for i, e in enumerate(load.sources) if (s := machine.sources[e.name].surface) in names}
    B = np.hstack([longer(body.B), np.zeros((n + m, len(heated)))])
    for column, node in enumerate(heated.values(), start=body.B.shape[1]):
        B[n + node, column] = 1.0
    return replace(
        body,
        E=after(body.E, sp.csr_array(sp.diags_array(capacities))),
        A0=after(body.A0),
        A=tuple(terms[k][0] for k in order),
        theta=tuple(order),
        M=np.column_stack([terms[k][1] for k in order]),
        B=B,
        sources=(*body.sources, *heated),
        P=longer(body.P),
        C=np.hstack([body.C, np.zeros((len(body.C), m))]),
        G=np.zeros((0, 3, n + m)),
        one=np.append(body.one, np.ones(m)),
        energy=np.append(body.energy, capacities),
        H=None if body.H is None else _moments(body, order, m),
        members=(*body.members, *names),
        first=(*body.first, *range(n, n + m)),
    )


def node_rows(machine: Machine, first: BodyMesh) -> tuple[NodeRow, ...]:
    """What the free nodes move the TCP by; first: the first body's mesh."""
    start = first.n + len(tanks_on(machine, tuple(part.name for part in first.parts)))
    at = {name: start + i for i, name in enumerate(free_nodes(machine))}
    return tuple(
        NodeRow(0, np.array([at[name]]), np.array(row, dtype=float))
        for name, row in machine.tcp.expansion.items()
        if any(row)
    )


def _areas(machine: Machine, load: LoadModel) -> dict[int, np.ndarray]:
    """Per film with free nodes the areas (m,) [m^2] of all of them."""
    nodes = free_nodes(machine)
    found = {}
    for k, film in enumerate(load.films):
        areas = [float(node.area or 0.0) * (name in machine.films[film.name].surfaces) for name, node in nodes.items()]
        if any(areas):
            found[k] = np.array(areas)
    return found


def _moments(body: AffineBody, order: list[int], m: int) -> np.ndarray:
    """Moments of height (n + m, terms): free nodes are as high as the air is measured."""
    assert body.H is not None
    known = dict(zip(body.theta, body.H.T, strict=True))
    return np.column_stack([np.concatenate([known.get(k, np.zeros(body.n)), np.zeros(m)]) for k in order])
