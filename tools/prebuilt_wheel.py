"""Adds compiled models to a pure wheel of this checkout: `python tools/prebuilt_wheel.py dist/msfp_gen-*.whl`.

Needs the extra "wheels". The models are compiled by ziglang for Linux on x86-64 with glibc 2.17 or newer, against the
limited API of Python 3.11, so that the wheel serves that version and all later ones.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from msfp_gen.jit.build import PREBUILT_LEVELS, add_prebuilt, build_driver, prebuilt_specs, prepare
from msfp_gen.jit.cache import digest_sources
from msfp_gen.jit.compiler import zig_program

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from build_backend import normal_zip, rewrite
from quick import QUICK, parser, pick

ROOT = Path(__file__).resolve().parents[1]
TAGS = ("cp311-abi3-manylinux_2_17_x86_64", "cp311-abi3-manylinux2014_x86_64")
OPTIONS = (
    "cc", "-target", "x86_64-linux-gnu.2.17", "-fno-sanitize=undefined", "-s", "-DPy_LIMITED_API=0x030B0000",
)  # fmt: skip
DRIVERS = ("msfp_gen.buildings",)  # packages with compiled code beside the models
PROCESSORS = {1: "x86_64", 3: "x86_64_v3"}


def main() -> None:
    """Write the wheel with models into the folder of -o."""
    options = parser(__doc__)
    options.add_argument(
        "wheel", nargs=pick(None, "?"), type=Path, help="pure wheel, such as `python -m build --wheel` writes"
    )
    options.add_argument("-o", "--output", type=Path, default=Path("wheels"), help="folder of the result")
    given = options.parse_args()
    zig, tool = zig_program(), [sys.executable, "-m", "wheel"]
    packs = subprocess.run([*tool, "version"], capture_output=True).returncode == 0
    missing = " and ".join(name for name, found in (("ziglang", zig), ("wheel", packs)) if not found)
    if missing and QUICK:
        print(f"left out, since {missing} is not installed (pip install -e .[wheels]): the wheel")
        return
    if zig is None or missing:
        raise SystemExit(f"error: {missing} is not installed: pip install -e .[wheels]")
    with TemporaryDirectory() as folder, TemporaryDirectory() as built:
        output = Path(built) if QUICK else given.output
        output.mkdir(parents=True, exist_ok=True)
        subprocess.run([*tool, "unpack", given.wheel or pure_wheel(Path(built)), "-d", folder], check=True)
        (unpacked,) = Path(folder).iterdir()
        check_sources(unpacked)
        with TemporaryDirectory() as cache:
            add_models(unpacked / "msfp_gen" / "prebuilt", zig, Path(cache))
        change_tags(unpacked)
        packed = Path(built) / "packed"
        packed.mkdir()
        subprocess.run([*tool, "pack", unpacked, "-d", packed], check=True)
        (wheel,) = packed.iterdir()
        rewrite(wheel, normal_zip)
        shutil.copy(wheel, output)


def pure_wheel(folder: Path) -> Path:
    """The wheel of a copy of this checkout, for a quick run."""
    copy = Path(shutil.copytree(ROOT, folder / "copy", ignore=shutil.ignore_patterns(".*", "build", "dist", "tests")))
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", folder, copy]
    subprocess.run(command, check=True)
    return next(folder.glob("*.whl"))


def check_sources(unpacked: Path) -> None:
    """Models are found by the sources of the wheel: refuse a wheel of other ones."""
    code = "from msfp_gen.jit.cache import digest_sources; print(digest_sources())"
    found = subprocess.run([sys.executable, "-c", code], cwd=unpacked, env={**os.environ, "PYTHONPATH": str(unpacked)},
                           text=True, capture_output=True, check=True)  # fmt: skip
    if found.stdout.strip() != digest_sources():
        raise SystemExit("error: the wheel has other sources than this checkout: build it again")


def add_models(root: Path, zig: Path, cache: Path) -> None:
    """Build every model for every level of the processor, and the drivers for all, and copy them to `root`."""
    os.environ.pop("MSFP_GEN_CFLAGS", None)
    for level in PREBUILT_LEVELS[: pick(None, 1)]:
        os.environ["CC"] = shlex.join([str(zig), *OPTIONS, f"-mcpu={PROCESSORS[level]}"])
        os.environ["MSFP_GEN_CACHE"] = str(cache / str(level))
        for spec in prebuilt_specs()[: pick(None, 1)]:
            folder = add_prebuilt(level, prepare(spec, portable=True).folder, root)
            print(folder.name, spec.key, flush=True)
    for package in DRIVERS:  # compiled for the last level, which every processor reaches
        print(add_prebuilt(level, build_driver(package).folder, root).name, package, flush=True)


def change_tags(unpacked: Path) -> None:
    """State in the metadata of the wheel that it has compiled files."""
    (path,) = unpacked.glob("*.dist-info/WHEEL")
    kept = [line for line in path.read_text(encoding="utf-8").splitlines() if line and not line.startswith("Tag:")]
    lines = [line.replace("Root-Is-Purelib: true", "Root-Is-Purelib: false") for line in kept]
    path.write_text("\n".join([*lines, *(f"Tag: {tag}" for tag in TAGS)]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
