"""Gamma, the conductance matrix of moving contacts between port temperatures, from what a drive says of the pads.

    q_port = -Gamma T_port,    Gamma = sum over pairs of g mean(d d^T),    d = pad minus weighted segments

(`twin.rom.contact`): symmetric, its rows sum to zero. It is tridiagonal on every rail, diagonal on pads, and of rank
one between a rail and a pad: these entries are made here, once for all steps of a run, and whoever needs the matrix, a
product with it or its projection gets it from them.

Functions with `xp` take numpy and JAX arrays alike (numpy or jax.numpy).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from twin.rom.drive import Drive
from twin.rom.load_model import LoadModel
from twin.rom.scatter import add

Array = Any


@dataclass(frozen=True)
class ContactPlaces:
    """Where moving contacts are among the ports. Hashable: a compiled step is specialised on it."""

    n_ports: int
    n_contacts: int
    contact_of_pair: tuple[int, ...]  # in the order of LoadModel.contacts
    pad: tuple[int, ...]  # per pair: port of the pad,
    first: tuple[int, ...]  # first port and
    count: tuple[int, ...]  # number of segments of its rail
    sources: tuple[int, ...]  # whose heat goes into contacts

    @classmethod
    def of(cls, load: LoadModel) -> ContactPlaces:
        names, rails = load.contacts, [load.rails[p.rail] for p in load.pairs]
        return cls(
            n_ports=len(load.ports),
            n_contacts=len(names),
            contact_of_pair=tuple(names.index(p.contact) for p in load.pairs),
            pad=tuple(p.pad_port for p in load.pairs),
            first=tuple(r.first_port for r in rails),
            count=tuple(len(r.stations) for r in rails),
            sources=load.contact_sources,
        )


@dataclass(frozen=True)
class ContactEntries:
    """Gamma by its entries; leading axes: steps, and contacts where these are kept apart."""

    diagonal: Array  # (..., n_ports) W/K
    neighbour: Array  # (..., n_ports) W/K, entry (i, i + 1); zero at the end of a rail and for pads
    weight: Array  # (..., n_pairs, n_segments) W/K: minus the entries between pad and rail segments

    def at(self, step: int) -> ContactEntries:
        return ContactEntries(self.diagonal[step], self.neighbour[step], self.weight[step])


def contact_entries(load: LoadModel, drive: Drive, steps: slice = slice(None)) -> ContactEntries:
    """All contacts of some steps of a drive together: diagonal and neighbour (n, n_ports)."""
    apart = _entries(load, drive, [0] * len(load.pairs), 1, steps)
    return ContactEntries(apart.diagonal[:, 0], apart.neighbour[:, 0], apart.weight)


def entries_by_contact(load: LoadModel, drive: Drive) -> ContactEntries:
    """Each moving contact on its own: diagonal and neighbour (n, n_contacts, n_ports)."""
    places = ContactPlaces.of(load)
    return _entries(load, drive, places.contact_of_pair, places.n_contacts, slice(None))


def _entries(load: LoadModel, drive: Drive, group: Sequence[int], n_groups: int, steps: slice) -> ContactEntries:
    conductance, square, beside = drive.conductance[steps], drive.square[steps], drive.neighbour[steps]
    diagonal, neighbour = np.zeros((2, len(conductance), n_groups, len(load.ports)))
    g = conductance[:, :, None]
    for k, pair in enumerate(load.pairs):
        rail = load.rails[pair.rail]
        n, c = len(rail.stations), group[k]
        diagonal[:, c, rail.first_port : rail.first_port + n] += g[:, k] * square[:, k, :n]
        diagonal[:, c, pair.pad_port] += conductance[:, k]
        neighbour[:, c, rail.first_port : rail.first_port + n - 1] += g[:, k] * beside[:, k, : n - 1]
    return ContactEntries(diagonal, neighbour, g * drive.weight[steps])


def scaled(xp: Any, places: ContactPlaces, apart: ContactEntries, factor: Array) -> ContactEntries:
    """One step's entries of contacts kept apart, each times its factor (n_contacts,), together."""
    factor = xp.asarray(factor)
    by_pair = factor[np.array(places.contact_of_pair, dtype=int)][:, None]
    return ContactEntries(
        factor @ xp.asarray(apart.diagonal), factor @ xp.asarray(apart.neighbour), by_pair * xp.asarray(apart.weight)
    )


def dense(xp: Any, places: ContactPlaces, entries: ContactEntries) -> Array:
    """Gamma (n_ports, n_ports) [W/K] of one step."""
    _, _, pair, place = _touching(places)
    beside, facing = entries.neighbour[:-1], -entries.weight[pair, place]
    values = xp.concatenate([entries.diagonal, beside, beside, facing, facing])
    n = places.n_ports
    return add(xp, xp.zeros(n * n), _flat(places), values).reshape(n, n)


def product(xp: Any, places: ContactPlaces, entries: ContactEntries, temperatures: Array) -> Array:
    """Gamma T (n_ports, k) [W] of one step for port temperatures T (n_ports, k), without making Gamma."""
    pad, segment, pair, place = _touching(places)
    beside, facing = entries.neighbour[:-1, None], -entries.weight[pair, place][:, None]
    result = entries.diagonal[:, None] * temperatures
    result = add(xp, result, slice(None, -1), beside * temperatures[1:])
    result = add(xp, result, slice(1, None), beside * temperatures[:-1])
    return add(
        xp,
        result,
        np.concatenate([pad, segment]),
        xp.concatenate([facing * temperatures[segment], facing * temperatures[pad]]),
    )


def tridiagonal_product(xp: Any, P: Array, diagonal: Array, neighbour: Array) -> Array:
    """P times the part of Gamma within rails and pads: P (r, n) and entries (..., n) -> (..., r, n)."""
    result = P * diagonal[..., None, :]
    beside = neighbour[..., None, :-1]
    result = add(xp, result, (..., slice(None, -1)), P[:, 1:] * beside)
    return add(xp, result, (..., slice(1, None)), P[:, :-1] * beside)


def projected(xp: Any, places: ContactPlaces, apart: ContactEntries, P: Array) -> Array:
    """P Gamma_c P^T (n_contacts, r, r) of one step for P (r, n_ports)."""
    result = tridiagonal_product(xp, P, apart.diagonal, apart.neighbour) @ P.T
    for k, c in enumerate(places.contact_of_pair):
        facing = P[:, places.first[k] : places.first[k] + places.count[k]] @ apart.weight[k, : places.count[k]]
        cross = xp.outer(facing, P[:, places.pad[k]])
        result = add(xp, result, c, -cross - cross.T)
    return result


@lru_cache(maxsize=8)
def _flat(places: ContactPlaces) -> np.ndarray:
    """Where in Gamma, as a flat index, the numbers go that `dense` lines up."""
    n, ports = places.n_ports, np.arange(places.n_ports)
    pad, segment, _, _ = _touching(places)
    row = np.concatenate([ports, ports[:-1], ports[1:], pad, segment])
    return row * n + np.concatenate([ports, ports[1:], ports[:-1], segment, pad])


@lru_cache(maxsize=8)
def _touching(places: ContactPlaces) -> np.ndarray:
    """(4, n): port of pad and of segment, pair, and number of the segment on its rail, of all that may touch."""
    pairs = [
        (pad, first + s, k, s)
        for k, (pad, first, n) in enumerate(zip(places.pad, places.first, places.count, strict=True))
        for s in range(n)
    ]
    return np.array(pairs, dtype=int).reshape(-1, 4).T
