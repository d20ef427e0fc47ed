"""What pages are made of: templates and scripts of assets/, figures, and selected rows of a run as arrays in JSON."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from importlib.resources import files
from importlib.resources.abc import Traversable
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array, Indices
from msfp_gen.common.output import check_output, write_bytes
from msfp_gen.common.tables import Table
from msfp_gen.common.version import __version__
from msfp_gen.figures.style import colour
from msfp_gen.results.geometry import POINTS, Poses, friction_circles, outline, poses
from msfp_gen.results.history import History
from msfp_gen.results.result import Result
from msfp_gen.results.sign import shown_sign
from msfp_gen.results.sliding import sliding_surfaces
from msfp_gen.scene.bearing import Bearing

if TYPE_CHECKING:
    from markupsafe import Markup
    from matplotlib.figure import Figure

FRAMES = 1500  # instants; 0.5 kB each for a triple pendulum, and more than a screen has pixel columns
FEWEST = 600  # least number of instants, so that the motion looks continuous
ARC = 20  # points on the profile of a spherical face
STATES = ("sticks", "slides", "rim contact", "separated")


def view(result: Result, count: int = FRAMES) -> dict[str, Any]:
    """Data for the scripts of the HTML report, ready for JSON: lengths [m], forces [N], angles [rad], axes E1, E2, E3.

    Bodies are solids of revolution; positions are relative to the base, as in `geometry.Poses`. count: of instants,
    about.
    """
    shown = result.at_times(instants(result, count))
    history, bearing, where = shown.alone.history, shown.bearing, poses(shown)
    frames = {
        "time": history.time,
        "bottom": where.bottom,
        "turn": quaternions(where),
        "centre": where.centre,
        "contact": where.contact,
        "line": where.line,
        "force": where.force,
        "base": history.base_displacement,
        "displacement": shown_sign().factor * history.displacement,
        "top_force": shown_sign().factor * history.top_force,
        "sliding": history.sliding,
        "normal": history.normal_force,
        "mobilised": np.linalg.norm(history.friction_state, axis=-1),
        "state": states(history),
        "circle": friction_circles(shown),
    }
    largest = frames["circle"].max(axis=0)
    return {
        "peak": history.peak_row,
        "sign": shown_sign()._asdict(),
        "azimuth": main_direction(history.displacement[:, :2]),
        "states": STATES,
        "surfaces": [
            {"capacity": surface.capacity, "circle": float(circle), "colour": colour(number)}  # largest circle [m]
            for number, (surface, circle) in enumerate(zip(bearing.surfaces, largest, strict=True), start=1)
        ],
        "bodies": [pieces(bearing, body) for body in range(bearing.layout.n)],
        "events": [
            {"time": event.time, "surface": event.surface, "kind": event.kind.replace("_", " ")}
            for event in result.events
        ],
        "frames": {name: packed(values) for name, values in frames.items()},
    }


def instants(result: Result, count: int = FRAMES) -> Array:
    """Increasing times of the view [s], shape (K,): rows of the run, and times between them if they are too few."""
    time = result.history.time[selected_rows(result, count)]
    return np.union1d(time, np.linspace(time[0], time[-1], FEWEST)) if len(time) < FEWEST else time


def selected_rows(result: Result, count: int = FRAMES) -> Indices:
    """Increasing row numbers of the view: evenly in time, with the ends, all peaks, and first events of each kind."""
    history = result.history
    time = history.time
    if len(time) <= count:
        return np.arange(len(time))
    even = np.linspace(time[0], time[-1], count)
    after = np.clip(np.searchsorted(time, even), 1, len(time) - 1)
    nearest = np.where(even - time[after - 1] < time[after] - even, after - 1, after)
    forces = np.abs(history.top_force)
    radial = np.hypot(history.top_force[:, 0], history.top_force[:, 1])
    peaks = [
        np.abs(history.displacement).argmax(axis=0),
        history.horizontal.argmax(),
        forces.argmax(axis=0),
        radial.argmax(),
        history.sliding.argmax(axis=0),
    ]
    first = {(event.surface, event.kind): event.time for event in reversed(result.events)}
    events = np.searchsorted(time, list(first.values())).clip(max=len(time) - 1)
    return np.unique(np.concatenate([nearest, *map(np.atleast_1d, peaks), events]).astype(np.intp))


def main_direction(path: Array) -> float:
    """Azimuth of the principal direction of a horizontal path, shape (T, 2) [rad], in (-pi/2, pi/2]."""
    (xx, xy), (_, yy) = np.cov((path - path[0]).T, ddof=0) if len(path) > 1 else np.zeros((2, 2))
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    return 0.0 if abs(angle) < 1e-6 else float(angle)


def quaternions(where: Poses) -> Array:
    """Rotation of every body as quaternions x, y, z, w, shape (T, n, 4) [-], with the spin about its axis (2.27)."""
    from scipy.spatial.transform import Rotation

    axes = np.swapaxes(where.basis, -1, -2).reshape(-1, 3, 3)  # t_1, t_2, t_3 as columns
    rotations = Rotation.from_matrix(axes) * Rotation.from_euler("z", where.spin.reshape(-1, 1))
    return np.asarray(rotations.as_quat()).reshape(*where.spin.shape, 4)


def states(history: History) -> Array:
    """State of every surface as index into `STATES`, shape (T, n-1) [-]."""
    result = np.where(sliding_surfaces(history), 1.0, 0.0)
    result[history.gap <= 0] = 2.0
    result[history.separated | (history.normal_force <= 0)] = 3.0
    return result


def pieces(bearing: Bearing, body: int) -> list[dict[str, Any]]:
    """Half profile of a body (index from 0), split at its edges: points (radius, height) [m] and number of the surface.

    The surface is 0 for parts that are not sliding faces.
    """
    points, last = outline(bearing, body), bearing.layout.surfaces
    ends = [POINTS if 0 <= surface < last else 1 for surface in (body - 1, body)]
    arc = np.linspace(0, POINTS - 1, ARC).round().astype(int)
    side = points[ends[0] - 1 : len(points) - ends[1] + 1]
    parts = [(0, np.array(pair)) for pair in pairwise(side)]
    if ends[0] > 1:
        parts.insert(0, (body, points[arc]))
    if ends[1] > 1:
        parts.append((body + 1, points[len(points) - POINTS + arc]))
    return [
        {"surface": surface, "points": line.round(7).tolist()} for surface, line in parts if np.ptp(line, axis=0).any()
    ]


def packed(values: Array) -> dict[str, Any]:
    """An array as little-endian float32 in base64, with its shape."""
    data = base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")
    return {"shape": list(values.shape), "data": data}


RESOLUTION = 110  # dots per inch of the figures
TALL = 0.8  # height over width, above which a figure needs most of a page


def render(template: str, **values: Any) -> str:
    """The page of a template, as text: of one in assets/ by its name, or of a text. An undefined name is an error."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True, loader=FunctionLoader(asset)
    )
    environment.filters["of_texts"] = of_texts
    page = environment.get_template(template) if template.endswith(".jinja") else environment.from_string(template)
    return page.render(version=__version__, style=Markup(asset("page.css")), **values)


