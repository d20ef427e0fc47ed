"""Frames on Dao's triple pendulums under the records of TCU065, beside OpenSees: prints a table of docs/buildings.md.

`python benchmarks/tcu065.py FOLDER` needs openseespy, and the records of the example of `TripleFrictionPendulum` in
FOLDER: TCU065-E.ATH, TCU065-N.ATH and TCU065-V.ATH, accelerations in g at 0.005 s. They belong to the example of
OpenSees, not to this package. A second argument is the factor on the records, 0.5 unless given.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from buildings import client, floors_given
from buildings import record as preset_record
from quick import installed, parser, pick

from msfp_gen import (
    BaseSlab,
    Bearing,
    Body,
    Building,
    BuildingBearing,
    BuildingScene,
    Effects,
    Layout,
    Motion,
    Solver,
    Storey,
    Surface,
    Top,
    simulate,
)
from msfp_gen.common.arrays import Array
from msfp_gen.studies.accuracy.series import Series

SAMPLE, G = 0.005, 9.81  # of the records [s], [m/s^2]
LENGTHS, FRICTIONS, CAPACITIES = (0.36, 1.25, 1.25), (0.012, 0.052, 0.14), (0.1, 0.2, 0.2)  # of the element
WEIGHT, VERTICAL, YIELD = 1000.0, 1e6, 1e-3  # on a bearing [N], its stiffness [N/m], yield displacement [m]
RATIO = 0.05  # of damping of that stiffness under the weight
STIFF = 50.0  # vertical frequency of columns that are as good as rigid [Hz]
PLACES = ((3.0, 3.0), (-3.0, 3.0), (-3.0, -3.0), (3.0, -3.0))  # [m]


class Case(NamedTuple):
    """Storeys of equal mass on a base of a quarter of the mass; heights are so small that nothing overturns.

    period: of the first mode on a fixed base [s]. vertical: frequency of that of the columns [Hz].
    """

    name: str
    storeys: int = 0
    period: float = 1.0
    vertical: float = STIFF


CASES = (
    Case("rigid mass"),
    Case("one storey, 0.5 s", 1, 0.5),
    Case("one storey, 1.0 s", 1, 1.0),
    Case("three storeys, 0.5 s, columns 12 Hz", 3, 0.5, 12.0),
)
DAMPING = 0.02  # of the first mode along E1 and E2, and of that along E3


def record(folder: Path, factor: float) -> Array:
    """Accelerations of the records, shape (k, 3) [m/s^2]."""
    columns = [np.loadtxt(folder / f"TCU065-{component}.ATH") for component in "ENV"]
    count = min(map(len, columns))
    return factor * G * np.column_stack([column[:count] for column in columns])


def parts_of(case: Case) -> list[BaseSlab | Storey]:
    """Base and storeys of a case."""
    mass = 4 * WEIGHT / G
    if not case.storeys:
        return [BaseSlab(mass, (10 * mass,) * 3)]
    own = 0.75 * mass / case.storeys
    matrix = 2 * np.eye(case.storeys) - np.eye(case.storeys, k=1) - np.eye(case.storeys, k=-1)
    matrix[-1, -1] = 1.0
    lowest = float(np.linalg.eigvalsh(matrix)[0])  # k/m of a storey times this is the square of the first frequency
    stiffness, vertical = (own / lowest * (2 * np.pi * f) ** 2 for f in (1 / case.period, case.vertical))
    storey = Storey(
        height=0.01,
        mass=own,
        inertia=(10 * own,) * 3,
        stiffness=stiffness,
        torsional_stiffness=10 * stiffness,
        vertical_stiffness=vertical,
        rocking_stiffness=10 * vertical,
    )
    return [BaseSlab(0.25 * mass, (2.5 * mass,) * 3), *case.storeys * [storey]]


def dao() -> Bearing:
    """A stack of the element's effective lengths; see tests/physics/test_opensees_client.py for its frictions."""
    inner, *outer = LENGTHS
    begins = FRICTIONS[0] * inner
    frictions = [FRICTIONS[0], *((mu * (r - inner) + begins) / r for mu, r in zip(FRICTIONS[1:], outer, strict=True))]
    radii = np.array(LENGTHS)
    for _ in range(3):  # effective lengths are radii less heights
        made = _stack(radii, frictions)
        links = {link.surface: link for link in Series(made, rims=True).links}
        radii = radii + LENGTHS - [links[k].effective for k in (1, 0, 3)]
    return _stack(radii, frictions)


