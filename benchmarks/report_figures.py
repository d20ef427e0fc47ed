"""Draw the figures of chapter 4 of PEER 2017/07 and write docs/peer-2017-07.md: `python benchmarks/report_figures.py [DIR]`.

DIR is the folder to write to; default: the docs of this checkout.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from quick import docs_folder, parser, pick

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "benchmarks"), str(ROOT / "tests")]  # the closed form is that of the tests

import inertia_study  # noqa: E402
import results_page  # noqa: E402
from drawing import COLOURS, FAINT, INK, MILLI, Runs, closed_form, cycle, drawn, panels, ratio, tilts  # noqa: E402

from msfp_gen import presets, simulate  # noqa: E402
from msfp_gen.figures import plot_result  # noqa: E402
from msfp_gen.results.result import Result  # noqa: E402

MARKS = {"u_star": "u*", "u_star_star": "u**", "u_dr1": "u_dr1", "u_dr4": "u_dr4"}
TESTS = tuple(f"fenz-test{number}" for number in range(1, 6))
AMPLITUDES = (125, 88, 50, 25, 12, 5)  # [mm], section 4.3
PLAIN = ("fenz-test2", "fenz-test5", "ridgecrest-clc")  # drawn as `msfp-gen run SCENE --plot` draws them
ROWS = pick(4000, 200)  # rows per cycle
U, F = "displacement across the bearing u = base − top [mm]", "force over axial load F / N"


def stages(runs: Runs, path: Path) -> None:
    """Figure 4.1: force and relative angles of the monotonic run, with its sliding regimes and the closed form."""
    result = runs("fenz-monotonic")
    u = result.history.displacement[:, 0] * MILLI
    grid = np.linspace(1e-5, u[-1] / MILLI, 150)
    with drawn(path, 11, 4.8) as figure:
        left, right = panels(figure, "(a) Force and displacement", "(b) Relative angles")
        left.plot(u, ratio(result)[:, 0], color=COLOURS[0], label="fenz-monotonic")
        left.plot(
            grid * MILLI,
            closed_form(result, grid),
            color=INK,
            linestyle="--",
            linewidth=0.9,
            label="closed form: friction circles,\nmassless, rigid-plastic",
        )
        left.set(xlabel=U, ylabel=F, xlim=(-3, 145), ylim=(0, 0.42))
        left.legend(loc="lower right", frameon=True, facecolor="white", edgecolor="none", framealpha=1)
        for index, delta in enumerate(tilts(result).T):
            right.plot(u, delta, color=COLOURS[index], label=f"δ{'₁₂₃₄'[index]}")
        right.set(xlabel=U, ylabel="relative angle δ [rad]", xlim=(-3, 145), ylim=(0, 0.21))
        right.legend(loc="upper left", bbox_to_anchor=(0.05, 0.95))
        found = result.summary["transitions"]
        edges = [0.0, *(found[key] * MILLI for key in MARKS), u[-1]]
        for axes in (left, right):
            for x in edges[1:-1]:
                axes.axvline(x, color=FAINT, linewidth=0.9, linestyle=":")
            for name, low, high in zip(("I", "II", "III", "IV", "V"), edges, edges[1:], strict=False):
                # Regime I is narrower than its label.
                place = -1.0 if name == "I" else (low + high) / 2
                axes.annotate(name, (place, 0.985), xycoords=("data", "axes fraction"), ha="center", va="top")
        for (key, symbol), x in zip(MARKS.items(), edges[1:], strict=False):
            last = key == "u_dr4"  # its label stands on the left, since the curve rises on the right
            left.annotate(
                f"{symbol} = {found[key] * MILLI:.1f} mm",
                (x, 0.92),
                xycoords=("data", "axes fraction"),
                xytext=(-2 if last else 2, 0),
                textcoords="offset points",
                rotation=90,
                va="top",
                ha="right" if last else "left",
                fontsize=8,
                color=INK,
            )


def loops(runs: Runs, path: Path) -> None:
    """Figure 4.2: the loops of tests 1 to 5, last cycle in colour, the preceding motion in grey."""
    with drawn(path, 8.2, 5.6) as figure:
        (axes,) = panels(figure, "Loops of tests 1 to 5 (table 4.1)")
        inset = axes.inset_axes((0.09, 0.66, 0.25, 0.27))
        for name, colour in reversed(list(zip(TESTS, COLOURS, strict=False))):
            result = runs(name)
            u, force = result.history.displacement[:, 0] * MILLI, ratio(result)[:, 0]
            last = cycle(result)
            amplitude = float(str(result.scene.motion.metadata["amplitude"]))
            label = f"test {name[-1]}: {amplitude * MILLI:g} mm"
            for place in (axes, inset) if name == TESTS[0] else (axes,):
                place.plot(u[: last.stop], force[: last.stop], color=FAINT, linewidth=0.8)
                place.plot(u[last], force[last], color=colour, label=label)
        inset.set_title("test 1", fontsize=8.5, fontweight="normal")
        inset.tick_params(labelsize=7)
        axes.set(xlabel=U, ylabel=F)
        axes.legend(loc="lower right")


def unusual(runs: Runs, path: Path) -> None:
    """Figure 4.4: the loop of the unusual stack, and the closed form of the first push."""
    result = runs("unusual-tfp")
    u = result.history.displacement[:, 0] * MILLI
    grid = np.linspace(1e-5, u.max() / MILLI, 150)
    with drawn(path, 7, 5) as figure:
        (axes,) = panels(figure, "Inner surfaces rougher than the outer ones")
        axes.plot(u, ratio(result)[:, 0], color=COLOURS[0], label="unusual-tfp")
        axes.plot(
            grid * MILLI,
            closed_form(result, grid),
            color=INK,
            linestyle="--",
            linewidth=0.9,
            label="closed form of the first push",
        )
        for surface, event in sorted(
            {e.surface: e for e in reversed(result.events) if e.kind == "rim_contact" and e.displacement[0] > 0}.items()
        ):
            axes.plot(
                event.displacement[0] * MILLI,
                event.top_force[0] / result.summary["axial_load"],
                marker="v",
                linestyle="none",
                color=COLOURS[surface],
                label=f"first contact of rim {surface}",
            )
        axes.set(xlabel=U, ylabel=F)
        axes.legend(loc="upper left")


def orbits(runs: Runs, path: Path, *, kind: str) -> None:
    """Figures 4.5 and 4.6: loops along both axes and the orbit of the force, last full cycle of six amplitudes."""
    with drawn(path, 13, 4.9) as figure:
        first, second, orbit = panels(figure, "Loops along E₁", "Loops along E₂", "Orbit of the force")
        for amplitude, colour in zip(AMPLITUDES, COLOURS, strict=True):
            result = runs(f"becker-{kind}-{amplitude}")
            rows = cycle(result)
            u, force = result.history.displacement[rows] * MILLI, ratio(result)[rows]
            first.plot(u[:, 0], force[:, 0], color=colour)
            second.plot(u[:, 1], force[:, 1], color=colour)
            orbit.plot(force[:, 0], force[:, 1], color=colour, label=f"A = {amplitude} mm")
        first.set(xlabel="u₁ = base − top [mm]", ylabel="F₁ / N")
        second.set(xlabel="u₂ = base − top [mm]", ylabel="F₂ / N")
        orbit.set(xlabel="F₁ / N", ylabel="F₂ / N")
        orbit.set_aspect("equal", adjustable="datalim")
        figure.legend(*orbit.get_legend_handles_labels(), loc="outside lower center", ncols=len(AMPLITUDES))


def write_figures(runs: Runs, folder: Path) -> None:
    """Write all figures except that of the inertia study to `folder`, as PNG."""
    stages(runs, folder / "fenz-stages.png")
    loops(runs, folder / "fenz-loops.png")
    unusual(runs, folder / "unusual-tfp.png")
    for kind in ("circle", "eight"):
        orbits(runs, folder / f"becker-{kind}.png", kind=kind)
    for name in PLAIN:
        plot_result(simulate(presets.scene(name)), folder / f"{name}.png")  # rows at the solver's own steps


@cache
def run(name: str) -> Result:
    """The run of a preset scene, cached; a failed run ends the script.

    Periodic scenes get many rows, for smooth orbits and the comparison of cycles: the solver's own steps are long.
    """
    scene = presets.scene(name)
    if period := scene.motion.metadata.get("period"):
        scene = replace(scene, output_step=float(str(period)) / ROWS)
    return simulate(scene)


def main(docs: Path = ROOT / "docs") -> None:
    figures = docs / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    write_figures(run, figures)
    study = inertia_study.study()
    inertia_study.write(study, figures)
    results_page.write(run, study, docs / "peer-2017-07.md")
    print(f"figures in {figures}, page {docs / 'peer-2017-07.md'}")


if __name__ == "__main__":
    options = parser(__doc__)
    options.add_argument("folder", nargs="?", type=Path, default=docs_folder())
    main(options.parse_args().folder)
