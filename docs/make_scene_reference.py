"""Write docs/scene.md, every key of a scene file, from its schema: `python docs/make_scene_reference.py`.

What a key takes and its default come from the rules that the reader of scene files checks; only the meanings are here.
"""

from __future__ import annotations

import sys
from dataclasses import MISSING
from pathlib import Path
from typing import Any

from msfp_gen.buildings import file as buildings
from msfp_gen.buildings.bearing import BuildingBearing
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.storey import BaseSlab, Soil, Storey
from msfp_gen.common.fields import Choice, G, Quantity, Rule, ruled_fields
from msfp_gen.common.tables import markdown_table
from msfp_gen.motions.records import ScaleTo
from msfp_gen.scene.bearing import Bearing, Body, Surface
from msfp_gen.scene.file import motion_tables, schema
from msfp_gen.scene.file.motion_tables import LOADS, ROTATIONS, Components, Paths
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.scene_fields import InitialState, Limits, Stop
from msfp_gen.scene.sheet import Sheet
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.top import MassTop, NodeTop, PrescribedTop, RigTop
from msfp_gen.specification.layout import Auto, Layout

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import docs_folder, parser

INTRODUCTION = """# Scene files: every key

For engineers who write a scene. A scene is a TOML file. Numbers are SI; a text may carry a unit (`"75 mm"`). Unknown
keys are errors. The [tutorial](tutorial.md) builds a scene step by step, `msfp-gen explain SCENE` prints one as the
program reads it. Surfaces and bodies are listed from the bottom; body 1 is the base, `[[bearing.bodies]]` begins with
body 2. `docs/make_scene_reference.py` writes this page from the schema that reads scene files; do not edit it.
"""

KIND = "Which of the tables of this section it is."
NAME = "A label for figures and files."
CYCLES = "Number of full cycles after the smooth start."
LEAD = "Duration of the smooth start."
FORCE, MOMENT = "Force on the top plate along E1, E2, E3.", "Moment on the top plate along E1, E2, E3."
KNOTS, COEFFICIENTS = "Ends of the pieces, from zero.", "Piece, channel, ascending power of the time since the knot."
ROTATIONAL = "Against tilt and spin of the top plate."
LAW = "Parameter of a friction law ([friction.md](friction.md))."
DIRECTION = "Azimuth from E1 towards E2."

