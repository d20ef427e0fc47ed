"""The design of an isolated hospital in one command: hand checks, data sheet, eleven records at three bounds, report.

    python examples/hospital-design/design.py            # into the folder hospital-design/ where it is called
    python examples/hospital-design/design.py --short    # two records of 5 s, to see that everything works

docs/hospital-design.md describes it, with the report. A run that was interrupted continues with the same command.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

from records import write_records

from msfp_gen import Bearing, Motion, Scene, Top, simulate
from msfp_gen.design.effective import effective, published_backbone

HERE = Path(__file__).parent
DISPLACEMENT = 0.5  # at which the bearing is checked [m]
FREQUENCY = 0.01  # of the cyclic test [Hz]; slow, as the formulas have it
SHEET = {
    "device": "triple",
    "radius": [2.235, 0.406],
    "height": [0.178, 0.045],
    "friction": [0.06, 0.02],
    "friction_lower": [0.045, 0.012],
    "friction_upper": [0.085, 0.035],
    "slider_diameter": [0.508, 0.2],
    "dish_diameter": [1.22, 0.356],
    "plate_height": 0.07,
    "axial_load": 1850e3,
}  # as in hospital.toml, in SI units


def by_hand() -> dict[str, float]:
    """Effective stiffness [N/m] and damping [-] of the bilinear loop of design formulas, from six numbers."""
    load, (outer, inner) = SHEET["axial_load"], SHEET["friction"]
    length = [radius - height for radius, height in zip(SHEET["radius"], SHEET["height"], strict=True)]
    friction = outer - (outer - inner) * length[1] / length[0]  # force over load at zero displacement
    stiffness = load / (2 * length[0]) + friction * load / DISPLACEMENT
    return {"k_eff": stiffness, "damping": 2 * friction * load / (math.pi * stiffness * DISPLACEMENT)}


def by_sheet() -> dict[str, float]:
    """The same by the published backbone with all its regimes, as `msfp-gen sheet` prints it."""
    found = effective(published_backbone(Bearing.from_sheet(**SHEET)), DISPLACEMENT, 9.8)
    return {"k_eff": found.stiffness * SHEET["axial_load"], "damping": found.damping}


def by_run() -> dict[str, float]:
    """The same of a simulated test: two cycles under constant load, by the equations of motion."""
    top = Top.rig(axial_load=SHEET["axial_load"], stiffness=1e9, damping=1e5, rotational_stiffness=1e9,
                  rotational_damping=1e5)  # fmt: skip
    motion = Motion.harmonic(DISPLACEMENT, frequency=FREQUENCY, cycles=2)
    cycle = simulate(Scene(Bearing.from_sheet(**SHEET), motion, top)).characterise().envelope
    return {"k_eff": cycle["effective_stiffness"].mean, "damping": cycle["effective_damping"].mean}


def checks() -> str:
    """The three, as a table."""
    rows = [("by hand", by_hand()), ("by the sheet", by_sheet()), ("by a run", by_run())]
    lines = [f"{name:14} k_eff {row['k_eff'] / 1e3:6.1f} kN/m   damping {row['damping']:6.2%}" for name, row in rows]
    return "\n".join([f"one bearing at {1e3 * DISPLACEMENT:g} mm under {SHEET['axial_load'] / 1e3:g} kN", *lines])


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
    command("bound", scene, "--suite", suite, "-o", folder / "analysis")
    command("report", folder / "analysis", "-o", folder / "report.html", "--project", "Hospital on twenty pendulums",
            "--code", "example, no code", "--author", "an engineer", "--checker", "another engineer")  # fmt: skip


if __name__ == "__main__":
    main()
