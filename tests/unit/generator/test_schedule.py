"""A schedule against its programs: mistakes that a C compiler does not see are found before anything is emitted."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from msfp_gen import Effects, Layout
from msfp_gen.generator import directions, drivers, generate, places
from msfp_gen.generator import schedule as schedules
from msfp_gen.generator.derive import Equations, derive
from msfp_gen.generator.drivers import with_ends
from msfp_gen.generator.lower import lower
from msfp_gen.generator.places import Call, Pass, Schedule, calls_of, check, passes_of
from msfp_gen.generator.program import Program
from msfp_gen.generator.schedule import beside, condensed, energies, momentum_balances, two_port, unknowns
from msfp_gen.specification.layout import ModelSpec

EFFECTS = [
    {},
    {"dimension": "planar", "sliders": "massless"},
    {"spin": "free", "rims": False},
    {"uplift": True},
    {"friction": "pvt"},
    {"top_rotation": True},
]


def equations_of(**effects: object) -> Equations:
    return derive(ModelSpec(Layout(3, 1, 1), Effects(**effects)))  # type: ignore[arg-type]


SCHEDULES = [momentum_balances, condensed]


def all_parts(effects: Effects) -> Schedule:
    """An evaluation, what follows it, and the programs that C calls one by one."""
    ends = with_ends(effects) if effects.permits_moving_ends else {}
    return {**condensed(effects), **ends, **energies(effects), **beside(effects)}


def checked(equations: Equations, passes: tuple[Pass, ...]) -> None:
    programs = {program.name: program for program in equations.programs}
    check(passes, programs, equations.blocks, equations.value_blocks)


def changed(name: str, change: Callable[[Call], Call | None]) -> tuple[Pass, ...]:
    """The schedule with another call of a program, or without it."""

    def calls(one: Pass) -> tuple[Call, ...]:
        made = (change(call) if call.program == name else call for call in one.calls)
        return tuple(call for call in made if call is not None)

    return tuple(replace(one, calls=calls(one)) for one in passes_of(momentum_balances(Effects())))


@pytest.mark.parametrize("schedule", [*SCHEDULES, all_parts])
@pytest.mark.parametrize("effects", EFFECTS, ids=str)
def test_schedule_fits_the_programs_of_every_model(
    effects: dict[str, object], schedule: Callable[[Effects], Schedule]
) -> None:
    equations = equations_of(**effects)
    checked(equations, tuple(passes_of(schedule(equations.spec.effects))))


def test_a_place_of_another_kind_is_found() -> None:
    swapped = changed("linear_balance", lambda call: replace(call, reads=(*call.reads[:2], "moment[k-1]", "force[k]")))
    with pytest.raises(AssertionError, match="linear_balance"):
        checked(equations_of(), swapped)


def test_generation_checks_the_ends_of_a_two_port(monkeypatch: pytest.MonkeyPatch) -> None:
    def swapped(effects: Effects) -> Schedule:
        def turned(one: Pass) -> Pass:
            return replace(one, calls=tuple(replace(call, reads=call.reads[::-1]) for call in one.calls))

        return {name: tuple(map(turned, passes)) for name, passes in two_port(effects).items()}

    monkeypatch.setattr(drivers, "two_port", swapped)
    with pytest.raises(AssertionError, match=r"interface_load|lower_wrench|upper_wrench|locking_moment"):
        generate(ModelSpec(Layout(2, 0, 1), Effects(top_rotation=True)))


def test_a_missing_input_is_found() -> None:
    with pytest.raises(AssertionError, match="report_wrench"):
        checked(equations_of(), changed("report_wrench", lambda call: replace(call, reads=call.reads[:2])))


def test_what_nobody_wrote_or_wrote_elsewhere_is_found() -> None:
    with pytest.raises(AssertionError, match="slip_rotation"):
        checked(equations_of(), changed("slip_rotation", lambda call: replace(call, writes=("report_contact[j]",))))
    with pytest.raises(AssertionError, match="report_contact"):
        checked(equations_of(), changed("slip_rotation", lambda call: None))


@pytest.mark.parametrize("effects", [*EFFECTS, {"dimension": "planar", "friction": "pvt"}], ids=str)
def test_programs_of_a_schedule_declare_no_derivatives(effects: dict[str, object]) -> None:
    """But for those that the runtime differentiates alone, and the columns of the fast tangent."""
    equations = equations_of(**effects)
    called = {
        name
        for schedule in SCHEDULES
        for call in calls_of(passes_of(schedule(equations.spec.effects)))
        for name in call.programs
    }
    declared = {program.name for program in equations.programs if program.tangents}
    assert declared & called == {"contact", *(["rim"] if equations.spec.effects.rims else [])}


@pytest.mark.parametrize(("dimension", "count"), [("spatial", 12), ("planar", 6)])
def test_unknowns_are_as_many_as_balances(dimension: str, count: int) -> None:
    found = unknowns(equations_of(dimension=dimension).spec)
    assert len(found) == len(set(found)) == count


def test_the_schedule_has_no_text_in_c() -> None:
    """Nodes alone: `drivers.py` knows how each is written, with constants, arguments and members of C."""
    text = inspect.getsource(schedules) + inspect.getsource(places)
    source = re.sub(r'""".*?"""', "", text, flags=re.DOTALL)
    assert not re.search(r"MSFP_|msfp_(?!gen)|\w->|\[j\];|NULL", source)


def test_arguments_that_a_driver_does_not_name_are_marked() -> None:
    """Found from the statements, and the same as a search of their text finds."""
    equations = equations_of(top_rotation=True)
    programs = {program.name: program for program in equations.programs}
    schedule = drivers.with_variables(equations.spec.effects)
    tangents = drivers.form_of(directions.BY_VARIABLES, schedule, drivers.variable_kernels(equations))
    for name, passes in schedule.items():
        printed = drivers.DriverPrinter().part(name, passes, programs, [tangents])
        for form in ("values", "tangents"):
            text = " ".join(line for one in printed["passes"][form] for line in one["lines"])
            named = {*re.findall(r"\w+", text)}
            assert printed["unused"][form] == [a for a in ("p", "dp", "w", "d", "s", "ds") if a not in named], name


@pytest.mark.parametrize("name", [name for parts in schedules.VARIABLES.values() for name, _ in parts])
def test_variables_of_a_step_are_quantities_of_their_blocks(name: str) -> None:
    """A quantity that was renamed would be left out of derivatives in silence."""
    blocks = equations_of(uplift=True).blocks
    known = set(places.block_of(name, blocks).quantities)
    assert {q for parts in schedules.VARIABLES.values() for one, many in parts for q in many if one == name} <= known


def test_what_moves_with_the_variables_of_a_step_is_found_from_the_schedule() -> None:
    """As with the ends, but constants of a stage stay; no balance reads the axial moment where spin is locked."""

    def derivatives(**effects: object) -> dict[str, Program]:
        equations = equations_of(**effects)
        programs = {program.name: program for program in equations.programs}
        schedule = drivers.with_variables(equations.spec.effects)
        return directions.directed(directions.BY_VARIABLES, schedule, programs, equations.blocks)

    locked, free, massless, heated = (
        derivatives(**one)
        for one in ({"spin": "locked"}, {"spin": "free"}, {"sliders": "massless"}, {"friction": "pvt"})
    )
    assert "contact_stage" not in locked and "contact" not in locked  # constant; the runtime differentiates it
    assert locked["angular_balance"].tangents == free["angular_balance"].tangents - {"rz"} == {"rx", "ry"}
    assert locked["report_contact"].tangents == {"px", "py", "pz", "Mx", "My", "Mz", "dY", "dZ"}
    assert {"acx", "acy", "acz"} == locked["forward"].tangents - massless["forward"].tangents
    assert not {"rcx", "vcx"} & locked["forward"].tangents
    assert heated["surface_local"].tangents == locked["surface_local"].tangents | {"tilt"}  # a source moves with it
    top = {use.alias: use.active for use in locked["top_wrench"].inputs}
    assert not top["par"] and not top["y"] and top["fe"] and {"Cx", "alpz"} <= top["b"]


def test_what_moves_with_the_ends_and_is_read_is_found_from_the_schedule() -> None:
    """The length of a step is given, so constants of its formulas stay; nothing reads accelerations without mass."""

    def derivatives(**effects: object) -> dict[str, Program]:
        equations = equations_of(top_rotation=True, **effects)
        programs = {program.name: program for program in equations.programs}
        schedule = drivers.with_ends(equations.spec.effects)
        return directions.directed(directions.BY_ENDS, schedule, programs, equations.blocks)

    full, massless, heated = derivatives(), derivatives(sliders="massless"), derivatives(friction="pvt")
    assert full["contact_stage"].tangents == {"Y", "Z"}
    assert heated["contact_stage"].tangents == {"Y", "Z", "past"}
    assert full["contact"].tangents == {"Mx", "My", "Mz", "dY", "dZ", "N"}
    assert heated["contact"].tangents == full["contact"].tangents | {"mu", "source"}
    assert {"acx", "acy", "acz"} == full["forward"].tangents - massless["forward"].tangents
    assert not {"rcx", "vcx"} & full["forward"].tangents
    assert not any(use.active for use in full["top_wrench"].inputs if use.block.name.endswith("_parameters"))


@pytest.mark.parametrize(("uplift", "counts"), [(False, (1184, 1462)), (True, (1964, 2585))])
def test_operations_of_a_direction_are_those_of_the_page(uplift: bool, counts: tuple[int, int]) -> None:
    """Why the ends of a two-port have kernels of their own (docs/architecture.md)."""
    equations = equations_of(top_rotation=True, uplift=uplift)
    programs = {program.name: program for program in equations.programs}
    found = []
    for parameters in (False, True):
        along = replace(directions.BY_ENDS, parameters=parameters)
        kernels = directions.directed(along, condensed(equations.spec.effects), programs, equations.blocks)
        found.append(sum(lower(kernel).tangent_operations for kernel in kernels.values()))
    assert tuple(found) == counts
    page = (Path(__file__).parents[3] / "docs" / "architecture.md").read_text(encoding="utf-8")
    assert all(str(count) in page for count in counts)
