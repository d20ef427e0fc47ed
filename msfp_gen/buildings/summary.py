"""Summary of a building: the numbers that `msfp-gen run --json` prints, its tables and its few lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from msfp_gen.analysis import tables
from msfp_gen.analysis.brief import html_of, text_of, with_status
from msfp_gen.buildings.data import BuildingData, energy_error
from msfp_gen.common.tables import Table, yes
from msfp_gen.results.extremes import by_axis
from msfp_gen.results.run_data import RunData


def summarise(result: BuildingData) -> dict[str, Any]:
    """Summary of a run as plain data, ready for JSON; SI units.

    Peaks are over all steps, along E1, E2, E3 and in the plane (`radial`).

    Keys:
        name, status, message, notes: of the run. duration: simulated time [s].
        peak_displacement: across any bearing [m].
        weight [N]. peak_base_shear: of the ground on all bearings [N]; base_shear_ratio: radial, over the weight.
        peak_base_torsion: about E3 through the centre of mass [N m]. peak_twist: of the base about E3 [rad].
        minimum_load_ratio, maximum_load_ratio: N of any bearing over that at rest [-].
        rims_met: bearings (from 1) of which a slider reached its rim.
        peak_floor_acceleration: of any node [m/s^2]. peak_drift_ratio: of any storey [-].
        floors: of each node, name, height [m], peak_acceleration [m/s^2], peak_displacement relative to the ground [m].
        storeys: of each, name, height [m], peak_drift [m], peak_drift_ratio [-], peak_shear [N], peak_torsion [N m].
        bearings: see `BearingResult.summary`.
        energy: largest kinetic and strain energy of the building, damped (in it) and dissipated (in the bearings) at
            the end [J]; closure_error of the balance of the building [-].
        counters: trials and tangents. wall_time [s]. real_time_factor: simulated time over wall time; None if unknown.
    """
    scene, duration = result.scene, float(result.time[-1] - result.time[0])
    bearings = [each.summary for each in result.bearings]
    floors, storeys = floor_rows(result), storey_rows(result)
    peaks = result.peaks
    shear = by_axis(peaks.base_reaction)
    return {
        "name": scene.name,
        "status": result.status,
        "message": result.message,
        "notes": [note.line for note in result.notes],
        "duration": duration,
        "peak_displacement": _largest([each["peak_displacement"] for each in bearings]),
        "weight": scene.weight,
        "peak_base_shear": shear,
        "base_shear_ratio": shear["radial"] / scene.weight,
        "peak_base_torsion": float(peaks.base_torsion[0]),
        "peak_twist": float(peaks.base_twist[0]),
        "minimum_load_ratio": min(each["minimum_load_ratio"] for each in bearings),
        "maximum_load_ratio": max(each["maximum_load_ratio"] for each in bearings),
        "rims_met": [each["number"] for each in bearings if each["rims_met"]],
        "peak_floor_acceleration": _largest([each["peak_acceleration"] for each in floors]),
        "peak_drift_ratio": max((each["peak_drift_ratio"] for each in storeys), default=None),
        "floors": floors,
        "storeys": storeys,
        "bearings": bearings,
        "energy": {
            "peak_kinetic": float(peaks.energy[0]),
            "peak_strain": float(peaks.energy[1]),
            "damped": float(result.damped[-1]),
            "dissipated": float(result.dissipated[-1].sum()),
            "closure_error": energy_error(result)[0],
        },
        "counters": dict(result.counts),
        "wall_time": result.wall_time,
        "real_time_factor": duration / result.wall_time if result.wall_time > 0 else None,
    }


def floor_rows(result: BuildingData) -> list[dict[str, Any]]:
    """Peaks of every node, as of `summarise`."""
    peaks = result.peaks
    return [
        {
            "name": node.name,
            "height": float(node.position[2]),
            "peak_acceleration": by_axis(acceleration),
            "peak_displacement": by_axis(moved),
        }
        for node, acceleration, moved in zip(
            result.scene.building.nodes, peaks.node_acceleration, peaks.node_displacement, strict=True
        )
    ]


def storey_rows(result: BuildingData) -> list[dict[str, Any]]:
    """Peaks of every storey, as of `summarise`."""
    nodes, peaks = result.scene.building.nodes, result.peaks
    rows = []
    for index, column in enumerate(result.scene.building.columns):
        height = float(nodes[index + 1].position[2] - nodes[index].position[2])
        drifts = by_axis(peaks.drift[index])
        rows.append(
            {
                "name": column.name,
                "height": height,
                "peak_drift": drifts,
                "peak_drift_ratio": drifts["radial"] / height,
                "peak_shear": by_axis(peaks.storey_shear[index]),
                "peak_torsion": float(peaks.storey_torsion[index]),
            }
        )
    return rows


def _largest(given: Sequence[Mapping[str, float]]) -> dict[str, float]:
    return {key: max(each[key] for each in given) for key in given[0]}


def brief_rows(result: BuildingData, s: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Label and value of the main results, nine rows at most. s: of `summarise`."""
    moved, shear, acceleration = s["peak_displacement"], s["peak_base_shear"], s["peak_floor_acceleration"]
    drift = "" if s["peak_drift_ratio"] is None else f", drift {100 * s['peak_drift_ratio']:.3g} % of the height"
    rows = [
        ("time", f"{result.time[-1]:.6g} s in {result.counts['steps']} steps, {result.wall_time:.3g} s"),
        ("bearings", f"{len(result.bearings)}, peak displacement {1e3 * moved['radial']:.4g} mm"),
        ("base shear", f"{1e-6 * shear['radial']:.4g} MN ({s['base_shear_ratio']:.3f} of the weight)"),
        ("floors", f"peak acceleration {acceleration['radial']:.4g} m/s^2, vertical {acceleration['E3']:.4g}{drift}"),
        ("N over N at rest", f"{s['minimum_load_ratio']:.2f} to {s['maximum_load_ratio']:.2f}"),
        ("rims met", ", ".join(result.scene.label(number - 1) for number in s["rims_met"]) or "none"),
    ]
    return with_status(result, rows)


