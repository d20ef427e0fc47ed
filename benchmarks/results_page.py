"""Write docs/peer-2017-07.md from its template: all numbers and tables are computed from the runs."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import numpy as np
from drawing import MILLI, Runs, closed_form, closed_push, cycle, ratio
from inertia_study import GRID, RTOL, SERIES, TESTED, Point, failures, scene
from quick import labelled

from msfp_gen import simulate
from msfp_gen.common.output import replacing
from msfp_gen.common.tables import markdown_table
from msfp_gen.results import summary as stops
from msfp_gen.results.result import Result
from msfp_gen.results.sliding import SHARE

# Table 4.2 as printed: analytical, experiment, model of PEER 2017/07. u in [mm], F over N.
TABLE_42 = {
    "u_star": ("u* [mm]", 0.1, 2.0, 1.9),
    "u_star_star": ("u** [mm]", 38.4, 42.0, 49.0),
    "u_dr1": ("u_dr1 [mm]", 92.1, 90.0, 87.0),
    "u_dr4": ("u_dr4 [mm]", 130.4, 130.0, 134.0),
    "F_dr1": ("F_dr1 / N", 0.161, 0.173, 0.175),
    "F_dr4": ("F_dr4 / N", 0.240, 0.272, 0.275),
}
EDGES = ("u_star", "u_star_star", "u_dr1", "u_dr4")  # between regimes I, II, III, IV, V
TAKES_PART = 0.05  # least share of all sliding of a surface that is listed
PERIODIC = (*(f"fenz-test{number}" for number in range(1, 6)), "unusual-tfp")
ORBITS = tuple(f"becker-{kind}-{a}" for kind in ("circle", "eight") for a in (125, 88, 50, 25, 12, 5))
TEMPLATE = Path(__file__).with_name("peer-2017-07.md.in")


def table_42_row(key: str, ours: float, closed: float | None) -> tuple[str, ...]:
    """One row of Table 4.2 with two more columns; `ours` and `closed` are displacements in [m] or F over N."""
    name, *printed = TABLE_42[key]
    scale, digits = (MILLI, 1) if key.startswith("u_") else (1.0, 3)
    numbers = [*(f"{value:.{digits}f}" for value in printed), f"{ours * scale:.{digits}f}"]
    return (name, *numbers, "–" if closed is None else f"{closed * scale:.{digits}f}")


def closed_transitions(result: Result) -> dict[str, float]:
    """The transitions of the massless, rigid-plastic stack; without u*, at which surface 2 remains at yield."""
    from reference.friction_circle import transitions

    push = closed_push(result)
    states = {(t.what, t.surface): t.at for t in transitions(push, result.history.horizontal.max())}
    found = {"u_star_star": states["slides", 4].displacement}
    for surface in (1, 4):
        rim = states["rim", surface]
        found |= {f"u_dr{surface}": rim.displacement, f"F_dr{surface}": rim.force / push.load}
    return found


def stage_rows(result: Result) -> list[tuple[str, ...]]:
    """For each sliding regime its displacements, and the surfaces that slide with their shares of all sliding."""
    history, found = result.history, result.summary["transitions"]
    u = history.displacement[:, 0]
    edges = [0.0, *(found[key] for key in EDGES), float(u[-1])]
    rows = []
    for name, low, high in zip(("I", "II", "III", "IV", "V"), edges, edges[1:], strict=False):
        moved = np.array([abs(np.interp(high, u, s) - np.interp(low, u, s)) for s in history.sliding.T])
        share = moved / moved.sum()
        taking = [f"{index + 1} ({share[index]:.0%})" for index in np.flatnonzero(share > TAKES_PART)]
        rows.append((name, f"{low * MILLI:.1f} – {high * MILLI:.1f}", ", ".join(taking)))
    return rows


def peak_row(result: Result, closed: bool) -> tuple[str, ...]:
    """Peaks of a run; with `closed` also the closed form at the same displacement, and the change of the last cycle."""
    summary = result.summary
    u = summary["peak_displacement"]["radial"]
    cells = [
        f"`{result.scene.name}`",
        f"{u * MILLI:.2f}",
        f"{summary['peak_force']['radial'] / 1e3:.2f}",
        f"{summary['peak_force_ratio']:.4f}",
    ]
    if closed:
        cells += [f"{closed_form(result, np.array([u]))[0]:.4f}", f"{cycle_change(result):.2%}"]
    return (*cells, ", ".join(map(str, summary["rims_met"])) or "none")


def resting_offset(result: Result) -> float:
    """Mean distance of the slider of surface 4 from the centre of its dish in the last cycle [m]."""
    tilt = result.history.tilt_angles[cycle(result), 3, :2].mean(axis=0)
    return float(np.hypot(*tilt)) * result.scene.bearing.surfaces[3].radius


def cycle_change(result: Result) -> float:
    """Largest difference of force between the last two cycles at equal phase, over the peak."""
    time, force = result.history.time, ratio(result)[:, 0]
    period = float(str(result.scene.motion.metadata["period"]))
    now = np.linspace(result.scene.end - period, result.scene.end, 2001)
    gap = np.interp(now, time, force) - np.interp(now - period, time, force)
    return float(np.abs(gap).max() / np.abs(force[cycle(result)]).max())


def force_differences(load: float) -> tuple[float, float]:
    """Largest difference in F/N between the runs with and without inertia, before and after contact with rim 4."""
    moving, still = (simulate(scene(load, series)) for series in SERIES[:2])
    forces = [np.interp(GRID, r.history.base_displacement[:, 0], ratio(r)[:, 0]) for r in (moving, still)]
    gap = np.abs(forces[0] - forces[1])
    met = min(r.summary["transitions"]["u_dr4"] for r in (moving, still))
    return float(gap[met > GRID].max()), float(gap[met <= GRID].max())


def study_numbers(points: list[Point]) -> dict[str, str]:
    """Values of the template: V at the least and at the tested load and on the plateau, and the runs that failed."""
    v = {
        name: {p.load: p.variance for p in points if p.series == name and p.variance is not None}
        for name in ("inertial", "weights", "fixed-rig")
    }
    tested = min(v["inertial"], key=lambda load: abs(np.log(load / TESTED)))
    plateau = min((p for p in points if p.series == "inertial"), key=lambda p: abs(np.log(p.eta / 0.1)))
    before, after = force_differences(tested)
    failed = failures(points)
    lines = [
        f"- {p.series}, N = {p.load:.3g} N (η = {p.eta:.2g}): `{p.status}` at t = {p.time:.4f} s, ground at "
        f"{p.reached * MILLI:.1f} mm"
        for p in failed
    ]
    return {
        "v_tested": f"{v['inertial'][tested]:.3f}",
        "w_tested": f"{v['weights'][tested]:.1e}",
        "f_tested": f"{v['fixed-rig'][tested]:.2f}",
        "tested": f"{tested / 1e3:.0f}",
        "v_least": f"{v['inertial'][min(v['inertial'])]:.3f}",
        "w_least": f"{v['weights'][min(v['weights'])]:.3f}",
        "f_before": f"{before:.2%}",
        "f_after": f"{after:.2%}",
        "v_plateau": f"{v['inertial'][plateau.load]:.3f}",
        "rtol": f"{RTOL:g}",
        "failed": f"{len(failed)} of {len(points)} runs failed:\n\n" + "\n".join(lines)
        if failed
        else f"All {len(points)} runs reached their end.",
    }


def page(runs: Runs, points: list[Point]) -> str:
    """The page as text. A name in the template without a value is an error."""
    push, closed = runs("fenz-monotonic"), closed_transitions(runs("fenz-monotonic"))
    found = push.summary["transitions"]
    quake = runs("ridgecrest-clc").summary
    peaks = ("scene", "u [mm]", "F [kN]", "F / N")
    return TEMPLATE.read_text(encoding="utf-8").format(
        table_42=markdown_table(
            ("", "analytical", "experiment", "PEER model", "this project", "closed form"),
            [table_42_row(key, found[key], closed.get(key)) for key in TABLE_42],
        ),
        stages=markdown_table(("regime", "u [mm]", "surfaces that slide (share of all sliding)"), stage_rows(push)),
        window=f"{stops.WINDOW * MILLI:g}",
        share=f"{SHARE:.0%}",
        resolution=f"{found['resolution'] * MILLI:.2f}",
        loops=markdown_table(
            (*peaks, "closed form F / N", "cycle 2 against 1", "rims met"),
            [peak_row(runs(name), closed=True) for name in PERIODIC],
        ),
        orbits=markdown_table((*peaks, "rims met"), [peak_row(runs(name), closed=False) for name in ORBITS]),
        offset=f"{resting_offset(runs(ORBITS[2])) * MILLI:.1f}",
        quake_u=f"{quake['peak_displacement']['radial'] * MILLI:.1f}",
        quake_f=f"{quake['peak_force_ratio']:.3f}",
        quake_rims=", ".join(map(str, quake["rims_met"])) or "none",
        quake_energy=f"{quake['energy']['closure_error']:.2%}",
        quake_least=f"{min(quake['minimum_normal_force']) / 1e3:.0f}",
        date=date.today(),
        **study_numbers(points),
    )


def write(runs: Runs, points: list[Point], path: Path) -> None:
    text = page(runs, points)
    with replacing(path) as temporary:
        temporary.write_text(labelled(text), encoding="utf-8")
