"""Numbers of the search, each halved and doubled: which verdicts of stored trials change.

    python -m benchmarks sensitivity                                   # every number, 30 trials: a day on two cores
    python -m benchmarks.sensitivity later covers --trials zone joint  # these

A number that changes none of them is needed by none of them. Cosines are moved by their distance from one, relative
changes by the factor that they are; numbers of iterations (`Origin.SOLVER`) should change nothing.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import fields, replace
from functools import cache

from benchmarks.five_axis import EXPERIMENT, FOLDER, TRUTHS
from twin.build.workers import each
from twin.diagnose.faults.table import FAMILIES
from twin.diagnose.pipeline import Settings, prepare
from twin.diagnose.search.detector import Detector
from twin.diagnose.search.dispersion import searched
from twin.diagnose.search.policy import POLICY, SearchPolicy, rules
from twin.diagnose.search.verdict import verdict_of, with_faults
from twin.diagnose.search.witness import other_measurements
from twin.errors import TwinError
from twin.inject.stored.recipe import trial_of
from twin.inject.stored.table import table
from twin.machine.load import load_machine
from twin.nearest import did_you_mean

SETTINGS = Settings(temperature_sigma=0.08, form=16, nulls=40)
TRIALS = 30  # stored ones that are looked at by default, the first of the table

Said = tuple[str, tuple[tuple[str, str], ...]]  # verdict; family and place of every cause


def moved(name: str) -> Iterator[tuple[float, SearchPolicy]]:
    """A number at half and at twice its value, and the policy with it."""
    value = getattr(POLICY, name)
    unit = next(f.metadata["unit"] for f in fields(SearchPolicy) if f.name == name)
    for factor in (0.5, 2.0):
        if unit == "cosine":
            other = 1.0 - factor * (1.0 - value)
        elif unit == "relative change":
            other = factor * (1.0 + value) - 1.0
        else:
            other = max(round(factor * value), 1) if isinstance(value, int) else factor * value
        if other != value:
            yield other, replace(POLICY, **{name: other})


@cache
def detector() -> Detector:
    """Of the described machine on the loads of the trials."""
    runs = trial_of(EXPERIMENT, table(EXPERIMENT)["null_0"], TRUTHS).runs
    return prepare(load_machine(FOLDER), runs[:2], runs[2:], SETTINGS)[0]


def said(trial: str, policies: list[SearchPolicy]) -> list[Said]:
    """The diagnosis of a trial by each policy."""
    runs, made = trial_of(EXPERIMENT, table(EXPERIMENT)[trial], TRUTHS).runs, detector()
    own = other_measurements(made, runs)
    result = []
    for policy in policies:
        verdict, causes = with_faults(
            *verdict_of(searched(replace(own.detector, policy=policy), own.y)[0], FAMILIES), own.faults
        )
        result.append((verdict, tuple((c.family, c.place) for c in causes)))
    return result


def _of_trial(policies: list[SearchPolicy], trial: str) -> list[Said]:
    return said(trial, policies)


def main(*arguments: str) -> None:
    names = [name for name, *_ in rules()]
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sensitivity", description=__doc__)
    parser.add_argument("rules", nargs="*", help=f"of {', '.join(names)}")
    parser.add_argument("--trials", nargs="*", default=list(table(EXPERIMENT))[:TRIALS])
    asked = parser.parse_args(list(arguments))
    for name in asked.rules:
        if name not in names:
            raise TwinError(f"'{name}' is no number of the search", "rules", did_you_mean(name, names, "numbers"))
    told = [(name, value, policy) for name in asked.rules or names for value, policy in moved(name)]
    policies = [POLICY, *(policy for _, _, policy in told)]
    answers = each(_of_trial, policies, asked.trials, long=0.0)
    idle = dict.fromkeys((name for name, _, _ in told), True)
    for i, (name, value, _) in enumerate(told, start=1):
        changed = [(t, own[0], own[i]) for t, own in zip(asked.trials, answers, strict=True) if own[i] != own[0]]
        idle[name] &= not changed
        print(f"   {name} {getattr(POLICY, name):g} -> {value:g}: {len(changed)} of {len(asked.trials)} change")
        for trial, before, after in changed:
            print(f"      {trial}: {_words(before)} -> {_words(after)}")
    print(f"   change nothing: {', '.join(name for name, none in idle.items() if none) or 'none'}")


def _words(answer: Said) -> str:
    verdict, causes = answer
    return f"{verdict} {', '.join(f'{family} at {place}' for family, place in causes)}".rstrip()


if __name__ == "__main__":
    import sys

    main(*sys.argv[1:])
