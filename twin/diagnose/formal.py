"""Model discrepancy that is known by kind: nuisance columns with priors, from the same sizes that synthetic data use.

What the modes of `detector` would have to learn from hundreds of synthetic measurements is mostly known beforehand:
where a source's heat enters, each face's coefficient, each film's reaction to speed, each sensor's place, each zone's
air, and each channel's own reading of every source. Only the rest is left to be learned.
"""

from __future__ import annotations

import numpy as np

from twin.diagnose.bank import Nominal
from twin.diagnose.elements import EXPONENT, Elements, heated_places
from twin.diagnose.nulls import Form, lump_of, typical
from twin.diagnose.study import Study
from twin.diagnose.whiten import Whitener

CAUSE = 0.04  # of what a cause does to a channel: that channel's own error in it
READ = ("source", "contact", "joint")  # kinds of parameters whose effect every channel reads in its own way
LITTLE = 0.5  # K, of a surface above the air: convection of the room's own draught is left below it
FREE = 25.0  # W/(m^2 K), the most that free convection in a gas is (Incropera, DeWitt, 6th ed. 2007, table 1.1)
LEAST = 0.7  # standard deviations over all its rows that a direction of a channel's readings must have


def known_forms(
    study: Study, elements: Elements, nominal: tuple[Nominal, ...], raw: np.ndarray, J: np.ndarray, wind: np.ndarray,
    whiten: Whitener, form: Form,
) -> np.ndarray:  # fmt: skip
    """White columns (m, k) of unit prior variance; raw (m, n) responses in physical units, J (m, n_parameters).

    wind (m, w): columns of `windy`.
    """
    load, probed = study.probed.base.load_model, study.probed
    films = [f.name for f in load.films]
    usual = np.mean([typical(study, k) for k in study.fitted], axis=0)
    columns: list[np.ndarray] = []

    def add(key: tuple[str, str, str], size: float) -> None:
        if key in elements.index and size > 0.0:
            columns.append(size * raw[:, elements.index[key]].astype(float))

    for place in probed.places:
        if place.film:
            add(("film", place.name, "always"), form.local_film * float(usual[films.index(place.film)]))
    for f, film in enumerate(load.films):
        for signal in film.use.signals.values():
            heard = elements.histories.same.get(signal, signal)
            add(("group_film", film.name, f"{heard}^{EXPONENT:g}"), form.wind * float(usual[f]))
    for p in heated_places(study):
        add(("capacity", probed.places[p].name, "always"), lump_of(study, p, form))
    for kind, source, history in list(elements.index):
        if kind == "moved":
            add((kind, source, history), form.beside)
        elif kind == "start":
            run = next(p.run for p in study.runs if source.startswith(f"{p.run.name}."))
            whole = source == f"{run.name}.machine" and not run.stated_start
            add((kind, source, history), form.start if whole else form.start_apart)
    for (kind, _), own in elements.block_of.items():
        if kind in ("joint", "contact"):
            columns.append(form.contact * raw[:, own].astype(float).sum(axis=1))
    for environment in load.environments:
        for c in elements.block_of.get(("air", environment.name), ()):
            columns.append(form.air * raw[:, c].astype(float))
    columns += _steeper(study, elements, nominal, raw, form)
    (body,) = probed.base.bodies
    first = {k: sum(study.runs[i].size for i in study.fitted if i < k) for k in study.fitted}
    for s in range(len(probed.base.sensors)):
        moved = np.zeros(len(J))
        for k in study.fitted:
            planned = study.runs[k]
            m = planned.measured
            if s in m.column:
                i = int(np.flatnonzero(m.column == s)[0])
                own = m.mean_of @ (nominal[k].states @ (probed.displaced[s] - body.C[s]))
                (b, n), _ = planned.shapes
                moved[first[k] + np.arange(b) * n + i] = form.aside * own
        if np.any(moved):
            columns.append(moved)
    parts = [whiten(np.hstack([np.stack(columns, axis=1), wind]))] if columns else []
    parts += _wobbles(study, elements, raw, whiten, form)
    return np.hstack([*parts, *_readings(study, J, whiten, form)]) if parts else np.zeros((len(J), 0))


