"""The command line, `msfp-gen`. Only this package prints; large libraries are imported when a command needs them."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from msfp_gen.cli import (
    assessment_commands,
    audit_commands,
    batch_commands,
    figure_commands,
    model_commands,
    record_commands,
    run_commands,
    sheet_commands,
    study_commands,
)
from msfp_gen.cli.console import fail, say, signals_as_interrupts
from msfp_gen.common.errors import MsfpError
from msfp_gen.common.version import __version__

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
# Base class of usage errors: ClickException, of click or of the copy of click inside newer versions of typer.
USAGE_ERROR: Any = typer.BadParameter.__mro__[2]

app = typer.Typer(
    help="Full nonlinear equations of motion of multi-stage friction pendulum bearings: derived, compiled, integrated.",
    epilog="Examples:\n\n\b\n"
    "  msfp-gen demo -o out\n  msfp-gen run fenz-test2 --plot loops.png\n  msfp-gen generate 7 3 3",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"max_content_width": 120},
)
# This order is the order of the commands in the help text.
for group in (
    run_commands, batch_commands, study_commands, figure_commands, assessment_commands, record_commands,
    sheet_commands, audit_commands, model_commands,
):  # fmt: skip
    app.add_typer(group.app)


def main(argv: list[str] | None = None) -> int:
    """Run the command line with `argv` (None: of the process).

    Returns the exit code: 0 success, 1 the run failed, 2 bad input, 128 + number of the signal if interrupted.
    """
    with signals_as_interrupts() as signals:
        code = _main(argv)
        return 128 + signals[0] if code == INTERRUPTED and signals else code


def _main(argv: list[str] | None) -> int:
    arguments = sys.argv[1:] if argv is None else argv
    try:
        code = app(args=arguments or ["--help"], prog_name="msfp-gen", standalone_mode=False) or 0
    except MsfpError as error:
        return fail(str(error), error.exit_code)
    except OSError as error:  # such as a full disk, or a closed pipe on standard output
        return fail(str(error), FAILED)
    except MemoryError:
        return fail("no memory is left; give output_step, a shorter duration or fewer scenes", FAILED)
    except typer.Abort:
        code = INTERRUPTED
    except USAGE_ERROR as error:
        return fail(f"{error.format_message().rstrip('.')} (see msfp-gen --help)", BAD_INPUT)
    # Typer turns Ctrl-C into this code without a message.
    return fail("interrupted", code) if code == INTERRUPTED else int(code)


def _print_version(requested: bool) -> None:
    if requested:
        say(f"msfp-gen {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_print_version, help="Print the version and exit.")
    ] = False,
) -> None:
    pass
