"""A drive with other gains, conductances and offsets: laws are evaluated once per log, not once per value."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.rom.drive import Drive
from twin.rom.load_model import LoadModel


def rescaled(drive: Drive, made_for: LoadModel, wanted: LoadModel) -> Drive:
    """The drive of a log for `wanted`, which differs from `made_for` by gains, conductances and offsets only.

    Film laws were tabulated at the environment temperatures of `made_for`; an offset of 1 K changes the properties of
    air by 0.3 %.
    """
    source = np.array([_ratio(b.gain, a.gain) for a, b in zip(made_for.sources, wanted.sources, strict=True)])
    film = np.array([_ratio(b.gain, a.gain) for a, b in zip(made_for.films, wanted.films, strict=True)])
    joint = np.array(
        [_ratio(b.conductance, a.conductance) for a, b in zip(made_for.joints, wanted.joints, strict=True)]
    )
    pair = np.array([_ratio(b.conductance, a.conductance) for a, b in zip(made_for.pairs, wanted.pairs, strict=True)])
    offset = np.array([b.offset - a.offset for a, b in zip(made_for.environments, wanted.environments, strict=True)])
    moving = list(made_for.contact_sources)
    return replace(
        drive,
        power=drive.power * source,
        contact_heat=drive.contact_heat * source[moving][:, None],
        theta=drive.theta * np.concatenate([film, joint]),
        films=replace(drive.films, value=drive.films.value * film[list(drive.films.index)][:, None]),
        losses=replace(drive.losses, value=drive.losses.value * source[list(drive.losses.index)][:, None]),
        environment=drive.environment + offset,
        conductance=drive.conductance * pair,
    )


def _ratio(now: float, before: float) -> float:
    return now / before if before else 1.0  # zero stays zero
