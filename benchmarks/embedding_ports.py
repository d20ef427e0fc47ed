"""Costs of a step of a two-port by every way, for `embedding.py`: C, Fortran, Python, FMU, and OpenSees as a client."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from threading import Thread
from time import process_time

import fmu
import numpy as np
from quick import installed

from msfp_gen import Effects, Layout, Solver, Top, TwoPort, presets
from msfp_gen.embedding.library import export_library
from msfp_gen.embedding.server import Server
from msfp_gen.embedding.unit import write_fmu
from msfp_gen.jit.compiler import FLAGS, find_compiler
from msfp_gen.model.compiled import bodies_and_surfaces, top_values
from msfp_gen.specification.layout import ModelSpec

HERE = Path(__file__).parent
SPEC = ModelSpec(Layout.tfp(), Effects(top_rotation=True))
ANALYSIS_STEPS = 400  # of the worked example


def numbers() -> dict[str, float | int]:
    """Scalars of the programs in C and Fortran."""
    solver = Solver()
    given = {"gravity": fmu.BEARING.gravity, "load": fmu.LOAD, "step": fmu.STEP}
    return given | {
        "rtol": solver.rtol, "atol": solver.angle_tolerance, "count": fmu.COUNT, "rounds": fmu.ROUNDS
    }  # fmt: skip


def arrays() -> dict[str, np.ndarray]:
    """Values of the bearing and its interface in the order of the contract."""
    bodies, surfaces = bodies_and_surfaces(fmu.BEARING, SPEC.effects)
    return {"bodies": bodies, "surfaces": surfaces, "top": top_values(fmu.rig().top)}


def listed(values: Iterable[float], exponent: str = "e") -> list[str]:
    """Numbers as C reads them; exponent "d": as Fortran does."""
    return [f"{float(value):.17e}".replace("e", exponent) for value in np.ravel(list(values))]


def headers(folder: Path) -> None:
    """`values.h` and `values.inc`."""
    c, fortran = ['#include "msfp_5_2_2.h"'], []
    for name, value in numbers().items():
        whole = isinstance(value, int)
        c.append(f"#define {name.upper()} {value!r}")
        kind, text = ("integer", repr(value)) if whole else ("real(c_double)", listed([value], "d")[0])
        fortran.append(f"{kind}, parameter :: {name} = {text}")
    for name, array in arrays().items():
        c.append(f"static const double {name}[] = {{ {', '.join(listed(array))} }};")
        shape = ", ".join(str(each) for each in reversed(array.shape))
        fortran.append(f"real(c_double) :: {name}({shape})")
        parts = listed(array, "d")
        rows = ", &\n".join(", ".join(parts[i : i + 4]) for i in range(0, len(parts), 4))
        fortran.append(f"data {name} / &\n{rows} /")
    (folder / "values.h").write_text("\n".join(c) + "\n", encoding="utf-8")
    (folder / "values.inc").write_text("\n".join(fortran) + "\n", encoding="utf-8")


def compiled(folder: Path) -> dict[str, list[float]]:
    """Nanoseconds of a step in C and, where gfortran is installed, in Fortran: without and with the tangent."""
    export_library([SPEC], folder / "msfp")
    headers(folder)
    library = [str(folder / "msfp/lib/libmsfp.a"), *FLAGS["libraries"]]
    includes = [f"-I{folder}", f"-I{folder / 'msfp/include'}"]
    commands = {"C": [*find_compiler().command, "-std=c99", "-O2", *includes, str(HERE / "c/port.c"), *library]}
    if shutil.which("gfortran"):
        module = str(folder / "msfp/share/msfp/msfp.f90")
        commands["Fortran"] = ["gfortran", "-O2", *includes, module, str(HERE / "c/port.f90"), *library]
    found = {}
    for name, command in commands.items():
        subprocess.run([*command, "-o", name], check=True, cwd=folder)
        printed = subprocess.run([str(folder / name)], check=True, capture_output=True, text=True).stdout
        found[name] = [float(word) for word in printed.split()]
    return found


def in_python() -> list[float]:
    """The same by `TwoPort`."""

    def once(tangents: bool) -> None:
        port = TwoPort.of_scene(fmu.rig())
        for i in range(1, fmu.COUNT + 1):
            response = port.trial(i * fmu.STEP, *fmu.motion(i * fmu.STEP))
            if tangents:
                response.tangent  # noqa: B018
            port.commit()

    return [1e9 * fmu.least(lambda: once(False)), 1e9 * fmu.least(lambda: once(True))]


def in_fmu(folder: Path) -> list[float]:
    """The same by a unit under FMPy."""
    from fmpy import extract

    path = write_fmu(fmu.rig(), folder / "bearing.fmu").path
    unit = str(extract(str(path), str(folder / "unit")))
    return [1e9 * fmu.least(lambda: fmu.by_unit(path, unit)), 1e9 * fmu.least(lambda: fmu.by_unit(path, unit, True))]


def doors() -> dict[str, list[float]]:
    """Nanoseconds of a committed step by door: without and with the tangent."""
    with tempfile.TemporaryDirectory() as name:
        found = compiled(Path(name)) | {"Python, `TwoPort`": in_python()}
        return found | ({"FMU under FMPy": in_fmu(Path(name))} if installed("fmpy", "a unit under FMPy") else {})


# ---- the worked example of docs/embedding.md and docs/other-programs.md --------------------------------------------


def block(page: str, index: int) -> str:
    """A block of Python of a page."""
    text = (HERE.parent / "docs" / page).read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)[index]


def worked_example() -> dict[str, float]:
    """Microseconds of CPU time of a step of the analysis: in Python; with OpenSees, of the server and of the client."""
    names: dict[str, object] = {}
    exec(block("embedding.md", 0), names)
    begin = process_time()
    exec(block("embedding.md", 1), names)
    found = {"Python, `TwoPort`": process_time() - begin}
    if installed("openseespy.opensees", "OpenSees as a client"):
        found |= by_opensees()
    return {name: 1e6 * time / ANALYSIS_STEPS for name, time in found.items()}


def by_opensees() -> dict[str, float]:
    """CPU time of the server and of the client [s]."""
    interface = Top.node(1e8, 6.7e7, 1e6, vertical_damping=1e5)
    port = TwoPort(presets.bearing("fenz-tfp"), interface, fmu.LOAD)
    with Server([("bearing", lambda: port)], 0, report=lambda _: None) as server:
        thread = Thread(target=server.serve, args=(1,))
        thread.start()
        code = block("other-programs.md", 0).replace("7000", str(server.ports[0]))
        code = code.replace("peak = 0.0", "import time\nbegin = time.process_time()\npeak = 0.0")
        begin = process_time()
        command = [sys.executable, "-c", code + "print(time.process_time() - begin)"]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        thread.join()
        server_time = process_time() - begin
    client = next(float(line) for line in reversed(done.stdout.splitlines()) if re.fullmatch(r"[\d.e-]+", line))
    return {"OpenSees, server": server_time, "OpenSees, client": client}