def brief_text(result: BuildingData) -> str:
    """The main results, ten lines at most."""
    return text_of(f"Result of {result.scene.name or 'an unnamed building'}", brief_rows(result, summarise(result)))


def brief_html(result: BuildingData) -> str:
    """The main results as a table, beside the orbit of the bearing that moves most."""
    most = max(result.bearings, key=lambda each: float(result.peaks.bearing_displacement[each.index, 3]))
    x, y = most.displacement[:, :2].T
    return html_of(result.scene.name, brief_rows(result, summarise(result)), x, y, f"orbit of {most.label}")


def summary_tables(result: BuildingData | RunData) -> list[Table]:
    """Tables of the run of one bearing, or of that of a building with its floors, storeys and bearings."""
    if isinstance(result, RunData):
        return tables.summary_tables(result)
    summary = summarise(result)
    rows = [
        *brief_rows(result, summary),
        ("energy", _energy(summary["energy"])),
        ("twist", f"{summary['peak_twist']:.3g} rad"),
    ]
    rows = [row for row in rows if row[0] != "notes"]
    first = [Table(summary["name"] or "unnamed building", (), rows), _floors(summary["floors"])]
    return [*first, *([_storeys(summary["storeys"])] if summary["storeys"] else []), _bearings(summary["bearings"])]


def _energy(energy: Mapping[str, float]) -> str:
    return (
        f"bearings dissipate {1e-3 * energy['dissipated']:.4g} kJ, the frame {1e-3 * energy['damped']:.4g} kJ; balance "
        f"of the frame closes to {energy['closure_error']:.2g}"
    )


def _floors(floors: Sequence[Mapping[str, Any]]) -> Table:
    rows = [
        (
            each["name"],
            f"{each['height']:g}",
            *(f"{each['peak_acceleration'][key]:.3f}" for key in ("E1", "E2", "E3")),
            *(f"{1e3 * each['peak_displacement'][key]:.1f}" for key in ("E1", "E2")),
        )
        for each in reversed(floors)
    ]
    columns = ("floor", "z [m]", "a1 [m/s^2]", "a2", "a3", "u1 [mm]", "u2")
    return Table("peaks of floors: absolute acceleration, displacement from the ground", columns, rows)


def _storeys(storeys: Sequence[Mapping[str, Any]]) -> Table:
    rows = [
        (
            each["name"],
            *(f"{1e3 * each['peak_drift'][key]:.2f}" for key in ("E1", "E2")),
            f"{100 * each['peak_drift_ratio']:.3f}",
            *(f"{1e-6 * each['peak_shear'][key]:.3f}" for key in ("E1", "E2")),
            f"{1e-6 * each['peak_torsion']:.3f}",
        )
        for each in reversed(storeys)
    ]
    columns = ("storey", "drift 1 [mm]", "drift 2", "[% height]", "shear 1 [MN]", "shear 2", "torsion [MN m]")
    return Table("peaks of storeys", columns, rows)


def _bearings(bearings: Sequence[Mapping[str, Any]]) -> Table:
    """Peaks of every bearing."""
    rows = [
        (
            str(each["number"]),
            each["name"] or "-",
            f"{1e3 * each['peak_displacement']['radial']:.1f}",
            f"{1e-3 * each['peak_top_force']['radial']:.1f}",
            f"{1e-3 * each['axial_load']:.1f}",
            f"{each['minimum_load_ratio']:.2f} ... {each['maximum_load_ratio']:.2f}",
            f"{1e3 * min(each['minimum_gap']):.1f}",
            yes(each["rims_met"]),
        )
        for each in bearings
    ]
    columns = ("no.", "name", "u [mm]", "F [kN]", "N at rest [kN]", "N / N at rest", "least left [mm]", "rim")
    return Table("peaks of bearings; left: capacity less sliding", columns, rows)
