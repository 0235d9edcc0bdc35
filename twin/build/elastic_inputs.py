"""What of a body's temperatures moves the tool: few rows W, and the structure that acts on them at every position.

Of a meshed body the port displacements H T of the supported body, then the temperatures that scales read (means and
slopes along their slices, means of surfaces). Of a lumped one a displacement of the TCP that is the same at every
position, then the temperatures of screws and those that scales read; where struts carry a platform also the growth of
their other members and the means of platform and frame. With W projected on the states, the reduced model knows its TCP
displacement wherever the machine stands (`twin.rom.tcp`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.build.flexibility import BodyFlexibility
from twin.build.structure import Structure
from twin.rom.elastic_structure import CutStructure, ElasticStructure, PortFlexibility
from twin.rom.lumped_structure import LumpedStructure
from twin.rom.scales import AddedScale
from twin.rom.springs import SpringSystem
from twin.rom.struts import StrutPlatform


class _Rows:
    """Collects the rows of W of all bodies."""

    def __init__(self, first: Sequence[np.ndarray]):
        self._blocks = [[rows] for rows in first]

    def add(self, body: int, states: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Rows (k, m) over some states (m,) of a body; returns their numbers (k,) in its W."""
        at = sum(len(block) for block in self._blocks[body]) + np.arange(len(rows))
        wide = np.zeros((len(rows), self._blocks[body][0].shape[1]))
        wide[:, states] = rows
        self._blocks[body].append(wide)
        return at

    def matrices(self) -> tuple[np.ndarray, ...]:
        return tuple(blocks[0] if len(blocks) == 1 else np.vstack(blocks) for blocks in self._blocks)


def elastic_inputs(
    structure: Structure | LumpedStructure,
) -> tuple[ElasticStructure | LumpedStructure, tuple[np.ndarray, ...]]:
    """The structure that acts on elastic inputs, and W (p_b, n_b) [m/K; rad/K of rotations, 1 of scales] per body."""
    return _of_lumped(structure) if isinstance(structure, LumpedStructure) else _of_meshed(structure)


def _of_meshed(structure: Structure) -> tuple[ElasticStructure, tuple[np.ndarray, ...]]:
    rows = _Rows([body.H for body in structure.bodies])
    encoders = []
    for e in structure.system.encoders:
        n = len(e.strip.centres)
        at = rows.add(e.strip.body, e.strip.nodes, np.vstack([e.strip.mean, e.strip.slope]))
        mean, slope = np.eye(n, 2 * n), np.eye(n, 2 * n, n)
        encoders.append(replace(e, strip=replace(e.strip, nodes=at, mean=mean, slope=slope)))
    scales = tuple(_scale(scale, rows) for scale in structure.system.scales)
    nodes = tuple(replace(n, states=rows.add(n.body, n.states, np.eye(1))) for n in structure.system.nodes)
    system = replace(structure.system, encoders=tuple(encoders), scales=scales, nodes=nodes)
    cut = None if structure.cut is None else _cut(structure.cut, system, rows)
    return ElasticStructure(_bare(structure), system, structure.middles, structure.size, cut), rows.matrices()


def _bare(structure: ElasticStructure) -> tuple[PortFlexibility, ...]:
    return tuple(PortFlexibility(body.name, body.F, body.R) for body in structure.bodies)


def _cut(cut: CutStructure, acting: SpringSystem, rows: _Rows) -> CutStructure:
    """Pieces read rows of their own, bodies that are not cut those of the whole machine; scales grow alike."""
    inputs = []
    for owner, piece in zip(cut.owners, cut.structure.bodies, strict=True):
        assert isinstance(piece, BodyFlexibility)
        all_of_it = cut.owners.count(owner) == 1
        inputs.append(np.arange(len(piece.F)) if all_of_it else rows.add(owner, np.arange(piece.H.shape[1]), piece.H))
    readers = zip(cut.structure.system.encoders, acting.encoders, strict=True)
    encoders = tuple(replace(e, strip=replace(same.strip, body=e.strip.body)) for e, same in readers)
    bare = replace(cut.structure.system, encoders=encoders, scales=(), nodes=())
    structure = replace(cut.structure, bodies=_bare(cut.structure), system=bare)
    return replace(cut, structure=structure, inputs=tuple(inputs))


def _of_lumped(structure: LumpedStructure) -> tuple[LumpedStructure, tuple[np.ndarray, ...]]:
    rows = _Rows(structure.constant)
    screws = []
    for screw in structure.screws:
        states = screw.first + np.arange(len(screw.borders))
        screws.append(replace(screw, first=int(rows.add(screw.body, states, np.eye(len(states)))[0])))
    scales = tuple(_scale(scale, rows) for scale in structure.scales)
    platform = None if structure.platform is None else _platform(structure.platform, rows)
    W = rows.matrices()
    constant = tuple(np.eye(3, len(w)) for w in W)
    return LumpedStructure(structure.axes, constant, tuple(screws), scales, platform), W


def _platform(platform: StrutPlatform, rows: _Rows) -> StrutPlatform:
    growth = tuple(
        tuple(replace(g, states=rows.add(g.body, g.states, g.rates[None]), rates=np.ones(1)) for g in own)
        for own in platform.growth
    )
    moving, frame = (
        None if s is None else replace(s, states=rows.add(s.body, s.states, s.mean[None]), mean=np.ones(1))
        for s in (platform.moving, platform.frame)
    )
    return replace(platform, growth=growth, moving=moving, frame=frame)


def _scale(scale: AddedScale, rows: _Rows) -> AddedScale:
    return replace(scale, states=rows.add(scale.body, scale.states, scale.mean[None]), mean=np.ones(1))
