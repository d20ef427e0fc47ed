"""`write_fmu`: a scene as a Functional Mock-up Unit, with what its C files need to know of the scene."""

from __future__ import annotations

import hashlib
import io
import platform
import re
import shutil
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from msfp_gen.common.errors import CompileError, InputError
from msfp_gen.common.output import check_output, write_bytes
from msfp_gen.common.version import __version__
from msfp_gen.embedding.description import (
    ReferenceBlock,
    UnitDescription,
    UnitVariable,
    build_description,
    model_description,
    top_names,
    variables,
)
from msfp_gen.embedding.library import render
from msfp_gen.embedding.two_port import REST, check_parts, parts_of_rig, scene_at_rest
from msfp_gen.generator.interface import effects_text, model_name
from msfp_gen.jit.library import build_shared
from msfp_gen.motions.motion import Motion
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import MassTop
from msfp_gen.specification import contract
from msfp_gen.specification.layout import Auto, ModelSpec

VERSIONS = (2, 3)
KINDS = {"me": "ModelExchange", "cs": "CoSimulation"}  # in the order of the schema
SUFFIXES = (".fmu",)
WRITTEN = ("fmu.c", "fmu_bearing.c", "fmu_state.c", "fmu_exchange.c", "fmu.h", "fmi.h")
DATE = (1980, 1, 1, 0, 0, 0)  # of the files in the archive: the same scene gives the same bytes
_SYSTEMS = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib"), "win32": ("win", ".dll")}
_MACHINES = {"AMD64": "x86_64", "arm64": "aarch64"}


@dataclass(frozen=True)
class WrittenUnit:
    """A unit that was written.

    kinds: "CoSimulation", "ModelExchange". model: name of the compiled model. variables: in the order of their value
    references.
    """

    path: Path
    model: str
    kinds: tuple[str, ...]
    variables: tuple[UnitVariable, ...]


def write_fmu(
    scene: Scene,
    path: Path | str,
    *,
    version: int = 2,
    exchange: bool = False,
    progress: Callable[[str, float], None] | None = None,
) -> WrittenUnit:
    """Write the unit of a scene: motion in and wrench out of a rig, or force in and motion out of a supported mass.

    The values of the scene are the start values of its parameters; its motion and duration are not used. version: 2 or
    3, of FMI. exchange: also for Model Exchange, of a supported mass. progress: called with a text and the completed
    share, 0 to 1. Raises InputError: the scene has parts that a unit has not, the file cannot be written; CompileError.
    """
    target = check_output(path, SUFFIXES, "--output")
    if version not in VERSIONS:
        raise InputError(f"--fmi = {version!r}: give one of {', '.join(map(str, VERSIONS))}")
    rest = scene_of_unit(scene)
    if exchange:
        _check_exchange(rest)
    unit = _unit(rest, target.stem, version, exchange)
    folder = Path(tempfile.mkdtemp(prefix="msfp-gen-fmu-"))
    try:
        content = _files(rest, unit, version, exchange, folder, progress or (lambda _, __: None))
    except BaseException as error:
        if not (isinstance(error, CompileError) and error.log):  # else the folder stays, with the log
            shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder)
    write_bytes(target, [_archive(content)])
    return WrittenUnit(target, model_name(spec_of_unit(rest)), unit.kinds, tuple(unit.variables))


def scene_of_unit(scene: Scene) -> Scene:
    """The scene with the effects of the unit, at rest, without what ends its run; raises InputError."""
    scene = replace(scene, stop=None)
    if not isinstance(scene.top, MassTop):
        return scene_at_rest(scene.bearing, *parts_of_rig(scene), scene.solver)
    check_parts(scene)
    effects = scene.effects
    if isinstance(effects, Auto):
        effects = effects.resolve(friction=scene.law[0])
    if effects.dimension != "spatial" or effects.spin != "locked":
        raise InputError(
            f"effects: dimension = {effects.dimension!r}, spin = {effects.spin!r}: a unit moves in space, and its ends "
            "transmit no torsion; give 'spatial' and 'locked'"
        )
    if scene.solver.method == "dopri5":
        raise InputError("solver.method = 'dopri5': the steps of a unit are implicit; give 'implicit' or 'esdirk4'")
    return Scene(scene.bearing, Motion(*REST), scene.top, effects=effects, solver=scene.solver, name=scene.name)


def spec_of_unit(scene: Scene) -> ModelSpec:
    """The model of a unit, a two-port: where the scene has no support of the top that rotates, it is at rest."""
    return ModelSpec(scene.bearing.layout, replace(scene.modelled, top_rotation=True))


def _check_exchange(scene: Scene) -> None:
    effects, top = scene.modelled, scene.top
    if not isinstance(top, MassTop):
        raise InputError(
            f"--type me: top.kind = {top.kind!r}: Model Exchange is of a supported mass; give 'mass', or --type cs"
        )
    if effects.sliders != "inertial" or effects.uplift:
        raise InputError(
            f"--type me: effects.sliders = {effects.sliders!r}, uplift = {effects.uplift}: Model Exchange needs the "
            "rates of all bodies; give 'inertial' and no uplift, or --type cs"
        )
    if top.vertical_stiffness is not None or (effects.law is not None and effects.law.memory is not None):
        raise InputError(
            "--type me: a vertical spring below the mass, and friction that depends on temperature or path, have "
            "states that Model Exchange does not give; leave them out, or --type cs"
        )


