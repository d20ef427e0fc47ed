"""A generator small enough to build in a second, for tests of the compile room; also run in child processes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from msfp_gen.generator import Generated

if TYPE_CHECKING:
    import pytest

HEADER = "double msfp_twice(double x);\nextern const double msfp_factor;\n"
SYMBOLS = "#define MSFP_MODEL msfp_fake\n"
KERNEL = '#include "msfp_model.h"\n\ndouble msfp_twice(double x) { return msfp_factor * x; }\n'
RUNTIME = '#include "msfp_model.h"\n\nconst double msfp_factor = 2.0;\n'
RUNTIME += "const struct msfp_api *msfp_fake(void);\nconst struct msfp_api *msfp_fake(void) { return 0; }\n"
WRAPPER = """\
cdef extern from "msfp_model.h":
    double msfp_twice(double x)


def twice(double x):
    return msfp_twice(x)
"""
STAGES = {"derive": 0.25, "lower": 0.5, "emit": 0.125}


def sources(kernel: str = KERNEL, wrapper: str = WRAPPER) -> dict[str, str]:
    return {"msfp_model.h": HEADER, "msfp_kernels.c": kernel, "msfp_module.pyx": wrapper, "msfp_symbols.h": SYMBOLS}


def generate(spec: object) -> Generated:
    return Generated(files=sources(), statements=1, operations=1, stages=dict(STAGES))


def generator(function=generate) -> ModuleType:
    module = ModuleType("msfp_gen.generator")
    module.generate = function
    return module


def write_house(house: Path) -> Path:
    """What the cache key reads: rules of fields, a specification, a generator, a template and a runtime."""
    python = dict.fromkeys(("common/fields.py", "specification/one.py", "generator/one.py"), "1\n")
    for name, text in {**python, "templates/one.jinja": "1\n", "runtime/unit.c": RUNTIME}.items():
        (house / name).parent.mkdir(parents=True, exist_ok=True)
        (house / name).write_text(text)
    return house


def prepare_in_child(house: str) -> None:
    """Build or find the double pendulum's fake model and say which."""
    from msfp_gen.jit import build, cache
    from msfp_gen.specification.layout import Layout, ModelSpec

    sys.modules["msfp_gen.generator"] = generator()
    cache.PACKAGE = Path(house)
    info = build.prepare(ModelSpec(Layout.dfp()))
    extension = build.load_extension(info.path, info.module)
    tools = sorted({"sympy", "Cython", "jinja2", "filelock"} & set(sys.modules))
    print(info.cached, extension.twice(21.0), *tools)


def run_child(house: Path, models: Path) -> subprocess.Popen[str]:
    """`prepare_in_child` with the cache `models`, in a session of its own."""
    environment = {name: value for name, value in os.environ.items() if name != "CC"} | {"MSFP_GEN_CACHE": str(models)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    command = [sys.executable, __file__, str(house)]
    return subprocess.Popen(command, env=environment, text=True, start_new_session=True, **pipes)


def house(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package of its own with a generator whose model builds in a second, and an empty cache `folder`/models."""
    from msfp_gen.jit import cache

    monkeypatch.setattr(cache, "PACKAGE", write_house(folder / "house"))
    monkeypatch.setenv("MSFP_GEN_CACHE", str(folder / "models"))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setitem(sys.modules, "msfp_gen.generator", generator())
    return cache.PACKAGE


def prebuilt(factory: pytest.TempPathFactory) -> Path:
    """A cache that holds the fake model, for all tests that start from one."""
    root = factory.mktemp("prebuilt")
    assert run_child(write_house(root / "house"), root / "models").communicate()[0].split()[:2] == ["False", "42.0"]
    return root / "models"


def keep_wrapper(prebuilt: Path, models: Path) -> None:
    """Copy the object of the wrapper from one cache into another."""
    (models / "objects").mkdir(parents=True, exist_ok=True)
    for path in prebuilt.glob("objects/wrapper-*.o"):
        shutil.copy2(path, models / "objects")


if __name__ == "__main__":
    prepare_in_child(sys.argv[1])
