"""Scores of hypotheses against explicit likelihoods, projectors against dense inverses, thresholds against chance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

from tests.diagnose import small_case
from twin.calibrate.fit.noise import Channels
from twin.diagnose.evidence.batch import Batch, History, best, prepared, score
from twin.diagnose.evidence.unknown import evidence, heat_of, surfaces_of, with_information
from twin.diagnose.evidence.whiten import Projector, Whitener, measured_of, missing, offsets
from twin.diagnose.result.diagnosis import Window
from twin.diagnose.search.detector import thresholds_of
from twin.diagnose.search.growth import grown

M, L = 60, 4


@pytest.fixture
def made():
    """White columns (M, 8) of two places, a projector, and a white residual."""
    rng = np.random.default_rng(0)
    D = rng.standard_normal((M, 2 * L))
    return D, Projector.of(3.0 * rng.standard_normal((M, 5))), rng.standard_normal(M)


def batch(histories, sign=0, fixed=False, smallest=0.0):
    columns = np.arange(2 * L).reshape(2, L)
    return Batch("heat_source", "heat", "W", ("a", "b"), columns, tuple(histories), sign, fixed, smallest)


def blocks(D, projector, of):
    return np.stack([D[:, c].T @ projector(D[:, c]) for c in of.columns])


def test_projector_is_the_inverse_of_the_marginal_covariance(made):
    D, projector, r = made
    dense = np.linalg.inv(np.eye(M) + projector.N @ projector.N.T)
    np.testing.assert_allclose(projector(D), dense @ D, atol=1e-10)
    np.testing.assert_allclose(projector(r), dense @ r, atol=1e-10)
    most_likely = projector.N.T @ dense @ r  # posterior mean of coordinates of unit prior variance
    np.testing.assert_allclose(projector.most_likely(r), most_likely, atol=1e-10)


def test_statistic_is_twice_the_log_likelihood_ratio(made):
    """Against generalised least squares with the dense covariance, two amplitudes at once."""
    D, projector, r = made
    W = np.random.default_rng(1).standard_normal((2, L))
    of = batch([History("always", W)])
    found = score(prepared(of, blocks(D, projector, of)), D.T @ projector(r))
    inverse = np.linalg.inv(np.eye(M) + projector.N @ projector.N.T)
    for p in range(2):
        X = D[:, of.columns[p]] @ W.T
        a = np.linalg.solve(X.T @ inverse @ X, X.T @ inverse @ r)
        left = r - X @ a
        assert found.statistic[p, 0] == pytest.approx(r @ inverse @ r - left @ inverse @ left, rel=1e-6)
        np.testing.assert_allclose(found.amplitude[p, 0], a, rtol=1e-6)


def test_a_fixed_amplitude_pays_for_being_wrong(made):
    D, projector, r = made
    of = batch([History("factor", np.eye(L)[[0]])], fixed=True)
    ready = prepared(of, blocks(D, projector, of))
    inverse = np.linalg.inv(np.eye(M) + projector.N @ projector.N.T)
    for scale in (0.2, 1.0, 3.0):
        seen = r + scale * D[:, 0]
        left = seen - D[:, 0]
        wanted = max(seen @ inverse @ seen - left @ inverse @ left, 0.0)
        assert score(ready, D.T @ projector(seen)).statistic[0, 0] == pytest.approx(wanted, rel=1e-6, abs=1e-9)


def test_wrong_signs_and_small_sizes_do_not_count(made):
    D, projector, r = made
    one = [History("always", np.eye(L)[[1]])]
    g = D.T @ projector(0.1 * r - 2.0 * D[:, 1])
    either = batch(one)
    assert score(prepared(either, blocks(D, projector, either)), g).statistic[0, 0] > 50.0
    for of in (batch(one, sign=1), batch(one, smallest=3.0)):
        assert score(prepared(of, blocks(D, projector, of)), g).statistic[0, 0] == 0.0


def test_best_finds_what_is_there(made):
    D, projector, r = made
    of = batch([History(f"column {k}", np.eye(L)[[k]]) for k in range(L)])
    ready = prepared(of, blocks(D, projector, of))
    ranked = best([ready], D.T @ projector(0.3 * r + 2.0 * D[:, L + 2]))
    assert (ranked[0].name, ranked[0].when.name) == ("b", "column 2")
    assert ranked[0].amplitude[0] == pytest.approx(2.0, abs=0.2)
    columns, weights = ranked[0].combination()
    np.testing.assert_array_equal(D[:, columns] @ weights[0], D[:, L + 2])


def test_further_windows_join_where_the_data_ask_for_them(made):
    D, projector, r = made
    windows = [History(f"h{k}", np.eye(L)[[k]], windows=(Window("run", k, k + 1),)) for k in range(L)]
    of = batch(windows)
    own = blocks(D, projector, of)
    for hidden, wanted in (((0, 2), ["0", "2"]), ((1,), ["1"])):
        g = D.T @ projector(0.3 * r + 3.0 * D[:, list(hidden)].sum(axis=1))
        first = best([prepared(of, own)], g)[0]
        more = grown(first, g, own[first.place])
        assert [f"{w.start}" for w in more.when.windows] == wanted
        assert more.amplitude[0] == pytest.approx(3.0, abs=0.3)


def test_thresholds_let_the_stated_share_of_nulls_pass():
    """Families of different sizes and tails; on nulls of the same law that were not used."""
    rng = np.random.default_rng(2)
    scale, at = np.array([3.0, 5.0, 2.0, 8.0]), np.array([128.0, 135.0, 126.0, 150.0])

    def drawn(n):
        return {f"f{k}": at[k] + scale[k] * rng.gumbel(size=n) for k in range(4)}

    def alarms(found, nulls):
        return np.any([nulls[f] > found[f] for f in nulls], axis=0).mean()

    known = drawn(210)
    found = thresholds_of(known)
    assert 0.0 < alarms(found, known) <= 0.05  # README: at most one false alarm in twenty
    assert 0.005 < alarms(found, drawn(20000)) < 0.15
    strict, loose = (thresholds_of(known, alarm=share) for share in (0.005, 0.3))
    assert all(strict[f] > found[f] > loose[f] for f in found)
    assert 0.2 < alarms(loose, known) <= 0.3


def test_families_without_nulls_above_zero_have_a_floor():
    chance = np.random.default_rng(3).gumbel(size=50)
    found = thresholds_of({"a": np.zeros(50), "b": 5.0 + chance, "c": 200.0 + chance})
    assert found["a"] > 16.0  # four standard deviations of one number
    assert found["a"] == found["b"] < 200.0 < found["c"]
    assert thresholds_of({"a": np.zeros(5)}) == {"a": found["a"]}


def test_whitening_goes_run_by_run_and_weights_tcp_rows():
    study = small_case.study()
    sensors, tcp = Channels(np.array([0.1, 0.2, 0.4]), np.zeros(3)), Channels(np.full(3, 2e-6), np.zeros(3))
    white = Whitener(study, ((sensors, tcp), (sensors, tcp)))
    values = np.ones(sum(study.runs[k].size for k in study.fitted))
    values[5] = np.nan
    found = white(values)
    T, w = study.runs[0].split(found[: study.runs[0].size])
    np.testing.assert_allclose(T[0], [10.0, 5.0, 2.5])
    assert found[5] == 0.0
    assert T[1, 2] == 0.0
    # rows know their own noise: 0.3 um counts as 0.3 um, whatever the channel's is
    np.testing.assert_allclose(w, 1.0 / small_case.TCP_NOISE)


def test_offsets_are_one_per_sensor_of_all_runs():
    study = small_case.study()
    columns, names = offsets(study)
    assert names == ("front", "housing", "screw_middle")
    assert columns.shape == (len(measured_of(study)), 3)
    T, w = study.runs[1].split(columns[study.runs[0].size :])
    np.testing.assert_array_equal(T, np.tile(np.eye(3), (len(T), 1, 1)))
    assert not w.any()
    # the last sample of a log has a bin of its own, too small for a mean
    lost = missing(study)
    T, w = study.runs[0].split(lost[: study.runs[0].size])
    assert T[-1].all()
    assert not T[:-1].any()
    assert not w.any()


@pytest.fixture(scope="module")
def seen():
    """Unknown heat looked for with white noise of 0.02 K and 0.3 um, parameters free within their tolerances."""
    study, elements, D = small_case.study(), small_case.elements(), small_case.responses()
    sigma, x = [], np.zeros(len(study.probed.parameters))
    for k in study.fitted:
        (b, s), (rows, _) = study.runs[k].shapes
        sigma += [np.full(b * s, 0.02), np.full(rows * 3, 3e-7)]
    weight = 1.0 / np.concatenate(sigma)
    J = np.vstack([study.jacobian(k, x)[:, : len(x)] for k in study.fitted])
    white, projector = D * weight[:, None], Projector.of(J * weight[:, None])
    bare = heat_of(study, elements.histories.blocks, elements.heat_blocks)
    return with_information(bare, [white[:, c].T @ projector(white[:, c]) for c in bare.columns]), white, projector


@pytest.mark.parametrize("part", ["housing", "slide"])
def test_unknown_heat_is_seen_in_its_part(seen, part):
    heat, white, projector = seen
    elements = small_case.elements()
    own = elements.block_of["heat", part]
    watts = 40.0 * np.sin(np.arange(len(own)))
    noise = np.random.default_rng(4).standard_normal(len(white))
    g = white.T @ projector(noise + white[:, own] @ watts)
    found = evidence(heat, g)
    assert max(found, key=lambda p: found[p]) == part
    assert found[part] > 30.0
    assert surfaces_of(heat, g, part, 0.9) == [part]


def test_evidence_charges_for_freedom(seen):
    heat, white, projector = seen
    rng = np.random.default_rng(5)
    found = [max(evidence(heat, white.T @ projector(rng.standard_normal(len(white)))).values()) for _ in range(20)]
    assert np.median(found) < 1.0
    assert max(found) < 15.0


def test_evidence_is_that_of_a_gaussian_process(seen):
    """Twice the log ratio of marginal likelihoods with the dense covariance."""
    heat, white, projector = seen
    k = heat.parts.index("housing")
    D = white[:, heat.columns[k]].astype(float)
    r = np.random.default_rng(6).standard_normal(len(white)) + D @ np.full(D.shape[1], 5.0)
    base = np.eye(len(r)) + projector.N @ projector.N.T
    n = D.shape[1]
    when = np.arange(n / 2)
    one = np.exp(-0.5 * ((when[:, None] - when) / 2.0) ** 2) + 1e-6 * np.eye(n // 2)  # docs/diagnosis.md: two hours
    np.testing.assert_allclose(heat.R, np.kron(np.eye(2), one), atol=2e-6)
    ratios = []
    for sigma in np.geomspace(0.1, 1000.0, 200):  # W
        wide = base + sigma**2 * D @ heat.R @ D.T
        ratios.append(
            r @ np.linalg.solve(base, r) - r @ np.linalg.solve(wide, r)
            + np.linalg.slogdet(base)[1] - np.linalg.slogdet(wide)[1]
        )  # fmt: skip
    found = evidence(heat, white.T @ projector(r))["housing"]
    # the best of some amplitudes is no more than that of all, and little less
    assert 0.75 * max(ratios) < found < (1.0 + 1e-3) * max(ratios)


@pytest.mark.parametrize("size", [(3.0, 2.0, 1.0), (3.0, -2.0, 1.0), (2.0, -1.0, -3.0), (3.0, 0.5, -4.0)])
def test_days_that_would_cool_are_left_out(made, size):
    """Against non-negative least squares with the dense covariance."""
    D, projector, r = made
    W = np.random.default_rng(2).standard_normal((3, L))
    of = replace(batch([History("a bell a day", W)], sign=1), positive=True)
    y = r + D[:, :L] @ W.T @ size
    found = score(prepared(of, blocks(D, projector, of)), D.T @ projector(y))
    half = scipy.linalg.cholesky(np.linalg.inv(np.eye(M) + projector.N @ projector.N.T))
    a, left = scipy.optimize.nnls(half @ D[:, :L] @ W.T, half @ y)
    assert (a > 0.0).sum() < 3 or min(size) > 0.0
    np.testing.assert_allclose(found.amplitude[0, 0], a, rtol=1e-5, atol=1e-9)
    assert found.statistic[0, 0] == pytest.approx(y @ projector(y) - left**2, rel=1e-6)


def test_nuisances_that_are_one_to_rounding_are_projected_out_as_one():
    """Of measurements beyond all reason a fit bends parameters until two do the same."""
    rng = np.random.default_rng(5)
    one = 1e12 * rng.standard_normal(M)
    both = np.column_stack([one, one * (1.0 + 1e-16), one + 1e-6 * rng.standard_normal(M)])
    white = rng.standard_normal(M)
    np.testing.assert_allclose(
        Projector.of(both)(white), white - one * (one @ white) / (one @ one), atol=1e-3 * np.abs(white).max()
    )
