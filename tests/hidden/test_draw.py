"""Trials with something hidden: every family is there, drawn by its seed alone, inside the runs, and does what it says.

Only the slow tests step a machine: a small one, on the mesh of the description, for which nobody needs gmsh.
"""

from __future__ import annotations

import math
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from tests.hidden.trials import EXPERIMENT
from twin.build.rich_basis import RichOptions
from twin.inject.draw import trial as drawing
from twin.inject.draw.histories import gate
from twin.inject.draw.parts import together
from twin.inject.draw.readings import fault
from twin.inject.draw.trial import FAMILIES, NULLS, draw
from twin.inject.experiment import RUNS, STEPS
from twin.inject.five_axis import BEARINGS, DRIVES, ELSEWHERE, JOINTS, OUTER, PARTS, ROOM, SPEEDS, WETTED
from twin.inject.truth import reduced as made_small
from twin.inject.truth.behaviour import SOURCES, Behaviour, Clean
from twin.inject.truth.other_films import FILMS
from twin.inject.truth.other_machine import OFF
from twin.logs.run import Run, Table, Tcp
from twin.machine.effects.effect import Window
from twin.machine.parameters import parameters

CATALOGUE = (
    "film_gain",
    "forced_convection",
    "heat_source",
    "loss_law",
    "joint",
    "zone",
    "sun",
    "coolant",
    "sensor",
    "signal",
    "scale_expansion",
    "expansion",
    "slip",
    "capacity",
    "initial_state",
    "measurement",
    "misplaced_source",
    "not_thermal",
)  # fmt: skip; a model too coarse is hidden in no machine
SEEDS = range(12)
part_of, values_of = partial(drawing.part_of, EXPERIMENT), partial(drawing.values_of, EXPERIMENT)
FELT = SimpleNamespace(environment=np.column_stack([np.full(STEPS, 21.0), np.full(STEPS, 23.0)]))


def made_up(r: int) -> tuple[Run, Clean]:
    """A run of loads as logged with made-up readings: every sensor warms by its own rate."""
    time = 60.0 * np.arange(STEPS + 1)
    names = [n for n, s in EXPERIMENT.machine.sensors.items() if s.part is not None]
    T = {n: 22.0 + (1.0 + k) * time / time[-1] for k, n in enumerate(names)} | {"air_column": np.full(STEPS + 1, 20.0)}
    when = np.arange(1800.0, time[-1] + 1.0, 1800.0)
    where = np.column_stack([np.linspace(-0.3, 0.3, len(when))] * 3)
    moved = 1e-5 * np.sin(2 * np.pi * time / 14400.0)[:, None] * np.ones(3)
    tcp = np.zeros((len(when), 3))
    run = EXPERIMENT.runs[r]
    shown = dict.fromkeys(OUTER, 22.0 + 3.0 * time / time[-1]) | {
        f"{a}_rail_1.sides": np.full(len(time), 24.0) for a in "xyz"
    }
    clean = Clean(time, np.column_stack(list(T.values())), when, where, tcp, shown, moved)
    return (
        Run(
            run.loads,
            Table(time, T, dict.fromkeys(T, "degC")),
            Tcp(when, ("x", "y", "z"), where, tcp),
            folder=run.folder,
        ),
        clean,
    )


