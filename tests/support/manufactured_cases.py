"""The cases of docs/verification.md: manufactured solutions of every effect, and runs against very short steps.

Soft yielding, heavy sliders and soft springs make every time scale of a case comparable with the motion, so that the
order of a method shows at errors well above rounding; no case is a device. The rig keeps the motion stable: a plate
that only loads hold up would turn over, and errors would grow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from msfp_gen import BaseSlab, Bearing, Building, BuildingBearing, BuildingScene, Effects, Motion, Solver, Storey, Top
from msfp_gen import simulate as simulated
from support import Array
from support.manufactured import LOAD, Case, Path, coefficients, spline
from support.stacks import a_stack

Push = Callable[[Array], Array]

BODY = {"mass": 200.0, "height": 0.05, "rim_radius": 0.05, "inertia": (60.0, 80.0)}
NONE = (0.0,) * 6
WEIGHT = (0.0, 0.0, -LOAD, 0.0, 0.0, 0.0)
MASS = {"mass": 2000.0, "inertia": 400.0, "height": 0.3, "rotational_stiffness": 4e5, "rotational_damping": 1e3}
PLANAR, SPATIAL = Effects(dimension="planar"), Effects()  # rims are far: the models of other tests
LAW = "mu * (1 - c1 * exp(-c2 * v))"
RIPPLE = 20.0  # frequency of the paths [rad/s]

ORDERS = {"implicit": 2, "esdirk4": 4, "dopri5": 5}
METHODS = {"implicit": (40, 80, 160), "esdirk4": (20, 40, 80), "dopri5": (80, 160, 320)}
SHORT = {"implicit": (80, 160, 320), "esdirk4": (80, 160, 320), "dopri5": (80, 160, 320)}
STIFF = {name: SHORT[name] for name in ("implicit", "esdirk4")}  # dopri5 is stable only where its error is rounding
UPLIFT = {"implicit": (80, 160, 320), "esdirk4": (40, 80, 160)}  # dopri5 is not for uplift
KNEES = dict.fromkeys(METHODS, (80, 113, 160, 226, 320, 453, 640))


def rig(**more: float) -> Top:
    usual = {"stiffness": 1e6, "damping": 2e3, "rotational_stiffness": 4e5, "rotational_damping": 1e3}
    return Top.rig(LOAD, **{**usual, **more})


def stack(radii: list[float], body: dict[str, Any] | None = None, **columns: Any) -> Bearing:
    """A single, double or triple pendulum with these radii."""
    layout = {1: (2, 1, 0), 2: (3, 1, 1), 4: (5, 2, 2)}[len(radii)]
    usual = {"yield_displacement": 0.05, "contact_damping": 0.0, "friction": 0.05, "capacity": 0.3}
    return a_stack(layout, radii, body={**BODY, **(body or {})}, **{**usual, **columns})


def double(**columns: Any) -> Bearing:
    return stack([1.0, 0.8], **columns)


def path(*phases: tuple[float, float], about_e1: float = 0.0) -> Path:
    """Tilts that grow with a ripple and without reversal. phases: of each body, about E1 and E2."""
    tilts = np.array([1.0, -1.0])[: len(phases), None] * np.array([about_e1, 1.0, 0.0])
    return Path(0.02 * tilts, 0.12 * tilts, 0.0045 * tilts, RIPPLE, np.array([(*row, 0.0) for row in phases]))


def planar(name: str, bearing: Bearing | None = None, **more: Any) -> Case:
    """A double pendulum in the plane."""
    usual = {"effects": PLANAR, "path": path((0.0, 0.0), (0.0, 1.0)), "sources": ("F1", "M2")}
    return Case(name, bearing or double(), **{**usual, "top": rig(), "load": NONE, "steps": METHODS, **more})


def spatial(name: str, bearing: Bearing | None = None, **more: Any) -> Case:
    """The same in space."""
    tilts = path((0.4, 0.0), (2.0, 1.0), about_e1=0.8)
    return planar(name, bearing, **{"effects": SPATIAL, "path": tilts, "sources": ("F1", "F2", "M1", "M2"), **more})


def uplift(name: str, separation: Array, ripple: Array, in_space: bool = True, **more: Any) -> Case:
    """One slider whose contact is soft: its compression is the negative of the separation, 0.05 m under the load."""
    bearing = stack([1.0], {"rim_radius": 0.3}, seat_stiffness=LOAD / 0.05, seat_damping=1.0)
    tilt = path((0.4, 0.0), about_e1=0.8 * in_space)
    start, slope, amplitude, phase = (
        np.concatenate([one, [other]], axis=1)
        for one, other in (
            (tilt.start, separation),
            (tilt.slope, np.zeros(3)),
            (tilt.amplitude, ripple),
            (tilt.phase, np.array([0.0, 0.5, 1.0])),
        )
    )
    both = Path(start, slope, amplitude, RIPPLE, phase)
    effects = replace(SPATIAL if in_space else PLANAR, uplift=True)
    sources = ("F1", "F2", "F3", "M1", "M2") if in_space else ("F1", "F3", "M2")
    given = {"effects": effects, "path": both, "sources": sources, "steps": UPLIFT, **more}
    return planar(name, bearing, **given)


def spin(name: str, word: str) -> Case:
    """One slider that also spins."""
    tilt, about_e3 = path((0.4, 0.0), about_e1=0.8), np.array([0.0, 0.0, 1.0])
    both = replace(tilt, slope=tilt.slope + 0.25 * about_e3, amplitude=tilt.amplitude + 0.005 * about_e3)
    effects = replace(SPATIAL, spin=word, bouc_wen="isotropic")
    return planar(name, stack([1.0]), effects=effects, path=both, sources=("F1", "F2", "M3"))


@cache
def smooth() -> dict[str, Case]:
    """Manufactured solutions that are smooth, by name."""
    pressed = {"capacity": 0.012, "rim_stiffness": 2e5, "rim_damping": 2e3}
    hot = {"reference_pressure": 1e6, "patch_radius": 0.2, "conductivity": 1.0, "velocity_rate": 10.0}
    slow = {"friction_slow": 0.02, "velocity_rate": 10.0}
    turning = {"amplitude": np.array([0.02, 0.03, 0.0]), "frequency": 15.0, "phase": np.array([0.0, 1.0, 0.0])}
    turned = {name: value[:2] if isinstance(value, np.ndarray) else value for name, value in turning.items()}
    flat = {"amplitude": np.array([0.0, 0.03, 0.0]), "frequency": 15.0}

    def with_(effects: Effects, **changes: Any) -> dict[str, Effects]:
        return {"effects": replace(effects, **changes)}

    made = [
        planar("planar"),
        spatial("spatial"),
        planar("isotropic hysteresis, planar", **with_(PLANAR, bouc_wen="isotropic")),
        spatial("isotropic hysteresis", **with_(SPATIAL, bouc_wen="isotropic")),
        spatial("contact damping", double(contact_damping=0.02)),
        spatial("plastic friction, stuck", double(yield_displacement=0.5), **with_(SPATIAL, bouc_wen="plastic")),
        spatial(
            "plastic friction, sliding",
            double(yield_displacement=0.02, contact_damping=0.03),
            friction=1.0,
            **with_(SPATIAL, bouc_wen="plastic"),
        ),
        planar("rims, planar", double(**pressed)),
        spatial("rims", double(**pressed)),
        planar("velocity law, planar", double(**slow), steps=SHORT, **with_(PLANAR, friction="velocity")),
        spatial("velocity law", double(**slow), steps=SHORT, **with_(SPATIAL, friction="velocity")),
        spatial("pressure and velocity law", double(**hot), steps=SHORT, **with_(SPATIAL, friction="pv")),
        planar("heat, planar", double(**hot), steps=STIFF, **with_(PLANAR, friction="pvt")),
        spatial("heat", double(**hot), steps=STIFF, **with_(SPATIAL, friction="pvt")),
        planar("heat of plates", double(**hot, plate_thickness=0.15), steps=STIFF, **with_(PLANAR, friction="pvtd")),
        spatial(
            "custom law",
            double(c1=0.5, c2=10.0),
            steps=SHORT,
            **with_(SPATIAL, friction="custom", friction_law=LAW),
        ),
        uplift("uplift, closed, planar", [2e-4, 0.0, -0.05], [1e-4, 0.0, -0.005], in_space=False),
        uplift(
            "uplift, heaving base, planar",
            [2e-4, 0.0, -0.05],
            [1e-4, 0.0, -0.005],
            in_space=False,
            sources=("F1", "a3", "M2"),
        ),
        uplift("uplift, closed", [2e-4, 1e-4, -0.05], [1e-4, 2e-4, -0.005]),
        uplift("uplift, on an edge", [0.03, 0.02, -0.05], [1e-3, 2e-3, -0.005]),
        uplift("uplift, open", [1e-3, 0.0, 5e-3], [1e-3, 1e-3, 1e-3], friction=0.0),
        spatial(
            "accelerated base",
            sources=("a1", "a2", "M1", "M2"),
            top=Top.mass(**MASS),
            load=WEIGHT,
            steps={**METHODS, "dopri5": (40, 60, 80)},  # the motion of the base is known to 1e-11
        ),
        spatial("rotating base", base=Path(**turning)),
        spatial("rotating support of the top", support=Path(**turned), **with_(SPATIAL, top_rotation=True)),
        planar(
            "both plates rotating, planar",
            base=Path(**flat, phase=0.5),
            support=Path(**{**flat, "amplitude": flat["amplitude"][:2]}),  # type: ignore[index]
            **with_(PLANAR, top_rotation=True),
        ),
        spatial("rig that holds its height", top=rig(vertical_stiffness=2e5, vertical_damping=1e3)),
        spatial("rigid mass", top=Top.mass(**MASS), load=WEIGHT, **with_(SPATIAL, rims=False)),
        planar("sprung top", top=Top.mass(**MASS, vertical_stiffness=2e6, vertical_damping=1e4), load=WEIGHT),
        spatial("massless sliders", steps=STIFF, **with_(SPATIAL, sliders="massless")),
        spin("spin held by the contact patch", "patch"),
        spin("free spin", "free"),
    ]
    return {case.name: case for case in made}


def quasistatic() -> dict[str, Case]:
    """Cases for quasi-static steps: without a force that depends on rates, and with dampers in the rig."""
    effects = replace(PLANAR, sliders="massless")
    still = rig(damping=0.0, rotational_damping=0.0)
    made = [planar("quasi-static", effects=effects, top=still), planar("quasi-static, dampers", effects=effects)]
    return {case.name: case for case in made}


def rise(duration: float) -> Push:
    """From 0 to 1 without kinks."""
    return lambda t: np.sin(np.pi * t / (2 * duration)) ** 4


def triple(name: str, effects: Effects, load: tuple[float, ...]) -> tuple[Case, Push]:
    """A triple pendulum, whose inner sliders no load reaches by itself. Nothing switches: it does not yield."""
    bearing = stack([1.0, 0.4, 0.4, 1.0], yield_displacement=0.5, contact_damping=0.05)
    still, law = Path(np.zeros((4, 3))), replace(effects, bouc_wen="plastic")
    steps = {**METHODS, "dopri5": (120, 160, 240)}
    return planar(name, bearing, effects=law, path=still, sources=(), load=load, steps=steps), rise(0.5)


def pushed(name: str, push: Push, bearing: Bearing, **effects: Any) -> tuple[Case, Push]:
    """A double pendulum under a horizontal load."""
    load, still = (1.5e5, *NONE[1:]), Path(np.zeros((2, 3)))
    return planar(name, bearing, effects=replace(PLANAR, **effects), path=still, sources=(), load=load), push


def resolvable() -> dict[str, tuple[Case, Push]]:
    """Smooth cases without a known solution, for `resolved`."""
    push = (1.5e5, 1e5, *NONE[2:])
    flat = triple("triple pendulum, planar", PLANAR, (push[0], *NONE[1:]))
    full = triple("triple pendulum", SPATIAL, push)
    return {case.name: (case, load) for case, load in (flat, full)}


def knees() -> dict[str, tuple[Case, Push]]:
    """Cases whose forces have a kink at a time that no step knows, for `resolved`."""
    there, back = rise(0.5), rise(0.25)
    made = [
        pushed("slip that reverses", back, double()),
        pushed("a rim met on the way", there, double(capacity=0.05, rim_stiffness=2e5), rims=True),
        pushed("plastic friction that yields", there, double(contact_damping=0.01), bouc_wen="plastic"),
        pushed("yielding in a hundredth of the slip", there, double(yield_displacement=1e-3)),
    ]
    return {case.name: (case, load) for case, load in made}


STOREYS = {"implicit": ((600, 1200), 1e-7), "esdirk4": ((100, 200), 1e-7)}  # steps, tolerance of Newton's method


def storeys(method: str, steps: int, rtol: float) -> tuple[int, Array]:
    """Three eccentric storeys on four double pendulums: steps taken, and positions of the floors at the end, (18,).

    Steps end at every hundredth of a second: they are even where `steps` is a multiple of 50.
    """
    end, mass = 0.5, 4 * LOAD / 9.8
    t = np.linspace(0.0, end, 241)
    pieces = np.zeros((len(t) - 1, 6, 6))
    pieces[:, :1] = coefficients(spline(t, 0.05 * rise(end)(t)[:, None], 5), t, 1)[:, :1]
    interface = Top.node(1e6, 1e7, 4e5, damping=2e3, vertical_damping=1e4, rotational_damping=1e3)
    floor = Storey(
        height=3.0,
        mass=0.2 * mass,
        inertia=(mass, mass, 2 * mass),
        stiffness=30.0 * mass,
        torsional_stiffness=3e3 * mass,
        mass_centre=(0.3, 0.1),
        vertical_stiffness=500.0 * mass,
        rocking_stiffness=4500.0 * mass,
    )
    building = Building.shear(BaseSlab(0.4 * mass, (3 * mass, 3 * mass, 6 * mass)), 3 * [floor], 0.05)
    bearing, effects = double(yield_displacement=0.5, contact_damping=0.05), replace(SPATIAL, bouc_wen="plastic")
    places = ((3.0, 2.0), (-3.0, 2.0), (-3.0, -2.0), (3.0, -2.0))
    bearings = [BuildingBearing(bearing, interface, place, effects=effects) for place in places]
    step = {"max_step": end / steps * (1 + 1e-12), "first_step": end / steps}
    solver = Solver(method=method, rtol=rtol, atol_angle=1e3, **step)  # type: ignore[arg-type]
    result = simulated(BuildingScene(building, bearings, Motion(t, pieces), solver, end))
    assert not result.counters["rejected_steps"]
    return result.counters["steps"], np.concatenate([result.node(f"floor {i}")[-1, 0] for i in (1, 2, 3)])


def storey_orders(method: str) -> tuple[list[float], float]:
    """Errors of the floors in runs with two numbers of steps, and the order, against very short steps of `esdirk4`."""
    exact = storeys("esdirk4", 2400, 1e-9)[1]
    counts, rtol = STOREYS[method]
    runs = [storeys(method, steps, rtol) for steps in counts]
    errors = [float(np.abs(found - exact).max() / np.abs(exact).max()) for _, found in runs]
    return errors, float(np.log(errors[0] / errors[1]) / np.log(runs[1][0] / runs[0][0]))
