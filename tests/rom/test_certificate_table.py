"""The table of all outputs: every part of the error in its column, the mesh beside the sum."""

from __future__ import annotations

from twin.rom.certificate_table import table

FIGURES = {
    "sensors": ["bed", "nose"],
    "temperature_error_in_case": [0.003, 0.005],
    "temperature_error": [0.03, 0.05],
    "temperature_range": [40.0, 90.0],
    "displacement_error_in_case": [[1e-9, 2e-9, 3e-9], [4e-9, 1e-9, 1e-9]],
    "displacement_error": [[1e-8, 2e-8, 3e-8], [4e-8, 1e-8, 1e-8]],
    "displacement_range": [[1e-5, 2e-5, 3e-5], [1e-5, 1e-5, 1e-5]],
}
REDUCTION = {"temperature_error_in_case": [0.001, 0.002], "displacement_error_in_case": [1e-9, 2e-9, 3e-9]}
MESH = {"temperature_error_in_case": [0.2, 0.3], "displacement_error_in_case": [5e-7, 6e-7, 7e-7]}


def rows(figures: dict) -> list[list[str]]:
    return [line.split() for line in table(figures)]


def test_parts_that_count_come_before_their_sum_and_the_mesh_after_it():
    parts = [{"name": "mesh", "counts": False, **MESH}, {"name": "reduction", "counts": True, **REDUCTION}]
    found = rows({**FIGURES, "parts": parts, "displacement_error_at_positions_in_case": [[0.0, 9e-9, 0.0]]})
    assert found == [
        ["in", "the", "case,", "from", "reduction", "together", "mesh", "as", "drawn", "range"],
        ["bed", "[K]", "0.0010", "0.0030", "0.2000", "0.0300", "40.0000"],
        ["nose", "[K]", "0.0020", "0.0050", "0.3000", "0.0500", "90.0000"],
        ["TCP", "x", "[um]", "0.001", "0.004", "0.500", "0.040", "10.000"],
        ["TCP", "y", "[um]", "0.002", "0.009", "0.600", "0.020", "20.000"],
        ["TCP", "z", "[um]", "0.003", "0.003", "0.700", "0.030", "30.000"],
    ]


def test_certificates_of_older_artefacts_have_a_table_without_parts():
    found = rows(FIGURES)
    assert found[0][-4:] == ["together", "as", "drawn", "range"]
    assert found[1] == ["bed", "[K]", "0.0030", "0.0300", "40.0000"]
    assert len(found) == 6