# Key -> meaning, for all tables; where a table means something else by a key, under "table.key".
MEANINGS = {
    "name": NAME,
    "kind": KIND,
    "bearing": "The bearing: `[bearing]`, or the name of a preset.",
    "motion": "Motion of the base: `[motion]`.",
    "top": "What stands on the bearing: `[top]`.",
    "load": "Load history on the top plate: `[load]` ([motion.md](motion.md#loads-on-the-top-plate)).",
    "top_rotation": "Rotation of the support of the top plate: `[top_rotation]`"
    " ([motion.md](motion.md#rotations-of-base-and-top)).",
    "effects": 'What is modelled: `[effects]`, or `"auto"` ([effects.md](effects.md)).',
    "solver": "Settings of the integration: `[solver]`.",
    "initial_state": "State at the start, `[initial_state]`, from which the displacement across the bearing counts;"
    " without it centred and at rest.",
    "stop": "Conditions that end the run early: `[stop]`.",
    "fidelity": "A cheaper model of this scene ([studies.md](studies.md#cheaper-models)).",
    "limits": "Limits of the device, with which the verdict of a run compares: `[limits]`"
    " ([results.md](results.md#the-verdict-of-a-run)).",
    "scene.duration": "Length of the run; without it the length of the motion.",
    "output_step": "Distance of the rows of results; without it every step of the solver.",
    "layout": "Numbers of bodies and surfaces: `n`, `m`, `p`.",
    "surfaces": "One table for each sliding surface.",
    "bodies": "One table for each moving body, from body 2 to the top plate.",
    "preset": "Name of a preset bearing; other keys change it. A list has one value for each surface or body.",
    "base_height": "Height of the base at its axis.",
    "gravity": "Acceleration of gravity, by default of PEER 2017/07. The unit g of texts, records and figures is the"
    f" standard gravity, {G}.",
    "base_rim_radius": "Radius of the edge of the base that meets a rim, where the base is a slider.",
    "base_rim_offset": "Distance of that edge from its upper face.",
    "base_centroid": "Centre of mass of the base above its bottom (3.2); no result of a run depends on it.",
    "sheet": "The data sheet of the bearing ([bearing.md](bearing.md#what-follows-from-a-data-sheet)).",
    "device": "Kind of the bearing.",
    "bearing.sheet.sheet.radius": "R of each surface. Lists go from the bottom, of all surfaces or of the lower half.",
    "effective_radius": "R_eff, from the centre of the sphere to the pivot. Two of radius, this and height are given.",
    "bearing.sheet.sheet.height": "h = R - R_eff of each surface, from it to the pivot.",
    "bearing.sheet.sheet.friction": "Coefficient of each surface at the pivot.",
    "bearing.sheet.sheet.friction_lower": "Its lower value, for `msfp-gen bound`.",
    "bearing.sheet.sheet.friction_upper": "Its upper value.",
    "friction_lower": "Lower values of friction of all surfaces, bottom first, for `msfp-gen bound` without factors.",
    "friction_upper": "Upper values.",
    "slider_diameter": "Of the face that slides in each surface.",
    "dish_diameter": "Of each surface, to its rim.",
    "bearing.sheet.sheet.capacity": "Arc of the slider to rim contact, in place of dish_diameter.",
    "bearing.sheet.sheet.yield_displacement": "Of each surface before it slides.",
    "bearing.sheet.sheet.axial_load": "At rest; effective properties in kN refer to it.",
    "plate_height": "Of the base and of the top plate at their axes.",
    "density": "Of the bodies, whose masses and inertias follow from it.",
    "n": "Number of bodies, with base and top plate; n = m + p + 1.",
    "m": "Number of surfaces that are concave up, the lower ones.",
    "p": "Number of surfaces that are concave down, above them.",
    "radius": "Radius R of the sphere.",
    "capacity": "Sliding displacement at which the slider meets the rim.",
    "friction": "Friction coefficient.",
    "effects.friction": "What the friction coefficient depends on ([friction.md](friction.md)).",
    "yield_displacement": "Slip over which friction builds up; 0.25 to 1 mm in practice.",
    "rim_stiffness": "Stiffness of the rim ([bearing.md](bearing.md#how-stiff-is-a-rim)).",
    "rim_damping": "Damping of the rim.",
    "seat_stiffness": "Stiffness of the unilateral contact, with uplift; left out: 5e9, or more below a stiffer top "
    "([uplift.md](uplift.md#the-model)).",
    "seat_damping": "Damping of that contact, over its stiffness and compression.",
    "contact_damping": "Damping time T of the sheared contact ([friction.md](friction.md#friction-before-sliding)).",
    "friction_at": "What friction coefficients refer to: the surfaces, or the pivot as in data sheets"
    " ([bearing.md](bearing.md#why-a-run-and-the-published-formulas-differ)).",
    **dict.fromkeys(
        (
            "friction_slow",
            "velocity_rate",
            "velocity_drop",
            "reference_pressure",
            "pressure_ratio",
            "temperature_ratio",
            "patch_radius",
            "conductivity",
            "diffusivity",
            "plate_thickness",
            "start_temperature",
            "c1",
            "c2",
            "c3",
            "c4",
        ),
        LAW,
    ),
    "height": "Height of the body at its axis.",
    "centroid": "z, distance of the centre of mass from the bottom of a body above a concave-up surface (3.6), from"
    " the top of one above a concave-down surface (3.10).",
    "mass": "Mass.",
    "inertia": "Moments of inertia (transverse, axial) about the centre of mass, or one value for both.",
    "rim_radius": "Radius of the edge that meets a rim; needed of sliders.",
    "rim_offset": "Distance of that edge from the face on that surface, along the axis (3.25).",
    "hold": "Time without motion after the end.",
    "rotation": "Rotation of the base: a table as `[top_rotation]`.",
    "amplitude": "Amplitude of the displacement.",
    "frequency": "Frequency.",
    "angular_frequency": "Angular frequency.",
    "direction": DIRECTION,
    "cycles": CYCLES,
    "lead_in": LEAD,
    "acceleration": "Constant acceleration from rest.",
    "duration": "Duration.",
    "motion.record.duration": "Length of the window; without it to the end of the record.",
    "records.duration": "Length of the window; without it to the end of the record.",
    "file": "File of the record, or one for each component; relative to the scene file ([motion.md](motion.md)).",
    "motion.arrays.file": "CSV file with columns of time and displacement, velocity or acceleration.",
    "bundled": "Name of a record that comes with the package, in place of `file`.",
    "unit": "Unit of the numbers in files without a header.",
    "motion.record.time_step": "Between the rows of files without a header and without a column of times.",
    "records.time_step": "Between the rows of files without a header and without a column of times.",
    "components": "Components that are kept; the others are zero.",
    "rotated_by": "Rotation of the horizontal components about E3, from E1 towards E2.",
    "scale": "Factor on the motion.",
    "scale_to": "Target of scaling: `[motion.scale_to]` ([motion.md](motion.md#scaling)).",
    "start": "Start of the window; without it the strongest window of the given duration.",
    "correct": "Whether the baseline is corrected.",
    "corner": "Corner frequency of the high-pass filter.",
    "taper": "Duration of the smooth start and end.",
    "knots": KNOTS,
    "coefficients": COEFFICIENTS,
    "jumps": "Knots at which the acceleration may jump.",
    "max_step": "Longest step of the integration.",
    "metadata": "Origin of the motion, for information.",
    "pga": "Peak ground acceleration.",
    "sa": "Pseudo-acceleration at `period`.",
    "period": "Period of `sa`.",
    "sds": "Ordinate of the design spectrum at short periods.",
    "sd1": "Ordinate of the design spectrum at 1 s.",
    "ag": "Design ground acceleration of EN 1998-1 on ground of type A, with the importance factor.",
    "ground": "Type of the ground of EN 1998-1.",
    "spectrum_type": "Type of the spectrum of EN 1998-1: 1, or 2 for magnitudes up to 5.5.",
    "spectrum": "Target spectrum: path of a CSV file with `period [s], Sa [g]`, or pairs of s and m/s^2.",
    "long_period": "Transition period T_L of the design spectrum.",
    "between": "Shortest and longest period of the fit.",
    "component": "Component or measure that meets the target.",
    "damping": "Damping of the horizontal springs.",
    "motion.record.scale_to.damping": "Damping ratio of the spectra.",
    "scale_to.damping": "Damping ratio of the spectra.",
    "least_share": "Least share of the target that the mean spectrum reaches; without it least squares.",
    "axial_load": "Constant load, downwards.",
    "stiffness": "Stiffness of the horizontal springs that hold the top plate.",
    "rotational_stiffness": ROTATIONAL,
    "rotational_damping": ROTATIONAL,
    "vertical_stiffness": "Vertical stiffness of the rig, or below the supported mass; without it rigid.",
    "vertical_damping": "Vertical damping beside it.",
    "force": FORCE,
    "moment": MOMENT,
    "top.mass.mass": "Supported mass.",
    "top.mass.height": "Height of its centre of mass above the top plate.",
    "phase": "Phase of the sine.",
    "time": "Times of the samples.",
    "psi": "Rotation about E1.",
    "theta": "Rotation about E2.",
    "angles": "psi, theta at these times.",
    "dimension": "Motion in one vertical plane, or in space.",
    "sliders": "Whether sliders have inertia.",
    "rims": "Whether sliders are stopped by rims.",
    "uplift": "Whether surfaces can open.",
    "spin": "Rotation of the bodies about their own axes.",
    "bouc_wen": "Hysteresis law: one switch for each axis, or one along the slip.",
    "friction_law": 'Formula of the friction coefficient, with `friction = "custom"`.',
    "error": "Permitted effect of what is left out, as a share of the friction force.",
    "method": "Method of integration ([accuracy.md](accuracy.md)).",
    "rtol": "Relative tolerance of a step.",
    "atol_angle": "Absolute tolerance of angles; without it a hundredth of `rtol`.",
    "solver.max_step": "Longest step; without it the resolution of the motion.",
    "first_step": "First step; without it chosen by the method.",
    "max_steps": "Number of steps after which a run ends with the status `steps`.",
    "q": "psi, theta, phi of bodies 2 to n.",
    "v": "Their rates.",
    "h": "Friction state Y, Z of each surface, within the unit disc.",
    "building": "The superstructure and its bearings: `[building]` ([buildings.md](buildings.md)).",
    "bearings": "Bearings by name, tables as `[bearing]`, for several places of a building.",
    "building_scene.motion": "Motion of the ground: `[motion]`.",
    "building_scene.duration": "Length of the run; without it the length of the motion.",
    "building_scene.solver": "Settings of the integration, of building and bearings together: `[solver]`.",
    "building_scene.output_step": "Distance of the rows of results, at which steps end; without it 10 ms.",
    "building.mass": "File of the mass matrix (`.mtx`, `.npz`), in place of `base` and `storey`.",
    "building.stiffness": "File of the stiffness matrix.",
    "building.damping": "File of the damping matrix; without it by `damping_ratio`.",
    "damping_ratio": "Damping ratio of the modes on fixed attachments.",
    "rayleigh_frequencies": "Two frequencies at which Rayleigh damping has that ratio.",
    "highest_frequency": "Reduction by Craig and Bampton: modes up to this frequency are kept.",
    "base": "The slab above the bearings: `[building.base]`.",
    "storey": "One table for each storey, from below: `[[building.storey]]`.",
    "node": "One table for each node of matrices: `[[building.node]]`.",
    "building.bearing": "One table for each bearing, or for each grid of bearings: `[[building.bearing]]`.",
    "interface": "Between top plate and building: `[building.interface]`, for all bearings without one of their own.",
    "soil": "Springs of the ground below the bearings: `[building.soil]`, for all without one of their own.",
    "building.effects": "`[effects]` of all bearings that have none of their own.",
    "building.base.mass": "Mass of the slab.",
    "building.base.inertia": "Moments of inertia about E1, E2, E3 through the centre of mass.",
    "mass_centre": "Centre of mass in plan.",
    "building.storey.height": "Height above the floor below.",
    "building.storey.mass": "Mass of the floor.",
    "building.storey.inertia": "Moments of inertia of the floor about E1, E2, E3 through the centre of mass.",
    "building.storey.stiffness": "Of all columns along E1 and E2, or one number for both.",
    "torsional_stiffness": "About E3 through the stiffness centre.",
    "stiffness_centre": "Stiffness centre in plan.",
    "building.storey.vertical_stiffness": "Of columns that shorten; without it floors follow the base vertically.",
    "rocking_stiffness": "About E1 and E2, with `vertical_stiffness`.",
    "coordinates": "Indices from 0 of its displacements along E1, E2, E3 and rotations about them.",
    "building.node.name": "Name of the node, to which bearings refer.",
    "building.node.position": "Its position.",
    "building.bearing.bearing": "Name of a table in `[bearings]` or of a preset, or a table as `[bearing]`.",
    "building.bearing.position": "Position in plan; without it the position of the node.",
    "building.bearing.name": "A label for messages and results; of a grid, the beginning of the names of its bearings.",
    "building.bearing.grid": "In place of `position`: bearings at all crossings of two sets of lines.",
    "building.bearing.grid.x": "Places of the lines A, B, ... along E1.",
    "building.bearing.grid.y": "Places of the lines 1, 2, ... along E2.",
    "building.bearing.node": "Node to which a rigid link attaches the bearing.",
    "building.bearing.interface": "As `[building.interface]`, for this bearing.",
    "building.bearing.soil": "As `[building.soil]`, for this bearing.",
    "building.bearing.effects": "As `[effects]`, for this bearing.",
    "building.bearing.motion": "Motion of the ground below it, as `[motion]`; without it the motion of the scene.",
    "building.interface.stiffness": "Along E1 and E2.",
    "building.interface.vertical_stiffness": "Along E3: steel, liner, column head, ground.",
    "building.interface.vertical_damping": "Along E3.",
    "building.interface.rotational_stiffness": "Against tilt of the top plate relative to the building.",
    "building.interface.rotational_damping": "Against the rate of that tilt.",
    "building.interface.damping": "Along E1 and E2.",
    "building.soil.stiffness": "Along E1 and E2, below each bearing.",
    "building.soil.vertical_stiffness": "Along E3.",
    "building.soil.damping": "Along E1 and E2.",
    "building.soil.vertical_damping": "Along E3.",
    "building.soil.rotational_stiffness": "Not modelled: giving it is an error.",
    "building.soil.mass": "Not modelled: giving it is an error.",
    "displacement": "Horizontal displacement across the bearing.",
    "limits.rim_force": "Of a rim; without it a third of the axial load at rest, or of the largest N where it varies.",
    "limits.rim_compression": "Of a rim; without it a tenth of the capacity of its surface.",
    "limits.uplift_height": "Clearance between the faces of a surface; without it the `rim_offset` of its slider.",
    "limits.uplift_duration": "Longest time for which a surface is open.",
    "limits.temperature": "At the centre of a surface.",
    "limits.axial_load": "Largest vertical force on what is carried; without it none.",
    "limits.displacement": "Largest horizontal displacement across a bearing, from its start; without it none.",
    "all_rims": "Whether contact at every rim ends the run.",
}

