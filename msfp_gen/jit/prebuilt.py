"""Models that a wheel brings compiled, so that common layouts need no compiler; made by `tools/prebuilt_wheel.py`.

`msfp_gen/prebuilt/` has one folder for each model and level of the processor, and one for each driver of two-ports
(`build.py`), with a manifest and an extension that uses only the limited API of Python, so that one file serves all
versions. A checkout has none, nor has a pure wheel.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from msfp_gen.jit import cache
from msfp_gen.jit.compiler import CFLAGS, COMPILER, words, x86_64_level
from msfp_gen.specification.layout import Effects, Layout, ModelSpec

SUFFIX = ".abi3.so"
# Levels of x86-64 that a wheel has models for: every processor, and those with AVX2.
LEVELS = (3, 1)
LAYOUTS = (Layout(2, 1, 0), Layout.dfp(), Layout.tfp())


def prebuilt_specs() -> list[ModelSpec]:
    """The models of a wheel: single, double and triple pendulum, planar and spatial, sliders and rims as selected; and
    those that a building moves at both ends, without and with uplift. The triple one also with the friction of
    earthquakes, as the presets have it.
    """
    alone = [
        ModelSpec(layout, Effects(dimension=dimension, sliders=sliders, rims=rims))
        for layout in LAYOUTS
        for dimension in ("spatial", "planar")
        for sliders in ("inertial", "massless")
        for rims in (True, False)
    ]
    below = [Effects(top_rotation=True, uplift=uplift) for uplift in (False, True)]
    shaken = [*(Effects(rims=rims) for rims in (True, False)), *below]
    heated = [ModelSpec(Layout.tfp(), replace(effects, friction="pvt", bouc_wen="plastic")) for effects in shaken]
    return [*alone, *(ModelSpec(layout, effects) for layout in LAYOUTS for effects in below), *heated]


def prebuilt_folder() -> Path:
    """Folder of the models that came with the package; it need not exist."""
    return cache.PACKAGE / "prebuilt"


def find_prebuilt(spec: ModelSpec) -> tuple[Path, cache.Manifest] | None:
    """Folder and manifest of a model that came with the package and runs on this processor; None if there is none.

    None too where the user names a compiler or its flags (CC, MSFP_GEN_CFLAGS). A damaged one raises a warning.
    """
    return _find(cache.module_name(spec), spec.key)


def find_prebuilt_driver(module: str, files: Mapping[str, str]) -> tuple[Path, cache.Manifest] | None:
    """The same for a module of these files, name -> text, that drives models."""
    return _find(module, cache.digest_files(files))


def add_prebuilt(level: int, built: Path, root: Path) -> Path:
    """Copy what is in the folder `built`, compiled for a level of the processor, to `root`; returns its folder.

    The manifest states neither the times of the build nor where its compiler lay, so that two builds are the same.
    """
    manifest = cache.Manifest.read(built)
    data = (built / manifest.extension).read_bytes()
    folder = root / _folder_name(manifest.module, _content(manifest), level)
    folder.mkdir(parents=True)
    extension = f"{manifest.module}{SUFFIX}"
    (folder / extension).write_bytes(data)
    files = {extension: hashlib.sha256(data).hexdigest()}
    compiler = [Path(word).name if Path(word).is_absolute() else word for word in manifest.inputs["compiler"]]
    inputs = {**manifest.inputs, "compiler": compiler}
    replace(manifest, inputs=inputs, key=folder.name, extension=extension, files=files, stages={}).write(folder)
    return folder


def prebuilt_key(manifest: cache.Manifest) -> str:
    """Hash of what determines its numbers: one for all levels of the processor, since all give the same."""
    return hashlib.sha256(f"prebuilt\0{manifest.inputs['sources']}\0{_content(manifest)}".encode()).hexdigest()


def _content(manifest: cache.Manifest) -> str:
    """`ModelSpec.key` of a model, the digest of the files of any other module."""
    return str(manifest.inputs.get("spec") or manifest.inputs["files"])


def _find(module: str, content: str) -> tuple[Path, cache.Manifest] | None:
    root = prebuilt_folder()
    if not root.is_dir() or words(COMPILER) or words(CFLAGS):
        return None
    reached = x86_64_level() or 1
    for level in (level for level in LEVELS if level <= reached):
        folder = root / _folder_name(module, content, level)
        if not folder.is_dir():
            continue
        try:
            manifest = cache.Manifest.read(folder)
            if cache.digest(folder / manifest.extension) == manifest.files[manifest.extension]:
                return folder, manifest
        except (OSError, ValueError, TypeError, KeyError):
            pass
        warnings.warn(f"{folder} is damaged and not used; install msfp-gen again", RuntimeWarning, stacklevel=3)
    return None


def _folder_name(module: str, content: str, level: int) -> str:
    """A name that only a module of these sources and this content has."""
    key = hashlib.sha256(f"{cache.digest_sources()}\0{content}".encode()).hexdigest()
    return f"{module}-{key[:20]}-v{level}"
