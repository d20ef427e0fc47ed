"""The emitted C as text: pure to make, clean to compile, no larger than the effects and no longer with the stack."""

from __future__ import annotations

import re
from itertools import combinations, product
from pathlib import Path

import pytest
from support import thinned
from support.emitted_c import emitted, text, warnings_of

from msfp_gen import Effects, InputError, Layout
from msfp_gen.common.version import __version__
from msfp_gen.generator import generate
from msfp_gen.generator.emit import FILES, TWO_PORT_FILES
from msfp_gen.jit.build import runtime_sources
from msfp_gen.jit.compiler import FLAGS
from msfp_gen.specification.layout import ModelSpec

CHOICES: dict[str, tuple[object, ...]] = {
    "dimension": ("spatial", "planar"),
    "spin": ("locked", "patch", "free"),
    "sliders": ("inertial", "massless"),
    "rims": (True, False),
    "bouc_wen": ("report", "isotropic"),
}
COMBINATIONS = [dict(zip(CHOICES, values, strict=True)) for values in product(*CHOICES.values())]
ALL_CHOICES = CHOICES | {
    "uplift": (False, True),
    "friction": ("constant", "velocity", "pvt"),
    "top_rotation": (False, True),
}
REFUSED = {"sliders": "massless", "spin": "free"}  # nothing would determine the spin
ALSO_REFUSED = {"sliders": "massless", "uplift": True}  # a separated body moves by its inertia
POSSIBLE = [e for e in COMBINATIONS if not REFUSED.items() <= e.items()]
LONGEST = 450  # lines: the Jacobian of a contact with the plastic law and a drilling moment


def functions(source: str) -> dict[str, str]:
    """Body of each C function by name."""
    return dict(re.findall(r"^static inline \w+ (msfp_\w+)\([^{]*\n?\{\n(.*?)^\}", source, re.DOTALL | re.MULTILINE))


def tuples(effects: dict[str, object], size: int) -> set[tuple[object, ...]]:
    """Every so many choices of a combination of effects taken together."""
    return set(combinations(effects.items(), size))


def covering(size: int, held: list[dict[str, object]]) -> list[dict[str, object]]:
    """Few combinations of all effects that, with those `held`, hold every possible `size` choices together."""
    possible = [dict(zip(ALL_CHOICES, values, strict=True)) for values in product(*ALL_CHOICES.values())]
    possible = [e for e in possible if not any(r.items() <= e.items() for r in (REFUSED, ALSO_REFUSED))]
    rest = {"uplift": False, "friction": "constant", "top_rotation": False}
    left = set().union(*(tuples(e, size) for e in possible)) - set().union(*(tuples(e | rest, size) for e in held))
    chosen = []
    while left:
        best = max(possible, key=lambda e: len(tuples(e, size) & left))
        chosen.append(best)
        left -= tuples(best, size)
    return chosen


def words(effects: dict[str, object]) -> str:
    return "-".join(map(str, effects.values()))


PAIRS = covering(2, [])  # those that hold the most pairs first


@pytest.mark.parametrize("effects", thinned(PAIRS, lambda effects: effects in PAIRS[:1]), ids=words)
def test_every_pair_of_effects_compiles_without_a_warning(effects: dict[str, object], tmp_path: Path) -> None:
    assert warnings_of(effects, tmp_path, "-fsyntax-only") == ""


@pytest.mark.slow
@pytest.mark.parametrize("effects", [*POSSIBLE, *covering(3, POSSIBLE)], ids=words)
def test_every_three_effects_compile_together_without_a_warning(effects: dict[str, object], tmp_path: Path) -> None:
    """And every combination of the effects that have kernels of their own."""
    assert warnings_of(effects, tmp_path, "-fsyntax-only") == ""


@pytest.mark.slow
def test_optimiser_has_nothing_to_warn_of_either(tmp_path: Path) -> None:
    """Some warnings, such as of values never set, need the flow that only the optimiser follows."""
    assert {"-std=c99", "-Wall", "-Wextra"} <= set(FLAGS["c"])
    assert warnings_of({"spin": "patch"}, tmp_path, "-O2", "-c") == ""


