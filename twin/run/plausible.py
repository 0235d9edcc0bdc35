"""What no result of a run may be: not finite, hotter than any machine, or without its heat balance.

Such numbers come from a model or from loads that are damaged beyond what reading them can see. A result with a flag was
rejected: summaries, scores and fits would go on with it.
"""

from __future__ import annotations

import numpy as np

from twin.errors import FailedCheck

# Share of the throughput. The runs of the shipped machines close to 3e-10 and better, most to 1e-11; what rounding can
# do at a thousand kelvin, in a step that exchanges next to nothing, is 1e-7.
BALANCE = 1e-6
HOTTEST = 1000.0  # K from the reference temperature, either way: steel glows, and no law of films or losses holds


def refuse_not_finite(time: np.ndarray, states: np.ndarray) -> None:
    """Raises FailedCheck where states (n + 1, N) at times (n + 1,) [s] are not finite."""
    finite = np.isfinite(states).all(axis=1)
    if not finite.all():
        step = int(np.argmin(finite))
        what = f"the temperatures are not finite after {time[step]:g} s"
        raise FailedCheck(
            what, "loads", "a value in the loads is beyond all reason: run `twin check` on the run folder"
        )


def refuse_glowing(time: np.ndarray, rise: np.ndarray, names: tuple[str, ...]) -> None:
    """Raises FailedCheck where a rise (n + 1, k) [K] from the reference temperature is beyond HOTTEST, time (n + 1,) s.

    names: of what the k columns are.
    """
    beyond = np.abs(rise) > HOTTEST
    if beyond.any():
        step = int(np.argmax(beyond.any(axis=1)))
        k = int(np.argmax(np.abs(rise[step])))
        what = f"{names[k]} is {rise[step, k]:.4g} K from the reference temperature after {time[step]:g} s"
        remedy = f"beyond {HOTTEST:g} K no law holds: look for wrong values with `twin check` on the run folder"
        raise FailedCheck(what, "loads", remedy)


def refuse_unbalanced(time: np.ndarray, error: np.ndarray) -> None:
    """Raises FailedCheck where the balance of a step is off by more than BALANCE; error (n,) 1, time (n + 1,) s."""
    if not error.max(initial=0.0) <= BALANCE:
        step = int(np.argmax(~(error <= BALANCE)))
        what = (
            f"the heat balance is off by {error.max():.1e} of the throughput, first after {time[step + 1]:g} s; "
            f"the limit is {BALANCE:g}"
        )
        raise FailedCheck(what, "model", "its matrices contradict each other: `twin info --check`, and build it again")
