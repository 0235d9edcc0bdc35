"""A certificate as text for a terminal."""

from __future__ import annotations

import numpy as np

from twin.build.certificate import Certificate


def lines(c: Certificate, every_output: bool = False) -> list[str]:
    """Summary lines, one per figure; with `every_output` also a line per sensor."""
    span_T, span_u = max(c.temperature_range, default=0.0), np.max(c.displacement_range, initial=0.0)
    error_T, error_u = max(c.temperature_error, default=0.0), np.max(c.displacement_error, initial=0.0)
    text = [
        f"certificate over {len(c.scenarios)} held-out scenarios of {c.hours:g} h and their steady states "
        f"(compact against rich, a new one exceeds any one maximum with probability <= {1 - c.confidence:.0%}):",
        f"  sensors   {c.max_temperature_error:.4f} K in a {c.case_temperature:g} K case "
        f"(limit {c.limit_temperature:g} K); as drawn {error_T:.3f} K at ranges up to {span_T:.0f} K: "
        f"{c.worst_temperature}",
        f"  TCP       {1e6 * c.max_displacement_error:.3f} um in a {1e6 * c.case_displacement:g} um case "
        f"(limit {1e6 * c.limit_displacement:g} um); as drawn {1e6 * error_u:.2f} um at ranges up to "
        f"{1e6 * span_u:.0f} um: {c.worst_displacement}",
        f"  worst output relative to its own range: {100 * c.worst_relative:.2f} % "
        f"(limit {100 * c.limit_relative:g} %)",
    ]
    if c.rich_temperature_error is not None and c.rich_displacement_error is not None:
        text.append(
            f"  of which rich against full, on {len(c.full_scenarios)}: {c.rich_temperature_error:.1e} K, "
            f"{1e6 * c.rich_displacement_error:.1e} um ({'; '.join(c.full_scenarios)})"
        )
    else:
        text.append("  the full model is not in this chain yet: twin verify puts it there")
    if every_output:
        text += [
            f"    {name:<24} {case:.4f} K in the case; as drawn {error:.4f} K of {span:.1f} K"
            for name, case, error, span in zip(
                c.sensors, c.temperature_error_in_case, c.temperature_error, c.temperature_range, strict=True
            )
        ]
    text.append("passed" if c.passed else "FAILED: an error is above its limit")
    return text
