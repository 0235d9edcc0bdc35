"""The elastic half of a machine as C arrays: rows of the TCP at any position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.errors import TwinError
from twin.export.c.text import Arrays
from twin.rom.elastic_structure import ElasticStructure
from twin.rom.lumped_structure import LumpedStructure
from twin.rom.model import MachineModel
from twin.rom.scales import AddedScale, LinearEncoder, ScaleStrip
from twin.rom.springs import SpringSystem
from twin.rom.struts import StrutPlatform
from twin.rom.tcp import inputs, is_exact

NONE, MESHED, LUMPED = 0, 1, 2  # TWIN_STRUCTURE


def kind_of(model: MachineModel) -> int:
    if not is_exact(model):
        return NONE
    return LUMPED if isinstance(model.structure, LumpedStructure) else MESHED


def put_elastic(out: Arrays, model: MachineModel, back: Sequence[np.ndarray]) -> dict[str, int]:
    """Arrays of the structure; back: per body X with x = X z. Returns sizes for the header."""
    load, grid = model.load_model, model.pose_grid
    axes = [a.name for a in load.axes]
    out.integers("pose_axis", [axes.index(a) for a in model.pose_axes])
    out.reals("grid_low", [g[0] for g in grid])
    out.reals("grid_high", [g[-1] for g in grid])
    out.reals("grid_margin", [1e-9 * max(abs(g[0]), abs(g[-1])) for g in grid])
    sizes = {"POSES": len(model.poses), "POSE_AXES": len(model.pose_axes), "STRUCTURE": kind_of(model), "INPUTS": 1}
    if not is_exact(model):
        out.reals("grid", np.concatenate([*grid, np.zeros(1)]))
        out.integers("grid_first", np.cumsum([0, *(len(g) for g in grid)])[:-1])
        out.integers("grid_count", [len(g) for g in grid])
        return sizes | {"GRID": max((len(g) for g in grid), default=1)}
    W = [_straight(model, b) @ X for b, X in enumerate(back)]
    first = np.cumsum([0, *(len(w) for w in W)])
    out.integers("input_count", [len(w) for w in W])
    out.integers("input_first", first[:-1])
    out.integers("input_row", np.cumsum([0, *(w.size for w in W)])[:-1])
    out.weights("W_rows", np.concatenate([w.ravel() for w in W]))
    sizes |= {"INPUTS": max(int(first[-1]), 1), "GRID": 1}
    structure = model.structure
    if isinstance(structure, LumpedStructure):
        return sizes | _put_lumped(out, structure, first)
    assert isinstance(structure, ElasticStructure)
    return sizes | _put_meshed(out, structure, first)


def _straight(model: MachineModel, body: int) -> np.ndarray:
    """The elastic inputs of a body but those of pieces that turn, which come last: here rotary axes stand at zero."""
    structure, W = model.structure, inputs(model, body)
    cut = structure.cut if isinstance(structure, ElasticStructure) else None
    if cut is None or cut.owners.count(body) == 1:
        return W
    return W[: min(int(at.min()) for owner, at in zip(cut.owners, cut.inputs, strict=True) if owner == body)]


def _put_scales(out: Arrays, scales: Sequence[AddedScale], first: np.ndarray) -> dict[str, int]:
    out.integers("scale_axis", [s.axis for s in scales])
    out.reals("scale_along", [s.along for s in scales])
    out.integers("scale_states", [len(s.states) for s in scales])
    out.integers("scale_first", np.cumsum([0, *(len(s.states) for s in scales)])[:-1])
    out.integers("scale_input", [first[s.body] + i for s in scales for i in s.states])
    out.reals("scale_mean", [v for s in scales for v in s.mean])
    out.reals("scale_expansion", [s.expansion for s in scales])
    out.reals("scale_fixed_at", [s.fixed_at for s in scales])
    return {"SCALES": len(scales)}


def _put_lumped(out: Arrays, structure: LumpedStructure, first: np.ndarray) -> dict[str, int]:
    out.reals("constant_rows", np.hstack(structure.constant))
    screws = structure.screws
    out.integers("screw_input", [first[s.body] + s.first for s in screws])
    out.integers("screw_borders", [len(s.borders) for s in screws])
    out.integers("screw_border_first", np.cumsum([0, *(len(s.borders) for s in screws)])[:-1])
    out.reals("screw_border", [v for s in screws for v in s.borders])
    if structure.platform is None:  # else they follow from the pose
        out.reals("screw_direction", [s.direction for s in screws])
    out.reals("screw_expansion", [s.expansion for s in screws])
    out.integers("screw_from_end", [s.from_end for s in screws])
    out.integers("screw_held_at_both", [s.held_at_both for s in screws])
    out.integers("screw_axis", [s.axis for s in screws])
    out.reals("screw_nut", [s.nut for s in screws])
    out.reals("screw_per_position", [s.per_position for s in screws])
    sizes = {"SCREWS": len(screws)} | _put_scales(out, structure.scales, first)
    return sizes | (_put_platform(out, structure, structure.platform, first) if structure.platform else {"STRUTS": 0})


def _put_platform(
    out: Arrays, structure: LumpedStructure, platform: StrutPlatform, first: np.ndarray
) -> dict[str, int]:
    """Places are as seen from the tool centre point at the zero pose."""
    place = platform.geometry
    out.reals("platform_joint", place.joint - place.point)
    out.reals("platform_base", place.base - place.point)
    out.reals("platform_ground", platform.ground - place.point)
    out.reals("platform_sign", [platform.sign])
    out.reals("strut_along", structure.along_struts())
    entries = [(k, first[g.body] + i, r) for k, own in enumerate(platform.growth) for g in own
               for i, r in zip(g.states, g.rates, strict=True)]  # fmt: skip
    out.integers("growth_strut", [k for k, _, _ in entries])
    out.integers("growth_input", [i for _, i, _ in entries])
    out.reals("growth_rate", [r for _, _, r in entries])
    sizes = {"STRUTS": 6, "GROWTHS": len(entries)}
    for name, spread in (("moving", platform.moving), ("frame", platform.frame)):
        states = [] if spread is None else [first[spread.body] + i for i in spread.states]
        out.integers(f"{name}_input", states)
        out.reals(f"{name}_spread", [] if spread is None else spread.expansion * spread.mean)
        sizes[name.upper()] = len(states)
    return sizes


def _put_meshed(out: Arrays, structure: ElasticStructure, first: np.ndarray) -> dict[str, int]:
    system = structure.system
    if system.nodes:
        raise TwinError(
            "nodes beside parts that move the tool are not exported to C",
            "nodes",
            "export another format, or take them out",
        )
    ports = np.diff(system.offsets)
    body_of = np.repeat(np.arange(len(ports)), ports)
    out.integers("port_body", body_of)
    out.integers("ports_of", ports)
    out.integers("port_offset", system.offsets[:-1])
    out.integers("port_input", [first[b] + c - system.offsets[b] for c, b in enumerate(body_of)])
    out.integers("flexibility_first", np.cumsum([0, *(n * n for n in ports)])[:-1])
    out.weights("F", np.concatenate([b.F.ravel() for b in structure.bodies]))
    out.reals("motion", [structure._motions[c, 6 * b : 6 * b + 6] for c, b in enumerate(body_of)])
    out.reals("shifts", system.shifts)
    out.reals("stiffness", system.stiffness)
    directions = np.zeros((max(len(system.stiffness), 1), 3))
    acting = [(g.first, g.directions) for g in system.guides] + [(g.first, g.directions) for g in system.grounds]
    for at, own in acting:
        directions[at : at + len(own)] = own
    out.reals("spring_direction", directions)
    _put_guides(out, system)
    tool, work = system.tool, system.work
    out.integers("tool_body", [tool.body, work.body])
    out.integers("tool_column", [system.offsets[p.body] + p.first for p in (tool, work)])
    out.reals("tool_centroid", [tool.centroid, work.centroid])
    out.reals("tool_point", system.tool_point)
    _put_encoders(out, system, system.encoders, first)
    widest = max(12, 12 + 7 * len(system.encoders))
    return {"SPRINGS": len(system.stiffness), "GUIDES": len(system.guides), "GROUNDS": len(system.grounds),
            "ENCODERS": len(system.encoders), "WIDEST": widest} | _put_scales(out, system.scales, first)  # fmt: skip


def _put_guides(out: Arrays, system: SpringSystem) -> None:
    guides, grounds = system.guides, system.grounds
    out.integers("guide_rail_body", [g.rail.body for g in guides])
    out.integers("guide_pad_body", [g.pad.body for g in guides])
    out.integers("guide_rail", [system.offsets[g.rail.body] + g.rail.first for g in guides])
    out.integers("guide_pad", [system.offsets[g.pad.body] + g.pad.first for g in guides])
    out.reals("guide_centroid", [g.pad.centroid for g in guides])
    out.reals("guide_along", [g.along for g in guides])
    out.integers("guide_stations", [len(g.rail.stations) for g in guides])
    out.integers("guide_station_first", np.cumsum([0, *(len(g.rail.stations) for g in guides)])[:-1])
    out.reals("guide_station", [s for g in guides for s in g.rail.stations])
    out.reals("guide_segment", [c for g in guides for c in g.rail.centroids])
    out.integers("guide_springs", [len(g.directions) for g in guides])
    out.integers("guide_first", [g.first for g in guides])
    out.integers("ground_column", [system.offsets[g.port.body] + g.port.first for g in grounds])
    out.integers("ground_springs", [len(g.directions) for g in grounds])
    out.integers("ground_first", [g.first for g in grounds])


def _put_encoders(out: Arrays, system: SpringSystem, encoders: Sequence[LinearEncoder], first: np.ndarray) -> None:
    out.reals("encoder_along", [e.along for e in encoders])
    out.reals("encoder_lever", [system._lever(e) * e.sign for e in encoders])
    out.integers("encoder_reader_body", [e.reader.body for e in encoders])
    out.integers("encoder_reader", [system.offsets[e.reader.body] + e.reader.first for e in encoders])
    out.reals("encoder_reader_centroid", [e.reader.centroid for e in encoders])
    out.integers("encoder_fixing", [system.offsets[e.fixing.body] + e.fixing.first for e in encoders])
    out.reals("encoder_fixing_point", [e.fixing.point for e in encoders])
    out.reals("encoder_fixed_at", [e.fixed_at for e in encoders])
    out.reals("encoder_expansion", [e.expansion for e in encoders])
    _put_strips(out, [e.strip for e in encoders], first)


def _put_strips(out: Arrays, strips: Sequence[ScaleStrip], first: np.ndarray) -> None:
    out.integers("encoder_strip_body", [s.body for s in strips])
    out.integers("strip_slices", [len(s.centres) for s in strips])
    out.integers("strip_nodes", [len(s.nodes) for s in strips])
    out.integers("strip_border_first", np.cumsum([0, *(len(s.borders) for s in strips)])[:-1])
    out.reals("strip_border", [v for s in strips for v in s.borders])
    out.reals("strip_centre", [v for s in strips for v in (*s.centres, 0.0)])
    out.integers("strip_entry_first", np.cumsum([0, *(s.mean.size for s in strips)])[:-1])
    out.reals("strip_mean", [v for s in strips for v in s.mean.ravel()])
    out.reals("strip_slope", [v for s in strips for v in s.slope.ravel()])
    out.integers("strip_input_first", np.cumsum([0, *(len(s.nodes) for s in strips)])[:-1])
    out.integers("strip_input", [first[s.body] + n for s in strips for n in s.nodes])
