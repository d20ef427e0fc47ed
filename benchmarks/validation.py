"""Fill the table of docs/validation.md from runs: `python benchmarks/validation.py [DIR]`, with openseespy installed.

DIR is the folder to write to; default: the docs of this checkout. Tests use `cases` without OpenSees.
"""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Iterator
from dataclasses import replace
from datetime import date
from functools import cache
from importlib import metadata
from pathlib import Path
from textwrap import wrap
from typing import NamedTuple

import numpy as np
from quick import QUICK, docs_folder, installed, labelled, parser, pick

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "benchmarks"), str(ROOT / "tests")]  # closed forms are those of the tests

import devices  # noqa: E402
import external  # noqa: E402
import outside  # noqa: E402
from drawing import MILLI, Array, closed_form  # noqa: E402
from reference import friction_laws as law_reference  # noqa: E402
from results_page import TABLE_42, closed_transitions  # noqa: E402

from msfp_gen import (  # noqa: E402
    Bearing,
    Body,
    Effects,
    Layout,
    Motion,
    Scene,
    Solver,
    Surface,
    Top,
    __version__,
    load_scene,
    simulate,
)
from msfp_gen.common.output import replacing  # noqa: E402
from msfp_gen.common.tables import markdown_table  # noqa: E402
from msfp_gen.results.result import Result  # noqa: E402
from msfp_gen.scene.friction_parameters import coefficient  # noqa: E402
from msfp_gen.specification.friction_laws import BUILT_IN  # noqa: E402
from msfp_gen.studies.accuracy.series import run_opensees  # noqa: E402

TEMPLATE = Path(__file__).with_name("validation.md.in")
HEAD = ("case", "compared with", "kind", "quantity", "reference", "ours", "difference", "command")
PERIODIC = (*(f"fenz-test{number}" for number in range(1, 6)), "unusual-tfp")
OPENSEES_SCENES = ("fenz-test2", "fenz-test3", "becker-circle-50", "becker-eight-125")
STEPS = pick(8000, 500)  # of OpenSees in a run
SCRIPT = "python benchmarks/validation.py"
RESULTS = ROOT / "benchmarks" / "results"
POINTS, HISTORY = RESULTS / "comparisons.csv", RESULTS / "validation.csv"
UNRELEASED = "unreleased"
SERIES_HEAD = ("case", "compared with", "kind", "quantity", "within", "tolerance", "largest", "RMS")


class Case(NamedTuple):
    """One row of the table.

    Attributes:
        case, source, kind: what was compared, with what, and whether that is an experiment, a model, a program, a
            formula or a closed form.
        quantity: with its unit.
        reference, ours: numbers in that unit.
        digits: behind the point.
        command: what gives our number.
    """

    case: str
    source: str
    kind: str
    quantity: str
    reference: float
    ours: float
    digits: int
    command: str

    @property
    def difference(self) -> float:
        """Ours over the reference, less 1."""
        return self.ours / self.reference - 1


def cases(opensees: bool = True) -> list[Case]:
    """All rows; without those of OpenSees where it is not to be run."""
    found = [*table_42(), *loops(), *stiff(), *device_pushes(), *laws(), *heating(), *pendulum(), *plant()]
    return [*found, *programs()] if opensees else found


FINE = 1e-5  # rtol at which first contacts with rims no longer depend on the steps, in the digits of the table


@cache
def run(name: str, rtol: float | None = None) -> Result:
    scene = load_scene(name)
    return simulate(scene if rtol is None else replace(scene, solver=replace(scene.solver, rtol=rtol)))


