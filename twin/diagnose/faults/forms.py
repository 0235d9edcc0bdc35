"""Which elementary causes a description may have wrong in its form, and by how much: no causes, but nuisances."""

from __future__ import annotations

import numpy as np

from twin.diagnose.evidence.formal import Described
from twin.diagnose.evidence.nulls import Form, lump_of, start_of, swing
from twin.diagnose.faults.elements import Elements, Key
from twin.diagnose.faults.signal import CLOCK
from twin.diagnose.model.probed_loads import convection
from twin.diagnose.model.study import Study, heated_places

# Kinds that `described_forms` makes nuisances of: with every history, or the one named
NUISANCE = {"film": "always", "capacity": "", "moved": "", "start": "", "joint": "", "contact": "",
            "group": "", "air": "", "unlogged": ""}  # fmt: skip


def is_nuisance(key: Key) -> bool:
    """Whether `described_forms` may need the column of an elementary cause."""
    kind, _, history = key
    return kind in NUISANCE and NUISANCE[kind] in ("", history)


def described_forms(study: Study, elements: Elements, raw: np.ndarray, form: Form) -> Described:
    """Of raw (m, n) responses in physical units."""
    load, probed = study.probed.base.load_model, study.probed
    films = [f.name for f in load.films]
    drives = [study.runs[k].run.drive for k in study.fitted]
    usual = np.mean([convection(drive, len(films)).mean(axis=0) for drive in drives], axis=0)
    columns: list[np.ndarray] = []

    def add(key: Key, size: float) -> None:
        if key in elements.index and size > 0.0:
            columns.append(size * raw[:, elements.index[key]].astype(float))

    for place in probed.places:
        if place.film:
            add(("film", place.name, "always"), form.local_film * float(usual[films.index(place.film)]))
    for p in heated_places(study):
        add(("capacity", probed.places[p].name, "always"), lump_of(study, p, form))
    for kind, source, history in list(elements.index):
        if kind == "moved":
            add((kind, source, history), form.beside)
        elif kind == "start":
            run = next(p.run for p in study.runs if source.startswith(f"{p.run.name}."))
            member = source.removeprefix(f"{run.name}.")
            add((kind, source, history), start_of(run.begins, form, "" if member == "machine" else member))
        elif kind == "unlogged":
            i, _, j = map(int, source.split("."))
            add((kind, source, history), swing(study, study.fitted[i], j))
    for (kind, _), own in elements.block_of.items():
        if kind in ("joint", "contact"):
            columns.append(form.contact * raw[:, own].astype(float).sum(axis=1))
    for environment in load.environments:
        for c in elements.block_of.get(("air", environment.name), ()):
            columns.append(form.air * raw[:, c].astype(float))
    slow = tuple(own for (kind, _), own in elements.block_of.items() if kind == "group")
    made = np.stack(columns, axis=1) if columns else np.zeros((len(raw), 0))
    return Described(made, slow, elements.histories.blocks)


def clocks(index: dict[Key, int]) -> list[int]:
    """The columns of the clocks of all runs."""
    return [column for (kind, _, _), column in index.items() if kind == CLOCK.kind]
