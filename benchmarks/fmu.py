"""Costs of a unit (FMU) under FMPy: `python benchmarks/fmu.py`, with FMPy. Rows of docs/other-programs.md.

CPU time of a communication step of a triple pendulum under 60 mm of motion, over that of a trial of `TwoPort`; and a
supported mass by Co-Simulation and by CVODE: its time and its error against a tight tolerance.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time

import numpy as np
from quick import installed, parser, pick

from msfp_gen import Motion, Scene, Top, TwoPort, presets
from msfp_gen.embedding.unit import write_fmu

BEARING, LOAD = presets.bearing("fenz-tfp").replace(contact_damping=1e-4), 112e3
STEP, COUNT, ROUNDS = 0.01, 200, pick(5, 1)
STILL = Motion(np.array([0.0, 1.0]), np.zeros((1, 6, 6)))
INPUTS = list(range(1, 37))


def motion(time: float, amplitude: float = 0.06, end: int = 1) -> np.ndarray:
    """Motion of both ends at a time: one of them swings along E1 with a period of 2 s, from rest."""
    w, found = np.pi, np.zeros((2, 3, 6))
    s, c = np.sin(w * time), np.cos(w * time)
    found[end, :, 0] = amplitude * s**3, amplitude * 3 * w * s**2 * c, amplitude * 3 * w**2 * (2 * s * c**2 - s**3)
    return found


def least(once: Callable[[], None]) -> float:
    """Least CPU time of a step [s], of several runs."""
    times = []
    for _ in range(ROUNDS):
        begin = process_time()
        once()
        times.append((process_time() - begin) / COUNT)
    return min(times)


def by_two_port() -> None:
    """Trials in Python."""
    port = TwoPort.of_scene(rig())
    for i in range(COUNT):
        port.trial((i + 1) * STEP, *motion((i + 1) * STEP))
        port.commit()


def rig() -> Scene:
    """A bearing whose ends move."""
    return Scene(BEARING, STILL, Top.rig(LOAD, 1e7, 1e4, 1e6, 1e3, 5e7, 1e5))


def mass() -> Scene:
    """A bearing under a supported mass."""
    return Scene(BEARING, STILL, Top.mass(11e3, 5e3, 0.5, rotational_stiffness=1e7, rotational_damping=1e4))


def by_unit(path: Path, folder: str, derivatives: bool = False, states: bool = False) -> None:
    """Communication steps under FMPy, with all directional derivatives or a state that is kept and set back."""
    from fmpy import read_model_description
    from fmpy.fmi2 import FMU2Slave

    description = read_model_description(str(path))
    outputs = [v.valueReference for v in description.modelVariables if v.causality == "output"][:12]
    switch = next(v.valueReference for v in description.modelVariables if v.name == "inputs_at_step_end")
    unit = FMU2Slave(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="unit",
    )
    unit.instantiate()
    unit.setupExperiment(startTime=0.0)
    unit.setBoolean([switch], [True])
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    time = 0.0
    for _ in range(COUNT):
        unit.setReal(INPUTS, motion(time + STEP).ravel().tolist())
        unit.doStep(time, STEP)
        if states:
            state = unit.getFMUstate()
            unit.setFMUstate(state)
            unit.freeFMUstate(state)
        time += STEP
        unit.getReal(outputs)
        for end in (0, 18) if derivatives else ():
            for freedom in range(6):
                unit.getDirectionalDerivative(outputs, [INPUTS[end + freedom]], [1.0])
    unit.freeInstance()


def exchange(path: Path) -> list[tuple[str, float, float]]:
    """Of a supported mass over 0.5 s: what runs it, CPU time [s], error of the sliding displacement [-]."""
    from fmpy import read_model_description, simulate_fmu

    names = [v.name for v in read_model_description(str(path)).modelVariables if v.causality == "input"]
    times = np.arange(0.0, 0.5001, 0.005)
    given = np.zeros(len(times), dtype=[(name, float) for name in ["time", *names]])
    given["time"] = times
    for i, time in enumerate(times):
        for name, value in zip(names, motion(time, 0.04, 0).ravel(), strict=True):
            given[name][i] = value
    wanted = "surface[1].sliding"
    options = {"stop_time": 0.5, "input": given, "output": [wanted], "output_interval": 0.005}
    kinds = [("Co-Simulation", {"fmi_type": "CoSimulation"})]
    kinds += [
        (f"CVODE, tolerance {tolerance:g}", {"fmi_type": "ModelExchange", "relative_tolerance": tolerance})
        for tolerance in (1e-4, 1e-6, 1e-8)
    ]
    exact = simulate_fmu(str(path), fmi_type="ModelExchange", relative_tolerance=1e-9, **options)[wanted]
    found = []
    for text, kind in kinds:
        begin = process_time()
        result = simulate_fmu(str(path), **kind, **options)[wanted]
        found.append((text, process_time() - begin, float(np.abs(result - exact).max() / np.abs(exact).max())))
    return found


def main() -> None:
    """Print the rows of both tables."""
    parser(__doc__).parse_args()
    if not installed("fmpy", "both tables"):
        return
    from fmpy import extract

    with tempfile.TemporaryDirectory() as name:
        path = write_fmu(rig(), Path(name) / "bearing.fmu").path
        folder = str(extract(str(path), str(Path(name) / "unit")))
        trial = least(by_two_port)
        rows = {
            "`TwoPort`, trial and commit": trial,
            "unit, step": least(lambda: by_unit(path, folder)),
            "unit, step, state kept and set back": least(lambda: by_unit(path, folder, states=True)),
            "unit, step, 12 directional derivatives": least(lambda: by_unit(path, folder, derivatives=True)),
        }
        print("| | microseconds | over a trial |\n|---|---|---|")
        for text, time in rows.items():
            print(f"| {text} | {1e6 * time:.0f} | {time / trial:.1f} |")
        units = exchange(write_fmu(mass(), Path(name) / "isolated.fmu", exchange=True).path)
        print("\n| | time, over Co-Simulation | error of the sliding displacement |\n|---|---|---|")
        for text, time, error in units:
            print(f"| {text} | {time / units[0][1]:.1f} | {100 * error:.2f} % |")


if __name__ == "__main__":
    main()