def table_42() -> Iterator[Case]:
    """Fenz and Constantinou (2008): the monotonic push of table 4.2."""
    result, command = run("fenz-monotonic", FINE), f"msfp-gen run fenz-monotonic --rtol {FINE:g}"
    found, closed = result.summary["transitions"], closed_transitions(result)
    for key, (name, _, experiment, model) in TABLE_42.items():
        scale, digits = (MILLI, 1) if key.startswith("u_") else (1.0, 3)
        references = [
            ("Fenz and Constantinou 2008, test", "experiment", experiment),
            ("PEER 2017/07, table 4.2", "model", model),
            *([("friction circles", "closed form", scale * closed[key])] if key in closed else []),
        ]
        for source, kind, reference in references:
            ours = scale * found[key]
            yield Case("monotonic push", source, kind, name, reference, ours, digits, command)


def loops() -> Iterator[Case]:
    """Tests 1 to 5 of table 4.1, and the unusual pendulum: force at the tip of the loop."""
    for name in PERIODIC:
        result = run(name)
        tip = np.array([result.summary["peak_displacement"]["radial"]])
        source = "friction circles" + (", Sarlis and Constantinou 2016" if name == "unusual-tfp" else "")
        reference, ours = closed_form(result, tip)[0], result.summary["peak_force_ratio"]
        yield Case(f"`{name}`", source, "closed form", "F/N, tip", reference, ours, 4, f"msfp-gen run {name}")


def stiff() -> Iterator[Case]:
    """What the yield displacement alone sets apart from the closed forms, with a tenth of it."""
    source = "friction circles, ours with a tenth of the yield displacement"
    for name, rtol in (("fenz-monotonic", FINE), ("fenz-test1", None)):
        scene = load_scene(name)
        tenth = [surface.yield_displacement / 10 for surface in scene.bearing.surfaces]
        solver = scene.solver if rtol is None else replace(scene.solver, rtol=rtol)
        result = simulate(replace(scene, bearing=scene.bearing.replace(yield_displacement=tenth), solver=solver))
        if name == "fenz-test1":
            tip = np.array([result.summary["peak_displacement"]["radial"]])
            reference, ours = closed_form(result, tip)[0], result.summary["peak_force_ratio"]
            yield Case(f"`{name}`", source, "closed form", "F/N, tip", reference, ours, 4, SCRIPT)
        else:
            key = "u_star_star"
            reference, ours = MILLI * closed_transitions(result)[key], MILLI * result.summary["transitions"][key]
            yield Case("monotonic push", source, "closed form", TABLE_42[key][0], reference, ours, 1, SCRIPT)


def device_pushes() -> Iterator[Case]:
    """Single to quintuple pendulums, pushed through all sliding regimes."""
    for device in devices.DEVICES:
        found = devices.rows(device)
        for column, source, kind in devices.references(device):
            worst = max(found, key=lambda at: abs(at["run"] / at[column] - 1))
            quantity = f"F/W at {worst['u'] * MILLI:.0f} mm, largest of {len(found)}"
            command = f"msfp-gen run {device.scene}"
            yield Case(f"{device.title} pendulum", source, kind, quantity, worst[column], worst["run"], 4, command)


def laws() -> Iterator[Case]:
    """The factors of Kumar, Whittaker and Constantinou (2015)."""
    law = BUILT_IN["pvt"]
    usual = {name: value for name, value in law.parameters.items() if value}
    usual |= {"reference_pressure": 50e6, "velocity_rate": 100.0, "mu": 1.0, "v": 10.0, "p": 50e6, "T": 20.0}
    for name, at, reference in (
        ("k_p at twice the reference pressure", {"p": 100e6}, law_reference.kp(100e6, 50e6)),
        ("k_v at 5 mm/s", {"v": 0.005}, law_reference.kv(0.005)),
        ("k_T at 200 degC", {"T": 200.0}, law_reference.kt(200.0)),
    ):
        ours = float(coefficient(law, {**usual, **at})[0])
        yield Case("friction law `pvt`", "Kumar et al. 2015", "formula", name, float(reference), ours, 4, SCRIPT)


