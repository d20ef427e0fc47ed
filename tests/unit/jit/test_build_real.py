"""The compile room with the real generator: the warm path, and a folder for a plain script."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from msfp_gen import Layout, build_model
from msfp_gen.jit.build import BuildInfo, generate_to
from msfp_gen.jit.cache import Entry
from msfp_gen.specification.layout import ModelSpec

WARM = """
import json, sys
from msfp_gen import Layout, build_model
info = build_model(Layout.tfp()).info
tools = sorted({"sympy", "Cython", "jinja2", "filelock", "msfp_gen.generator.derive"} & set(sys.modules))
print(json.dumps([info.cached, str(info.path), tools]))
"""


def run(code: str, *options: str) -> str:
    return subprocess.run([sys.executable, *options, "-c", code], capture_output=True, text=True, check=True).stdout


@pytest.fixture(scope="module")
def built() -> BuildInfo:
    return build_model(Layout.tfp()).info  # type: ignore[no-any-return]


def test_stages_and_counts_of_a_build(built: BuildInfo) -> None:
    assert list(built.stages) == ["derive", "lower", "emit", "compile"]
    assert all(seconds > 0 for seconds in built.stages.values())
    assert built.statements > 0 and built.operations > built.statements


def test_second_process_takes_it_from_the_cache_without_the_tools(built: BuildInfo) -> None:
    assert json.loads(run(WARM)) == [True, str(built.path), []]


def test_generated_folder_serves_a_plain_script(built: BuildInfo, tmp_path: Path) -> None:
    info = generate_to(ModelSpec(Layout.tfp()), tmp_path / "out")
    assert info.key == built.key and "MSFP_X86_64_LEVEL" not in (info.folder / "build.log").read_text()
    code = f"import sys; sys.path.insert(0, {str(info.folder)!r}); import msfp_5_2_2; print(msfp_5_2_2.__file__)"
    assert run(code).strip() == str(info.path)


def test_layouts_and_effects_have_entries_of_their_own(built: BuildInfo) -> None:
    other = Entry.of(ModelSpec(Layout(2, 1, 0)))
    assert other.folder != built.folder and other.module == "msfp_2_1_0"


def test_two_threads_import_a_driver_once() -> None:
    """Both ask at once in a new process: a study of buildings begins so, and a module of Cython is imported once."""
    script = (
        "from concurrent.futures import ThreadPoolExecutor\n"
        "from threading import Barrier\n"
        "from msfp_gen.jit.build import load_driver\n"
        "meet = Barrier(4)\n"
        "def load(_):\n"
        "    meet.wait()\n"
        "    return load_driver('msfp_gen.buildings')[0]\n"
        "found = list(ThreadPoolExecutor(4).map(load, range(4)))\n"
        "assert all(module is found[0] for module in found)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
