"""Damaged result files of all kinds: the right content or one line, in a time that is bounded, and nothing printed."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import h5py
import pytest
from support import preset_run
from support.buildings import frame, scene
from support.damaged_files import SEAL, ends

from msfp_gen import InputError, Motion, Result, load_scene, simulate
from msfp_gen.results.stored_group import stored_groups


def bearing(folder: Path) -> Path:
    """A result with its motion as a table of the scene."""
    return preset_run("fenz-test2").to_netcdf(folder / "bearing.nc")


def pieces(folder: Path) -> Path:
    """A result with its motion as polynomials."""
    result = preset_run("fenz-test2")
    given = replace(result.scene, motion=Motion.harmonic(0.01, 0.1), duration=None)
    return replace(result, scene=given).to_netcdf(folder / "pieces.nc")


def building(folder: Path) -> Path:
    """The result of a building."""
    given = scene(frame(), motion=Motion.harmonic(0.05, 0.6, direction=0.4, cycles=1), duration=0.1, output_step=0.02)
    return simulate(given).to_netcdf(folder / "building.nc")


def streamed(folder: Path) -> Path:
    """A result whose rows were written block by block."""
    simulate(load_scene("fenz-test2"), stream=folder / "streamed.nc")
    return folder / "streamed.nc"


def gradients(folder: Path) -> Path:
    """A result with derivatives."""
    return simulate(load_scene("fenz-test2"), gradients=["bearing.friction[0]"]).to_netcdf(folder / "gradients.nc")


def right(found: dict[int, str]) -> None:
    assert not {seed: end for seed, end in found.items() if end not in ("refused", "read")}


def test_damage_ends_in_one_line(tmp_path: Path) -> None:
    """Runs of 64 zeros in the first heap of a building's file, most of which make HDF5 loop for ever; other damage."""
    found = ends(building(tmp_path), -64, 94)
    right(found)
    assert Counter(found.values())["refused"] >= 70


@pytest.mark.slow
@pytest.mark.parametrize("kind", [bearing, pieces, building, streamed, gradients])
def test_much_damage_ends_in_one_line(kind, tmp_path: Path) -> None:
    found = ends(kind(tmp_path), 0, 1000)
    right(found)
    assert Counter(found.values())["refused"] > 700


def test_one_changed_byte_of_a_sealed_file_is_refused_before_hdf5_sees_it(tmp_path: Path, monkeypatch) -> None:
    path = bearing(tmp_path)
    whole = path.read_bytes()
    monkeypatch.setattr(h5py, "File", lambda *_: pytest.fail("opened"))
    for at in (0, 8, len(whole) // 2, len(whole) - SEAL - 1, len(whole) - 1):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
        with pytest.raises(InputError, match="its bytes are not those that were written"):
            Result.from_netcdf(path)


def test_another_program_that_writes_takes_the_seal_off(tmp_path: Path) -> None:
    path = bearing(tmp_path)
    size = path.stat().st_size
    with h5py.File(path, "r+"):
        pass
    assert path.stat().st_size == size - SEAL
    with stored_groups(path) as root:
        assert "time" in root
