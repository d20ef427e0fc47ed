"""The design of an isolated hospital in one command: hand checks, data sheet, eleven records at three bounds, report.

    python examples/hospital-design/design.py            # into the folder hospital-design/ where it is called
    python examples/hospital-design/design.py --short    # two records of 5 s, to see that everything works

docs/hospital.md describes it, with the report. A run that was interrupted continues with the same command.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tomllib
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from opensees_cycle import cycle
from records import write_records

from msfp_gen import Motion, Scene, Top, simulate
from msfp_gen.design.effective import characteristic, effective, published_backbone
from msfp_gen.scene.file.loader import load_sheet

HERE = Path(__file__).parent
DISPLACEMENT = 0.5  # at which the bearing is checked [m]
FREQUENCY = 0.01  # of the cyclic test [Hz]; slow, as the formulas have it
TORSION = "16 m, 1.7 m, 34 m, 26 m"  # of `equivalent`: row of bearings farthest off, eccentricity, plan
_, SHEET, BEARING = load_sheet(HERE / "hospital.toml")


class Loop(NamedTuple):
    """One cycle at DISPLACEMENT: k_eff [N/m], damping by its area, and by its force at zero displacement [-]."""

    stiffness: float
    by_area: float
    by_height: float


def loop(force: float, area: float, height: float) -> Loop:
    """Of the force at DISPLACEMENT [N], the area of the loop [J] and its force at zero displacement [N]."""
    return Loop(force / DISPLACEMENT, area / (2 * math.pi * force * DISPLACEMENT), 2 * height / (math.pi * force))


def by_hand() -> Loop:
    """The bilinear loop of design formulas, from seven numbers of the sheet."""
    load, (outer, inner) = SHEET.axial_load, SHEET.friction[:2]
    length = [radius - height for radius, height in zip(SHEET.radius[:2], SHEET.height[:2], strict=True)]
    friction = outer - (outer - inner) * length[1] / length[0]  # force over load at zero displacement
    force = load * DISPLACEMENT / (2 * length[0]) + friction * load
    return loop(force, 4 * friction * load * DISPLACEMENT, friction * load)  # it slides from the first millimetre


def by_sheet() -> Loop:
    """The published backbone with all its regimes, as `msfp-gen sheet` prints it."""
    backbone, load = published_backbone(BEARING), SHEET.axial_load
    found = effective(backbone, DISPLACEMENT, BEARING.gravity)
    return loop(found.force * load, found.energy * load, characteristic(backbone)[0] * load)


def by_run() -> Loop:
    """A simulated test: two cycles under constant load, by the equations of motion."""
    top = Top.rig(axial_load=SHEET.axial_load, stiffness=1e9, damping=1e5, rotational_stiffness=1e9,
                  rotational_damping=1e5)  # fmt: skip
    motion = Motion.harmonic(DISPLACEMENT, frequency=FREQUENCY, cycles=2)
    found = simulate(Scene(BEARING, motion, top)).characterise().envelope
    stiffness, height = found["effective_stiffness"].mean, found["zero_displacement_force"].mean
    by_height = 2 * height / (math.pi * stiffness * DISPLACEMENT)
    return Loop(stiffness, found["effective_damping"].mean, by_height)


def by_opensees() -> Loop:
    """The element of OpenSees for triple pendulums. Raises ImportError where OpenSeesPy is not installed."""
    u, force = cycle(SHEET, BEARING, DISPLACEMENT)
    falling = slice(int(u.argmax()), int(u.argmin()) + 1)
    height = float(np.interp(0.0, -u[falling], force[falling]))  # at u = 0, on the way back
    return loop(float(np.ptp(force)) / 2, float(np.trapezoid(force, u)), abs(height))


def checks() -> str:
    """All of them, as a table."""
    found = {"by hand": by_hand(), "by the sheet": by_sheet(), "by a run": by_run()}
    with suppress(ImportError):
        found["by OpenSees"] = by_opensees()
    lines = [
        f"{name:14} k_eff {one.stiffness / 1e3:6.1f} kN/m   damping {one.by_area:6.2%} by the area of the loop, "
        f"{one.by_height:6.2%} by its height"
        for name, one in found.items()
    ]
    return "\n".join([f"one bearing at {1e3 * DISPLACEMENT:g} mm under {SHEET.axial_load / 1e3:g} kN", *lines])


def shortened(folder: Path) -> Path:
    """The suite of `--short`: a recorded motion and an artificial one, 5 s of each."""
    suite = tomllib.loads((HERE / "suite.toml").read_text(encoding="utf-8"))
    lines = [
        f'{{ name = "{one["name"]}", {key} = "{one[key]}", duration = "5 s", hold = "0.5 s" }},'
        for one, key in ((suite["records"][0], "bundled"), (suite["records"][2], "file"))
    ]
    path = folder / "suite.toml"
    text = "\n".join(['scale_to = { sa = "0.4 g", period = 1.0 }', "records = [", *lines, "]\n"])
    path.write_text(text, encoding="utf-8")
    return path


def command(*words: Any) -> None:
    """Run a command of msfp-gen. Raises CalledProcessError where it fails."""
    print("msfp-gen", *words, flush=True)
    subprocess.run([sys.executable, "-m", "msfp_gen", *map(str, words)], check=True)


def main() -> None:
    """Everything, into one folder."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("hospital-design"), help="folder of all files")
    parser.add_argument("--short", action="store_true", help="two records of 5 s")
    given = parser.parse_args()
    folder: Path = given.output
    folder.mkdir(parents=True, exist_ok=True)
    print(checks(), flush=True)
    write_records(folder / "records", [1] if given.short else range(1, 10))
    scene, suite = HERE / "hospital.toml", folder / "suite.toml"
    if given.short:
        shortened(folder)
    else:
        suite.write_text((HERE / "suite.toml").read_text(encoding="utf-8"), encoding="utf-8")
    command("sheet", scene, "--displacement", f"{DISPLACEMENT} m", "-o", folder / "sheet.png")
    equivalent = ("equivalent", scene, "--spectrum", HERE / "spectrum.csv", "--torsion", TORSION)
    command(*equivalent)
    command("bound", scene, "--suite", suite, "-o", folder / "analysis")
    command(*equivalent, "--history", folder / "analysis")
    command("report", folder / "analysis", "-o", folder / "report.html", "--project", "Hospital on twenty pendulums",
            "--code", "example, no code", "--author", "an engineer", "--checker", "another engineer")  # fmt: skip


if __name__ == "__main__":
    main()
