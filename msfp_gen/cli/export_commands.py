"""Command that hands over to other programs: the rows of a run as a table, or layouts as a C library: export."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msfp_gen.cli.console import SignOption, building, note, show, with_effects
from msfp_gen.cli.inputs import load_source, of_building, result_of
from msfp_gen.common.output import check_output
from msfp_gen.errors import InputError
from msfp_gen.jit.platforms import TARGETS
from msfp_gen.results.sign import DEFAULT, sign_of
from msfp_gen.specification.layout import Effects, Layout, ModelSpec

app = typer.Typer()


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
            "each, as of generate.",
        ),
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Of a run: write .csv or .parquet.")
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help="Columns after time, separated by commas: names or whole variables."),
    ] = None,
    sign: SignOption = DEFAULT,
    prefix: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Of layouts: write a C library there. The effects below are for this."),
    ] = None,
    target: Annotated[
        str | None,
        typer.Option(metavar="PLATFORM", help=f"Of the C library, if not this machine: {', '.join(TARGETS)}."),
    ] = None,
    *,
    effects: Effects,
) -> None:
    """Write the rows of a run as CSV or Parquet, or (--prefix) layouts as a C library for C, C++ and Fortran."""
    if prefix is not None:
        for given, option in (
            (output, "--output"),
            (columns, "--columns"),
            (None if sign == DEFAULT else sign, "--sign"),
        ):
            if given is not None:
                raise InputError(
                    f"{option} = {str(given)!r}: this is for the rows of a run; leave it out with --prefix"
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
        _export_rows(what[0], output, columns, sign)


def _export_rows(source: str, output: Path, columns: str | None, sign: str) -> None:
    from msfp_gen.results.files import TABLE_WRITERS, export_columns

    check_output(output, TABLE_WRITERS, "--output")
    names = None if columns is None else [name.strip() for name in columns.split(",")]
    sign_of(sign, "--sign")
    loaded = load_source(source)
    if of_building(loaded) and sign != DEFAULT:
        raise InputError(f"--sign = {sign!r}: columns of a building have one sign, base - top; leave it out")
    result, failure = result_of(loaded)
    note(f"wrote {export_columns(result, output, names, sign)}")
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
    from msfp_gen.embedding import export_library

    with building(kept=False) as progress:
        library = export_library(specs, prefix, progress, target)
    rows = [*library.models.items(), ("prefix", str(library.prefix)), ("files", str(len(library.files)))]
    show([Table("C library msfp", (), rows)])
    example = "" if target else "; `make run` in share/msfp/examples runs a C example"
    note(f"start with {library.prefix / 'share/msfp/README.md'}{example}")
