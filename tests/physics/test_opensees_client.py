"""Served bearings in OpenSees: a linear spring, its own triple pendulum, a frame on four bearings, a failure.

Skipped where OpenSeesPy is not installed: `pip install -e .[opensees]`.
"""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest
from support import ROOT, Array
from support.ends import BEARING, LOAD
from support.generic_client import serving

from msfp_gen import Bearing, Body, Effects, Layout, Surface, Top, TwoPort, load_scene, presets
from msfp_gen.studies.accuracy.series import Series

pytestmark = pytest.mark.skipif(
    not (find_spec("openseespy") or find_spec("openseespylinux")), reason="OpenSeesPy is not installed"
)


def analysis(name: str, **arguments: Any) -> tuple[Any, str]:
    """The answer of an analysis in a process of its own, and what it printed as errors."""
    command = [sys.executable, str(ROOT / "tests" / "support" / "opensees_client.py"), name, json.dumps(arguments)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=500)
    assert run.returncode == 0, run.stderr
    lines = [line for line in run.stdout.splitlines() if line.startswith(("[", "{"))]
    return json.loads(lines[-1]), run.stderr


def test_vertically_a_bearing_equals_a_native_spring():
    """The stack is rigid, so the interface alone deforms: the same motion to rounding."""
    stiffness = 6.7e7
    port = TwoPort(BEARING, Top.node(1e8, stiffness, 1e6), LOAD)
    with serving(port) as served:
        mass, number = LOAD / BEARING.gravity, served.ports[0]
        found, _ = analysis("vertical", port=number, mass=mass, stiffness=stiffness, load=LOAD, step=2e-3, count=150)
    bearing, native = np.array(found)
    assert np.abs(native).max() > 0.5 * LOAD / stiffness
    assert np.abs(bearing - native).max() < 1e-9 * np.abs(native).max()
    assert served.failed == 0


# Radii of Dao's example times four and a third of its friction: tilts below 0.06 rad, as the element assumes.
RADII, FRICTIONS, CAPACITIES, YIELD, WEIGHT = (1.44, 5.0, 5.0), (0.004, 0.017, 0.047), (0.1, 0.2, 0.2), 1e-3, 1000.0


def shallow(yielding: float = YIELD) -> Bearing:
    """A triple pendulum with plates and sliders of 2 mm, so that effective radii are the radii."""
    values = [(RADII[1], FRICTIONS[1], CAPACITIES[1])] + 2 * [(RADII[0], FRICTIONS[0], CAPACITIES[0])]
    values.append((RADII[2], FRICTIONS[2], CAPACITIES[2]))
    surfaces = [Surface(r, c, mu, yielding, rim_stiffness=1e6, contact_damping=1e-4) for r, mu, c in values]
    light = [Body(height=2e-3, centroid=1e-3, mass=0.01, inertia=(1e-6, 1e-6), rim_radius=0.05) for _ in range(4)]
    return Bearing(Layout.tfp(), 2e-3, surfaces, light, gravity=0.0)