def test_the_one_impossible_combination_is_refused() -> None:
    assert len(POSSIBLE) == 40
    with pytest.raises(InputError, match="nothing determines the spin"):
        Effects(sliders="massless", spin="free")


def test_generating_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path, mode: str = "r", *rest: object, **more: object) -> None:
        raise AssertionError(f"the generator opened {path} with mode {mode}")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Path, "write_text", refuse)
    monkeypatch.setattr(Path, "mkdir", refuse)
    generated = generate(ModelSpec(Layout(2, 1, 0), Effects(top_rotation=True)))
    assert sorted(generated.files) == sorted([*FILES, *TWO_PORT_FILES, "msfp_2_1_0.h"])
    assert not list(tmp_path.iterdir())


def test_generating_twice_gives_the_same_text() -> None:
    spec = ModelSpec(Layout(3, 2, 0))
    assert generate(spec).files == generate(spec).files


@pytest.mark.parametrize("name", [*FILES, *TWO_PORT_FILES, "msfp_5_2_2.h"])
def test_each_file_carries_its_stamp(name: str) -> None:
    head = "\n".join(text(name, top_rotation=True).splitlines()[:4])
    spec = ModelSpec(Layout.tfp(), Effects(top_rotation=True))
    assert name in head and __version__ in head and "Do not edit" in head
    assert (spec.key in head) == (name not in ("msfp_module.pyx", "msfp.h"))  # these are the same for every model


def test_header_maps_each_index_to_a_symbol_and_a_unit() -> None:
    """Every enumerator but the sizes has `= index, /* [unit] meaning */`; indices of a block count up from 0."""
    header = text("msfp_model.h")
    blocks = re.findall(r"^/\* (\w+) \*/\nenum \{\n(.*?)^\};", header, re.DOTALL | re.MULTILINE)
    names = {name for name, _ in blocks}
    assert {"coordinates", "surface_parameters", "body_parameters", "top_parameters", "contact"} <= names
    for name, body in blocks:
        *fields, size = body.strip().splitlines()
        for i, line in enumerate(fields):
            assert re.fullmatch(rf"\s*MSFP_{name.upper()}_\w+ = {i}, /\* \[[^\]]*\] \S.* \*/", line), line
        assert size.strip() == f"MSFP_{name.upper()}_SIZE = {len(fields)}"
    assert "MSFP_SURFACE_PARAMETERS_MU" in header and "kernels" not in header.split("enum")[1]
    assert "msfp_model.h, which names each index" in text("msfp_kernels.h")


# ---- what is absent ----------------------------------------------------------------------------------------------


def test_rims_off_leaves_no_rim_in_the_kernels() -> None:
    assert "msfp_rim" in functions(text("msfp_kernels.h"))
    bare = text("msfp_kernels.h", rims=False)
    assert "msfp_rim" not in functions(bare) and "msfp_rim_tangent" not in functions(bare)
    assert not re.search(r"\bpar_kc\b|\bpar_cc\b", bare)


def test_planar_leaves_no_second_angle() -> None:
    flat, full = text("msfp_kernels.h", dimension="planar"), text("msfp_kernels.h")
    for symbol in ("psi", "phi"):
        assert re.search(rf"\bx_{symbol}|_{symbol}\b", full), symbol
        assert not re.search(rf"\b\w*{symbol}\w*\b *=|\b\w+_{symbol}\b", flat), symbol
    assert emitted(dimension="planar").operations < 0.5 * emitted().operations


def test_massless_leaves_no_inertia_in_the_balances() -> None:
    """Mass stays for the weight alone: no product with an acceleration, no moment of inertia."""
    for file, suffix, inertia in (
        ("msfp_kernels.h", "", r"par_j[ta]|b_ac"),
        ("msfp_schedule.h", "_by_variables", r"par_j[ta]|d_b_ac"),
    ):
        full, light = (functions(text(file, sliders=s)) for s in ("inertial", "massless"))
        for name in ("msfp_linear_balance", "msfp_angular_balance"):
            assert re.search(inertia, full[name + suffix]), name
            assert not re.search(r"par_j[ta]|b_ac|b_alp", light[name + suffix]), name