# Heading, path of the table in the schema, class whose fields have the rules.
SECTIONS: list[tuple[str, str, type]] = [
    ("The scene", "", Scene),
    ("`[bearing]`", "bearing.full", Bearing),
    ("`sheet` of a bearing", "bearing.sheet.sheet", Sheet),
    ("`layout` of a bearing", "bearing.full.layout", Layout),
    ("`[[bearing.surfaces]]`", "bearing.full.surfaces", Surface),
    ("`[[bearing.bodies]]`", "bearing.full.bodies", Body),
    *((f'`[motion]`, `kind = "{kind}"`', f"motion.{kind}", table) for kind, table in motion_tables.KINDS.items()),
    ("`[motion.scale_to]`", "motion.record.scale_to", ScaleTo),
    *((f'`[top]`, `kind = "{kind.kind}"`', f"top.{kind.kind}", kind) for kind in (RigTop, PrescribedTop, MassTop)),
    *((f'`[load]`, `kind = "{kind}"`', f"load.{kind}", table) for kind, table in LOADS.items()),
    *((f'`[top_rotation]`, `kind = "{kind}"`', f"top_rotation.{kind}", table) for kind, table in ROTATIONS.items()),
    ("`[effects]`", "effects", Auto),
    ("`[solver]`", "solver", Solver),
    ("`[initial_state]`", "initial_state", InitialState),
    ("`[stop]`", "stop", Stop),
    ("`[limits]`", "limits", Limits),
    ("A building on bearings", "", BuildingScene),
    ("`[building]`", "building", buildings.FrameTable),
    ("`[building.base]`", "building.base", BaseSlab),
    ("`[[building.storey]]`", "building.storey", Storey),
    ("`[[building.node]]`", "building.node", buildings.NodeTable),
    ("`[[building.bearing]]`", "building.bearing", BuildingBearing),
    ("`grid` of `[[building.bearing]]`", "building.bearing.grid", buildings.GridTable),
    ("`[building.interface]`", "building.interface", NodeTop),
    ("`[building.soil]`", "building.soil", Soil),
    ("Suites: `[[records]]`", "records", motion_tables.RecordMotion),
    ("Suites: `[scale_to]`", "scale_to", ScaleTo),
]