@pytest.fixture(scope="module")
def small():
    """Trials of a machine that is made in half a minute: the shipped mesh, few states from few trajectories."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(made_small, "other_machine", lambda experiment, text: experiment.another(text))
        patch.setattr(made_small, "RICH", RichOptions(samples=2, tolerance=5e-2))
        patch.setattr(made_small, "STATES", 150)
        patch.setattr(made_small, "DRAWS", 2)
        patch.setattr(made_small, "cached", lambda *given: given[-1]())
        for function in (made_small.reduced, made_small.nominal_drives):
            function.cache_clear()
        yield
        for function in (made_small.reduced, made_small.nominal_drives):
            function.cache_clear()


def test_every_family_of_the_catalogue_is_there_and_more():
    assert set(CATALOGUE) <= set(FAMILIES)
    assert {"null", "null_law", "outside", "pair", "two", "effect_and_sensor"} == set(FAMILIES) - set(CATALOGUE)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_seed_gives_one_truth_and_seeds_differ(family):
    def shown(part):
        powers = [part.behaviour.acting(r, FELT).power for r in range(3)]
        return repr(part.hidden) + repr([(k, float(np.sum(v))) for p in powers for k, v in p.items()])

    assert shown(part_of(family, 1.0, 5)) == shown(part_of(family, 1.0, 5))
    assert values_of(family, 5) == values_of(family, 5) != values_of(family, 6)
    different = {shown(part_of(family, 1.0, seed)) for seed in SEEDS}
    assert len(different) > (0 if family in NULLS else 1)


@pytest.mark.parametrize("family", FAMILIES)
def test_what_is_hidden_is_said_in_the_words_of_the_catalogue(family):
    for seed in SEEDS:
        part = part_of(family, 1.0, seed)
        assert bool(part.hidden) == (family not in NULLS)
        assert len(part.hidden) == (2 if family in ("two", "effect_and_sensor") else len(part.hidden[:1]))
        for hidden in part.hidden:
            assert hidden.family in (*CATALOGUE, "outside")
            assert hidden.size != 0.0
            assert hidden.unit
            for w in hidden.windows:
                assert w.run in RUNS
                assert 0.0 <= w.start < w.end <= 60.0 * STEPS
        if family in CATALOGUE:
            assert part.hidden[0].family == family


@pytest.mark.parametrize("family", FAMILIES)
def test_no_more_acts_than_the_machine_has_slots_for(family):
    for seed in SEEDS:
        behaviour = part_of(family, 1.0, seed).behaviour
        assert len(set(behaviour.heats)) <= SOURCES
        assert len(behaviour.films) <= 1
        for r in range(3):
            acting = behaviour.acting(r, FELT)
            assert set(acting.power) <= set(behaviour.heats)
            assert set(acting.film) == set(acting.medium) == set(behaviour.films)
            for values in (*acting.power.values(), *acting.film.values(), *acting.medium.values()):
                assert np.shape(values) == (STEPS,)
                assert np.isfinite(values).all()


def test_names_are_those_of_the_machine():
    machine = EXPERIMENT.machine
    for place in (*OUTER, *WETTED, *(p for places in ELSEWHERE.values() for p in places)):
        assert place.split(".")[0] in machine.parts
    assert set(JOINTS) <= set(machine.contacts)
    assert {*DRIVES, *BEARINGS, *ELSEWHERE} <= set(machine.sources)
    assert {*SPEEDS.values(), *BEARINGS.values()} <= set(machine.signals)
    assert set(PARTS) <= set(machine.parts)
    assert list(machine.environment)[ROOM] == "room"


def test_a_size_scales_what_acts():
    for seed in SEEDS:
        one, two = (part_of("heat_source", f, seed) for f in (1.0, 2.0))
        assert two.hidden[0].size == pytest.approx(2.0 * one.hidden[0].size)
        place = one.hidden[0].place
        for r in range(3):
            a, b = (p.behaviour.acting(r, FELT).power[place] for p in (one, two))
            np.testing.assert_allclose(b, 2.0 * a)
    with pytest.raises(ValueError, match="a size of 0"):
        part_of("heat_source", 0.0, 1)


def test_a_hidden_source_makes_its_watts_while_it_works():
    for seed in SEEDS:
        part = part_of("heat_source", 1.0, seed)
        watts = np.concatenate([part.behaviour.acting(r, FELT).power[part.hidden[0].place] for r in (0, 1)])
        assert watts[watts > 0.01 * watts.max()].mean() == pytest.approx(12.0, rel=1e-6)


def test_a_window_in_a_fitted_run_comes_again_in_the_sealed_one():
    for seed in SEEDS:
        windows = part_of("coolant", 1.0, seed).hidden[0].windows
        assert [w.run in RUNS[:2] for w in windows] == [True, False]
        assert windows[1].run == RUNS[2]
        assert sum(gate(windows, RUNS[2])) == 120.0  # minutes


def test_parameters_are_off_by_their_half_widths():
    known = {p.path: p for p in parameters(EXPERIMENT.machine)}
    off = {}
    for path, value in values_of("null", 3).items():
        p = known[path]
        gain = FILMS[path.split(".")[1]].gain if p.kind == "film" else 1.0
        off.setdefault(p.kind, []).append(abs(value / p.nominal / gain - 1.0))
    assert set(off) == set(OFF)
    for kind, found in off.items():
        assert 0.0 < max(found) <= OFF[kind]


def test_levels_of_windows_count_shares_of_a_step():
    level = gate((Window("a", 30.0, 150.0, 2.0), Window("b", 0.0, 60.0)), "a")
    np.testing.assert_allclose(level[:4], [1.0, 2.0, 1.0, 0.0])


def test_a_clock_is_late_for_temperatures_and_the_tool_alike():
    part = next(p for s in range(60) if (p := part_of("signal", 1.0, s)).hidden[0].history == "clock")
    r = RUNS.index(part.hidden[0].place.removeprefix("runs."))
    run, clean = made_up(r)
    late = part.readings(r, run, clean)
    T = run.temperatures.columns["x_motor"]
    np.testing.assert_allclose(late.temperatures.columns["x_motor"][6:], T[:-6])
    np.testing.assert_array_equal(late.tcp.time, run.tcp.time)  # measured when it was asked for, told 6 min later
    assert together([part, part_of("heat_source", 1.0, 0)]).behaviour.late == {r: 360.0}
    other, did = made_up(1 - r)
    assert part.readings(1 - r, other, did) is other


@pytest.mark.slow
def test_the_tool_is_late_with_the_temperatures(small):
    seed = next(s for s in range(60) if part_of("signal", 1.0, s).hidden[0].history == "clock")
    late, right = draw(EXPERIMENT, "signal", 1.0, seed), draw(EXPERIMENT, "signal", 1.0, seed, hidden=False)
    r = RUNS.index(late.hidden[0].place.removeprefix("runs."))
    for k, (a, b) in enumerate(zip(late.runs, right.runs, strict=True)):
        moved = float(np.abs(a.tcp.displacement - b.tcp.displacement).max())
        assert 0.2e-6 < moved < 20e-6 if k == r else moved == 0.0


@pytest.mark.parametrize("kind", ["offset", "drift", "lag", "detached", "stuck", "swapped"])
def test_a_faulty_sensor_is_the_only_one(kind):
    part = fault(EXPERIMENT, np.random.default_rng(3), kind, 1.0)
    (hidden,) = part.hidden
    run, clean = made_up(1)
    faulty = part.logs(1, part.readings(1, run, clean))
    changed = {n for n, T in faulty.temperatures.columns.items() if np.any(run.temperatures.columns[n] != T)}
    name = hidden.place.removeprefix("sensors.")
    assert changed == {name} | ({hidden.settings["other"].removeprefix("sensors.")} if kind == "swapped" else set())
    T, shown, t = run.temperatures.columns[name], faulty.temperatures.columns[name], run.temperatures.time
    if kind == "offset":
        np.testing.assert_allclose(shown - T, hidden.size)
    elif kind == "drift":
        assert abs(shown[-1] - T[-1]) == pytest.approx(0.6)  # half a day
    elif kind == "lag":  # a ramp is followed by the time constant late
        assert (T[-1] - shown[-1]) / (T[1] - T[0]) * 60.0 == pytest.approx(2400.0, rel=0.03)
    elif kind == "detached":
        np.testing.assert_allclose(shown, (T + 20.0) / 2)
    elif kind == "stuck":
        start = {w.run: w.start for w in hidden.windows}[RUNS[1]]
        assert np.ptp(shown[t >= start]) == 0.0
    else:
        other = hidden.settings["other"].removeprefix("sensors.")
        np.testing.assert_array_equal(shown, run.temperatures.columns[other])


def test_the_signal_wants_the_factor_that_is_told():
    part = next(p for s in range(60) if (p := part_of("signal", 1.0, s)).hidden[0].history == "factor")
    (hidden,) = part.hidden
    run, _ = made_up(0)
    name = hidden.place.removeprefix("signals.")
    was = part.behaviour.really(0, run).loads.columns[name]
    np.testing.assert_allclose(hidden.size * run.loads.columns[name], was)
    assert part.logs(0, run) is run  # the log is the one that is read
    assert hidden.size in (0.5, 2.0, pytest.approx(math.sqrt(0.5)))


@pytest.mark.parametrize("family", ["scale_expansion", "slip", "measurement", "not_thermal"])
def test_readings_of_the_tool_change_by_what_is_said(family):
    for seed in SEEDS:
        part = part_of(family, 1.0, seed)
        (hidden,) = part.hidden
        run, clean = made_up(1)
        more = part.readings(1, run, clean).tcp.displacement
        assert np.count_nonzero(np.any(more != 0.0, axis=0)) <= 1
        largest = np.abs(more).max()
        if hidden.history == "drift":
            assert largest == pytest.approx(8e-6)
        elif hidden.history == "frame":
            assert largest == pytest.approx(20e-6 * 0.3)
        elif hidden.history == "step":
            assert largest in (0.0, pytest.approx(10e-6))
        elif family == "slip":
            assert 2e-6 < largest <= 3e-6 + 1e-12
        elif family == "scale_expansion":
            assert 0.0 < largest <= 8e-6 * 3.0 * 0.3 + 1e-12


def test_put_together_powers_add_and_both_are_told():
    one, two = part_of("heat_source", 1.0, 1), part_of("sun", 1.0, 2)
    both = together([one, two, one])
    assert [h.family for h in both.hidden] == ["heat_source", "sun", "heat_source"]
    place = one.hidden[0].place
    single = one.behaviour.acting(0, FELT).power[place]
    np.testing.assert_allclose(both.behaviour.acting(0, FELT).power[place], 2.0 * single)


@pytest.mark.slow
def test_a_trial_is_what_a_user_would_have(small):
    trial = draw(EXPERIMENT, "heat_source", 2.0, 3)
    null = draw(EXPERIMENT, "heat_source", 1e-9, 3)
    assert [run.folder.name for run in trial.runs] == list(RUNS)
    for run, without in zip(trial.runs, null.runs, strict=True):
        assert run.initial_temperature == 22.0
        assert len(run.temperatures.columns) == len(EXPERIMENT.machine.sensors)
        # the same seed has the same noise: what is left is the effect
        left = {n: np.abs(T - without.temperatures.columns[n]).max() for n, T in run.temperatures.columns.items()}
        assert left["air_column"] == 0.0
        assert np.isfinite(run.tcp.displacement).all()
    assert max(left.values()) > 0.3


@pytest.mark.slow
@pytest.mark.parametrize("family", ["zone", "capacity", "misplaced_source", "null_law", "expansion"])
def test_a_machine_of_another_shape_can_be_stepped(small, family):
    seed = next(s for s in SEEDS if part_of(family, 1.0, s).behaviour.shape is not Behaviour().shape)
    with_it, without = draw(EXPERIMENT, family, 1.0, seed), draw(EXPERIMENT, family, 1.0, seed, hidden=False)
    pairs = list(zip(with_it.runs, without.runs, strict=True))
    warmer = max(np.abs(a.temperatures.columns[n] - b.temperatures.columns[n]).max()
                 for a, b in pairs for n in a.temperatures.columns)  # fmt: skip
    moved = max(np.abs(a.tcp.displacement - b.tcp.displacement).max() for a, b in pairs)
    assert warmer == 0.0 if family == "expansion" else 0.05 < warmer < 50.0
    assert 0.1e-6 < moved < 500e-6
