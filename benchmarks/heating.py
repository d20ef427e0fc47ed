"""Draw docs/figures/heating.png: examples/heating.toml with and without its friction law. `python benchmarks/heating.py`"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from drawing import COLOURS, MILLI, drawn, panels, ratio
from quick import docs_folder, parser

from msfp_gen import Scene, load_scene, simulate
from msfp_gen.results.result import Result
from msfp_gen.specification.friction_laws import law_parameter_names

ROOT = Path(__file__).resolve().parents[1]


def without_law(scene: Scene) -> Scene:
    """The same scene with constant friction."""
    plain = scene.bearing.replace(**dict.fromkeys(law_parameter_names()))
    return replace(scene, bearing=plain, effects=replace(scene.effects, friction="constant"))


def draw(heats: Result, constant: Result) -> None:
    """Draw the loops of both runs, and temperature and friction of the dish."""
    rows = heats.history
    assert rows.temperature is not None
    with drawn(docs_folder() / "figures" / "heating.png", 11.0, 3.6) as figure:
        loop, warm, drop = panels(figure, "force over load", "temperature of the dish", "its friction, sliding fast")
        for run, colour, name in ((constant, COLOURS[1], "constant"), (heats, COLOURS[0], "pvt")):
            loop.plot(run.history.displacement[:, 0] * MILLI, ratio(run)[:, 0], color=colour, lw=0.9, label=name)
        loop.set(xlabel="u = base − top [mm]", ylabel="F/N")
        loop.legend()
        warm.plot(rows.time, rows.temperature[:, 0], color=COLOURS[0], lw=0.9)
        warm.set(xlabel="time [s]", ylabel="[°C]")
        fast = np.hypot(*rows.slip_velocity[:, 0].T) > 0.1
        drop.plot(rows.time[fast], heats.friction_coefficient[fast, 0], ".", ms=1.5, color=COLOURS[0])
        drop.set(xlabel="time [s]", ylabel="μ", ylim=(0, None))


def main() -> None:
    """Run both scenes, draw them, and print the peak temperature and the ratio of the dissipated energies."""
    parser(__doc__).parse_args()
    scene = load_scene(ROOT / "examples" / "heating.toml")
    heats, constant = simulate(scene), simulate(without_law(scene))
    draw(heats, constant)
    lost = [run.history.energy["friction_dissipated"][-1] for run in (heats, constant)]
    print(
        f"peak temperature {heats.summary['peak_temperature'][0]:.0f} degC, "
        f"dissipated energy over that at constant friction {lost[0] / lost[1]:.2f}"
    )


if __name__ == "__main__":
    main()