# Keys that are no field of a part.
EXTRA: dict[str, tuple[Rule, Any]] = {"friction_at": (Choice(("surface", "pivot")), "surface")}
# Every table of the files of scenes and suites, by its path.
TABLES = {
    "bearing": schema.tables_of(schema.SCENE) | schema.tables_of(schema.SUITE),
    "building": schema.tables_of(buildings.SCENE),
}
TABLES["bearing"][""] = schema.SCENE


def meaning(path: str, key: str) -> str:
    """The meaning of a key of the table at `path`: the longest entry that fits. Raises KeyError where there is none."""
    head = path.split(".")[0] if path else "scene"
    for name in (f"{path}.{key}", f"{head}.{key}"):
        if name in MEANINGS:
            return MEANINGS[name]
    return MEANINGS[key]


def takes(rule: Rule | None) -> str:
    """What a key takes: a number with its unit and bounds, one of some words, a text, a list, or a table."""
    if isinstance(rule, Quantity):
        bounds = {">": rule.above, "≥": rule.least, "<": rule.below}
        limits = ",".join(f" {sign} {bound:g}" for sign, bound in bounds.items() if bound is not None)
        noun = "whole number" if rule.whole else "number"
        if rule.shape:
            noun = "list of " + " x ".join("any" if count is None else str(count) for count in rule.shape) + " numbers"
        return f"{noun}{limits}" + (f" [{rule.unit}]" if rule.unit else "")
    if isinstance(rule, Choice):
        return ", ".join(str(word).lower() if isinstance(word, bool) else f'`"{word}"`' for word in rule.words)
    if isinstance(rule, Paths):
        return "text, or a list of texts"
    if isinstance(rule, Components):
        return '`"E1"`, `"E2"`, `"E3"` in a list'
    return "table" if rule is None else "text"


