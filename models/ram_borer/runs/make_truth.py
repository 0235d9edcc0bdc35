"""Truth for the five tests: `python make_truth.py -o FOLDER` steps the full model through every run beside this file.

Each FOLDER/test_N is a run folder with loads.csv, temperatures.csv (every minute) and tcp.csv (every five minutes), as
`twin simulate models/ram_borer models/ram_borer/runs/test_N -o FOLDER/test_N --tcp-every '5 min'` writes it, but the
full model is assembled once. Two to three minutes, half a megabyte. Needs the extra `build` of the package.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from make_runs import TESTS

from twin.build.simulate import Noise, simulate_run
from twin.logs.write import refuse_to_destroy, write_run

HERE = Path(__file__).parent


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the five run folders")
    parser.add_argument("--noise", type=float, default=0.0, help="standard deviation [K], default 0")
    parser.add_argument("--tcp-noise", type=float, default=0.0, help="standard deviation [um], default 0")
    arguments = parser.parse_args()
    for name in TESTS:
        refuse_to_destroy(arguments.output / name)
    for seed, name in enumerate(TESTS, start=1):
        noise = Noise(arguments.noise, arguments.tcp_noise * 1e-6, seed)
        run, balance = simulate_run(HERE.parent, HERE / name, tcp_every=300.0, noise=noise)
        write_run(arguments.output / name, run)
        print(f"{arguments.output / name}: heat balance closes to {balance:.1e} of the throughput")


if __name__ == "__main__":
    main()
