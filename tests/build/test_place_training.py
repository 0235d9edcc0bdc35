"""What the draws are that a window model is made from."""

from __future__ import annotations

from inspect import signature

import numpy as np
import pytest

from tests.support.descriptions import SLIDE
from twin.build.acting import Acting
from twin.build.place_training import Shared, alone, heat_alone, snapshots, stepped, values_of
from twin.build.places import pruned
from twin.diagnose.model.rich_probed_model import rich_probed_model
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.rom.drive import evaluate

pytestmark = pytest.mark.long


def test_every_contact_is_lost_in_some_draws_and_all_else_stays_near_its_prior():
    known = {p.path: p for p in parameters(load_machine(SLIDE))}
    contacts = {path for path, p in known.items() if p.kind in ("joint", "contact")}
    assert contacts
    lost = set[str]()
    for seed in range(1, signature(snapshots).parameters["draws"].default + 1):
        values = values_of(tuple(known.values()), seed)
        assert set(values) == set(known)
        gone = {path for path in contacts if 0.0 < values[path] < 0.5 * known[path].low}
        lost.update(gone)
        assert len(gone) < len(contacts)
        for path in set(known) - gone:
            assert known[path].low <= values[path] <= known[path].high
    assert lost == contacts
    assert values_of(tuple(known.values()), 0) == {}


def test_heat_at_all_places_at_once_does_what_it_does_at_each_alone():
    """But for losses that follow temperatures, which it changes: those of the screw's bearings, by a thousandth."""
    machine = load_machine(SLIDE)
    known = rich_probed_model(machine)
    base = pruned(known.rich)
    run, load = read_run(SLIDE.parent / "runs" / "short"), base.load_model
    drive = evaluate(load, run.loads.time, signal_values(run, load.signals), 60.0, 30)
    shared = Shared(known.rich, base, tuple(parameters(machine)), known.places, (drive,), (20.0,))
    found = alone(shared)
    assert len(found) == len(known.places) > 3

    still = np.zeros(known.rich.n)
    without = stepped(shared, drive, 20.0, {}, Acting(), still)
    for place, X in zip(known.places, found, strict=True):
        alone_there = stepped(shared, drive, 20.0, {}, Acting({place.name: heat_alone(drive)}), still) - without
        assert np.linalg.norm(X - alone_there[:, 1:]) < 2e-3 * np.linalg.norm(X), place.name
