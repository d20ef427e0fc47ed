"""docs/extending.md holds: its blocks, put where it says into a copy of the sources, are a new effect that runs."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support import ROOT

from msfp_gen.generator.blocks import make_blocks
from msfp_gen.generator.program import Program

PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
# The blocks of a list are indented as its text is.
BLOCKS = [
    re.sub(f"^{indent}", "", block, flags=re.MULTILINE)
    for indent, block in re.findall(r"^( *)```python\n(.*?)```", PAGE, re.DOTALL | re.MULTILINE)
]
LAW, NUMBER, FIELD, MEMORY, REMEMBERING, NUMBERS, FIELDS, SWITCHES, SEAL, SEAL_NUMBER, SEAL_FIELD, DRILLING = BLOCKS[
    :12
]
FILM, FILM_NUMBER, FILM_FIELD = BLOCKS[12:]


def entries(block: str) -> str:
    """What a page shows within the parentheses of a tuple, as the formatter requires."""
    return block.removeprefix("(\n").removesuffix(")\n")


LAWS = "msfp_gen/specification/friction_laws.py"
WHERE = {
    (LAWS, "_LAWS = (\n"): entries(LAW) + entries(REMEMBERING),
    (LAWS, "_NUMBERS = (\n"): f"    {NUMBER.strip()},\n" + entries(NUMBERS),
    (LAWS, "        TEMPERATURE,\n"): entries(MEMORY),
    ("msfp_gen/specification/friction_laws.py", "HYSTERESIS = {\n"): SWITCHES,
    ("msfp_gen/specification/friction_laws.py", "SPIN = {\n"): SEAL,
    ("msfp_gen/specification/friction_laws.py", "_SPIN_NUMBERS: tuple[Value, ...] = ("): f"{SEAL_NUMBER.strip()},",
    ("msfp_gen/scene/bearing.py", "    friction_slow: Annotated[float | None"): FIELD
    + FIELDS
    + SEAL_FIELD
    + FILM_FIELD,
    ("msfp_gen/specification/layout.py", "    top_rotation: Annotated["): FILM,
    ("msfp_gen/specification/contract.py", '    "uplift": ('): FILM_NUMBER,
    ("tests/reference/forces.py", "DRILLING = {\n"): DRILLING,
}
AFTER = {place for _, place in WHERE if place.endswith(("\n", "= ("))}
SCENE = """
from dataclasses import dataclass, replace
from msfp_gen import Effects, load_scene
scene = load_scene("single-articulated-push")
effects = Effects(friction="pressure", bouc_wen="rounded", dimension="planar")
bearing = scene.bearing.replace(pressure_drop=0.02, reference_pressure=30e6)
scene = replace(scene, bearing=bearing, effects=effects)
"""


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the sources with the new effects."""
    root = tmp_path_factory.mktemp("extended")
    for folder in ("generator", "templates", "msfp_gen", "tests/reference"):
        shutil.copytree(ROOT / folder, root / folder, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    for (name, place), block in WHERE.items():
        path = root / name
        text = path.read_text(encoding="utf-8")
        assert text.count(place) == 1, f"{name}: {place!r} is not there"
        shown = place + block if place in AFTER else block + place
        path.write_text(text.replace(place, shown), encoding="utf-8")
    return root


def run(root: Path, code: str) -> str:
    """What a program prints that imports the copy."""
    environment = {**os.environ, "PYTHONPATH": str(root), "MSFP_GEN_CACHE": str(root / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=root, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_new_words_are_known_everywhere(extended: Path) -> None:
    out = run(
        extended,
        f"""{SCENE}
from msfp_gen.scene.explain import explain
from msfp_gen.generator import generate
from msfp_gen.cli import main
import msfp_gen
print(msfp_gen.__file__)
print("\\n".join(table.text for table in explain(scene)))
print(scene.spec.key)
print(generate(scene.spec).files["msfp_model.h"])
main(["generate", "--help"])
""",
    )
    assert str(extended) in out.splitlines()[0]
    told = (
        "it falls with pressure, by pressure_drop in the end",
        "always on: unloading is curved",
        "planar-locked-inertial-rims-rounded-pressure",
        "MSFP_SURFACE_PARAMETERS_PRESSURE_DROP",
        "what friction loses under high pressure",
        "rounded|report|isotropic",
    )
    for words in told:
        assert words in out, words


def test_numbers_that_are_missing_are_named(extended: Path) -> None:
    without = SCENE.replace("pressure_drop=0.02, ", "").replace("scene = replace", "try:\n    scene = replace")
    out = run(extended, without + "except Exception as error:\n    print(error)\n")
    assert re.search(r"surfaces\[0\]\.pressure_drop is missing .*'pressure' needs it", out)


def test_a_new_effect_is_accepted_wherever_effects_are(extended: Path, tmp_path: Path) -> None:
    """In scene files, complete and selected, options, names and texts; its number is noted without it."""
    scene = tmp_path / "film.toml"
    scene.write_text(
        'bearing = { preset = "fenz-tfp", film_damping = 20.0 }\n'
        '[motion]\nkind = "harmonic"\namplitude = 0.05\nfrequency = 0.1\n'
        '[top]\nkind = "rig"\naxial_load = 112e3\nstiffness = 1e8\n'
    )
    out = run(
        extended,
        f"""
from dataclasses import dataclass, replace
from msfp_gen import Auto, Effects, load_scene
from msfp_gen.cli import main
from msfp_gen.generator.interface import effects_text
from msfp_gen.scene.plausibility import scene_doubts
path = {str(scene)!r}
text = open(path).read()
plain = load_scene(path)
print([doubt for _, _, doubt in scene_doubts(plain)])
complete = 'film = true\\ndimension = "planar"\\nsliders = "inertial"\\nrims = true\\nuplift = false'
for table in ("film = true", complete):
    open(path, "w").write(text + "[effects]\\n" + table + "\\n")
    found = load_scene(path)
    assert found.effects.film is True and found.modelled.film is True, found
    assert found.spec.key.endswith("-film") and "film on" in effects_text(found.spec)
    assert not any("film" in doubt for _, _, doubt in scene_doubts(found))
    print(type(found.effects).__name__)
try:
    Auto(film="yes")
except Exception as error:
    print(error)
main(["generate", "--help"])
""",
    )
    told = "film_damping = 20: effects.film = false, so that nothing reads it; leave it out, or give film = true"
    assert out.count(told) == 4 and "Auto" in out and "Effects" in out
    assert "effects.film = 'yes': give " in out
    assert "--film" in out


def test_a_field_that_is_constant_in_the_plane_names_its_file() -> None:
    blocks = make_blocks(planar=True, uplift=False)
    program = Program("tilted", "a force across the plane")
    with pytest.raises(AssertionError, match=r"tilted: F of block force is 1, but generator/blocks\.py keeps it at 0"):
        program.write(blocks.force, {"F": (0, 1, 0)})


@pytest.mark.slow
def test_the_new_effects_run(extended: Path) -> None:
    """Built, the law is that of the formula, and the hysteresis that of its switches."""
    run(
        extended,
        f"""{SCENE}
import numpy as np
from msfp_gen import simulate
found = simulate(scene)
rows, surface = found.history, bearing.surfaces[0]
assert found.succeeded and found.summary["energy"]["closure_error"] < 5e-3
p = rows.normal_force[:, 0] / (np.pi * bearing.slider_rim_radius(0) ** 2)
want = surface.friction - 0.02 * np.tanh(p / 30e6)
assert np.abs(rows.friction_coefficient[:, 0] - want).max() < 1e-6 * want.max()
assert np.ptp(want) > 0 and want.max() < surface.friction
assert np.abs(rows.friction_state[-1, 0]).max() > 0.999
""",
    )


@pytest.mark.slow
def test_the_law_with_a_state_of_its_own_runs(extended: Path) -> None:
    """The state is what its equation says, and friction what the formula says."""
    run(
        extended,
        """
from dataclasses import dataclass, replace
import numpy as np
from msfp_gen import Effects, Motion, load_scene, simulate
scene = load_scene("single-articulated-push")
bearing = scene.bearing.replace(sliding_drop=0.4, sliding_path=0.02)
motion = Motion.harmonic(0.05, 0.5, cycles=2).held(2.0)
scene = replace(scene, bearing=bearing, effects=Effects(friction="recovering"), motion=motion, motion_table=None,
                stop=None, duration=6.0, output_step=0.01, solver=replace(scene.solver, rtol=1e-6))
found = simulate(scene)
rows = found.history
assert found.succeeded
mu = bearing.surfaces[0].friction * (1 - 0.4 * np.tanh(rows.memory[:, 0] / 0.02))
assert np.abs(rows.friction_coefficient[:, 0] / mu - 1).max() < 1e-4  # rows inside steps are interpolated
y = (rows.friction_state[:, 0] ** 2).sum(-1)
v = y * np.maximum((rows.friction_state[:, 0] * rows.slip_velocity[:, 0]).sum(-1), 0.0)
z, path = 0.0, [0.0]
for a, b, h in zip(v[:-1], v[1:], np.diff(rows.time)):
    z = np.exp(-2.0 * h) * z + 0.5 * h * (np.exp(-2.0 * h) * a + b)
    path.append(z)
assert np.ptp(path) > 0.02 and np.abs(rows.memory[:, 0] - path).max() < 3e-3 * np.max(path)
assert rows.memory[-1, 0] < 0.1 * rows.memory[:, 0].max()
slopes = simulate(scene, gradients=["bearing.surfaces[0].sliding_drop"], gradient_errors=False).gradient
assert np.abs(slopes["friction_coefficient"].values).max() > 0
""",
    )


@pytest.mark.slow
def test_the_seal_resists_spin(extended: Path) -> None:
    """Its equations are those of the reference, its work closes the energy balance, and its number has a gradient."""
    run(
        extended,
        f"""
import sys
sys.path[:0] = [{str(extended / "tests")!r}, {str(ROOT / "tests")!r}]
from dataclasses import dataclass, replace
import numpy as np
from reference import forces, stack
from support import bearing_of, model_of
from support.random_states import inputs, sensible
from msfp_gen import Effects, InputError, load_scene, simulate
from msfp_gen.scene.scene_fields import InitialState
assert "seal" in forces.DRILLING
values, state, h, load = sensible((3, 1, 1), 0)
@dataclass(frozen=True)
class Sealed(type(values.surfaces[0])):
    seal_damping: float = 0.0
surfaces = [Sealed(**vars(each), seal_damping=40.0 * k) for k, each in enumerate(values.surfaces, 1)]
values = replace(values, surfaces=tuple(surfaces))
model, bearing = model_of((3, 1, 1), spin="seal"), bearing_of(values)
still = replace(state, a=np.zeros_like(state.a))
for resisted in (True, False):
    expected = stack.solve(values, still, h, load, "seal" if resisted else "free").acceleration
    found = model.evaluate(bearing, state.q, state.v, h, **inputs(state, load)).acceleration
    error = np.abs(found - expected).max() / np.abs(expected).max()
    assert error < 1e-9 if resisted else error > 1e-6, error
scene = load_scene("becker-circle-50")
try:
    replace(scene, effects=Effects(spin="seal"))
except InputError as error:
    assert "seal_damping is missing (surface 1): effects.spin = 'seal' needs it" in str(error)
bearing = scene.bearing.replace(seal_damping=300.0)
try:
    replace(scene, bearing=bearing)
except InputError as error:
    assert "effects.spin = 'locked' has no such parameter; leave it out or give 'seal'" in str(error)
rates = np.zeros((4, 3))
rates[:, 2] = 0.1
start = InitialState(np.zeros((4, 3)), rates, np.zeros((4, 2)))
scene = replace(scene, bearing=bearing, effects=Effects(spin="seal"), duration=8.0, initial_state=start)
found = simulate(scene, gradients=["bearing.surfaces[0].seal_damping"], gradient_errors=False)
spin = np.abs(found.history.tilt_rates[:, :, 2])
assert found.succeeded and found.summary["energy"]["closure_error"] < 5e-3
assert spin[0].max() == 0.1 and spin[-1].max() < 0.01  # without the seal it grows beyond 1 rad/s
slope = found.gradient["tilt_rate"].values
assert np.abs(slope).max() > 1e-6, np.abs(slope).max()
""",
    )
