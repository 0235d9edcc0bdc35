"""Checkpoints: the states of finished steps on disk, so that an interrupted run goes on with the very same numbers.

Every checkpoint is one file with the steps since the one before, written whole or not at all. Its key is a hash chain
over model, initial state, time steps and all loads up to its end: whatever is taken up again belongs to this very run,
and a log that has grown since keeps the checkpoints of its beginning.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import h5py
import numpy as np

from twin.errors import TwinError
from twin.rom.hdf5_file import put, put_attributes, writing

FORMAT = "twin checkpoint"


@dataclass(frozen=True)
class Steps:
    """What stepping yields; n steps, N states."""

    z: np.ndarray  # (n, N) states at step ends, coordinates of twin.run.system
    film: np.ndarray  # (n, n_films) W into the machine
    gross: np.ndarray  # (n,) W: all that films exchange
    stored: np.ndarray  # (n,) J
    power: np.ndarray  # (n, n_sources) W
    theta: np.ndarray  # (n, n_theta) W/(m^2 K)
    surface: np.ndarray  # (n, n_films) degC at step starts
    winding: np.ndarray  # (n, n_following_losses) degC at step starts

    @classmethod
    def join(cls, parts: Sequence[Steps]) -> Steps:
        return cls(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)))


def chain(key: str, *arrays: np.ndarray) -> str:
    """The key that follows `key` when `arrays` are added."""
    digest = hashlib.sha256(key.encode())
    for array in arrays:
        digest.update(str((array.dtype, array.shape)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


@dataclass(frozen=True)
class CheckpointFolder:
    """Checkpoints of one run, named by their first step."""

    folder: Path
    every: int  # steps
    resume: bool  # take up what is there, else start afresh

    def save(self, first: int, steps: Steps, key: str) -> None:
        """Raises TwinError if it cannot be written."""
        with writing(self.folder / f"{first:09d}.h5") as f:
            put_attributes(f, {"format": FORMAT, "first": first, "key": key})
            put(f, "z", steps.z, "K", (), "states in normalised coordinates")
            put(f, "film", steps.film, "W")
            put(f, "gross", steps.gross, "W")
            put(f, "stored", steps.stored, "J")
            put(f, "power", steps.power, "W")
            put(f, "theta", steps.theta, "W/(m^2*K)")
            put(f, "surface", steps.surface, "degC")
            put(f, "winding", steps.winding, "degC")

    def load(self) -> list[tuple[int, Steps, str]]:
        """(first step, steps, key) of all checkpoints in order. Raises TwinError for files that cannot be read."""
        found = []
        for path in sorted(self.folder.glob("*.h5")):
            try:
                with h5py.File(path, "r") as f:
                    steps = Steps(**{field.name: f[field.name][...] for field in fields(Steps)})
                    found.append((int(f.attrs["first"]), steps, str(f.attrs["key"])))
            except (OSError, KeyError, RuntimeError) as e:
                raise TwinError(f"not a checkpoint: {e}", str(path), "remove it, or run without --resume") from e
        return found

    def clear(self) -> None:
        """Remove all checkpoints."""
        shutil.rmtree(self.folder, ignore_errors=True)
