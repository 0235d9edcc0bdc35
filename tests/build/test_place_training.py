"""What the draws are that a window model is made from."""

from __future__ import annotations

from inspect import signature

from tests.support.descriptions import SLIDE
from twin.build.place_training import snapshots, values_of
from twin.machine.load import load_machine
from twin.machine.parameters import parameters


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
