"""Which face has which name, where a file says it in several ways."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.build.mesh_formats.solid_file import Array, Faces
from twin.build.mesh_formats.tetrahedra import triangles


def named_triangles(tiers: Sequence[Faces]) -> dict[str, Array]:
    """Corner points (m, 3) of the triangles of every name.

    tiers: the most explicit way of naming first, such as surfaces, sets of shell elements, sets of nodes. A name of a
    later tier whose faces all have names already says the same in other words, and one that holds all faces that have
    names is the whole body: both are left out. Else it counts, so that a contradiction is seen by whoever checks the
    surfaces. A name of a later tier without any face is no surface.
    """
    named: dict[str, Array] = {}
    for rank, faces in enumerate(tiers):
        known = list(named.values())
        found: dict[str, Array] = {}
        for name, pieces in faces.items():
            cut = np.vstack([_NONE, *(triangles(np.asarray(p)) for p in pieces)])
            if not rank or (len(cut) and not _covers(known, cut)):
                found[name if name not in named else f"{name}_{rank + 1}"] = cut
        for name in list(found) if rank else ():
            others = [*known, *(cut for other, cut in found.items() if other != name)]
            if any(map(len, others)) and _covers([found[name]], np.vstack(others)):
                del found[name]
        named |= found
    return named


_NONE = np.zeros((0, 3), dtype=int)


def _covers(known: Sequence[Array], cut: Array) -> bool:
    """Whether every triangle of `cut` is among the known ones."""
    whole = np.vstack([_NONE, *known])
    _, inverse = np.unique(np.sort(np.vstack([whole, cut]), axis=1), axis=0, return_inverse=True)
    inverse = inverse.ravel()
    return bool(np.isin(inverse[len(whole) :], inverse[: len(whole)]).all())