def heating() -> Iterator[Case]:
    """Temperature at the centre of the dish: Duhamel's integral over the heat flux of the run, by direct summation."""
    scene = load_scene(ROOT / "examples" / "heating.toml")
    result = simulate(replace(scene, output_step=2e-3))
    rows, surface = result.history, result.scene.bearing.surfaces[0]
    assert rows.temperature is not None and rows.friction_coefficient is not None
    radius = result.scene.bearing.bodies[0].rim_radius
    velocity = law_reference.sliding_velocity(rows.friction_state, rows.slip_velocity)[:, 0]
    cover = law_reference.cover(surface.radius * np.sin(rows.sliding[:, 0] / surface.radius), radius)
    flux = rows.friction_coefficient[:, 0] * rows.normal_force[:, 0] / (np.pi * radius**2) * velocity * cover
    reference = law_reference.temperature(rows.time, flux, 18.0, 4.44e-6, 20.0).max() - 20.0
    ours = rows.temperature[:, 0].max() - 20.0
    command = "msfp-gen run examples/heating.toml"
    source = "half-space, Carslaw and Jaeger 1959"
    yield Case("`heating.toml`", source, "closed form", "largest rise [K]", reference, ours, 1, command)


def pendulum() -> Iterator[Case]:
    """A slider without friction, let go at 0.5 rad: the period of a physical pendulum by elliptic integrals."""
    from scipy.special import ellipk
    from support.stacks import a_pendulum, arm_and_inertia, swing

    bearing, start = a_pendulum(), 0.5
    arm, inertia = arm_and_inertia(bearing)
    reference = 4 * ellipk(np.sin(start / 2) ** 2) * np.sqrt(inertia / (bearing.bodies[0].mass * bearing.gravity * arm))
    scene = swing(bearing, start, 2.2 * reference, solver=Solver(rtol=1e-7), output_step=1e-3)
    history = simulate(scene).history
    angle = history.tilt_angles[:, 0, 1]
    falling = np.flatnonzero((angle[:-1] > 0) & (angle[1:] <= 0))
    zeros = [np.interp(0.0, -angle[i : i + 2], history.time[i : i + 2]) for i in falling]
    ours = float(zeros[1] - zeros[0])
    yield Case(
        "frictionless pendulum, 0.5 rad", "elliptic integral", "closed form", "period [s]", reference, ours, 6, SCRIPT
    )


def manual_scene() -> Scene:
    """The example of OpenSees' TripleFrictionPendulum: L 0.36, 1.25, 1.25 m, mu 0.012, 0.052, 0.14, W 1 kN.

    Its bodies are flat, so that R = L; sliders have no mass there and next to none here.
    """
    radii, friction, capacity = (1.25, 0.36, 0.36, 1.25), (0.052, 0.012, 0.012, 0.14), (0.2, 0.1, 0.1, 0.2)
    surfaces = [
        Surface(radius=r, friction=mu, capacity=d, yield_displacement=1e-3, rim_stiffness=1e6)
        for r, mu, d in zip(radii, friction, capacity, strict=True)
    ]
    body = Body(height=1e-6, centroid=5e-7, mass=1e-6, inertia=(1e-9, 1e-9), rim_radius=1e-3)
    bearing = Bearing(layout=Layout.tfp(), base_height=1e-6, surfaces=surfaces, bodies=[body] * 4)
    return Scene(
        bearing,
        Motion.harmonic(0.3, 0.05, cycles=1.25),
        Top.rig(axial_load=1e3, stiffness=1e8, rotational_stiffness=1e8),
        Effects(dimension="planar", sliders="massless"),
        name="example of the manual of OpenSees",
    )


def plant() -> Iterator[Case]:
    """A mat on seventy pendulums by MASTODON (docs/audit.md), with inertia twice as its input has it."""
    _, theirs, ours = external.mat_on_pendulums(2.0)
    for sign, quantity in ((1, "largest u [mm]"), (-1, "largest -u [mm]")):
        numbers = [1e3 * float((sign * u).max()) for u in (theirs, ours)]
        yield Case(
            "mat on pendulums, inertia twice", "MASTODON, Virtual Test Bed", "program", quantity, *numbers, 1, SCRIPT
        )


