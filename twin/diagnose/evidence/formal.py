"""Model discrepancy that is known by kind: nuisance columns with priors, from the same sizes that synthetic data use.

What the modes of `detector` would have to learn from hundreds of synthetic measurements is mostly known beforehand;
only the rest is left to be learned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.diagnose.evidence.leading import LEAST, channel_of, leading, leading_of_each
from twin.diagnose.evidence.nulls import READ, Form
from twin.diagnose.evidence.unknown import correlation
from twin.diagnose.evidence.whiten import Whitener
from twin.diagnose.model.bank import Nominal
from twin.diagnose.model.study import Study

CAUSE = 0.04  # of what a cause does to a channel: that channel's own error in it


@dataclass(frozen=True)
class Described:
    """What the elementary causes of a machine say of its form, of raw responses (m, n) in physical units."""

    columns: np.ndarray  # (m, k) of unit prior variance
    slow: tuple[np.ndarray, ...]  # per film the columns of its coefficient in every block, of raw
    blocks: tuple[tuple[int, int, int], ...]  # (fitted run, first step, end)


def known_forms(
    study: Study, described: Described, nominal: tuple[Nominal, ...], raw: np.ndarray, J: np.ndarray,
    whiten: Whitener, form: Form,
) -> np.ndarray:  # fmt: skip
    """White columns (m, k) of unit prior variance; raw (m, n), J (m, n_parameters)."""
    columns = np.hstack([described.columns, _aside(study, nominal, len(J), form)])
    parts = [whiten(columns)] if columns.shape[1] else []
    parts += _wobbles(study, described, raw, whiten, form)
    return np.hstack([*parts, _readings(study, J, whiten, form)]) if parts else np.zeros((len(J), 0))


def _aside(study: Study, nominal: tuple[Nominal, ...], m: int, form: Form) -> np.ndarray:
    """(m, k): every sensor some millimetres beside where it is described."""
    probed = study.probed
    (body,) = probed.base.bodies
    columns = []
    for s in range(len(probed.base.sensors)):
        moved = np.zeros(m)
        for k, (planned, T, _) in zip(study.fitted, study.split(moved), strict=True):
            read = planned.measured
            if s in read.column:
                i = int(np.flatnonzero(read.column == s)[0])
                T[:, i] = form.aside * (read.mean_of @ (nominal[k].states @ (probed.displaced[s] - body.C[s])))
        if np.any(moved):
            columns.append(moved)
    return np.stack(columns, axis=1) if columns else np.zeros((m, 0))


def _wobbles(study: Study, described: Described, raw: np.ndarray, whiten: Whitener, form: Form) -> list[np.ndarray]:
    """Per film the leading directions of its slow variation within runs."""
    root = np.linalg.cholesky(correlation(described.blocks, form.shape_time / study.fitted_runs[0][1]))
    return [leading(whiten(form.shape * raw[:, own].astype(float) @ root)) for own in described.slow]


def of_channels(study: Study, white: np.ndarray) -> np.ndarray:
    """(m, k) columns of unit prior variance: every channel's own error of a white response (m,)."""
    label = channel_of(study)
    columns = [np.where(label == channel, CAUSE * white, 0.0) for channel in np.unique(label)]
    kept = [c for c in columns if np.linalg.norm(c) > LEAST]
    return np.stack(kept, axis=1) if kept else np.zeros((len(white), 0))


def _readings(study: Study, J: np.ndarray, whiten: Whitener, form: Form) -> np.ndarray:
    """Per channel the leading directions of what sources and contacts do to it, in all runs."""
    heated = [i for i, p in enumerate(study.probed.parameters) if p.kind in READ]
    white = whiten(form.reading * J[:, heated] / study.scale[heated])
    return leading_of_each(channel_of(study), white)