def test_drilling_moment_is_there_for_the_patch_alone() -> None:
    kernels = {spin: functions(text("msfp_kernels.h", spin=spin)) for spin in ("locked", "patch", "free")}
    uses_radius = {spin: "par_rs" in code["msfp_contact_lanes"] for spin, code in kernels.items()}
    assert uses_radius == {"locked": False, "patch": True, "free": False}


def test_laws_of_friction_differ_in_the_switches_alone() -> None:
    report, isotropic = (text("msfp_kernels.h", bouc_wen=law).splitlines() for law in CHOICES["bouc_wen"])
    calls = [sum(line.count("msfp_heaviside(") for line in lines) for lines in (report, isotropic)]
    assert calls[0] > calls[1] > 0


# ---- size --------------------------------------------------------------------------------------------------------


def without_names(source: str, layout: tuple[int, int, int]) -> str:
    """The text less what names the layout."""
    return source.replace("{}_{}_{}".format(*layout), "N_M_P")


@pytest.mark.parametrize("larger", thinned([((7, 3, 3),), ((11, 5, 5),)], lambda larger: larger == (7, 3, 3)), ids=str)
def test_kernels_do_not_grow_with_the_stack(larger: tuple[int, int, int]) -> None:
    small = without_names(text("msfp_kernels.h"), (5, 2, 2))
    assert without_names(text("msfp_kernels.h", larger), larger) == small
    header = [text("msfp_model.h", layout).splitlines() for layout in ((5, 2, 2), larger)]
    assert len(header[0]) == len(header[1])
    changed = [line for line, other in zip(*header, strict=True) if line != other]
    assert len(changed) <= 7, changed  # the stamp, the layout, its counts and its signs


def test_wrapper_is_the_same_text_for_every_model() -> None:
    """Cython translates it once for all."""
    other = text("msfp_module.pyx", (2, 1, 0), friction="pvt", uplift=True, top_rotation=True, dimension="planar")
    assert other == text("msfp_module.pyx")


def test_no_function_is_long() -> None:
    """The compiler's time goes up faster than the length of a function."""
    lengths = {name: body.count("\n") for name, body in functions(text("msfp_kernels.h", spin="patch")).items()}
    assert len(lengths) > 10
    assert max(lengths.values()) < LONGEST, max(lengths, key=lengths.__getitem__)


def test_what_no_scene_of_a_model_can_ask_for_is_not_compiled() -> None:
    """Two-ports with a rotating top, the report's method with masses and closed surfaces, unilateral contacts."""

    def files(**effects: object) -> set[str]:
        spec = ModelSpec(Layout.tfp(), Effects(**effects))  # type: ignore[arg-type]
        return {*runtime_sources(spec), *generate(spec).files}

    ports = {"port.c", "ends.c", "stage.c", "derivatives.c", "two_port.c", "msfp_by_ends.h"}
    every = files(top_rotation=True, uplift=True, friction="pvt") | files(top_rotation=True)
    assert ports | {"dopri5.c", "contact_unilateral.c", "memory.c"} <= every
    assert every - files() == ports | {"contact_unilateral.c", "memory.c"}
    assert every - files(uplift=True) >= ports | {"dopri5.c"}
    assert "dopri5.c" not in files(sliders="massless") and not ports & files(top_rotation=True, dimension="planar")
    kernels = text("msfp_kernels.h")
    assert not [word for word in ("rotation_angles", "far_end", "end_wrench", "locking") if word in kernels]


@pytest.mark.parametrize("friction", ["velocity", "pvt"])
def test_a_planar_model_with_a_friction_law_is_derived(friction):
    """In a plane the contact keeps no slope of the law along Z."""
    spec = ModelSpec(Layout(2, 1, 0), Effects(dimension="planar", rims=False, sliders="massless", friction=friction))
    assert any(re.search(r"law_Y", file) for file in generate(spec).files.values())