def plant_words() -> str:
    """Largest displacements and RMS differences of the plant, with inertia twice and as stated."""
    words = []
    for times, name in ((1.0, "once, as stated"), (2.0, "twice")):
        _, theirs, ours = external.mat_on_pendulums(times)
        apart = float(np.sqrt(np.mean((ours - theirs) ** 2)) / np.abs(theirs).max())
        words.append(
            f"with inertia {name}, u is {-1e3 * ours.min():.1f} mm to one side and {1e3 * ours.max():.1f} mm to the other, "
            f"and off by {100 * apart:.1f} % of the largest published value (RMS of all rows)"
        )
    text = f"{words[0][0].upper()}{words[0][1:]}; {words[1]}."
    return "\n".join(wrap(text, 118, subsequent_indent="  ", break_on_hyphens=False))


def programs() -> Iterator[Case]:
    """OpenSees, element TripleFrictionPendulum: the largest force of a scene, and with friction at the pivot as there."""
    for scene in (manual_scene(), *(load_scene(name) for name in OPENSEES_SCENES)):
        theirs = run_opensees(scene, STEPS)
        assert theirs.status == "ok", theirs.message
        reference = float(np.linalg.norm(theirs.histories["force"][:, 0], axis=1).max()) / scene.top.axial_load
        preset = scene.name in OPENSEES_SCENES
        case, command = (f"`{scene.name}`", f"msfp-gen run {scene.name}") if preset else (scene.name, SCRIPT)
        source, quantity = "OpenSees TripleFrictionPendulum", "largest F/W"
        ours = simulate(scene).summary["peak_force_ratio"]
        yield Case(case, source, "program", quantity, reference, ours, 4, command)
        friction = [surface.friction for surface in scene.bearing.surfaces]
        at_pivot = replace(scene, bearing=scene.bearing.replace(friction=friction, friction_at="pivot"))
        ours = simulate(at_pivot).summary["peak_force_ratio"]
        source += ", ours with friction at the pivot"
        yield Case(case, source, "program", quantity, reference, ours, 4, SCRIPT)


def series(opensees: bool = True) -> list[external.Series]:
    """Comparisons point by point; without those of OpenSees where it is not to be run."""
    found = list(external.here())
    if opensees:
        scenes = [manual_scene(), *(load_scene(name) for name in OPENSEES_SCENES)]
        found += [*external.opensees_single(), *external.opensees_shaken(), *external.opensees_triple(scenes, STEPS)]
    return found


def series_line(found: external.Series) -> tuple[str, ...]:
    """One row of the table of series."""
    off, limit = np.abs(found.differences), external.TOLERANCE[found.kind]
    rms = float(np.sqrt(np.mean(off**2)))
    inside = f"{found.within} of {len(off)}"
    return (
        found.name,
        found.source,
        found.kind,
        found.quantity,
        inside,
        f"{limit:.0%}",
        f"{off.max():.2%}",
        f"{rms:.2%}",
    )


def points(rows: list[Case], found: list[external.Series]) -> str:
    """Every comparison as CSV: of the rows, and of the series. The difference is a share of the scale."""
    out = io.StringIO()
    write = csv.writer(out, lineterminator="\n")
    write.writerow(("case", "source", "kind", "quantity", "at", "reference", "ours", "difference", "tolerance"))
    for one in rows:
        limit = external.TOLERANCE[one.kind]
        numbers = (f"{one.reference:.6g}", f"{one.ours:.6g}", f"{one.difference:.2e}", limit)
        write.writerow((one.case.strip("`"), one.source, one.kind, one.quantity, "", *numbers))
    for many in found:
        for point, off in zip(many.points, many.differences, strict=True):
            numbers = (f"{point.reference:.6g}", f"{point.ours:.6g}", f"{off:.2e}", external.TOLERANCE[many.kind])
            write.writerow((many.name, many.source, many.kind, many.quantity, point.at, *numbers))
    return out.getvalue()


