"""`msfp-gen explain`: tables of the input of a scene, its effects with their meaning, and its solver options."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.fields import Choice, Quantity, ruled_fields
from msfp_gen.common.tables import Table, vector, yes
from msfp_gen.scene.bearing import Surface
from msfp_gen.scene.effect_selection import GIVEN, EffectSelection, damping_share, quasistatic, scene_doubts
from msfp_gen.scene.friction_parameters import law_parameters
from msfp_gen.specification.layout import Effects

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion
    from msfp_gen.motions.prescribed import Prescribed
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.scene import Scene
    from msfp_gen.scene.solver import Solver
    from msfp_gen.scene.top import NodeTop, Top
    from msfp_gen.specification.friction_laws import Law

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
# Units of the numbers that describe the origin of a motion (`Motion.metadata`); the others have none.
MOTION_UNITS = {
    "amplitude": "m", "period": "s", "lead_in": "s", "acceleration": "m/s^2", "initial_speed": "m/s",
    "start_time": "s", "window_start": "s", "end_offset": "m",
}  # fmt: skip
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


def explain(scene: Scene) -> list[Table]:
    """Tables that describe `scene`: bearing, motion, top, histories, effects with their meaning, friction, solver."""
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
        _solver(scene),
    ]


def surface_table(bearing: Bearing) -> Table:
    """Surfaces of a bearing."""
    layout, shapes = bearing.layout, {1: "up", -1: "down"}
    rows = [
        (str(number), shapes[sign], *_cells(surface, SURFACE_COLUMNS))
        for number, (sign, surface) in enumerate(zip(layout.signs, bearing.surfaces, strict=True), start=1)
    ]
    title = (
        f"bearing {layout.name}: {layout.n} bodies, {layout.surfaces} surfaces, bottom first; "
        f"base {bearing.base_height * 1e3:g} mm high, g = {bearing.gravity:g} m/s^2"
    )
    return Table(title, ("surface", "concave", *SURFACE_COLUMNS), rows)


def doubt_tables(doubts: Iterable[tuple[int, float, str]]) -> Iterator[Table]:
    """Values that are hardly meant, as of `plausibility.doubtful_values`; no table without them."""
    rows = [(text,) for _, _, text in doubts]
    if rows:
        yield Table("values that are hardly meant", ("value",), rows)


def body_table(bearing: Bearing) -> Table:
    """Moving bodies of a bearing."""
    rows = [(str(number), *_cells(body, BODY_COLUMNS)) for number, body in enumerate(bearing.bodies, start=2)]
    return Table("moving bodies, bottom first", ("body", *BODY_COLUMNS), rows)


def _cells(part: object, columns: dict[str, tuple[str, float]]) -> Iterator[str]:
    return (vector(np.atleast_1d(getattr(part, name)), scale) for name, scale in columns.values())


def motion_table(motion: Motion) -> Table:
    """Peaks and origin of a motion of the ground."""
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
            ("peak displacement along E1, E2, E3", f"{vector(peaks[0], 1e3)} mm"),
            ("peak velocity", f"{vector(peaks[1], 1e3)} mm/s"),
            ("peak acceleration", f"{vector(peaks[2])} m/s^2"),
            ("rotates", yes(np.any(motion.rotation(t)))),
            *sources,
        ],
    )


def top_table(top: Top | NodeTop, title: str) -> Table:
    """Stiffness, damping, mass and load of a top, or of the interface to a building."""
    rows = [
        (name.replace("_", " "), "rigid" if value is None else f"{_value(value)} {rule.unit}")
        for name, rule, _ in ruled_fields(type(top))
        if isinstance(rule, Quantity)
        for value in (getattr(top, name),)
    ]
    return Table(title, (), rows)


def effect_table(selection: EffectSelection) -> Table:
    """The effects and their meaning; of each selected effect also the reason and what the selection saves."""
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
    """Ranges of the channels of a load or rotation history."""
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
    """Parameters of the friction law on each surface, defaults included."""
    if law is None:
        return []
    rows = [law_parameters(law, bearing, index) for index in range(len(bearing.surfaces))]
    units = {name: rule.unit for name, rule, _ in ruled_fields(Surface) if isinstance(rule, Quantity)}
    names = {name: f"{name} [{units[name]}]" if units[name] else name for name in law.parameters}
    lines = [(shown, *(f"{row[name]:.4g}" for row in rows)) for name, shown in names.items()]
    return [Table("friction law, surfaces bottom first", ("", *map(str, range(1, len(rows) + 1))), lines)]


def _solver(scene: Scene) -> Table:
    solver: Solver = scene.solver
    stop = scene.stop
    ends = [f"{scene.end:.6g} s"]
    if stop is not None and stop.displacement is not None:
        ends.append(f"{stop.displacement * 1e3:.4g} mm across the bearing")
    if stop is not None and stop.all_rims:
        ends.append("every rim in contact")
    return Table(
        "solver",
        (),
        [
            ("method", f"{solver.method}: {METHODS[solver.method]}"),
            ("rtol", f"{solver.rtol:g}, relative error of a step"),
            ("steps", _steps(scene)),
            ("tolerance of angles", f"{solver.angle_tolerance:g} rad"),
            ("longest step", "resolution of the motion" if solver.max_step is None else f"{solver.max_step:g} s"),
            ("rows", "every step" if scene.output_step is None else f"every {scene.output_step:g} s"),
            ("start", "centred, at rest" if scene.initial_state is None else "given"),
            ("ends at", " or ".join(ends)),
        ],
    )


def _steps(scene: Scene) -> str:
    if not quasistatic(scene, scene.modelled):
        return "integrated"
    share = f"damper forces are {100 * damping_share(scene):.2g}% of friction"
    return f"quasi-static: no masses, {share}; exact for any step length"


def _value(value: object) -> str:
    if isinstance(value, bool):
        return yes(value)
    if isinstance(value, tuple):
        return vector(value)
    return f"{value:g}" if isinstance(value, float) else str(value)