def _stack(radii: Array, frictions: list[float]) -> Bearing:
    shares = ((1, 1.0), (0, 0.5), (0, 0.5), (2, 1.0))  # length and share of the yield displacement of each surface
    surfaces = [
        Surface(radii[k], CAPACITIES[k], frictions[k], YIELD * share, rim_stiffness=1e6, contact_damping=1e-4)
        for k, share in shares
    ]
    light = [Body(height=2e-3, centroid=1e-3, mass=0.01, inertia=(1e-6, 1e-6), rim_radius=0.05) for _ in range(4)]
    return Bearing(Layout.tfp(), 2e-3, surfaces, light, gravity=G)


def own(case: Case, ground: Array) -> tuple[Array, Array]:
    """Displacement of a bearing, shape (k, 2) [m], and axial force of all over the weight, by this package."""
    times = SAMPLE * np.arange(len(ground))
    motion = Motion.from_acceleration(times, (ground - ground[0]) * np.minimum(1.0, times / 0.2)[:, None])
    damping = 2 * RATIO * np.sqrt(VERTICAL * WEIGHT / G)
    interface = Top.node(1e7, VERTICAL, 1e6, 1e3, damping, 1e2)
    bearings = [BuildingBearing(dao(), interface, place, effects=Effects(bouc_wen="plastic")) for place in PLACES]
    result = simulate(BuildingScene(damped_frame(case), bearings, motion, Solver(rtol=1e-4), output_step=SAMPLE))
    return result.bearing_displacement[:, 0, :2], result.axial_force.sum(axis=1) / (4 * WEIGHT)


def theirs(case: Case, ground: Array) -> tuple[Array, Array]:
    """The same by the element of OpenSees."""
    damping = 2 * RATIO * np.sqrt(VERTICAL * WEIGHT / G)
    native: dict[str, Any] = {"lengths": LENGTHS, "frictions": FRICTIONS, "capacities": CAPACITIES, "weight": WEIGHT}
    native |= {"load": WEIGHT, "yield_displacement": YIELD, "vertical_stiffness": VERTICAL, "vertical_damping": damping}
    answer = client(
        floors_given=floors_given(parts_of(case), damping_times(case)),
        bearings_given=[{"position": place, **native} for place in PLACES],
        ground=ground.T.tolist(),
        ground_step=SAMPLE,
        step=SAMPLE,
        count=len(ground) - 1,
        every=1,
        tolerance=1e-5 * WEIGHT,
    )
    if answer["status"]:
        raise SystemExit(f"OpenSees: {case.name} ends after {len(answer['displacement'])} steps")
    return np.array(answer["displacement"])[:, 0, :2], np.array(answer["compression"]).sum(axis=1) / (4 * WEIGHT)


def damping_times(case: Case) -> list[float]:
    """Damping over stiffness of the columns along and about E1, E2, E3 [s]."""
    along, upright = DAMPING * case.period / np.pi, DAMPING / (np.pi * case.vertical)
    return [along, along, upright, upright, upright, along]


def damped_frame(case: Case) -> Building:
    """The frame, with dampers beside the springs of its columns."""
    base, *storeys = parts_of(case)
    made = Building.shear(base, storeys, 0.0)  # type: ignore[arg-type]
    damping = np.zeros_like(made.stiffness)
    for storey, column in zip(storeys, made.columns, strict=True):
        dampers = storey.springs * damping_times(case)  # type: ignore[union-attr]
        damping += column.deformation.T * dampers @ column.deformation
    return Building(made.mass, damping, made.stiffness, made.nodes, made.columns)


def main() -> None:
    """Print the table; a quick run takes a second of the record of a preset."""
    options = parser(__doc__)
    options.add_argument("folder", nargs=pick(None, "?"), type=Path, help="with the records")
    options.add_argument("factor", nargs="?", type=float, default=0.5, help="on the records")
    given = options.parse_args()
    if not installed("openseespy.opensees", "the whole table"):
        return
    ground = np.repeat(preset_record(1.0)[0], 2, axis=0) if given.folder is None else record(given.folder, given.factor)
    print("| building | OpenSees [m] | N/W | msfp-gen [m] | N/W |\n|---|---|---|---|---|")
    for case in CASES[: pick(None, 2)]:
        cells = []
        for path, load in (theirs(case, ground), own(case, ground)):
            cells += [f"{np.linalg.norm(path, axis=1).max():.3f}", f"{load.min():.2f} to {load.max():.2f}"]
        print(f"| {' | '.join([case.name, *cells])} |", flush=True)


if __name__ == "__main__":
    main()
