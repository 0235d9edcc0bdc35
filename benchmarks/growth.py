"""Time and peak memory of assembly and condensation on growing meshes of the shipped machine (needs the mesh extra)."""

from __future__ import annotations

import subprocess
import sys

SIZES = (0.16, 0.12, 0.09)

CHILD = """
import sys, time
from benchmarks.five_axis import machine
from twin.build.full_model import assemble
from twin.build.remesh import remesh
other = remesh(machine(), float(sys.argv[1]))
began = time.perf_counter()
full = assemble(other)
seconds = time.perf_counter() - began
# VmHWM, not ru_maxrss, which a child process inherits from its parent
peak = next(line for line in open("/proc/self/status") if line.startswith("VmHWM")).split()[1]
print(full.thermal.n, seconds, int(peak) / 2**20)
"""


def main() -> None:
    for size in SIZES:
        done = subprocess.run([sys.executable, "-c", CHILD, str(size)], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            print(f"   size {1e3 * size:.0f} mm: not measured: {done.stderr.strip().splitlines()[-1]}")
            continue
        n, seconds, peak = done.stdout.split()[-3:]
        print(f"   size {1e3 * size:.0f} mm: {n} nodes, {float(seconds):.1f} s, peak {float(peak):.2f} GiB")
