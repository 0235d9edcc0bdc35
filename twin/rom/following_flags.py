"""Flags of laws that follow the machine's temperatures: known only after a run."""

from __future__ import annotations

import numpy as np

from twin.physics.laws import LAWS
from twin.rom.drive import Drive, outside_flag
from twin.rom.following import difference_place, temperature_place
from twin.rom.load_model import LoadModel

AT_REST = 0.05  # K: closer to its surroundings a surface exchanges no heat that counts, whatever its coefficient


def following_flags(
    load: LoadModel, drive: Drive, theta: np.ndarray, surface: np.ndarray, winding: np.ndarray
) -> dict[str, np.ndarray]:
    """Name -> (n_steps,) bool: coefficients outside the certified range, and laws outside their validity.

    theta (n_steps, n_theta) W/(m^2 K), surface (n_steps, n_films) and winding (n_steps, len(drive.losses.index)) degC
    as stepped.
    """
    flags: dict[str, np.ndarray] = {}
    air = drive.environment[:, [f.environment for f in load.films]]
    exchanges = np.abs(surface - air) > AT_REST
    for k, film in enumerate(load.films):
        margin = 1e-9 * film.high
        flags[f"films.{film.name} below {film.low:g} W/(m^2*K)"] = exchanges[:, k] & (theta[:, k] < film.low - margin)
        flags[f"films.{film.name} above {film.high:g} W/(m^2*K)"] = theta[:, k] > film.high + margin
    step = np.arange(drive.n_steps)
    for column, k in enumerate(drive.films.index):
        if validity := LAWS[load.films[k].use.law].validity:
            nearest = np.rint(difference_place(np, surface[:, k] - air[:, k])).astype(int)
            outside = drive.films.outside[step, column, nearest] & exchanges[:, k]
            flags[outside_flag("films", load.films[k].name, validity.text)] = outside
    for column, k in enumerate(drive.losses.index):
        if validity := LAWS[load.sources[k].use.law].validity:
            nearest = np.rint(temperature_place(np, winding[:, column])).astype(int)
            outside = drive.losses.outside[step, column, nearest]
            flags[outside_flag("sources", load.sources[k].name, validity.text)] = outside
    return flags