def _steeper(
    study: Study, elements: Elements, nominal: tuple[Nominal, ...], raw: np.ndarray, form: Form
) -> list[np.ndarray]:
    """Per film (m,) outputs of another exponent of the rise of its surface above the air: form.steep (ln rise - mean).

    A coefficient that is too large for free convection has it in the share that free convection may be.
    """
    load = study.probed.base.load_model
    (body,) = study.probed.base.bodies
    M = np.asarray(study.probed.system.M)[:, : len(load.films)]
    blocks = elements.histories.blocks
    wide = np.array([b - a for _, a, b in blocks], dtype=float)
    result = []
    for f, film in enumerate(load.films):
        own, area = elements.block_of.get(("group", film.name)), float(M[:, f] @ body.one)
        if own is None or not area > 0.0:
            continue
        rise = {k: np.abs(nominal[k].middle @ M[:, f] / area - nominal[k].outer[:, f]) for k in study.fitted}
        told = np.array([np.log(np.maximum(rise[i][a:b], LITTLE)).mean() for i, a, b in blocks])
        most = max(float(nominal[k].convection[:, f].mean()) for k in study.fitted)
        size = form.steep * min(1.0, FREE / max(most, 1e-30))
        result.append(size * (raw[:, own].astype(float) @ (told - wide @ told / wide.sum())))
    return result


def _wobbles(study: Study, elements: Elements, raw: np.ndarray, whiten: Whitener, form: Form) -> list[np.ndarray]:
    """Per film the leading directions of its slow variation within runs."""
    blocks = elements.histories.blocks
    run = np.array([i for i, _, _ in blocks])
    when = np.array([(a + b) / 2 for _, a, b in blocks], dtype=float)
    time = study.runs[study.fitted[0]].run.drive.time
    memory = form.shape_time / (time[1] - time[0])
    R = np.exp(-0.5 * ((when[:, None] - when) / memory) ** 2) * (run[:, None] == run)
    root = np.linalg.cholesky(R + 1e-6 * np.eye(len(R)))
    result = []
    for (kind, _), own in elements.block_of.items():
        if kind == "group":
            U, s, _ = np.linalg.svd(whiten(form.shape * raw[:, own].astype(float) @ root), full_matrices=False)
            kept = s > LEAST
            result.append(U[:, kept] * s[kept])
    return result


def of_channels(study: Study, white: np.ndarray, share: float = CAUSE) -> np.ndarray:
    """(m, k) columns of unit prior variance: every channel's own error of a white response (m,)."""
    label = np.concatenate([_labels(study, k) for k in study.fitted])
    columns = [np.where(label == channel, share * white, 0.0) for channel in np.unique(label)]
    kept = [c for c in columns if np.linalg.norm(c) > LEAST]
    return np.stack(kept, axis=1) if kept else np.zeros((len(white), 0))


def _readings(study: Study, J: np.ndarray, whiten: Whitener, form: Form) -> list[np.ndarray]:
    """Per channel the leading directions of what sources and contacts do to it, in all runs."""
    own = [i for i, p in enumerate(study.probed.parameters) if p.kind in READ]
    white = whiten(form.reading * J[:, own] / study.scale[own])
    label = np.concatenate([_labels(study, k) for k in study.fitted])
    result = []
    for channel in np.unique(label):
        rows = np.flatnonzero(label == channel)
        U, s, _ = np.linalg.svd(white[rows], full_matrices=False)
        kept = s > LEAST
        block = np.zeros((len(white), int(kept.sum())))
        block[rows] = U[:, kept] * s[kept]
        result.append(block)
    return result


def _labels(study: Study, k: int) -> np.ndarray:
    """(size,) which channel every number of a run is of: sensors by number, TCP components -1 to -3."""
    planned = study.runs[k]
    (b, _), (rows, _) = planned.shapes
    return np.concatenate([np.tile(planned.measured.column, b), np.tile([-1, -2, -3], rows)])
