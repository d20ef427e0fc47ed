"""Compare one device of each kind with friction circles and published formulas: `python benchmarks/devices.py [DIR]`.

Draws docs/figures/devices.png and fills the table of docs/bearing.md. DIR is the folder to write to, with a copy of the
page in it; default: the docs of this checkout.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from quick import docs_folder, labelled, parser

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "benchmarks"), str(ROOT / "tests")]  # the closed form is that of the tests

from drawing import Array, closed_push, ratio  # noqa: E402
from reference.friction_circle import Transition, centres, force_at, transitions  # noqa: E402

from msfp_gen import Bearing, load_scene, simulate  # noqa: E402
from msfp_gen.common.output import replacing  # noqa: E402
from msfp_gen.figures.style import COLOURS, FAINT, INK, MILLI, page  # noqa: E402
from msfp_gen.results.result import Result  # noqa: E402

MARKS = ("<!-- numbers: python benchmarks/devices.py -->\n", "<!-- end -->\n")
HEAD = """\
| device | layout | u [mm] | run | friction circles | off | published | off | with the arms of friction | off |
|---|---|---|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Device:
    """A scene, and the data of its bearing that the published formula needs.

    Attributes:
        title: as in figure and table.
        scene: name of the preset.
        source: of the formula.
        lower, upper: surfaces below and above the pivot, outermost first, numbered from 1.
        joint: surface whose sphere centre is the pivot; None: the pivot is the middle of the innermost slider.
        textbook: the formula takes R for the effective radius, as that of the single pendulum does.
        at: displacements of the table [m].
    """

    title: str
    scene: str
    source: str
    lower: tuple[int, ...]
    upper: tuple[int, ...] = ()
    joint: int | None = None
    textbook: bool = False
    at: tuple[float, ...] = ()


SINGLE, DOUBLE = "W/R u + μW", "Fenz & Constantinou 2006"
DEVICES = (
    Device("single, tilting top", "single-push", SINGLE, (1,), textbook=True, at=(0.05, 0.2, 0.35)),
    Device("single, articulated", "single-articulated-push", SINGLE, (1,), (), 2, True, (0.05, 0.2, 0.35)),
    Device("double, rigid slider", "double-push", DOUBLE, (1,), (2,), at=(0.05, 0.2, 0.35)),
    Device("double, articulated", "double-articulated-push", DOUBLE, (1,), (3,), 2, at=(0.05, 0.2, 0.35)),
    Device("triple", "triple-push", "Fenz & Constantinou 2008", (1, 2), (4, 3), at=(0.02, 0.07, 0.11, 0.133)),
    Device(
        "quintuple",
        "quintuple-push",
        "Lee & Constantinou 2016",
        (1, 2, 3),
        (6, 5, 4),
        at=(0.03, 0.1, 0.2, 0.4, 0.58, 0.65, 0.69, 0.73),
    ),
)


@cache
def run(device: Device) -> Result:
    return simulate(load_scene(device.scene))


@cache
def friction_circle_transitions(device: Device) -> list[Transition]:
    """Transitions between sliding regimes in the whole push, by friction circles."""
    result = run(device)
    return transitions(closed_push(result), float(result.history.displacement[-1, 0]))


@cache
def circles(device: Device) -> tuple[Array, Array]:
    """Displacements of the push [m], with its transitions and those of the table, and F/W by friction circles."""
    found, push = friction_circle_transitions(device), closed_push(run(device))
    end = float(run(device).history.displacement[-1, 0])
    corners = [t.at.displacement for t in found if t.at.displacement > 0]
    u: Array = np.unique([*np.linspace(0.0025, 0.9999, 40) * end, *corners, *device.at])
    return u, force_at(push, list(u), found) / push.load


def effective_radii(bearing: Bearing, device: Device) -> dict[int, float]:
    """Distance from the centre of every surface to the pivot, R - h [m]; for a single pendulum to the top of the plate."""
    height = centres(bearing, np.zeros(bearing.layout.surfaces))[:, 1]
    if device.joint is not None:
        pivot = height[device.joint - 1]
    elif device.upper:
        below = bearing.bodies[: device.lower[-1]]  # up to the innermost slider
        pivot = bearing.base_height + sum(body.height for body in below) - below[-1].height / 2
    else:
        pivot = height[-1]
    return {surface: abs(float(height[surface - 1] - pivot)) for surface in (*device.lower, *device.upper)}


def thresholds(bearing: Bearing, device: Device, arms: bool) -> dict[int, float]:
    """F/W at which every surface starts to slide: mu, or with `arms` the value for friction at its true lever arm.

    The contact is at the distance R from the sphere centre, not R - h: mu_bar = (mu R - mu' R') / (R_eff - R_eff'), with
    ' for the next surface inwards. At the pivot mu' R' is zero, or the friction moment of the joint, with opposite signs
    for the side that slides first and the other one.
    """
    surfaces, radii = bearing.surfaces, effective_radii(bearing, device)
    if not arms:
        return {surface: surfaces[surface - 1].friction for surface in radii}
    moment = {surface: s.friction * s.radius for surface, s in enumerate(surfaces, start=1)}
    at_joint = 0.0 if device.joint is None else moment[device.joint]
    first = min((chain for chain in (device.lower, device.upper) if chain), key=lambda chain: moment[chain[-1]])
    found = {}
    for chain in filter(None, (device.lower, device.upper)):
        inner, radius = (-at_joint if chain == first else at_joint), 0.0
        for surface in reversed(chain):
            found[surface] = (moment[surface] - inner) / (radii[surface] - radius)
            inner, radius = moment[surface], radii[surface]
    return found