def of_texts(table: Table) -> list[bool]:
    """Whether each column of a table has texts rather than numbers, so that its cells begin at the left."""
    return [any(cell[:1].isalpha() for cell in column) for column in zip(*table.rows, strict=True)]


def picture(title: str, figure: Figure) -> dict[str, str]:
    """A figure as the templates show it: its title, its WebP data, and whether it is tall, for print."""
    drawn = BytesIO()
    # Without loss: a palette of the image's own would mix the colours of figures.style. Less than half of a PNG.
    figure.savefig(drawn, format="webp", dpi=RESOLUTION, pil_kwargs={"lossless": True})
    shape = "tall" if figure.get_figheight() > TALL * figure.get_figwidth() else "low"
    return {"title": title, "webp": base64.b64encode(drawn.getvalue()).decode("ascii"), "shape": shape}


ASSETS = files(__package__) / "assets"


def asset(name: str, folder: Traversable = ASSETS) -> str:
    """A file of a folder, or where it has none of this name of assets/, as text."""
    path = folder / name
    return (path if path.is_file() else ASSETS / name).read_text(encoding="utf-8")


def script_data(data: Any) -> Markup:
    """Data as JSON inside a script element, which no text in it can end: <, > and & are escaped."""
    from markupsafe import Markup

    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return Markup(re.sub(r"[<>&]", lambda match: f"\\u{ord(match[0]):04x}", text))


REPORT_SUFFIXES = (".html", ".htm")


def write_page(path: str | Path, text: Callable[[], str]) -> Path:
    """Write a page; the file appears only when complete. Raises InputError for a path that cannot be written."""
    path = check_output(path, REPORT_SUFFIXES)
    write_bytes(path, [text().encode()])
    return path
