"""A result as CSV, JSON and netCDF4: pandas and xarray read the numbers of result.h5, with units."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

import twin
from tests.reference.exports import read_tables_of_results as read
from twin.errors import TwinError
from twin.export.options import ExportOptions


@pytest.fixture(scope="module")
def stored(slide_result) -> dict[str, np.ndarray]:
    with h5py.File(slide_result / "result.h5") as f:
        names = ("time", "temperature", "tcp", "tcp_actual", "position", "power", "pose_position")
        return {**{name: f[name][...] for name in names}, "sensor": f["sensor"].asstr()[...]}


def export(artefact, result, path, name):
    return twin.export(artefact, name, path, ExportOptions(result=result))


def test_csv_in_pandas(slide_artefact, slide_result, stored, tmp_path):
    pytest.importorskip("pandas", reason="pandas is not installed (extra `compare`)")
    export(slide_artefact, slide_result, tmp_path / "r.csv", "csv")
    table = read.frame(tmp_path / "r.csv")
    np.testing.assert_array_equal(table.index, stored["time"])
    columns = [f"temperature_{name}" for name in stored["sensor"]]
    np.testing.assert_allclose(table[columns], stored["temperature"], rtol=1e-8)
    np.testing.assert_allclose(table[["tcp_x", "tcp_y", "tcp_z"]], stored["tcp_actual"], atol=1e-14)
    np.testing.assert_allclose(table["offset_x"], -stored["tcp_actual"][:, 0], atol=1e-14)  # the axis carries the tool
    assert table.attrs["units"]["tcp_x"] == table.attrs["units"]["offset_x"] == "m"
    assert table.attrs["units"][columns[0]] == "degC"
    assert np.ptp(table["tcp_x"]) > 1e-6


@pytest.mark.parametrize(("name", "file"), [("json", "r.json"), ("xarray", "r.nc")])
def test_all_tables_in_xarray(name, file, slide_artefact, slide_result, stored, tmp_path):
    pytest.importorskip("h5netcdf", reason="h5netcdf is not installed (extra `compare`)")
    export(slide_artefact, slide_result, tmp_path / file, name)
    data = read.dataset(tmp_path / file)
    for key in ("temperature", "tcp", "tcp_actual", "position", "power", "pose_position"):
        np.testing.assert_array_equal(data[key], stored[key])
    assert data["temperature"].dims == ("time", "sensor")
    assert data["temperature"].attrs["units"] == "degC"
    assert data["tcp"].attrs["units"] == data["offset"].attrs["units"] == "m"
    sensor = str(stored["sensor"][0])
    np.testing.assert_array_equal(data["temperature"].sel(sensor=sensor), stored["temperature"][:, 0])
    np.testing.assert_array_equal(data["offset"][:, :, 0], -stored["tcp"][:, :, 0])
    data.to_netcdf(tmp_path / "again.nc", engine="h5netcdf")
    assert read.dataset(tmp_path / "again.nc").equals(data)


@pytest.mark.parametrize("name", ["csv", "json", "xarray"])
def test_what_is_no_result_is_refused(name, slide_artefact, tmp_path):
    target = tmp_path / "r"
    with pytest.raises(TwinError, match="of a result"):
        twin.export(slide_artefact, name, target)
    with pytest.raises(TwinError, match="not a result"):
        export(slide_artefact, slide_artefact, target, name)
    assert not list(tmp_path.iterdir())
