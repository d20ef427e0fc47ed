"""Matrices of buildings against closed forms: shear frames, damping, reduction; and the messages of bad input."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.linalg import eigh

from msfp_gen.buildings.building import Building
from msfp_gen.buildings.storey import FREEDOMS, BaseSlab, Storey, rigid
from msfp_gen.common.errors import InputError

MASS, STIFFNESS, HEIGHT = 2e5, 3e8, 3.5
BASE = BaseSlab(3e5, (4e6, 6e6, 9e6))
STOREY = Storey(HEIGHT, MASS, (3e6, 4e6, 7e6), STIFFNESS, 1.2e10)
TALL = replace(STOREY, vertical_stiffness=8e9, rocking_stiffness=(3e11, 4e11))
ECCENTRIC = replace(TALL, mass_centre=(0.8, -0.5), stiffness_centre=(-0.3, 0.4))
COUNT = 3


def shear_frequencies(count: int, stiffness: float, inertia: float) -> np.ndarray:
    """Of a uniform chain that is fixed at one end [Hz]."""
    angles = (2 * np.arange(1, count + 1) - 1) * np.pi / (2 * (2 * count + 1))
    return np.sqrt(stiffness / inertia) * np.sin(angles) / np.pi


def test_frequencies_of_a_uniform_shear_frame():
    found = Building.shear(BASE, COUNT * [STOREY]).frequencies
    sway, twist = shear_frequencies(COUNT, STIFFNESS, MASS), shear_frequencies(COUNT, 1.2e10, 7e6)
    assert found == pytest.approx(np.sort([*sway, *sway, *twist]), rel=1e-10)


def test_columns_that_shorten_add_vertical_modes():
    found = Building.shear(BASE, COUNT * [TALL]).frequencies
    assert len(found) == 6 * COUNT
    for each in shear_frequencies(COUNT, 8e9, MASS):
        assert np.abs(found / each - 1).min() < 1e-10


def test_tall_columns_tend_to_rigid_ones():
    stiff = replace(STOREY, vertical_stiffness=1e15, rocking_stiffness=1e17)
    found = Building.shear(BASE, COUNT * [stiff]).frequencies[:9]
    assert found == pytest.approx(Building.shear(BASE, COUNT * [STOREY]).frequencies, rel=1e-5)


def test_one_eccentric_storey_has_the_frequencies_of_its_coupled_equations():
    """Lateral motion along E2 and twist: the textbook case of an eccentricity e along E1, on rigid columns."""
    e = 1.1
    storey = replace(STOREY, mass_centre=(e, 0.0))
    k = np.diag([STIFFNESS, 1.2e10]) + STIFFNESS * np.array([[0.0, -e], [-e, e**2]])
    coupled = np.sqrt(eigh(k, np.diag([MASS, 7e6]), eigvals_only=True)) / (2 * np.pi)
    expected = np.sort([*coupled, np.sqrt(STIFFNESS / MASS) / (2 * np.pi)])
    assert Building.shear(BASE, [storey]).frequencies == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("storey", [STOREY, TALL, ECCENTRIC])
def test_rigid_motions_meet_no_force_and_move_the_whole_mass(storey):
    building = Building.shear(BASE, COUNT * [storey], 0.05, (1.0, 10.0))
    motions = np.linalg.lstsq(
        np.vstack([node.rows for node in building.nodes]),
        np.vstack([rigid(node.position) for node in building.nodes]),
        rcond=None,
    )[0]
    for node in building.nodes:
        assert node.rows @ motions == pytest.approx(rigid(node.position), abs=1e-9)
    for matrix in (building.stiffness, building.damping):
        assert np.abs(matrix @ motions).max() < 1e-12 * np.abs(matrix).max() * 100
    total = BASE.mass + COUNT * MASS
    inertia = motions.T @ building.mass @ motions
    assert inertia[:3, :3] == pytest.approx(total * np.eye(3), abs=1e-6 * total)
    height = [HEIGHT * (i + 1) for i in range(COUNT)]
    own = BASE.inertia[0] + sum(storey.inertia[0] + MASS * (storey.mass_centre[1] ** 2 + z**2) for z in height)
    assert inertia[3, 3] == pytest.approx(own, rel=1e-12)


def test_inertia_of_the_storeys_above():
    """All floors accelerate by 1 m/s^2 along E1: shears are the masses above, moments those about mid-height."""
    building = Building.shear(BASE, COUNT * [STOREY])
    acceleration = np.zeros(len(building.mass))
    acceleration[[0, *range(6, 15, 3)]] = 1.0
    for index, column in enumerate(building.columns):
        force = column.inertia @ acceleration
        above = COUNT - index
        moment = sum(MASS * HEIGHT * (i + 0.5) for i in range(above))
        assert force == pytest.approx([MASS * above, 0, 0, 0, moment, 0], abs=1e-6)
        assert column.deformation @ acceleration == pytest.approx(np.zeros(6), abs=1e-12)


def ratios_of(building: Building) -> np.ndarray:
    fixed = building.fixed
    inner = np.ix_(fixed.inner, fixed.inner)
    damping = fixed.modes.T @ building.damping[inner] @ fixed.modes
    assert damping == pytest.approx(np.diag(np.diag(damping)), abs=1e-9 * damping.max())
    return np.diag(damping) / (2 * fixed.frequencies)


def test_modal_damping():
    one = ratios_of(Building.shear(BASE, COUNT * [ECCENTRIC], 0.03))
    assert one == pytest.approx(np.full(18, 0.03), rel=1e-9)
    several = ratios_of(Building.shear(BASE, COUNT * [ECCENTRIC], [0.01, 0.05]))
    assert several == pytest.approx([0.01, *17 * [0.05]], rel=1e-9)


def test_rayleigh_damping():
    building = Building.shear(BASE, COUNT * [STOREY], 0.05, (2.0, 15.0))
    f = building.frequencies
    assert ratios_of(building) == pytest.approx(0.05 / 17 * (30 / f + f), rel=1e-9)


def test_reduction_keeps_modes_statics_and_mass():
    building = Building.shear(BASE, 8 * [ECCENTRIC], 0.04)
    full, limit = building.frequencies, 20.0
    found = building.reduced(limit)
    count = int((full <= limit).sum())
    assert 6 < count < len(full) and len(found.mass) == FREEDOMS + count
    assert found.frequencies == pytest.approx(full[:count], rel=1e-9)
    assert ratios_of(found) == pytest.approx(np.full(count, 0.04), rel=1e-9)
    static = found.mass[:FREEDOMS, :FREEDOMS]
    motions = np.vstack([node.rows for node in building.nodes])
    rigidly = np.linalg.lstsq(motions, np.vstack([rigid(n.position) for n in building.nodes]), rcond=None)[0]
    assert static == pytest.approx(rigidly.T @ building.mass @ rigidly, rel=1e-6, abs=1e-3)


def test_response_of_the_reduced_building_to_its_base():
    """Forces on the base that moves harmonically, from 6 Hz of 25: against all coordinates."""
    building = Building.shear(BASE, 8 * [ECCENTRIC], 0.04)
    w = 2 * np.pi * 6.0

    def base_stiffness(b: Building) -> np.ndarray:
        dynamic = b.stiffness + 1j * w * b.damping - w**2 * b.mass
        return np.linalg.inv(np.linalg.inv(dynamic)[:6, :6])

    full = base_stiffness(building)
    errors = [np.abs(base_stiffness(building.reduced(f)) / full - 1)[np.diag_indices(6)].max() for f in (15, 40, 1e4)]
    assert errors[0] > errors[1] > errors[2]
    assert errors[1] < 2e-2 and errors[2] < 1e-8


def test_matrices_from_arrays_and_files_are_the_same(tmp_path: Path):
    frame = Building.shear(BASE, COUNT * [ECCENTRIC], 0.05)
    nodes = {"base": (range(6), (0.0, 0.0, 0.0))}
    arrays = Building.from_matrices(frame.mass, None, frame.stiffness, nodes=nodes, damping_ratio=0.05)
    assert arrays.damping == pytest.approx(frame.damping, abs=1e-6)
    np.savez(tmp_path / "frame.npz", mass=frame.mass, damping=frame.damping, stiffness=frame.stiffness)
    from_npz = Building.from_matrices(*3 * [tmp_path / "frame.npz"], nodes=nodes)
    for name in ("mass", "stiffness"):
        mmwrite(tmp_path / f"{name}.mtx", getattr(frame, name), precision=17)
    from_mtx = Building.from_matrices(tmp_path / "mass.mtx", None, str(tmp_path / "stiffness.mtx"), nodes=nodes)
    assert from_npz.damping == pytest.approx(frame.damping, abs=1e-12 * frame.damping.max())
    assert from_mtx.frequencies == pytest.approx(frame.frequencies, rel=1e-12)


def test_two_nodes_on_a_beam_are_free():
    """Two nodes that carry bearings, joined by an elastic beam: no rigid motion strains it."""
    beam = rigid([4.0, 0.0, 0.0]).T @ np.diag([1e8, 1e7, 1e7, 1e8, 1e8, 1e8]) @ rigid([4.0, 0.0, 0.0])
    shape = np.hstack([-np.eye(6), rigid([-4.0, 0.0, 0.0])])
    k = shape.T @ beam @ shape
    nodes = {"a": (range(6), (0.0, 0.0, 0.0)), "b": (range(6, 12), (4.0, 0.0, 0.0))}
    found = Building.from_matrices(np.eye(12), None, k, nodes=nodes)
    assert found.boundary == tuple(range(12)) and found.frequencies.size == 0


def frame_parts() -> tuple[np.ndarray, np.ndarray, dict[str, tuple[range, tuple[float, float, float]]]]:
    frame = Building.shear(BASE, [STOREY])
    return frame.mass.copy(), frame.stiffness.copy(), {"base": (range(6), (0.0, 0.0, 0.0))}


def supported(m: np.ndarray, k: np.ndarray) -> None:
    k[0, 0] += 1e6


def skew(m: np.ndarray, k: np.ndarray) -> None:
    m[0, 1] = 1e5


def nan(m: np.ndarray, k: np.ndarray) -> None:
    m[2, 3] = np.nan


def negative(m: np.ndarray, k: np.ndarray) -> None:
    m[6, 6] = -1.0


def loose(m: np.ndarray, k: np.ndarray) -> None:
    k[8], k[:, 8] = 0.0, 0.0


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (supported, r"building\.stiffness resists a translation along E1 of the whole building; leave out"),
        (skew, r"building\.mass\[0, 1\] = .* give a symmetric matrix"),
        (nan, r"building\.mass\[2, 3\] = nan: give finite numbers"),
        (negative, r"building\.mass has the eigenvalue"),
        (loose, r"building\.stiffness: on fixed attachments its least eigenvalue is 0"),
    ],
)
def test_messages_of_bad_matrices(spoil, message):
    m, k, nodes = frame_parts()
    spoil(m, k)
    with pytest.raises(InputError, match=message):
        Building.from_matrices(m, None, k, nodes=nodes)


def test_damping_of_rigid_motions_is_rejected():
    m, k, nodes = frame_parts()
    with pytest.raises(InputError, match=r"building\.damping resists a translation along E1 .* damping_ratio"):
        Building.from_matrices(m, 0.1 * m + 1e-3 * k, k, nodes=nodes)


def test_messages_of_bad_files(tmp_path: Path):
    m, _, nodes = frame_parts()
    np.savez(tmp_path / "frame.npz", mass=m)
    (tmp_path / "damaged.mtx").write_text("not a matrix")
    for source, message in (
        (tmp_path / "frame.npz", "it has no array 'stiffness' but mass"),
        (tmp_path / "none.mtx", "check the file"),
        (tmp_path / "damaged.mtx", "check the file"),
        (tmp_path / "frame.txt", "give a file of Matrix Market"),
        ("words", "give a file of Matrix Market"),
        ([["a"]], "these are no real numbers"),
        (1j * np.eye(9), "these are no real numbers"),
        (-1e200 * np.eye(9), r"building\.stiffness\[0, 0\] = -1e\+200: give finite numbers up to 1e\+30"),
        (np.eye(3)[:2], r"has the shape \(2, 3\)"),
        (np.eye(3), "building.stiffness has 3 rows: building.mass has 9"),
    ):
        with pytest.raises(InputError, match=message):
            Building.from_matrices(m, None, source, nodes=nodes)


def test_messages_of_bad_storeys():
    with pytest.raises(InputError, match=r"storey\.mass = -1: give a finite number above 0 \[kg\]"):
        replace(STOREY, mass=-1)
    with pytest.raises(InputError, match=r"storey\.vertical_stiffness = 1.0: .* give storey\.rocking_stiffness"):
        replace(STOREY, vertical_stiffness=1.0)
    with pytest.raises(InputError, match=r"node = 'roof': .* 'base', 'floor 1'"):
        Building.shear(BASE, [STOREY]).node("roof")


def test_nodes_of_one_rigid_body_share_its_coordinates():
    """As of a building of matrices that is taken for rigid; other nodes with coordinates of another are refused."""
    frame = Building.shear(BASE, [STOREY])
    base, corner = frame.nodes[0], np.array([3.0, 2.0, 0.0])
    linked = replace(base, name="corner", position=corner, rows=base.linked(corner))
    assert replace(frame, nodes=(*frame.nodes, linked)).boundary == frame.boundary
    bent = replace(linked, rows=linked.rows * np.array([2.0, 1, 1, 1, 1, 1])[:, None])
    with pytest.raises(InputError, match=r"building\.nodes\['corner'\]: coordinate 0 belongs to another node"):
        _ = replace(frame, nodes=(*frame.nodes, bent)).boundary
    with pytest.raises(InputError, match="frequency = 0"):
        Building.shear(BASE, [STOREY]).reduced(0)
