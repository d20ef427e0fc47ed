"""Damaged result files of all kinds: the right content or one line, in a time that is bounded, and nothing printed."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from support import preset_run
from support.buildings import frame, scene
from support.damaged_files import ends

from msfp_gen import Motion, load_scene, simulate


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


def gradients(folder: Path) -> Path:
    """A result with derivatives."""
    return simulate(load_scene("fenz-test2"), gradients=["bearing.friction[0]"]).to_netcdf(folder / "gradients.nc")


@pytest.mark.slow
@pytest.mark.parametrize("kind", [bearing, pieces, building, gradients])
def test_much_damage_ends_in_one_line(kind, tmp_path: Path) -> None:
    counts = Counter(ends(kind(tmp_path), 0, 60).values())
    assert set(counts) == {"refused", "read"} and counts["refused"] > 15, counts