def default_of(given: Any) -> str:
    """The default of a key, as it is written in a scene file."""
    if given is MISSING:
        return "required"
    if given is None or given == "" or given == ():
        return "-"
    if isinstance(given, bool):
        return str(given).lower()
    return f'`"{given}"`' if isinstance(given, str) else f"{given:g}" if isinstance(given, float | int) else str(given)


def section(title: str, path: str, kind: type) -> str:
    """One table of the page: the keys in the order of the schema, those that are required first."""
    rules = {name: (rule, default) for name, rule, default in ruled_fields(kind)}
    rows = []
    tables = TABLES["building" if kind is BuildingScene or path.startswith("building") else "bearing"]
    path = path or ("" if kind is Scene else "building_scene")
    keys = tables["" if path == "building_scene" else path].keys
    for key in sorted(keys, key=lambda name: not keys[name].required):
        rule, given = EXTRA.get(key) or rules.get(key, (None, MISSING if keys[key].required else None))
        shown = f'`"{kind.kind}"`' if key == "kind" else takes(rule)  # type: ignore[attr-defined]
        if key == "least_share":
            shown = takes(Quantity("", above=0.0))
        rows.append((f"`{key}`", shown, default_of(given), meaning(path, key)))
    return f"## {title}\n\n{markdown_table(('key', 'takes', 'default', 'meaning'), rows)}"


def page() -> str:
    """The text of docs/scene.md."""
    parts = [INTRODUCTION, *(section(*each) for each in SECTIONS)]
    preset = (
        "## `[bearing]` from a preset\n\n"
        "`preset` and any key of `[bearing]`, `[[bearing.surfaces]]` and `[[bearing.bodies]]`: one value for all\n"
        "surfaces or bodies, or a list with one for each, bottom first. `msfp-gen presets` lists the bearings.\n\n"
        '```toml\nbearing = { preset = "fenz-tfp", friction = [0.04, 0.02, 0.02, 0.08] }\n```\n\n'
        "`sheet` in place of `preset` makes the bearing of its data sheet; the same keys change it, except friction,\n"
        "which is in the sheet."
    )
    parts.insert(7, preset)
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    parser(__doc__).parse_args()
    target = docs_folder() / "scene.md"
    target.write_text(page(), encoding="utf-8")
    print(f"wrote {target}")