def displacement(bearing: Bearing, device: Device, force: Array, arms: bool) -> Array:
    """Displacement u [m] by the small-angle formula at forces F/W: a slider tilts by F/W - mu, up to its rim contact."""
    radii, starts = effective_radii(bearing, device), thresholds(bearing, device, arms)
    if device.textbook and not arms:
        radii = {surface: bearing.surfaces[surface - 1].radius for surface in radii}
    u = np.zeros_like(force)
    for chain in (device.lower, device.upper):
        tilt = np.zeros_like(force)
        for surface, inside in zip(chain, (*chain[1:], None), strict=False):
            data = bearing.surfaces[surface - 1]
            tilt = np.minimum(np.maximum(force - starts[surface], 0.0), tilt + data.capacity / data.radius)
            u += (radii[surface] - (radii[inside] if inside else 0.0)) * tilt
    return u


def formula(bearing: Bearing, device: Device, arms: bool = False) -> Callable[[Array], Array]:
    """F/W of the published formula as a function of the displacement [m]."""
    force = np.linspace(min(thresholds(bearing, device, arms).values()), 0.6, 60001)
    u = displacement(bearing, device, force, arms)
    return lambda at: np.interp(at, u, force)


def figure(path: Path) -> None:
    """Draw F/W of every device: the run, friction circles, and the formula with and without the arms of friction."""
    with page(11, 6.4, path) as whole:
        for device, axes in zip(DEVICES, whole.subplots(2, 3).flat, strict=True):
            result = run(device)
            bearing, u = result.scene.bearing, result.history.displacement[:, 0]
            grid = np.linspace(u[-1] / 500, u[-1], 500)
            axes.plot(u * MILLI, ratio(result)[:, 0], color=COLOURS[0], linewidth=3, alpha=0.5, label="run")
            axes.plot(
                circles(device)[0] * MILLI,
                circles(device)[1],
                color=INK,
                linewidth=1,
                linestyle="--",
                label="friction circles",
            )
            axes.plot(grid * MILLI, formula(bearing, device)(grid), color=COLOURS[1], linewidth=1.2, label="published")
            axes.plot(
                grid * MILLI,
                formula(bearing, device, True)(grid),
                color=COLOURS[2],
                linewidth=1.4,
                linestyle=":",
                label="with the arms of friction",
            )
            axes.set_title(f"{device.title} ({bearing.layout.name.replace('_', ', ')})")
            axes.set(xlabel="u = base − top [mm]", ylabel="F / W", xlim=(0, None), ylim=(0, None))
            axes.grid(color=FAINT, linewidth=0.4)
            axes.annotate(device.source, (0.97, 0.04), xycoords="axes fraction", ha="right", fontsize=8, color=INK)
        whole.axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 0.1))


def references(device: Device) -> tuple[tuple[str, str, str], ...]:
    """What a run of a device is compared with: the column of `rows`, its source, and the kind of reference."""
    return (
        ("circles", "friction circles", "closed form"),
        ("published", device.source, "formula"),
        ("arms", f"{device.source}, with the arms of friction", "formula"),
    )


def rows(device: Device) -> list[dict[str, float]]:
    """Rows of the table of one device: u [m], and F/W by run, friction circles, and formula without and with arms."""
    result = run(device)
    bearing, at = result.scene.bearing, np.array(device.at)
    columns = {
        "u": at,
        "run": np.interp(at, result.history.displacement[:, 0], ratio(result)[:, 0]),
        "circles": np.interp(at, *circles(device)),
        "published": formula(bearing, device)(at),
        "arms": formula(bearing, device, True)(at),
    }
    return [dict(zip(columns, map(float, row), strict=True)) for row in zip(*columns.values(), strict=True)]


def table() -> str:
    lines = []
    for device in DEVICES:
        layout = load_scene(device.scene).bearing.layout
        for row in rows(device):
            off = {name: f"{row[name] / row['circles'] - 1:+.1%}" for name in ("run", "published", "arms")}
            lines.append(
                f"| {device.title} | ({layout.n}, {layout.m}, {layout.p}) | {row['u'] * MILLI:.0f} | "
                f"{row['run']:.4f} | {row['circles']:.4f} | {off['run']} | {row['published']:.4f} | "
                f"{off['published']} | {row['arms']:.4f} | {off['arms']} |\n"
            )
    return HEAD + "".join(lines)


def write_table(folder: Path) -> None:
    """Replace the table of the page."""
    text = (folder / "bearing.md").read_text(encoding="utf-8")
    before, rest = text.split(MARKS[0])
    after = rest.split(MARKS[1])[1]
    with replacing(folder / "bearing.md") as temporary:
        temporary.write_text(labelled(before + MARKS[0] + table() + MARKS[1] + after), encoding="utf-8")


def main(folder: Path) -> None:
    (folder / "figures").mkdir(exist_ok=True)
    figure(folder / "figures" / "devices.png")
    write_table(folder)


if __name__ == "__main__":
    options = parser(__doc__)
    options.add_argument("folder", nargs="?", type=Path, default=docs_folder())
    main(options.parse_args().folder)
