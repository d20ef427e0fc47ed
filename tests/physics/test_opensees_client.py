"""Served bearings in OpenSees: a linear spring, its own triple pendulum, a frame on four bearings, a failure.

Skipped where OpenSeesPy cannot be imported: `pip install -e .[opensees]`.
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from support import ROOT, Array, links
from support.ends import BEARING, LOAD
from support.generic_client import serving
from support.links import WEIGHT
from support.peers import opensees_runs

from msfp_gen import Effects, Top, TwoPort, load_scene, presets
from msfp_gen.studies.accuracy.series import Series

pytestmark = pytest.mark.skipif(not opensees_runs(), reason="OpenSeesPy cannot be imported")


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


def native_and_served(
    path: Array, frictions: tuple[float, ...], yields: tuple[float, float], parts: int
) -> tuple[Array, Array]:
    """Forces of TripleFrictionPendulum and of a served bearing under imposed displacement, shape (rows, 2) [N].

    yields: small yield displacements here and there [m]. parts: steps of the element from row to row.
    """
    bearing, rows = links.shallow(yields[0], frictions), path.tolist()
    found = {link.surface: link for link in Series(bearing, rims=True).links}
    radii = [found[surface].effective for surface in (1, 0, 3)]
    assert radii == pytest.approx(links.RADII, rel=2e-3)
    native = [*radii, *links.CAPACITIES, WEIGHT, yields[1], 1e10, 0.1, 1e-5]
    coefficients = links.beginning(frictions)
    element, _ = analysis("path", port=0, native=native, frictions=coefficients, load=WEIGHT, rows=rows, parts=parts)
    effects = Effects(bouc_wen="plastic", sliders="massless")
    with serving(TwoPort(bearing, Top.node(1e7, 100.0, 1e6), WEIGHT, effects)) as served:
        ours, _ = analysis("path", port=served.ports[0], native=None, frictions=[], load=WEIGHT, rows=rows)
    return np.array(element), np.array(ours)


@pytest.mark.parametrize(
    ("frictions", "path", "yields", "parts"),
    [
        # Along one axis. Sliding in the element begins so late that its loop is inside the exact one, by 3 % of the
        # force with 1 mm; it follows smaller ones only in short steps.
        (links.FRICTIONS, links.eight(0.29, 100, 0.0), (1e-4, 3e-4), 20),
        # In two directions, with hardly any friction of the inner surfaces, which acts on the outer ones in a stack
        # only. The element's elastic stiffness is of the inner friction over this yield displacement.
        ((2e-4, *links.FRICTIONS[1:]), links.eight(0.25, 100), (1e-4, 1e-5), 40),
    ],
)
def test_a_shallow_triple_pendulum_is_that_of_opensees(
    frictions: tuple[float, ...], path: Array, yields: tuple[float, float], parts: int
) -> None:
    """To 1 % of the largest force. The first step of the element after the axial load gives hardly any force."""
    element, ours = native_and_served(path, frictions, yields, parts)
    assert np.abs(element - ours)[1:].max() < 0.01 * np.abs(element).max()
    assert np.abs(element).max() > 0.04 * WEIGHT


def test_in_two_directions_the_element_is_a_series_and_the_bearing_a_stack() -> None:
    """With friction of the inner surfaces they differ by 5 %, as these two models of tilting links do."""
    path, yields = links.eight(0.2, 100), (1e-4, 3e-4)
    element, ours = native_and_served(path, links.FRICTIONS, yields, 20)
    series = links.series(path, links.beginning(links.FRICTIONS), yields[1], 20)
    stack = links.stack(path, links.FRICTIONS, yields[0])
    largest = np.abs(ours).max()
    # The links have the radii; the effective radii that the element is given are smaller by up to 1 mm.
    assert np.abs(element - series)[1:].max() < 1e-3 * largest
    assert np.abs(ours - stack).max() < 3e-3 * largest
    assert 0.04 * largest < np.abs(element - ours).max() < 0.055 * largest


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
