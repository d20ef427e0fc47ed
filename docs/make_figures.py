"""Draw figures of README and of the pages in docs/: `python docs/make_figures.py [FOLDER]`."""

from __future__ import annotations

import base64
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import run_tutorial

from msfp_gen import figures, load_scene, simulate, study
from msfp_gen.cli.run_commands import DEMO, DEMO_METHODS, DEMO_TOLERANCES
from msfp_gen.figures import style
from msfp_gen.motions.records import baseline_corrected, bundled, response_spectrum
from msfp_gen.results.geometry import sections
from msfp_gen.results.result import Result
from msfp_gen.studies import fragility, ida, plot_fragility, plot_ida, read_study
from msfp_gen.studies.accuracy.study import draw_summary, work_precision

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import docs_folder, parser, pick

FOLDER = Path(__file__).resolve().parent / "figures"
EXAMPLES = FOLDER.parents[1] / "examples"
RECORD = "ridgecrest-2019-ci-clc"
ROWS = pick(3000, 300)
DEVICES = {  # preset scene -> name in docs/bearing.md
    "single-push": "single",
    "single-articulated-push": "single, articulated",
    "double-push": "double",
    "double-articulated-push": "double, articulated",
    "triple-push": "triple",
    "quintuple-push": "quintuple",
}
HOSPITAL_DESIGN = {  # figure of docs/hospital.md -> how its caption begins in the report
    "suite": "Main quantities",
    "floor-spectra": "Floor spectra",
    "vertical": "Base shear",
}
TOLERANCES = 10.0 ** -np.arange(2, pick(7, 4))


def run(name: str, sliders: str = "inertial", **solver: Any) -> Result:
    """The run of a preset, with enough rows for smooth curves."""
    scene = load_scene(name)
    step = min(scene.end / ROWS, scene.motion.max_step or scene.end)
    effects = replace(scene.effects, sliders=sliders)
    return simulate(replace(scene, output_step=step, effects=effects, solver=replace(scene.solver, **solver)))


def draw_runs(folder: Path) -> None:
    """Figures of test 5 of PEER 2017/07, of an orbit and of an earthquake."""
    test, quake = run("fenz-test5"), run("ridgecrest-clc")
    for name in ("loops", "sliding", "stages", "energy"):
        figures.FIGURES[name](test, folder / f"gallery-{name}.png")
    figures.plot_orbit(run("becker-eight-125"), folder / "gallery-orbit.png")
    figures.plot_stages(quake, folder / "gallery-stages-record.png")
    figures.plot_section(test, folder / "gallery-section.png")
    figures.plot_section(test, folder / "gallery-circles.png", time=65.0, friction_circles=True)
    figures.plot_force_path(test, folder / "gallery-force-path.png", time=65.0)
    figures.animate(test, folder / "gallery-movie.gif", seconds=3.0, frames_per_second=6, start=173.6, end=243.0)
    hospital = simulate(load_scene("hospital-clc"))
    figures.animate(
        hospital, folder / "gallery-movie-building.gif", seconds=4.0, frames_per_second=6, start=7.5, end=11.5
    )


def draw_layouts(folder: Path) -> None:
    """A section of every kind of device at rest: numbers of bodies in black, of surfaces in their colours."""
    with style.page(11.0, 4.2, folder / "layouts.png") as figure:
        for axes, (scene, title) in zip(figure.subplots(2, 3).flat, DEVICES.items(), strict=True):
            given = load_scene(scene)
            result = simulate(replace(given, duration=0.05, output_step=None, stop=None))
            (section,) = sections(result.at_times(0.0))
            for polygon in section.bodies:
                axes.fill(*(polygon * style.MILLI).T, facecolor="#DCE1E7", edgecolor=style.INK, linewidth=0.7)
            for number, face in enumerate(section.faces, start=1):
                colour, (x, z) = style.colour(number), face[-1] * style.MILLI
                axes.plot(*(face * style.MILLI).T, color=colour, linewidth=2)
                side = max(polygon[:, 0].max() for polygon in section.bodies) * style.MILLI
                axes.annotate(
                    str(number), (x, z), (1.12 * side, z), va="center", color=colour, fontweight="bold",
                    arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.7},
                )  # fmt: skip
            for number, polygon in enumerate(section.bodies, start=1):
                middle = polygon[np.abs(polygon[:, 0]) < 1e-3][:, 1]
                axes.text(0, style.MILLI * middle.mean(), str(number), ha="center", va="center", fontsize=8)
            layout = given.bearing.layout
            axes.set_title(f"{title}: ({layout.n}, {layout.m}, {layout.p})", fontsize=10)
            axes.set_aspect("equal")
            axes.margins(0.12)
            axes.set_axis_off()


