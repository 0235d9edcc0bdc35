"""A certificate as text for a terminal."""

from __future__ import annotations

import numpy as np

from twin.build.certificate import Certificate


def lines(c: Certificate, every_output: bool = False) -> list[str]:
    """Summary lines, one per figure; with `every_output` also a line per sensor."""
    u_range = np.array(c.displacement_range)
    text = [
        f"certificate over {len(c.scenarios)} held-out scenarios of {c.hours:g} h and their steady states "
        f"(a new one exceeds these with probability <= {1 - c.confidence:.0%}):",
        f"  temperature   max {c.max_temperature_error:.4f} K (limit {c.limit_temperature:g} K) "
        f"at ranges up to {max(c.temperature_range, default=0):.1f} K: {c.worst_temperature}",
        f"  TCP           max {1e6 * c.max_displacement_error:.3f} um (limit {1e6 * c.limit_displacement:g} um) "
        f"at ranges up to {1e6 * u_range.max(initial=0):.1f} um: {c.worst_displacement}",
        f"  worst output relative to its own range: {100 * c.worst_relative:.2f} %",
    ]
    if c.full_scenarios:
        text.append(
            f"  rich against full on {len(c.full_scenarios)}: {c.rich_temperature_error:.1e} K, "
            f"{1e6 * c.rich_displacement_error:.1e} um ({'; '.join(c.full_scenarios)})"
        )
    else:
        text.append("  the full model is not in this chain yet: twin verify puts it there")
    if every_output:
        text += [
            f"    {name:<24} {error:8.4f} K of {span:6.1f} K"
            for name, error, span in zip(c.sensors, c.temperature_error, c.temperature_range, strict=True)
        ]
    text.append("passed" if c.passed else "FAILED: an error is above its limit")
    return text
