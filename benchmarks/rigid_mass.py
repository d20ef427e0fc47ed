"""Range of the normal force under a rigid supported mass: prints the table of docs/model.md.

Runs both earthquake scenes on three preset bearings: `python benchmarks/rigid_mass.py`.
"""

from __future__ import annotations

from dataclasses import replace

from msfp_gen import RunError, load_scene, presets, simulate

WEIGHT = 112e3


def row(scene_name: str, bearing_name: str) -> str:
    """One line of the table."""
    scene = replace(load_scene(scene_name), bearing=presets.bearing(bearing_name))
    try:
        result, end = simulate(scene), "completes"
    except RunError as error:
        result, end = error.result, "stops with an error"
    friction = " / ".join(f"{100 * surface.friction:g}" for surface in scene.bearing.surfaces)
    normal = result.history.normal_force / WEIGHT
    time = f"{result.history.time[-1]:.1f} s"
    most = f"{normal.max():.2f}" if normal.max() < 100 else "beyond 100"
    return f"| {scene_name} | {bearing_name} | {friction} | {normal.min():.2f} | {most} | {end} at {time} |"


def main() -> None:
    """Print the table."""
    print("| scene | bearing | friction [%] | least N/W | most N/W | run |\n|---|---|---|---|---|---|")
    for scene in ("ridgecrest-clc", "ridgecrest-ccc"):
        for bearing in ("prototype-tfp", "becker-tfp", "fenz-tfp"):
            print(row(scene, bearing), flush=True)


if __name__ == "__main__":
    main()
