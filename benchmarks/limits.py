"""What published designs ask of their bearings, and the verdicts of the hospital: prints the tables of docs/results.md.

All preset scenes and examples run as they are. The preset hospitals run at lower bound, nominal and upper bound of the
table `asce7`, under 1, 1.5 and 2 times their records: `python benchmarks/limits.py`; with `hospital` these alone.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from quick import QUICK, parser, pick

from msfp_gen import RunError, changed_scene, load_scene, presets, simulate
from msfp_gen.studies.bounding import bounded_scenes, load_factors

EXAMPLES = sorted((Path(__file__).resolve().parents[1] / "examples").glob("*.toml"))
SCENES = pick([*presets.names("scene"), *map(str, EXAMPLES)], ["fenz-test5"])
HOSPITALS = pick(("hospital-ccc", "hospital-clc"), ("hospital-ccc",))
SCALES = pick((1.0, 1.5, 2.0), (1.0,))
CASES = pick(("lower", "nominal", "upper"), ("lower",))
VISIBLE = 1e-6  # opening of a bearing that counts as lifted [m]
END = 0.5  # of a quick run [s]


def demanding() -> Iterator[tuple[str, dict[str, float]]]:
    """Name of a scene whose bearing meets a rim or heats, and its values: rims over all, rim force over N, degC."""
    for name in SCENES:
        verdict = (result := simulate(load_scene(name))).verdict
        assert not verdict.exceeded and not verdict.failure, f"{name}: {verdict.text}"
        worst = {key: reading.value for key, reading in verdict.worst.items()}
        yield (
            Path(name).stem,
            {
                "rims": worst["travel"].reached,
                "surfaces": worst["travel"].allowed + 1,
                "force": worst["rim_force"].reached / result.summary["axial_load"],
                "temperature": worst["temperature"].reached if "temperature" in worst else 20.0,
            },
        )


def hospital(
    name: str, scale: float, duration: float | None = None, cases: Iterable[str] = CASES
) -> Iterator[tuple[str, Any]]:
    """Case and result of a preset under a scaled record; of a run that failed the result until then."""
    changes: dict[str, Any] = {"motion.scale": scale} | ({} if duration is None else {"duration": duration})
    scenes = bounded_scenes(changed_scene(name, changes), load_factors("asce7"))
    for case in cases:
        try:
            yield case, simulate(scenes[case])
        except RunError as error:
            yield case, error.result


def cells(result: Any) -> list[str]:
    """The verdict, displacement [mm], capacity used, rim force over N, bearings at all rims, bearings lifted, height."""
    ends = result.verdict
    ratios = [float(np.max(one.extremes.rim_force)) / one.axial_load for one in result.bearings]
    used = max(float((one.extremes.sliding / one.bearing.arrays()["capacity"]).max()) for one in result.bearings)
    full = sum(reading.limit.key == "travel" for reading in ends.exceeded)
    lifts = [one["uplift"] for one in result.summary["bearings"]]
    lifted = [lift["height"] for lift in lifts if lift["height"] > VISIBLE]
    return [
        ends.word + (f" (`{result.status}`)" if ends.failure else ""),
        f"{1e3 * result.summary['peak_displacement']['radial']:.0f}",
        f"{used:.2f}",
        f"{max(ratios):.2f}",
        str(full),
        str(len(lifted)),
        f"{1e3 * max(lifted, default=0.0):.2g}",
    ]


def main() -> None:
    made = parser(__doc__)
    made.add_argument("part", nargs="?", choices=("hospital",), help="the verdicts of the hospital alone")
    part = made.parse_args().part
    if part is None:
        print("| scene | rims met at one time, of | rim force over N | degC |\n|---|---|---|---|")
        for name, values in demanding():
            if values["rims"] or values["temperature"] > 100.0 or QUICK:
                rims = f"{values['rims']:.0f} of {values['surfaces']:.0f}"
                print(f"| {name} | {rims} | {values['force']:.2f} | {values['temperature']:.0f} |", flush=True)
        print()
    head = ("record", "times", "case", "verdict", "u [mm]", "capacity used", "rim force over N")
    head += ("bearings at all rims", "bearings lifted", "height [mm]")
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    for name in HOSPITALS:
        for scale in SCALES:
            for case, result in hospital(name, scale, END if QUICK else None):
                row = [name.removeprefix("hospital-").upper(), f"{scale:g}", case, *cells(result)]
                print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    sys.exit(main())
