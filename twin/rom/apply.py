"""A model with other values of its parameters: the affine terms scaled, nothing built anew."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from twin.rom.load_model import LoadModel
from twin.rom.model import AffineBody, MachineModel
from twin.rom.parameter import Parameter


def with_values(model: MachineModel, parameters: Sequence[Parameter], values: Mapping[str, float]) -> MachineModel:
    """The model, full or reduced, with the parameters of these paths at these values [SI]; others stay nominal.

    Exact for the full model. A reduced one keeps its basis: what it was certified for holds at the nominal values, and
    `twin verify` on an artefact of the new description tells how much of it is left.
    Raises KeyError for a path that is no parameter, ValueError for members without shares in an old artefact.
    """
    known = {p.path: p for p in parameters}
    chosen = [(known[path], float(value)) for path, value in values.items()]
    load = _load_model(model.load_model, chosen)
    return replace(model, load_model=load, bodies=tuple(_body(b, chosen) for b in model.bodies))


def _factors(chosen: Sequence[tuple[Parameter, float]], kind: str) -> dict[str, float]:
    result: dict[str, float] = {}
    for p, value in chosen:
        if p.kind == kind:
            for target in p.targets:
                result[target] = result.get(target, 1.0) * value / p.nominal
    return result


def _load_model(load: LoadModel, chosen: Sequence[tuple[Parameter, float]]) -> LoadModel:
    source, film = _factors(chosen, "source"), _factors(chosen, "film")
    joint, contact = _factors(chosen, "joint"), _factors(chosen, "contact")
    offset = {t: value - p.nominal for p, value in chosen if p.kind == "environment" for t in p.targets}
    return replace(
        load,
        sources=tuple(replace(s, gain=s.gain * source.get(s.name, 1.0)) for s in load.sources),
        films=tuple(replace(f, gain=f.gain * film.get(f.name, 1.0)) for f in load.films),
        joints=tuple(replace(j, conductance=j.conductance * joint.get(j.name, 1.0)) for j in load.joints),
        pairs=tuple(replace(p, conductance=p.conductance * contact.get(p.contact, 1.0)) for p in load.pairs),
        environments=tuple(replace(e, offset=e.offset + offset.get(e.name, 0.0)) for e in load.environments),
    )


def _body(body: AffineBody, chosen: Sequence[tuple[Parameter, float]]) -> AffineBody:
    capacity = _factors(chosen, "capacity")
    expansion = _factors([(p, v) for p, v in chosen if p.component < 0], "expansion")
    shift = {(t, p.component): v - p.nominal for p, v in chosen if p.component >= 0 for t in p.targets}
    E, G, W = body.E, body.G, body.W
    E_members, G_members, W_members = body.E_members, body.G_members, body.W_members
    for m, name in enumerate(body.members):
        factor, growth = capacity.get(name, 1.0), expansion.get(name, 1.0)
        more = {c: d for (target, c), d in shift.items() if target == name}
        if factor == 1.0 and growth == 1.0 and not more:
            continue
        own = growth * member_expansion(body, m)
        for component, per_kelvin in more.items():
            own[:, component] += per_kelvin * member_mean(body, m)
        E = E + (factor - 1.0) * member_capacity(body, m)
        G = G + own - member_expansion(body, m)
        if E_members is not None and G_members is not None:
            E_members, G_members = E_members.copy(), G_members.copy()
            E_members[m] *= factor
            G_members[m] = own
        if W is not None:
            read = growth * member_inputs(body, m)
            for component, per_kelvin in more.items():  # of lumped machines: W begins with what moves the TCP itself
                read[component] += per_kelvin * member_mean(body, m)
            W = W + read - member_inputs(body, m)
            if W_members is not None:
                W_members = W_members.copy()
                W_members[m] = read
    return replace(
        body, E=E, G=G, W=W, energy=E.T @ body.left_one, E_members=E_members, G_members=G_members, W_members=W_members
    )


def member_capacity(body: AffineBody, member: int) -> np.ndarray | sp.csr_array:
    """The share of a member in E (n, n) [J/K]. Raises ValueError for artefacts without shares."""
    if body.E_members is not None:
        return np.asarray(body.E_members[member])
    own = _own(body, member)
    mask = np.zeros(body.n)
    mask[own] = 1.0
    return sp.csr_array(sp.diags_array(mask) @ body.E)  # members share no states, and E couples none of them


def member_expansion(body: AffineBody, member: int) -> np.ndarray:
    """The share of a member in G (n_poses, 3, n) [m/K]."""
    if body.G_members is not None:
        return np.asarray(body.G_members[member])
    G = np.zeros_like(body.G)
    G[:, :, _own(body, member)] = body.G[:, :, _own(body, member)]
    return G


def member_inputs(body: AffineBody, member: int) -> np.ndarray:
    """The share of a member in W (p, n). Raises ValueError where the body has no W."""
    if body.W is None:
        raise ValueError(f"body '{body.name}' has no elastic inputs")
    if body.W_members is not None:
        return np.asarray(body.W_members[member])
    W = np.zeros_like(body.W)
    W[:, _own(body, member)] = body.W[:, _own(body, member)]
    return W


def member_mean(body: AffineBody, member: int) -> np.ndarray:
    """The mean temperature of a member, weighted by its capacity: a row (n,), of a node its temperature."""
    weight = member_capacity(body, member) @ body.one
    return np.asarray(weight / (body.one @ weight))


def member_field(body: AffineBody, member: int) -> np.ndarray:
    """The state (n,) in which a member is 1 K warm and the others 0 K: the best approximation in the norm of E."""
    weight = member_capacity(body, member) @ body.one
    if sp.issparse(body.E):
        field = np.zeros(body.n)
        field[_own(body, member)] = 1.0
        return field
    return np.asarray(np.linalg.solve(body.E, weight))


def _own(body: AffineBody, member: int) -> slice:
    if not body.first:
        raise ValueError("the artefact has no shares of its parts: build it again")
    return body.member_states(member)
