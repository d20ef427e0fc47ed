"""`explain`: a scene comes in; tables that describe it in words go out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import singledispatch
from typing import Any

import numpy as np

from msfp_gen.common.fields import Choice, Quantity, ruled_fields
from msfp_gen.common.tables import Table, vector_text, yes
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.prescribed import Prescribed
from msfp_gen.scene.bearing import Bearing, Surface
from msfp_gen.scene.effect_selection import (
    GIVEN,
    EffectSelection,
    damping_share,
    quasistatic,
)
from msfp_gen.scene.friction_parameters import law_parameters
from msfp_gen.scene.plausibility import scene_doubts
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.scene_fields import Limits
from msfp_gen.scene.system import System
from msfp_gen.scene.top import NodeTop, Top
from msfp_gen.specification.friction_laws import Law
from msfp_gen.specification.layout import Effects

SURFACE_COLUMNS = {
    "R [mm]": ("radius", 1e3),
    "capacity [mm]": ("capacity", 1e3),
    "friction [-]": ("friction", 1.0),
    "yield [mm]": ("yield_displacement", 1e3),
    "damping [ms]": ("contact_damping", 1e3),
    "rim [N/m]": ("rim_stiffness", 1.0),
    "rim [N s/m]": ("rim_damping", 1.0),
}
BODY_COLUMNS = {
    "height [mm]": ("height", 1e3),
    "centroid [mm]": ("centroid", 1e3),
    "mass [kg]": ("mass", 1.0),
    "inertia [kg m^2]": ("inertia", 1.0),
    "rim radius [mm]": ("rim_radius", 1e3),
    "rim offset [mm]": ("rim_offset", 1e3),
}
# Number in `Motion.metadata`, which describes the origin of a motion -> unit; other numbers have no unit.
MOTION_UNITS = {
    "amplitude": "m", "period": "s", "lead_in": "s", "acceleration": "m/s^2", "initial_speed": "m/s",
    "start_time": "s", "window_start": "s", "end_offset": "m", "pga": "m/s^2", "sa": "m/s^2", "sds": "m/s^2",
    "ag": "m/s^2",
}  # fmt: skip
DOUBTFUL = "values that are hardly meant"  # title of the table
METHODS = {
    "implicit": "L-stable, states and unknowns solved together",
    "esdirk4": "L-stable of order 4, for tight tolerances",
    "dopri5": "explicit Dormand-Prince, the method of PEER 2017/07",
}
TOPS = {
    "rig": "test machine: constant axial load, springs that hold the top plate (PEER 2017/07, chapter 4)",
    "prescribed": "constant force and moment on the top plate",
    "mass": "rigid supported mass fixed to the top plate",
}


@singledispatch
def explain(system: Any) -> list[Table]:
    """Tables that describe a system: bearings, motions, what they carry, effects with their meaning, solver."""
    tables: list[Table] = system.explain()
    return tables


@explain.register(Scene)
def _explain_scene(scene: Scene) -> list[Table]:
    start = "centred, at rest" if scene.initial_state is None else "given"
    more = [
        ("steps", _steps(scene)),
        ("tolerance of angles", f"{scene.solver.angle_tolerance:g} rad"),
        ("start", start),
    ]
    return [
        surface_table(scene.bearing),
        *doubt_tables(scene_doubts(scene)),
        body_table(scene.bearing),
        motion_table(scene.motion),
        top_table(scene.top, f"top: {scene.top.kind}, {TOPS[scene.top.kind]}"),
        *_history("load on the top plate", scene.load),
        *_history("rotation of the top", scene.top_rotation),
        effect_table(scene.effect_selection),
        *friction_tables(scene.modelled.law, scene.bearing),
        *limit_tables(scene.limits),
        solver_table(scene, METHODS[scene.solver.method], scene.output_step, more, _stops(scene)),
    ]


def surface_table(bearing: Bearing) -> Table:
    """Table of the surfaces of a bearing."""
    layout, shapes = bearing.layout, {1: "up", -1: "down"}
    rows = [
        [str(number), shapes[sign], *_cells(surface, SURFACE_COLUMNS)]
        for number, (sign, surface) in enumerate(zip(layout.signs, bearing.surfaces, strict=True), start=1)
    ]
    columns = ["surface", "concave", *SURFACE_COLUMNS]
    if (sheet := bearing.friction_at_pivot) is not None:
        place = columns.index("friction [-]") + 1
        for row, coefficient in zip([columns, *rows], ["at pivot [-]", *map("{:.5g}".format, sheet)], strict=True):
            row.insert(place, coefficient)
    title = (
        f"bearing {layout.name}: {layout.n} bodies, {layout.surfaces} surfaces, bottom first; "
        f"base {bearing.base_height * 1e3:g} mm high, g = {bearing.gravity:g} m/s^2"
    )
    return Table(title, tuple(columns), [tuple(row) for row in rows])


def doubt_tables(doubts: Iterable[tuple[int, float, str]]) -> Iterator[Table]:
    """A table of doubtful values, as in `plausibility.doubtful_values`; none without any."""
    rows = [(text,) for _, _, text in doubts]
    if rows:
        yield Table(DOUBTFUL, ("value",), rows)


def body_table(bearing: Bearing) -> Table:
    """Table of the moving bodies of a bearing."""
    rows = [(str(number), *_cells(body, BODY_COLUMNS)) for number, body in enumerate(bearing.bodies, start=2)]
    return Table("moving bodies, bottom first", ("body", *BODY_COLUMNS), rows)


def _cells(part: object, columns: dict[str, tuple[str, float]]) -> Iterator[str]:
    return (vector_text(np.atleast_1d(getattr(part, name)), scale) for name, scale in columns.values())


def motion_table(motion: Motion) -> Table:
    """Table of the peaks and the origin of a motion of the ground."""
    t = np.union1d(motion.knots, np.linspace(0, motion.duration, 4001))
    peaks = [np.abs(of(t)).max(axis=0) for of in (motion.displacement, motion.velocity, motion.acceleration)]
    sources = [
        (str(key).replace("_", " "), f"{_value(value)} {MOTION_UNITS.get(key, '')}".rstrip())
        for key, value in motion.metadata.items()
        if value != ""
    ]
    return Table(
        f"motion of the base: {motion.name or 'unnamed'}",
        (),
        [
            ("duration", f"{motion.duration:.6g} s, {len(motion.knots) - 1} pieces"),
            ("peak displacement along E1, E2, E3", f"{vector_text(peaks[0], 1e3)} mm"),
            ("peak velocity", f"{vector_text(peaks[1], 1e3)} mm/s"),
            ("peak acceleration", f"{vector_text(peaks[2])} m/s^2"),
            ("rotates", yes(np.any(motion.rotation(t)))),
            *sources,
        ],
    )


def top_table(top: Top | NodeTop, title: str) -> Table:
    """Table of stiffness, damping, mass and load of a top, or of the interface to a building."""
    rows = [
        (name.replace("_", " "), "rigid" if value is None else f"{_value(value)} {rule.unit}")
        for name, rule, _ in ruled_fields(type(top))
        if isinstance(rule, Quantity)
        for value in (getattr(top, name),)
    ]
    return Table(title, (), rows)


def effect_table(selection: EffectSelection) -> Table:
    """Table of the effects with their meaning; with the reason and the saving of each selected effect."""
    effects = selection.effects
    reasons = {reason.effect: reason for reason in selection.reasons}
    rows = []
    for name, rule, _ in ruled_fields(Effects):
        if not isinstance(rule, Choice):  # friction_law: shown below as "mu ="
            continue
        value = getattr(effects, name)
        rows.append((name, _value(value), rule.meanings[value]))
        if name in reasons and (because := reasons[name].because) != GIVEN:
            rows.append(("", "because", because))
            rows += [("", "saves", saves)] if (saves := reasons[name].saves) else []
    if effects.law is not None:
        rows.append(("", "mu =", effects.law.text))
    if not reasons:
        return Table("effects as given; monitors note where an effect left out becomes significant", (), rows)
    error = f"{selection.error:.3g} of the friction force"
    title = f"effects selected for an error of {error}; monitors add others when needed"
    return Table(title, (), rows)


def _history(title: str, history: Prescribed | None) -> list[Table]:
    """Table of the ranges of the channels of a load or rotation history; none without a history."""
    if history is None:
        return []
    values = history.evaluate(np.union1d(history.knots, np.linspace(0, history.duration, 2001)))
    rows = [
        (name, f"{low:.5g} ... {high:.5g} {history.unit(name)}")
        for name, low, high in zip(history.CHANNELS, values.min(axis=0), values.max(axis=0), strict=True)
        if low or high
    ]
    return [Table(f"{title}, given until {history.duration:.6g} s", (), rows)]


def friction_tables(law: Law | None, bearing: Bearing) -> list[Table]:
    """Table of the parameters of the friction law on each surface, defaults included; none without a law."""
    if law is None:
        return []
    rows = [law_parameters(law, bearing, index) for index in range(len(bearing.surfaces))]
    units = {name: rule.unit for name, rule, _ in ruled_fields(Surface) if isinstance(rule, Quantity)}
    names = {name: f"{name} [{units[name]}]" if units[name] else name for name in law.parameters}
    lines = [(label, *(f"{row[name]:.4g}" for row in rows)) for name, label in names.items()]
    return [Table("friction law, surfaces bottom first", ("", *map(str, range(1, len(rows) + 1))), lines)]


def limit_tables(limits: Limits | None) -> Iterator[Table]:
    """Table of the limits of the device, given or by default; none where the scene gives no limits."""
    if limits is not None:
        units = {name: rule.unit for name, rule, _ in ruled_fields(Limits) if isinstance(rule, Quantity)}
        values = {name: getattr(limits, name) for name in units}
        rows = [(name, f"{value:g} {units[name]}") for name, value in values.items() if value is not None]
        yield Table("limits of the device, for the verdict", (), rows)


def solver_table(
    system: System,
    method: str,
    step: float | None,
    more: Iterable[tuple[str, str]] = (),
    stops: Iterable[str] = (),
) -> Table:
    """Table of the options of the solver and of the end of the run.

    method: its description. step: between rows [s]. more: further rows. stops: conditions that end the run earlier.
    """
    solver = system.solver
    rows = [
        ("method", f"{solver.method}: {method}"),
        ("rtol", f"{solver.rtol:g}, relative error of a step"),
        *more,
        ("longest step", "resolution of the motion" if solver.max_step is None else f"{solver.max_step:g} s"),
        ("rows", "every step" if step is None else f"every {step:g} s"),
        ("ends at", " or ".join([f"{system.end:.6g} s", *stops])),
    ]
    return Table("solver", (), rows)


def _stops(scene: Scene) -> Iterator[str]:
    """The stop conditions of a scene, as text."""
    stop = scene.stop
    if stop is not None and stop.displacement is not None:
        yield f"{stop.displacement * 1e3:.4g} mm across the bearing"
    if stop is not None and stop.all_rims:
        yield "every rim in contact"


def _steps(scene: Scene) -> str:
    if not quasistatic(scene, scene.modelled):
        return "integrated"
    share = f"damper forces are {100 * damping_share(scene):.2g}% of friction"
    return f"quasi-static: no masses, {share}; exact for any step length"


def _value(value: object) -> str:
    if isinstance(value, bool):
        return yes(value)
    if isinstance(value, tuple):
        return vector_text(value)
    return f"{value:g}" if isinstance(value, float) else str(value)