def _unit(scene: Scene, name: str, version: int, exchange: bool) -> UnitDescription:
    unit_variables = variables(scene, exchange)
    what = f"{spec_of_unit(scene).key} {scene.solver!r} {version} {exchange} {__version__} {unit_variables!r}"
    digest = hashlib.sha256(what.encode())
    for text in _written(version).values():
        digest.update(text.encode())
    inout = "force in, motion of a supported mass out" if isinstance(scene.top, MassTop) else "motion in, wrench out"
    return UnitDescription(
        name=name,
        identifier=re.sub(r"^(?=\d)|\W", "_", name, flags=re.ASCII),
        token=f"{{{uuid.UUID(bytes=digest.digest()[:16])}}}",
        text=f"Multi-stage friction pendulum bearing (PEER 2017/07), {inout}; {effects_text(spec_of_unit(scene))}",
        kinds=tuple(kind for short, kind in KINDS.items() if short == "cs" or exchange),
        tolerance=scene.solver.rtol,
        variables=unit_variables,
        sources=(),
    )


def _written(version: int) -> dict[str, str]:
    """The C files of the unit that are the same for every scene, and the headers of the standard."""
    folder = files(__package__).joinpath("assets/fmi")
    headers = [file for file in folder.joinpath("standard").iterdir() if file.name.startswith(f"fmi{version}")]
    own = [folder.joinpath(name) for name in (*WRITTEN, f"fmi{version}.c")]
    return {
        file.name: file.read_text(encoding="utf-8") for file in (*own, *sorted(headers, key=lambda file: file.name))
    }


def _files(
    scene: Scene,
    unit: UnitDescription,
    version: int,
    exchange: bool,
    folder: Path,
    progress: Callable[[str, float], None],
) -> dict[str, bytes]:
    """Content of the archive."""
    content = model_content(scene, unit, exchange)
    others = _written(version)
    for name in ("fmu_model.h", "fmu_model.c"):
        others[name] = render(f"fmi/{name}", content)
    system, suffix = _SYSTEMS.get(sys.platform, ("linux", ".so"))
    library = f"{unit.identifier}{suffix}"
    sources = build_shared(spec_of_unit(scene), others, f"fmi{version}*", library, folder, progress)
    unit = replace(unit, sources=tuple(name for name in sources if name.endswith(".c")))
    archive_files = {"modelDescription.xml": model_description(unit, version)}
    archive_files[f"binaries/{_platform(system, version)}/{library}"] = (folder / library).read_bytes()
    archive_files |= {f"sources/{name}": text.encode() for name, text in sources.items()}
    if version == 3:
        archive_files["sources/buildDescription.xml"] = build_description(unit)
    page = {"unit": unit, "scene": scene, "stamp": content["stamp"], "effects": effects_text(spec_of_unit(scene))}
    archive_files["documentation/index.html"] = render("fmi/index.html", page).encode()
    return archive_files


def _platform(system: str, version: int) -> str:
    """Name of the folder of the binary of this machine."""
    machine = _MACHINES.get(platform.machine(), platform.machine())
    if version == 2 and machine == "x86_64":
        return f"{system}64"
    return f"{machine}-{'windows' if system == 'win' else system}"


def _archive(content: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, data in content.items():
            archive.writestr(zipfile.ZipInfo(name, DATE), data, zipfile.ZIP_DEFLATED)
    return stream.getvalue()


def model_content(scene: Scene, unit: UnitDescription, exchange: bool) -> dict[str, Any]:
    """The names in the templates fmu_model.h and fmu_model.c."""
    effects, count = scene.modelled, scene.bearing.layout.surfaces
    loaded, surface = isinstance(scene.top, MassTop), contract.surface_values(effects)
    top, body = contract.names(contract.TOP), contract.names(contract.BODY)
    return {
        "stamp": f"written by msfp-gen {__version__}",
        "model": model_name(spec_of_unit(scene)),
        "token": unit.token,
        "mass": int(loaded),
        "exchange": int(exchange),
        "uplift": int(effects.uplift),
        "method": scene.solver.method,
        "top_places": [top.index(name) for name in top_names(scene)],
        "surfaces": count,
        "coordinates": 6 if effects.uplift else 3,
        "body_size": len(body),
        "body_mass": body.index("mass"),
        "surface_size": len(surface),
        "seat_stiffness": surface.index("seat_stiffness") if effects.uplift else 0,
        "top_size": len(top),
        "output_places": _output_places(unit, loaded),
        "output_count": len(unit.at(ReferenceBlock.OUTPUTS)),
        "places": _places(unit, loaded),
        "names": [variable.name for variable in unit.variables],
        "start": [variable.start for variable in unit.variables],
        "input_nominals": [unit.variables[i].nominal for i in unit.at(ReferenceBlock.INPUTS)],
        "state_nominals": [*(unit.variables[i].nominal for i in unit.at(ReferenceBlock.STATES)), 1.0],
    }


def _output_places(unit: UnitDescription, loaded: bool) -> list[tuple[str, int]]:
    """Names in C of outputs, counted from the first output."""
    names = [unit.variables[i].name for i in unit.at(ReferenceBlock.OUTPUTS)]
    names_in_c = {"SLIDING": "surface[1].sliding", "NORMAL": "surface[1].normal"}
    if loaded:
        names_in_c |= {"TOP_FORCE": "top.force[1]", "BASE_FORCE": "lower.force[1]"}
    return [(place, names.index(name)) for place, name in names_in_c.items()]


def _places(unit: UnitDescription, loaded: bool) -> list[tuple[str, int]]:
    """Names of value references in C: where blocks begin, and the variables that have a place."""
    places, end = [], 0
    for block in ReferenceBlock:
        references = unit.at(block)
        places.append((block.value, end))
        end += len(references)
        assert not references or references == list(range(references[0], end)), block
    places += [(variable.place, i) for i, variable in enumerate(unit.variables) if variable.place]
    if loaded:
        names = [variable.name for variable in unit.variables]
        places.append(("TOP_MASS", names.index("top.mass")))
    return places