def label() -> str:
    """Of the row of this code in `HISTORY`: its version, or `unreleased` where the changelog goes beyond the version."""
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    return UNRELEASED if "\n## Unreleased\n" in changes else __version__


def history(text: str) -> list[dict[str, str]]:
    """Rows of `HISTORY`, the one of this code from the comparisons `text`: number, and within their tolerance."""
    rows = list(csv.DictReader(HISTORY.read_text(encoding="utf-8").splitlines())) if HISTORY.exists() else []
    found = list(csv.DictReader(text.splitlines()))
    now = {"version": label(), "date": f"{date.today()}", "comparisons": str(len(found))}
    now["within"] = str(sum(abs(float(one["difference"])) <= float(one["tolerance"]) for one in found))
    for kind in external.TOLERANCE:
        off = [float(one["difference"]) for one in found if one["kind"] == kind]
        now[f"rms, {kind}"] = f"{np.sqrt(np.mean(np.square(off))):.2%}"
    return [*(one for one in rows if one["version"] not in (label(), UNRELEASED)), now]


def line(case: Case) -> tuple[str, ...]:
    """One row of the table."""
    numbers = [f"{value:.{case.digits}f}" for value in (case.reference, case.ours)]
    share = abs(case.difference)
    difference = f"{case.difference:+.1%}" if share >= 5e-4 else f"{case.difference:+.0e}" if share >= 1e-12 else "0"
    return (case.case, case.source, case.kind, case.quantity, *numbers, difference, f"`{case.command}`")


def versions() -> str:
    """The programs that the page compares with."""
    return f"openseespy {metadata.version('openseespy')} ({STEPS} steps in every run; Python {sys.version_info[0]}.{sys.version_info[1]})"


def page(rows: list[Case], found: list[external.Series], past: list[dict[str, str]], text: str) -> str:
    """Text of docs/validation.md; text: every comparison, from `points`."""
    comparisons = list(csv.DictReader(text.splitlines()))
    filled = TEMPLATE.read_text(encoding="utf-8")
    for name, value in {
        "table": markdown_table(HEAD, map(line, rows)),
        "series": markdown_table(SERIES_HEAD, map(series_line, found)),
        "outside": "" if QUICK else outside.causes(comparisons),  # steps of a quick run have causes of their own
        "beyond": str(len(outside.outside(comparisons))),
        "history": markdown_table(tuple(past[-1]), (one.values() for one in past)),
        "count": past[-1]["comparisons"],
        "within": past[-1]["within"],
        "plant": plant_words(),
        "programs": versions(),
        "date": f"{date.today()}",
    }.items():
        filled = filled.replace(f"{{{name}}}", value)
    return filled


def main(folder: Path) -> None:
    rows, found = cases(), series()
    text = points(rows, found)
    past = history(text)
    with replacing(folder / "validation.md") as temporary:
        temporary.write_text(labelled(page(rows, found, past, text)), encoding="utf-8")
    if QUICK:
        return
    with replacing(POINTS) as temporary:
        temporary.write_text(text, encoding="utf-8")
    with replacing(HISTORY) as temporary, temporary.open("w", encoding="utf-8") as file:
        write = csv.DictWriter(file, list(past[-1]), lineterminator="\n")
        write.writeheader()
        write.writerows(past)


if __name__ == "__main__":
    options = parser(__doc__)
    options.add_argument("folder", nargs="?", type=Path, default=docs_folder())
    given = options.parse_args()
    if installed("openseespy.opensees", "the whole page, whose rows are all measured at once"):
        main(given.folder)


__all__ = ["Array", "Case", "cases", "line", "main", "page", "series", "series_line"]
