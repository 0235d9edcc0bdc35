"""The state of an update as a file, read back bit by bit: a program started again goes on as if it had not stopped.

state.h5 of the method "state", state.json of the others.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import jax
import numpy as np

from twin.atomic import atomic_path
from twin.calibrate.update.gain import At, PaperAt
from twin.calibrate.update.gain_filter import GainState
from twin.calibrate.update.program import Live, Program
from twin.calibrate.update.state import StateUpdater
from twin.calibrate.update.state_filter import Machine, StateEstimate, begin
from twin.calibrate.update.state_tangent import UncertainLoads
from twin.errors import TwinError
from twin.ordinary import ordinary
from twin.rom.hdf5_file import put, put_attributes, writing
from twin.run.stepping import State

FORMAT = "twin update state"


def write_live(folder: Path, program: Program[Any], live: Live[Any]) -> None:
    """Write the state of any method to a folder. Raises TwinError if the file cannot be written."""
    own = "state.h5" if isinstance(program.updater, StateUpdater) else "state.json"
    for other in {"state.h5", "state.json"} - {own}:  # of another method: stale from now on
        (Path(folder) / other).unlink(missing_ok=True)
    if isinstance(program.updater, StateUpdater):
        write_state(Path(folder) / "state.h5", program.updater.machine, live)
    else:
        write_gains(Path(folder) / "state.json", live)


def write_gains(path: Path, live: Live[At] | Live[PaperAt]) -> None:
    """Write the state of the methods "gain" and "paper" as JSON."""
    at = live.state
    numbers: dict[str, Any] = {"time_s": at.time, "base_m": at.base.tolist(), "held_m": live.held.tolist()}
    if isinstance(at, At):
        numbers |= {"slow_m": at.slow.tolist(), "learnt": at.learnt.to_json()}
    else:
        numbers |= {"gain": at.gain.tolist()}
    with atomic_path(Path(path)) as temporary:
        temporary.write_text(json.dumps({"format": FORMAT, **numbers}) + "\n", encoding="utf-8")


def read_gains(path: Path) -> Live[At] | Live[PaperAt]:
    """The state that `write_gains` wrote. Raises TwinError for other files."""
    remedy = "start afresh, or give the state.json of a run with --method gain or paper"
    try:
        d = json.loads(ordinary(Path(path)).read_text(encoding="utf-8"))
        if d.get("format") != FORMAT:
            raise TwinError("not a state of `twin update`", str(path), remedy)
        time, base, held = float(d["time_s"]), np.array(d["base_m"]), np.array(d["held_m"])
        if "gain" in d:
            return Live(PaperAt(time, base, np.array(d["gain"])), held)
        return Live(At(time, base, np.array(d["slow_m"]), GainState.from_json(d["learnt"])), held)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as e:
        raise TwinError("not a state of `twin update`", str(path), remedy) from e


def write_state(path: Path, machine: Machine, live: Live[StateEstimate]) -> None:
    """Write the state and what the slew limit holds back. Raises TwinError if the file cannot be written."""
    state = live.state
    with writing(Path(path)) as f:
        put_attributes(f, {"format": FORMAT, "artefact": machine.artefact.digest})
        put(f, "time", float(state.time), "s")
        put(f, "noise_due", float(state.noise_due), "s", (), "process noise not yet added")
        put(f, "parameter", [p.path for p in machine.parameters], "", (), "order of the first of `extra`")
        put(
            f,
            "extra",
            state.extra,
            "",
            (),
            "ln(value / nominal) or shifts, TCP gain - 1, TCP offset [m], sensor bias [K]",
        )
        put(f, "root", state.root, "", (), "root of the covariance of thermal states and extra")
        put(f, "left_out", state.left_out, "m")
        put(f, "belief", state.belief, "", (), "in the factors of the predicted TCP standard deviation")
        put(f, "held", live.held, "m", (), "learnt and not let in yet, by pose")
        for k, leaf in enumerate(jax.tree.leaves(state.step)):
            put(f, f"step_{k:03d}", np.asarray(leaf), "", (), "thermal states, and the factor of their last step")


def read_state(path: Path, machine: Machine, first: UncertainLoads) -> Live[StateEstimate]:
    """The state of a program; first: the loads of any one step. Raises TwinError for other files and machines."""
    shape = begin(machine, 0.0, 0.0, first)
    remedy = "start afresh, or with the artefact and parameters that the file was written with"
    try:
        with h5py.File(ordinary(path), "r") as f:
            if f.attrs.get("format") != FORMAT:
                raise TwinError("not a state of `twin update`", str(path), remedy)
            paths = tuple(str(s) for s in f["parameter"].asstr()[...])
            if f.attrs["artefact"] != machine.artefact.digest or paths != tuple(p.path for p in machine.parameters):
                raise TwinError("a state of another artefact, or of other parameters", str(path), remedy)
            leaves, tree = jax.tree.flatten(shape.step)
            stored = [f[f"step_{k:03d}"][...] for k in range(len(leaves))]
            if any(a.shape != b.shape for a, b in zip(stored, leaves, strict=True)):
                raise TwinError("a state of another shape", str(path), remedy)
            step: State = jax.tree.unflatten(tree, [jax.numpy.asarray(a) for a in stored])
            state = StateEstimate(
                time=float(f["time"][()]),
                step=step,
                extra=f["extra"][...],
                root=f["root"][...],
                noise_due=float(f["noise_due"][()]),
                left_out=f["left_out"][...],
                belief=f["belief"][...],
            )
            return Live(state, f["held"][...])
    except (OSError, KeyError) as e:
        raise TwinError("not a state of `twin update`", str(path), remedy) from e