def draw_hospital(folder: Path) -> None:
    """The figure of docs/hospital.md, made by its own commands."""
    with TemporaryDirectory() as name:
        page = Path(__file__).with_name("hospital.md")
        for _ in run_tutorial.follow(Path(name), page=page):
            pass
        shutil.copy(Path(name) / "hospital.png", folder)


def draw_hospital_design(folder: Path) -> None:
    """The sheet of the design in docs/hospital.md, and three figures of its report."""
    with TemporaryDirectory() as name:
        short = pick([], ["--short"])
        subprocess.run([sys.executable, EXAMPLES / "hospital-design" / "design.py", "-o", name, *short], check=True)
        shutil.copy(Path(name) / "sheet.png", folder / "hospital-design-sheet.png")
        page = (Path(name) / "report.html").read_text(encoding="utf-8")
    for figure, begin in HOSPITAL_DESIGN.items():
        (image,) = re.findall(rf'"Figure \d+\. {begin}[^"]*" src="data:image/webp;base64,([\w+/=]+)"', page)
        (folder / f"hospital-design-{figure}.webp").write_bytes(base64.b64decode(image))


def draw_tutorial(folder: Path) -> None:
    """The figures of the tutorial, made by its own commands."""
    with TemporaryDirectory() as name:
        for _ in run_tutorial.follow(Path(name)):
            pass
        for picture in run_tutorial.PICTURES:
            shutil.copy(Path(name) / picture, folder)


def draw_record(folder: Path) -> None:
    """A record before and after correction, and its response spectra."""
    raw = bundled(RECORD)
    corrected = baseline_corrected(raw, duration=60.0)
    figures.plot_correction(raw, corrected, folder / "gallery-correction.png")
    found = response_spectrum(corrected)
    curves = dict(zip(("E1", "E2", "E3"), found.psa.T, strict=False))
    figures.plot_response_spectrum(found.period, curves, folder / "gallery-spectrum.png", title=raw.name)


def draw_cost(folder: Path) -> None:
    """Error of the top force against cost for one test, with and without the mass of the sliders."""
    exact = run("fenz-test2", rtol=1e-9).history.top_force[:, 0]
    table = {}
    for label, sliders in (("implicit", "inertial"), ("implicit, massless sliders", "massless")):
        columns: dict[str, list[float]] = {"seconds": [], "newton": [], "force_max": [], "force_rms": []}
        for rtol in TOLERANCES:
            result = run("fenz-test2", sliders, rtol=float(rtol))
            error = np.abs(result.history.top_force[:, 0] - exact) / np.abs(exact).max()
            point = (
                result.counters.wall_time,
                result.counters.newton_iterations,
                error.max(),
                np.sqrt(np.mean(error**2)),
            )
            for column, value in zip(columns.values(), point, strict=True):
                column.append(float(value))
        table[label] = columns
    named = {"force_max": "largest error of the top force", "force_rms": "RMS error of the top force"}
    figures.plot_work_precision(table, folder / "gallery-work-precision.png", errors=named, title="fenz-test2")


def draw_demo(folder: Path) -> None:
    """What accuracy costs in the first scene of `make demo`, for README."""
    found = work_precision(load_scene(DEMO[0]), methods=DEMO_METHODS, tolerances=pick(DEMO_TOLERANCES, (1e-2,)))
    draw_summary(found, folder / "demo-accuracy.png")


def draw_study(folder: Path) -> None:
    """IDA and fragility of the study of docs/studies.md."""
    with TemporaryDirectory() as place:
        study(EXAMPLES / "fragility" / "study.toml", place)
        rows = read_study(place)
    nominal = rows[rows.bounds == "nominal"]
    plot_ida(
        ida(nominal, "intensity", "peak_displacement"), folder / "study-ida.png", "Triple pendulum, nominal friction"
    )
    found = fragility(rows, "intensity", "peak_displacement", [0.22], by="bounds")
    plot_fragility(found, folder / "study-fragility.png", "Displacement capacity of a triple pendulum")


def main(folder: Path = FOLDER) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    draw_runs(folder)
    draw_layouts(folder)
    draw_tutorial(folder)
    draw_hospital(folder)
    draw_hospital_design(folder)
    draw_record(folder)
    draw_cost(folder)
    draw_demo(folder)
    draw_study(folder)
    print(f"figures in {folder}")


if __name__ == "__main__":
    options = parser(__doc__)
    options.add_argument("folder", nargs="?", type=Path, default=docs_folder() / "figures")
    main(options.parse_args().folder)
