"""Tables and texts of the HTML report. All numbers are those of the result; none depends on the machine."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from io import BytesIO
from typing import TYPE_CHECKING, Any

from msfp_gen.common.errors import InputError
from msfp_gen.common.tables import Table
from msfp_gen.common.version import __version__
from msfp_gen.results.files import COUNTER, PROVENANCE, without
from msfp_gen.results.history import Event
from msfp_gen.results.note import by_importance
from msfp_gen.results.result import AnyResult
from msfp_gen.results.run_data import BearingData
from msfp_gen.scene.bearing import Bearing

if TYPE_CHECKING:
    from markupsafe import Markup
    from matplotlib.figure import Figure


MILLI, KILO = 1e3, 1e-3
MACHINE_KEYS = ("build_seconds",)  # keys of the provenance that depend on the machine
EVENTS = 40  # most events listed; in an earthquake there may be a rim contact in every cycle


DEVICES = {1: "single", 2: "double", 4: "triple", 6: "quintuple"}  # number of sliding surfaces -> pendulum
# Words of the page for a reader who has seen nothing else of msfp-gen.
TERMS = (
    ("friction pendulum bearing", "steel sliders in spherical dishes, between a structure and its foundation. It "
     "slides when the ground moves, friction dissipates energy, and the weight on the curved dishes brings it back."),
    ("surface", "a pair of spherical faces that slide on each other, numbered from the bottom."),
    ("sliding", "distance of a slider from the centre of its dish, along the dish."),
    ("capacity, rim, gap", "the sliding at which the slider meets the raised edge (rim) of its dish; the gap is what "
     "is left until then. A negative gap is the compression of the rim."),
    ("u", "horizontal displacement across the bearing: base less top, less its value at the start."),
    ("F", "force of the bearing on what stands on it; it has the sign of u in a loop."),
    ("normal force N", "compression through a surface. Where it falls to zero, the surface would open."),
    ("effective stiffness, damping", "of one cycle: force over displacement between its two ends, and the energy of "
     "the loop over 2π times stiffness times displacement squared."),
    ("sliding regime", "a part of the motion in which the same surfaces slide."),
    ("friction mobilised", "share of the full friction force; 100 % while a surface slides, less while it sticks."),
    ("energy balance", "work of the ground and the loads, less all energy stored and dissipated; what remains is the "
     "error of the computation."),
)  # fmt: skip
BUILDING_TERMS = (
    TERMS[0],
    ("u", "horizontal displacement across a bearing: base less top, less its value at the start."),
    ("N", "compression between a bearing and the building; at rest its share of the weight. Where it falls to zero, "
     "the bearing would lift off."),
    ("base shear", "horizontal force of the ground on all bearings."),
    ("drift", "horizontal displacement of a floor relative to that below, tilt of the floors taken out."),
    ("storey shear", "force that accelerates the floors above."),
    ("floor spectrum", "largest response of oscillators of a period that stand on a floor, with 5 % damping."),
    ("left", "capacity of a surface less its sliding: what remains until the slider meets the rim of its dish."),
    ("rim", "the raised edge of a dish. Inner sliders of a triple pendulum meet theirs in strong motion."),
)  # fmt: skip


@dataclass(frozen=True)
class TitleBlock:
    """What identifies a report in a project: texts; "" leaves an entry out. device: "" for the kind of the bearing.

    code: the edition of the design code, such as "ASCE 7-22".
    """

    project: str = ""
    device: str = ""
    date: str = ""
    revision: str = ""
    code: str = ""

    def rows(self, device: str) -> list[tuple[str, str]]:
        """Names and texts of the entries that are given, the device in any case; `device`: its kind."""
        entries = {
            "project": self.project,
            "device": self.device or device,
            "date": self.date,
            "revision": self.revision,
            "code edition": self.code,
        }
        return [(name, text) for name, text in entries.items() if text]


def kind_of(bearing: Bearing) -> str:
    """The kind of a bearing by its sliding surfaces, with its layout."""
    layout = bearing.layout
    kind = DEVICES.get(layout.surfaces)
    surfaces = f"{layout.surfaces} sliding surface{'s' if layout.surfaces > 1 else ''}"
    return f"{kind} friction pendulum, {surfaces}" if kind else f"friction pendulum of {surfaces}"


def summary_page(result: AnyResult) -> list[Table]:
    """Tables of the run as in `msfp-gen run`, without times of the machine, and of the events of one bearing."""
    first, *others = result.tables()
    rows = [("time simulated", f"{result.summary['duration']:.6g} s"), *(row for row in first.rows if row[0] != "time")]
    events = result.events if isinstance(result, BearingData) else ()
    return [Table("the run", (), rows), *others, *([_event_table(events)] if events else [])]


def note_tables(result: AnyResult) -> list[Table]:
    """A table of all notes of the run, the most important first; none without notes."""
    rows = [(f"t = {note.time:.6g} s", note.sentence) for note in by_importance(result.notes)]
    return [Table("notes, the most important first", (), rows)] if rows else []


def characterisation_page(result: AnyResult) -> list[Table]:
    """Tables of the characterisation; none if no bearing moved."""
    try:
        return result.characterise().tables()
    except InputError:
        return []


def provenance_table(result: AnyResult) -> Table:
    """Table of versions, model and method of the run, and the counters of the solver."""
    about = result.dataset.attrs
    provenance = {name: text for name, text in without(PROVENANCE, about).items() if name not in MACHINE_KEYS}
    counters = {name: count for name, count in without(COUNTER, about).items() if name != "wall_time"}
    rows = [(name.replace("_", " "), str(value)) for name, value in {**provenance, **counters}.items()]
    return Table("versions, model and counters of the solver", (), rows)


def outcome(result: AnyResult) -> str:
    """How a run ended, and its verdict, in one or two sentences."""
    ends, verdict = {"ok": "The run reached its end", "stopped": "The run ended at its stop condition"}, result.verdict
    if result.status not in ends:
        lines = verdict.exceeded_text
        return f"The run failed ({result.status}): {result.message}" + (
            f". Until then exceeded: {lines}" if lines else ""
        )
    return ends[result.status] + (f", {verdict.text}." if verdict.ok else f". Limits of the device {verdict.text}.")


def _event_table(events: Sequence[Event]) -> Table:
    shown = events[:EVENTS]
    more = f", the first {EVENTS} of {len(events)}" if len(events) > EVENTS else ""
    rows = [
        (
            f"{event.time:.4f}",
            event.kind.replace("_", " "),
            str(event.surface or "-"),
            *(f"{value * MILLI:.2f}" for value in event.displacement[:2]),
            *(f"{value * KILO:.3f}" for value in event.top_force[:2]),
        )
        for event in shown
    ]
    columns = ("time [s]", "event", "surface", "u1 [mm]", "u2 [mm]", "F1 [kN]", "F2 [kN]")
    return Table(f"events{more}", columns, rows)


RESOLUTION = 110  # dots per inch of the figures


def render(template: str, **values: Any) -> str:
    """The page of a template in assets/, as text. An undefined name is an error; text is escaped."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True, loader=FunctionLoader(asset)
    )
    return environment.get_template(template).render(version=__version__, style=Markup(asset("page.css")), **values)


def picture(title: str, figure: Figure) -> dict[str, str]:
    """A figure as the templates show it: its title and its PNG data."""
    data = BytesIO()
    figure.savefig(data, format="png", dpi=RESOLUTION)
    return {"title": title, "png": base64.b64encode(data.getvalue()).decode("ascii")}


def asset(name: str) -> str:
    """A file of assets/ as text."""
    return files(__package__).joinpath("assets", name).read_text(encoding="utf-8")


def script_data(data: Any) -> Markup:
    """Data as JSON inside a script element, which no text in it can end: <, > and & are escaped."""
    from markupsafe import Markup

    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return Markup(re.sub(r"[<>&]", lambda match: f"\\u{ord(match[0]):04x}", text))
