"""Peaks of the hospital over the vertical stiffness and damping of its interfaces: prints the table of docs/buildings.md.

The stiffness is that of steel, liner, pedestal and ground below each bearing; its frequency is that of the rigid building
on all of them. The damping is a share of the critical one of that vibration. Minutes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from quick import parser, pick

from msfp_gen import BuildingScene, load_scene, simulate

STIFFNESSES = pick((0.5e9, 1e9, 2e9, 4e9, 8e9), (2e9,))  # of each interface [N/m]
SHARES = pick((0.05, 0.1, 0.2), (0.2,))
RECORDS = pick(("hospital-ccc", "hospital-clc"), ("hospital-clc",))


def varied(scene: BuildingScene, stiffness: float, share: float) -> tuple[BuildingScene, float]:
    """The building on such interfaces, and the vertical frequency of its mass on all of them [Hz]."""
    count, mass = len(scene.bearings), scene.weight / scene.gravity
    turn = np.sqrt(count * stiffness / mass)
    damping = 2.0 * share * turn * mass / count
    bearings = [
        replace(each, interface=replace(each.interface, vertical_stiffness=stiffness, vertical_damping=float(damping)))
        for each in scene.bearings
    ]
    return replace(scene, bearings=bearings), float(turn / (2.0 * np.pi))


def main() -> None:
    """Print the table."""
    parser(__doc__).parse_args()
    columns = ("record", "stiffness [N/m]", "frequency [Hz]", "damping", "roof, vertical", "roof, horizontal")
    columns += ("N over N at rest", "u [mm]", "base shear over weight")
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}")
    for name in RECORDS:
        scene = load_scene(name)
        assert isinstance(scene, BuildingScene)
        for stiffness in STIFFNESSES:
            for share in SHARES:
                changed, frequency = varied(pick(scene, replace(scene, duration=2.0)), stiffness, share)
                s = simulate(changed).summary
                roof = s["floors"][-1]["peak_acceleration"]
                ratios = f"{s['minimum_load_ratio']:.2f} to {s['maximum_load_ratio']:.2f}"
                cells = (f"{stiffness:.2g}", f"{frequency:.1f}", f"{share:.0%}", f"{roof['E3'] / 9.81:.2f} g")
                cells += (f"{roof['radial'] / 9.81:.3f} g", ratios, f"{1e3 * s['peak_displacement']['radial']:.0f}")
                print(f"| {name} | {' | '.join(cells)} | {s['peak_force_ratio']:.3f} |", flush=True)


if __name__ == "__main__":
    main()