@pytest.mark.parametrize(
    ("across", "cycles", "count", "yields", "parts", "accuracy"),
    [
        # Along one axis, to 1 %: sliding in the element begins so late that its loop is inside the exact one, by 3 % of
        # the force with 1 mm; it follows smaller ones only in short steps.
        (0.0, 1.0, 100, (1e-4, 3e-4), 20, 0.01),
        (0.5, 2.0, 400, (YIELD, YIELD), 1, 0.04),  # in two directions
    ],
)
def test_a_shallow_triple_pendulum_is_that_of_opensees(
    across: float, cycles: float, count: int, yields: tuple[float, float], parts: int, accuracy: float
):
    """Forces under imposed displacement, against the largest. yields: small yield displacements here and there [m].

    The element takes for each outer surface the coefficient at which a force begins to move it. In a stack of bodies
    this is (mu R - mu' R')/(R - R'), with ' for the next surface inwards (docs/devices.md). Its first step after the
    axial load, which gives hardly any force, is left out.
    """
    bearing = shallow(yields[0])
    links = {link.surface: link for link in Series(bearing, rims=True).links}
    inner, lower, upper = links[1], links[0], links[3]
    radii = [link.effective for link in (inner, lower, upper)]
    assert radii == pytest.approx(RADII, rel=2e-3)
    angle = np.linspace(0.0, 2 * np.pi * cycles, count + 1)[1:]
    rows = (0.29 * np.column_stack([np.sin(angle), across * np.sin(2 * angle)])).tolist()
    inside = FRICTIONS[0] * RADII[0]
    outer = [(mu * r - inside) / (r - RADII[0]) for mu, r in zip(FRICTIONS[1:], RADII[1:], strict=True)]
    native = [*radii, *CAPACITIES, WEIGHT, yields[1], 1e10, 0.1, 1e-5]
    frictions = [FRICTIONS[0], *outer]
    expected, _ = analysis("path", port=0, native=native, frictions=frictions, load=WEIGHT, rows=rows, parts=parts)
    effects = Effects(bouc_wen="plastic", sliders="massless")
    port = TwoPort(bearing, Top.node(1e7, 100.0, 1e6), WEIGHT, effects)
    with serving(port) as served:
        found, _ = analysis("path", port=served.ports[0], native=None, frictions=[], load=WEIGHT, rows=rows)
    difference = np.abs(np.array(found) - np.array(expected))[1:].max()
    assert difference < accuracy * np.abs(expected).max()
    assert np.abs(expected).max() > 0.05 * WEIGHT


def ground(step: float, start: float, duration: float, scale: float = 1.0) -> Array:
    """Horizontal accelerations of a recorded motion, shape (2, times) [m/s^2]."""
    times = start + np.arange(round(duration / step) + 1) * step
    record: Array = scale * load_scene("ridgecrest-clc").motion.acceleration(times)[:, :2].T
    return record * np.minimum(1.0, np.arange(len(times)) * step / 0.2)  # from rest


def four_ports() -> list[TwoPort]:
    bearing = presets.bearing("prototype-tfp").replace(gravity=9.81)
    return [TwoPort(bearing, Top.node(1e8, 6.7e7, 1e6), LOAD) for _ in range(4)]


@pytest.mark.slow
def test_a_frame_on_four_bearings_runs_a_record():
    """It isolates: the bearings move, alike up to torsion and overturning, and carry the weight together."""
    ports, step = four_ports(), 0.01
    record = ground(step, 6.0, 3.0)
    with serving(*ports) as served:
        (status, moved, reactions), _ = analysis(
            "frame", ports=served.ports, load=LOAD, step=step, ground=record.tolist(), height=4.0, period=0.4
        )
    assert status == 0 and served.failed == 0
    path, weights = np.array(moved), np.array(reactions)
    assert 0.02 < np.abs(path).max() < 0.35
    assert np.abs(path - path.mean(axis=1, keepdims=True)).max() < 1e-2 * np.abs(path).max()
    bodies = 9.81 * sum(body.mass for body in ports[0].bearing.bodies)
    assert weights.sum(axis=1).mean() == pytest.approx(4 * (LOAD + bodies), rel=5e-3)
    assert weights.std() > 0.02 * LOAD  # overturning moves load from one side to the other


def test_a_failed_bearing_ends_the_analysis_with_a_message():
    """The client stops with its own code; the server says why. The other bearings are served until the client ends."""
    ports, step = four_ports(), 0.01
    record = ground(step, 6.0, 2.0)
    record[0] += 40.0 * np.linspace(0.0, 1.0, record.shape[1])  # far beyond the capacity
    with serving(*ports) as served:
        (status, moved, _), errors = analysis(
            "frame", ports=served.ports, load=LOAD, step=step, ground=record.tolist(), height=4.0, period=0.4
        )
    assert status == -3 and 0 < len(moved) < record.shape[1] - 1
    assert "nan" in errors and served.failed >= 1
    assert any("two-port: stopped at t = " in line for line in served.lines)
