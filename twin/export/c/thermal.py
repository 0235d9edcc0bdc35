"""The thermal half of a machine as C arrays, in coordinates with E = 1 (`twin.run.system`)."""

from __future__ import annotations

import numpy as np

from twin.export.c.text import Arrays
from twin.run.system import Prepared


def put_thermal(out: Arrays, prepared: Prepared, sensor_bodies: tuple[int, ...]) -> None:
    """Matrices and rows of all bodies."""
    layout, system = prepared.layout, prepared.system
    sizes, offsets = layout.sizes, layout.offsets
    A0 = [_stored(np.asarray(A), layout.symmetric) for A in system.A0]
    A = [[_stored(term, layout.symmetric) for term in np.asarray(terms)] for terms in system.A]
    out.integers("size", sizes)
    out.integers("first", offsets[:-1])
    out.integers("factor_first", _starts([len(a) for a in A0]))
    out.weights("A0", np.concatenate(A0))
    out.integers("term_count", [len(t) for t in layout.terms])
    out.integers("term_first", _starts([len(t) for t in layout.terms]))
    out.integers("term", [k for terms in layout.terms for k in terms])
    out.integers("term_matrix", _starts([len(a) for terms in A for a in terms]))
    out.weights("A_of_terms", np.concatenate([a for terms in A for a in terms] or [np.zeros(1)]))
    out.reals("nominal", system.nominal)
    _put_ports(out, prepared)
    _put_films(out, prepared)
    _put_sources(out, prepared)
    C = np.asarray(system.C)
    rows = [C[s, offsets[b] : offsets[b + 1]] for s, b in enumerate(sensor_bodies)]
    out.integers("sensor_row", _starts([len(r) for r in rows]))
    out.weights("C_rows", np.concatenate(rows or [np.zeros(1)]))
    out.reals("energy", system.energy)
    out.reals("one", system.one)
    out.weights("G_rows", system.G)


def _put_ports(out: Arrays, prepared: Prepared) -> None:
    layout, system = prepared.layout, prepared.system
    out.integers("port_count", [len(p) for p in layout.ports])
    out.integers("port_first", _starts([len(p) for p in layout.ports]))
    out.integers("port", [p for ports in layout.ports for p in ports])
    out.integers("port_row", _starts([len(p) * n for p, n in zip(layout.ports, layout.sizes, strict=True)]))
    out.weights("P_in", np.concatenate([np.asarray(P).T.ravel() for P in system.P]))
    if layout.symmetric:
        out.parts.append("#define P_out P_in\n")
    else:
        out.weights("P_out", np.concatenate([np.asarray(P).ravel() for P in system.port_rows]))


def _put_films(out: Arrays, prepared: Prepared) -> None:
    layout, system = prepared.layout, prepared.system
    M, rows = np.asarray(system.M), np.asarray(system.film_rows)
    H = np.asarray(system.H).reshape(len(M), -1, layout.n_films)
    where, parts, at = [], [], 0
    for f in range(layout.n_films):
        line = []
        for b, n in enumerate(layout.sizes):
            own = slice(layout.offsets[b], layout.offsets[b] + n)
            touches = f in layout.terms[b]
            line.append(at if touches else -1)
            if touches:
                parts.append((rows[f, own], M[own, f], *H[own, :, f].T))
                at += n
        where.append(line)
    out.table("film_row", where, len(layout.sizes))
    out.add(f"enum {{ film_entries = {at} }};\n")
    for name, which in (("film_rows", range(1)), ("M_columns", range(1, 2)), ("H_columns", range(2, 2 + H.shape[1]))):
        out.weights(name, np.concatenate([p[k] for k in which for p in parts] or [np.zeros(1)]))
    area, plan = np.asarray(system.film_area), system.film_plan
    out.reals("film_total_area", area)
    out.reals("film_area", np.where(area > 0.0, area, 1.0))
    out.reals("film_moment", np.ravel(system.film_moment))
    out.reals("film_mean_height", plan.mean_height)
    out.reals("film_climb", np.ravel(plan.climb))


def _put_sources(out: Arrays, prepared: Prepared) -> None:
    layout, system = prepared.layout, prepared.system
    for name, table, values in (("source_column", "B_columns", np.asarray(system.B).T),
                                ("source_row", "source_rows", np.asarray(system.source_rows))):  # fmt: skip
        where, parts, at = [], [], 0
        for row in values:
            line = []
            for b, n in enumerate(layout.sizes):
                own = row[layout.offsets[b] : layout.offsets[b] + n]
                line.append(at if own.any() else -1)
                if own.any():
                    parts.append(own)
                    at += n
            where.append(line)
        out.table(name, where, len(layout.sizes))
        out.weights(table, np.concatenate(parts or [np.zeros(1)]))


def _stored(A: np.ndarray, symmetric: bool) -> np.ndarray:
    """The rows of the lower triangle, or all of the matrix."""
    return A[np.tril_indices(len(A))] if symmetric else A.ravel()


def _starts(counts: list[int]) -> list[int]:
    return [0, *np.cumsum(counts).tolist()][:-1] if counts else []
