"""Commands for models and the installation, and for other programs: tables, a C library, a unit, a server."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import (
    Force,
    SceneName,
    SignOption,
    building,
    load_source,
    note,
    number,
    result_of,
    say,
    scenes,
    show,
    whole_number,
    with_effects,
)
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.output import check_output
from msfp_gen.jit.library import TARGETS
from msfp_gen.results.sign import DEFAULT, sign_of, using_sign
from msfp_gen.specification.layout import Effects, Layout, ModelSpec

if TYPE_CHECKING:
    from msfp_gen.jit.cache import CachedModel

app = typer.Typer()

Bodies = Annotated[
    int, typer.Argument(parser=whole_number, metavar="N", help="Number of bodies, with base and top plate.")
]
ConcaveUp = Annotated[
    int, typer.Argument(parser=whole_number, metavar="M", help="Number of concave-up surfaces, the lower ones.")
]
ConcaveDown = Annotated[
    int, typer.Argument(parser=whole_number, metavar="P", help="Number of concave-down surfaces; n = m + p + 1.")
]


@app.command(epilog="Example:\n\n\b\n  msfp-gen generate 5 2 2 -o models   # then: import msfp_5_2_2")
@with_effects
def generate(
    n: Bodies,
    m: ConcaveUp,
    p: ConcaveDown,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Write the module, its sources and a README there."),
    ] = None,
    alone: Annotated[
        bool,
        typer.Option("--equations", help="With -o: the derived equations alone, to be read; without integration."),
    ] = False,
    *,
    effects: Effects,
) -> None:
    """Derive and compile the equations of a stack layout (a library for C and Fortran: export)."""
    spec = ModelSpec(Layout(n, m, p), effects)
    from msfp_gen.embedding.alone import write_alone
    from msfp_gen.embedding.library import check_guide, write_guide
    from msfp_gen.jit.build import build_table, generate_to, prepare

    if alone:
        if output is None:
            raise InputError("--equations: give the folder for them, -o DIR")
        info = write_alone(spec, output)
        show([build_table(info)])
        note(f"start with {info.folder / 'README.md'}")
        return
    if output is not None:
        check_guide(output)
    with building() as progress:
        info = prepare(spec, progress) if output is None else generate_to(spec, output, progress)
    show([build_table(info)])
    if output is not None:
        note(f"start with {write_guide(spec, info.folder, info.module)}; for C and Fortran: msfp-gen export")


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen equations 2 1 0 --planar --no-rims\n  msfp-gen equations 5 2 2 --latex > a.tex"
)
@with_effects
def equations(
    n: Bodies,
    m: ConcaveUp,
    p: ConcaveDown,
    latex: Annotated[bool, typer.Option("--latex", help="A LaTeX document, in the symbols of PEER 2017/07.")] = False,
    planar: Annotated[bool, typer.Option("--planar", help="The same as --dimension planar.")] = False,
    *,
    effects: Effects,
) -> None:
    """Print the equations of motion of a stack: positions and rates, momentum balances, rates of friction."""
    from msfp_gen.model.symbolic import symbolic

    model = symbolic(Layout(n, m, p), replace(effects, dimension="planar") if planar else effects)
    say(model.latex() if latex else str(model))


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen explain fenz-test2\n  msfp-gen explain scene.toml --effects",
)
def explain(
    scene: SceneName,
    effects: Annotated[
        bool,
        typer.Option("--effects", help="Run it with each effect changed alone: change of results, time and verdict."),
    ] = False,
    force: Force = False,
) -> None:
    """Describe a scene: bearing, motion, top, or building; what is modelled and how it is solved."""
    from msfp_gen.scene.explain import explain as describe
    from msfp_gen.scene.file.source import load_scene

    system = load_scene(scene)
    if not effects:
        show(describe(system))
        return
    from msfp_gen.scene.plausibility import require_meant
    from msfp_gen.studies.accuracy.effect_by_effect import effect_by_effect

    require_meant(system, force=force)
    show(effect_by_effect(system, note).tables)


@app.command(epilog="Example:\n\n\b\n  msfp-gen presets")
def presets() -> None:
    """List the scenes, buildings and bearings that come with msfp-gen."""
    from msfp_gen.common.tables import Table
    from msfp_gen.scene.file.catalogue import descriptions, words_of_presets

    bearing, *systems = words_of_presets()
    show(Table(f"preset {word}s", (), list(descriptions(word).items())) for word in (*systems, bearing))


@app.command(epilog="Example:\n\n\b\n  msfp-gen doctor")
def doctor() -> None:
    """Check Python, libraries, compiler and cache."""
    from msfp_gen.jit.doctor import check_table, diagnose

    checks = diagnose()
    show([check_table(checks)])
    if not all(check.ok for check in checks):
        raise typer.Exit(1)


@app.command(
    epilog="Example:\n\n\b\n  msfp-gen cache\n"
    "  msfp-gen cache --prune 30   # remove models not used for 30 days\n  msfp-gen cache --clear"
)
def cache(
    prune: Annotated[
        float | None,
        typer.Option(parser=number, metavar="DAYS", help="Remove models not used for this many days."),
    ] = None,
    clear: Annotated[
        bool, typer.Option("--clear", help="Remove all models; they are built again when needed.")
    ] = False,
) -> None:
    """List the compiled models, their size and last use; remove old ones."""
    from msfp_gen.jit import cache

    if clear and prune is not None:
        raise InputError(f"--prune = {prune:g}: --clear removes everything; give one of them")
    if not clear and prune is None:
        _list(cache.cached_models())
        return
    removed, in_use = cache.prune(0.0 if clear or prune is None else prune)
    say(f"removed {_count(removed)}, {_megabytes(cache.total(removed))}")
    if in_use:
        say(f"kept {_count(in_use)} in use by another process")


def _list(items: list[CachedModel]) -> None:
    """Print one row per model of this version, and one row per kind of other entries."""
    from msfp_gen.common.tables import Table
    from msfp_gen.jit.cache import cache_root, total

    rows = [
        (item.spec, item.state, _megabytes(item.size), f"{item.days:.1f}") for item in items if item.state == "current"
    ]
    for state in ("other version", "damaged or old", "unfinished"):
        others = [item for item in items if item.state == state]
        if others:
            days = min(item.days for item in others)
            rows.append((_count(others), state, _megabytes(total(others)), f"{days:.1f}"))
    title = f"cache of models: {cache_root()} ({_count(items)}, {_megabytes(total(items))})"
    show([Table(title, ("model", "state", "size", "days since use"), rows)])


def _count(items: list[CachedModel]) -> str:
    return f"{len(items)} model{'' if len(items) == 1 else 's'}"


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"


TYPES = ("cs", "me")  # of a unit
AXES = ("Y", "Z")  # that may be vertical in a client of `serve`


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen export out.nc -o out.csv\n"
    "  msfp-gen export out.nc -o loop.csv --columns displacement_E1,top_force_E1,sliding\n"
    "  msfp-gen export fenz-test2 -o loop.parquet --columns displacement,top_force\n"
    "  msfp-gen export 5 2 2 --prefix msfp         # a C library: lib, include, share\n"
    "  msfp-gen export 5 2 2  3 1 1 --prefix msfp  # two layouts in one library\n"
    "  msfp-gen export 5 2 2 --prefix win --target windows-x86_64"
)
@with_effects
def export(
    what: Annotated[
        list[str],
        typer.Argument(
            metavar="RUN | N M P",
            help="A result (.nc), or a scene file or preset, which is run first. With --prefix: layouts, three numbers "
            "each, as for generate.",
        ),
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Write the rows of a run: .csv or .parquet.")
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help="Columns after time, separated by commas: names or whole variables."),
    ] = None,
    sign: SignOption = DEFAULT,
    prefix: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write a C library of layouts there. The effects below are for this."),
    ] = None,
    target: Annotated[
        str | None,
        typer.Option(metavar="PLATFORM", help=f"Platform of the C library, if not this machine: {', '.join(TARGETS)}."),
    ] = None,
    force: Force = False,
    *,
    effects: Effects,
) -> None:
    """Write the rows of a run as CSV or Parquet, or (--prefix) layouts as a C library for C, C++ and Fortran."""
    if prefix is not None:
        for value, option in (
            (output, "--output"),
            (columns, "--columns"),
            (None if sign == DEFAULT else sign, "--sign"),
        ):
            if value is not None:
                raise InputError(
                    f"{option} = {str(value)!r}: this is for the rows of a run; leave it out with --prefix"
                )
        _export_library([ModelSpec(layout, effects) for layout in _layouts(what)], prefix, target)
    elif target is not None:
        raise InputError(f"--target = {target!r}: this is for a C library; give --prefix DIR")
    elif output is None:
        raise InputError("export: give --output FILE for the rows of a run, or --prefix DIR for a C library of layouts")
    elif len(what) > 1 or effects != Effects():
        words = " ".join(what)
        raise InputError(
            f"RUN = {words!r}: give one result, scene file or preset and no effects; layouts need --prefix"
        )
    else:
        _export_rows(what[0], output, columns, sign, force)


def _export_rows(source: str, output: Path, columns: str | None, sign: str, force: bool) -> None:
    from msfp_gen.common.tables import TABLE_SUFFIXES
    from msfp_gen.results.files import export_columns

    check_output(output, TABLE_SUFFIXES, "--output")
    names = None if columns is None else [name.strip() for name in columns.split(",")]
    sign_of(sign, "--sign")
    result, failure = result_of(load_source(source), force)
    with using_sign(sign):
        note(f"wrote {export_columns(result, output, names)}")
    if failure is not None:
        raise failure


def _layouts(words: list[str]) -> list[Layout]:
    """The layouts that words name, three whole numbers each."""
    try:
        numbers = [int(word) for word in words]
    except ValueError:
        numbers = []
    if not numbers or len(numbers) % 3:
        raise InputError(f"N M P = {' '.join(words)!r}: give three whole numbers for each layout, such as 5 2 2")
    return [Layout(*numbers[i : i + 3]) for i in range(0, len(numbers), 3)]


def _export_library(specs: list[ModelSpec], prefix: Path, target: str | None) -> None:
    from msfp_gen.common.tables import Table
    from msfp_gen.embedding.library import export_library

    with building(kept=False) as progress:
        library = export_library(specs, prefix, progress, target)
    rows = [*library.models.items(), ("prefix", str(library.prefix)), ("files", str(len(library.files)))]
    show([Table("C library msfp", (), rows)])
    example = "" if target else "; `make run` in share/msfp/examples runs a C example"
    note(f"start with {library.prefix / 'share/msfp/README.md'}{example}")


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen fmu bearing.toml -o bearing.fmu            # a rig: motion in, wrench out\n"
    "  msfp-gen fmu isolated.toml -o isolated.fmu --fmi 3 --type me  # a mass: force in, motion out"
)
def fmu(
    source: Annotated[
        str,
        typer.Argument(metavar="SCENE", help="A scene file or preset with a rig or a mass.", autocompletion=scenes),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.fmu", help="The file to write.")],
    fmi: Annotated[int, typer.Option(metavar="2|3", parser=whole_number, help="Version of FMI.")] = 2,
    kind: Annotated[
        str,
        typer.Option(
            "--type", metavar="|".join(TYPES), help="cs: Co-Simulation; me: also Model Exchange, of a supported mass."
        ),
    ] = "cs",
) -> None:
    """Write a bearing as a unit (FMU) for Co-Simulation: a rig takes motion and gives wrenches, a mass takes forces."""
    from msfp_gen.common.tables import Table
    from msfp_gen.embedding.unit import write_fmu
    from msfp_gen.scene.file.source import load_bearing_scene

    if kind not in TYPES:
        raise InputError(f"--type = {kind!r}: give one of {', '.join(TYPES)}")
    with building(kept=False) as progress:
        unit = write_fmu(load_bearing_scene(source), output, version=fmi, exchange=kind == "me", progress=progress)
    counts = {block.name.lower(): 0 for block in dict.fromkeys(unit_variable.block for unit_variable in unit.variables)}
    for variable in unit.variables:
        counts[variable.block.name.lower()] += 1
    rows = [("model", unit.model), ("kinds", ", ".join(unit.kinds))]
    rows += [(name, str(counts[name])) for name in ("inputs", "outputs", "parameters", "states") if name in counts]
    show([Table(f"FMI {fmi}.0 unit {output.stem}", (), rows)])
    note(f"wrote {unit.path}")


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen serve bearing.toml --port 7000\n"
    "  msfp-gen serve outer.toml inner.toml --port 7000 --bearings 4"
)
def serve(
    sources: Annotated[
        list[str],
        typer.Argument(metavar="SCENE...", help="Scene files or presets, each with a rig.", autocompletion=scenes),
    ],
    port: Annotated[
        int,
        typer.Option(metavar="N", parser=whole_number, help="Port of the first scene; the others have the next ones."),
    ],
    bearings: Annotated[
        int | None,
        typer.Option(metavar="N", parser=whole_number, help="End after N bearings have ended; else at Ctrl-C."),
    ] = None,
    up: Annotated[str, typer.Option(metavar="|".join(AXES), help="Vertical axis of the client in space.")] = "Z",
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="Address to listen on.")] = "127.0.0.1",
) -> None:
    """Serve bearings to `element genericClient` of OpenSees: every element is a bearing of its own."""
    from msfp_gen.embedding.server import Server
    from msfp_gen.embedding.two_port import TwoPort
    from msfp_gen.scene.file.source import load_bearing_scene

    if up not in AXES:
        raise typer.BadParameter(f"--up = {up!r}: give one of {', '.join(AXES)}")
    if bearings is not None and bearings < 1:
        raise typer.BadParameter(f"--bearings = {bearings}: give at least 1")
    if port < 1:
        raise typer.BadParameter(f"--port = {port}: give at least 1")
    makers = []
    for source in sources:
        make = partial(TwoPort.of_scene, load_bearing_scene(source))
        make()  # what is wrong with a scene is said before anybody connects
        makers.append((source, make))
    with Server(makers, port, report=note, host=host, up=up) as server:
        for source, port_of_source in zip(sources, server.ports, strict=True):
            say(f"serving {source} at {host}:{port_of_source}")
        failed = server.serve(bearings)
    if failed:
        raise RunError(f"{failed} of {bearings} bearings failed; see the messages above", status="failed")
