"""`msfp-gen export N M P --prefix DIR`: the C library is built once, and used as its users would."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import ROOT, Array
from support.example import example_bearing
from support.replay import REPLAY, inputs

from msfp_gen import (
    Effects,
    Layout,
    Motion,
    Scene,
    Solver,
    Top,
    build_model,
    cli,
    load_scene,
    simulate,
)
from msfp_gen.common.errors import CompileError
from msfp_gen.embedding import values
from msfp_gen.embedding.library import export_library
from msfp_gen.generator.interface import ABI_VERSION, model_name
from msfp_gen.jit.compiler import find_compiler
from msfp_gen.jit.library import BuiltLibrary, Platform, build_library, find_platform
from msfp_gen.simulation.start import start_compiled_run
from msfp_gen.specification import contract
from msfp_gen.specification.layout import ModelSpec

PLANAR = Effects(dimension="planar")  # of the library: half of the compiling of a spatial one
STRICT = "-std=c99 -O1 -Wall -Wextra -Werror -pedantic"
C = ROOT / "tests" / "support" / "c"


def needs(*tools: str) -> pytest.MarkDecorator:
    missing = [tool for tool in tools if shutil.which(tool) is None]
    return pytest.mark.skipif(bool(missing), reason=f"{', '.join(missing)} is not installed")


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two layouts in one library; the folder is moved after the export."""
    written, moved = tmp_path_factory.mktemp("written") / "msfp", tmp_path_factory.mktemp("moved") / "msfp"
    assert cli.main(["export", "5", "2", "2", "3", "1", "1", "--dimension", "planar", "--prefix", str(written)]) == 0
    shutil.move(written, moved)
    return moved


def run(command: list[str], cwd: Path, given: str = "", **environment: str) -> str:
    done = subprocess.run(
        command, cwd=cwd, input=given, capture_output=True, text=True, check=False, env={**os.environ, **environment}
    )
    assert done.returncode == 0 and not done.stderr, f"{command}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout


def compiled(prefix: Path, source: Path, folder: Path, *options: str) -> Path:
    """A program built through pkg-config with the shared library."""
    environment = {"PKG_CONFIG_PATH": str(prefix / "lib" / "pkgconfig")}
    flags = run(["pkg-config", "--cflags", "--libs", "msfp"], folder, **environment).split()
    rpath = f"-Wl,-rpath,{prefix / 'lib'}"
    command = [*find_compiler().command, *STRICT.split(), *options, str(source), *flags, rpath, "-o", "program"]
    run(command, folder)
    return folder / "program"


def values_header(prefix: Path, folder: Path) -> None:
    """`values.h` with the bearings of example.c."""
    example = (prefix / "share/msfp/examples/example.c").read_text(encoding="utf-8")
    pattern = r'^#include "msfp_.*?$|static const double (?:bodies|surfaces|top).*?^};'
    lines = re.findall(pattern, example, flags=re.DOTALL | re.MULTILINE)
    assert len(lines) == 8
    (folder / "values.h").write_text("\n".join(lines) + "\n", encoding="utf-8")


def example_scene() -> Scene:
    """The triple pendulum of the example as a scene."""
    found = values.example(ModelSpec(Layout.tfp(), PLANAR))
    names = ("stiffness", "damping", "rotational_stiffness", "rotational_damping")
    top = dict(zip(contract.names(contract.TOP), found.top, strict=True))
    return Scene(
        bearing=example_bearing(),
        motion=Motion.ramp(values.ACCELERATION, values.DURATION),
        top=Top.rig(axial_load=values.LOAD, **{name: top[name] for name in names}),
        effects=PLANAR,
        solver=Solver(rtol=1e-4),
        output_step=values.OUTPUT_STEP,
    )


@pytest.fixture(scope="module")
def expected() -> Array:
    """What the examples print of the triple pendulum, from Python: t [s], u1 [mm], F1 [kN], N1 [kN]."""
    h = simulate(example_scene()).history
    return np.column_stack((h.time, 1e3 * h.displacement[:, 0], 1e-3 * h.top_force[:, 0], 1e-3 * h.normal_force[:, 0]))


def printed_rows(output: str) -> dict[str, Array]:
    """Rows of each model that an example prints; every run must have ended well."""
    parts = re.split(r"^(msfp_\S+)\n.*\n", output, flags=re.MULTILINE)[1:]
    found = {}
    for name, text in zip(parts[::2], parts[1::2], strict=True):
        *rows, last = text.strip().splitlines()
        assert last == "ok: the run reached its end"
        found[name] = np.array([row.split() for row in rows], dtype=float)
    assert list(found) == ["msfp_5_2_2", "msfp_3_1_1"]
    assert all(rows.shape == (41, 4) and rows[-1, 2] > 50 for rows in found.values())
    return found


def assert_as_python(output: str, expected: Array) -> None:
    """As many digits as the example prints."""
    rows = printed_rows(output)["msfp_5_2_2"]
    for column, digits in enumerate((3, 4, 5, 5)):
        np.testing.assert_allclose(rows[:, column], expected[:, column], atol=0.51 * 10.0**-digits, rtol=0)


@needs("make", "pkg-config")
def test_the_c_example_links_two_layouts_and_runs_as_python_does(prefix: Path, expected: Array) -> None:
    folder = prefix / "share/msfp/examples"
    output = run(["make", "-s", f"CFLAGS={STRICT}", "run"], folder)
    assert_as_python(output, expected)
    assert run(["make", "-s", f"CFLAGS={STRICT}", "run-static"], folder) == output
    run(["make", "-s", "clean"], folder)


@needs("cmake")
def test_find_package_finds_it(prefix: Path, tmp_path: Path, expected: Array) -> None:
    source = prefix / "share/msfp/examples"
    run(
        ["cmake", "-S", str(source), "-B", "build", f"-DCMAKE_PREFIX_PATH={prefix}", f"-DCMAKE_C_FLAGS={STRICT}"],
        tmp_path,
    )
    run(["cmake", "--build", "build"], tmp_path)
    for program in ("example", "example-static"):
        assert_as_python(run([f"build/{program}"], tmp_path), expected)


@needs("make", "pkg-config", "gfortran")
def test_the_fortran_example_prints_what_the_c_example_prints(prefix: Path, expected: Array) -> None:
    folder = prefix / "share/msfp/examples"
    flags = "-std=f2018 -O1 -Wall -Werror -pedantic -fcheck=all"
    assert_as_python(run(["make", "-s", f"FFLAGS={flags}", "run-fortran"], folder), expected)
    run(["make", "-s", "clean"], folder)


@needs("pkg-config")
def test_rows_are_those_of_python_bit_by_bit(prefix: Path, tmp_path: Path) -> None:
    """A preset through the C library, half of it after a snapshot, its rows received by a callback.

    Rows at every step and at even times; a callback that ends every call of run_advance loses none.
    """
    program = compiled(prefix, REPLAY, tmp_path, "-DMODEL=msfp_5_2_2")
    for output_step in (None, 0.05):
        scene = replace(load_scene("fenz-test2"), effects=PLANAR, output_step=output_step)
        python = python_run(scene)
        for arguments in (["rows"], ["rows", "early"]):
            *lines, steps, status = run([str(program), *arguments], tmp_path, inputs(scene)).splitlines()
            rows = np.array([[float(word) for word in line.split()] for line in lines])
            np.testing.assert_array_equal(rows, python.rows)
            assert (int(steps), status) == (python.counts["steps"], "ok") and len(rows) > 100


def python_run(scene: Scene) -> Any:
    """The compiled run of a scene, at its end."""
    model = build_model(scene.bearing.layout, scene.effects)
    run, _ = start_compiled_run(scene, model, scene.effect_selection, scene.end, None, ())
    while run.advance():
        pass
    return run


@needs("pkg-config")
def test_a_history_changed_between_two_calls_counts(prefix: Path, tmp_path: Path) -> None:
    values_header(prefix, tmp_path)
    program = compiled(prefix, C / "changed_load.c", tmp_path, f"-I{tmp_path}", "-Wno-unused-const-variable")
    runs: dict[str, Array] = {}
    printed = run([str(program)], tmp_path).splitlines()
    for name in ("pieces", "changed", "constant"):
        lines = [line.split() for line in printed if line.startswith(name)]
        assert lines[-1][1:] == ["status", "0"]
        runs[name] = np.array([line[1:] for line in lines[:-1]], dtype=float)
    np.testing.assert_allclose(runs["changed"], runs["pieces"], rtol=1e-9, atol=1e-6)
    assert runs["changed"][-1, 1] > 1.7 * runs["constant"][-1, 1]


@needs("pkg-config")
def test_runs_in_threads_are_those_of_one_thread(prefix: Path, tmp_path: Path) -> None:
    values_header(prefix, tmp_path)
    program = compiled(prefix, C / "threads.c", tmp_path, f"-I{tmp_path}", "-pthread", "-D_POSIX_C_SOURCE=200112L")
    assert run([str(program)], tmp_path) == "same\n"


@needs("pkg-config")
def test_bad_values_are_refused_with_a_message(prefix: Path, tmp_path: Path) -> None:
    """Each names the field and the remedy; no handle is made."""
    values_header(prefix, tmp_path)
    program = compiled(prefix, C / "refusals.c", tmp_path, f"-I{tmp_path}", "-Wno-unused-const-variable")
    lines = [line.split("|") for line in run([str(program)], tmp_path).splitlines()]
    assert len(lines) == 33 and all(len(line) == 3 for line in lines), lines
    for what, status, message in lines:
        if "=" in what:
            assert status == "argument" and re.search(r"give |leave it|--", message), (what, message)
            field = re.split("[:,]", message)[0]
            assert field.rstrip("s") in what or (field == "motion" and "_time" in what), (what, message)
    found = {what: status for what, status, _ in lines if "=" not in what}
    assert found == {
        "no bodies": "argument",
        "no handle": "argument",
        "accelerations of nothing": "argument",
        "accelerations at NaN": "finite",
        "no snapshot": "snapshot",
        "no status": "unknown",
    }


@needs("nm")
def test_the_shared_library_shows_the_tables_alone(prefix: Path) -> None:
    (shared,) = prefix.glob("lib/libmsfp.so.*")
    shown = run(["nm", "-D", "--defined-only", str(shared)], prefix).split()[2::3]
    assert sorted(shown) == ["msfp_3_1_1", "msfp_5_2_2"]
    static = run(["nm", "-g", "--defined-only", str(prefix / "lib/libmsfp.a")], prefix)
    names = re.findall(r"^[0-9a-f]+ \w (\S+)$", static, flags=re.MULTILINE)
    assert len(names) > 100 and all(name.startswith(("msfp_5_2_2", "msfp_3_1_1")) for name in names)


def test_the_sources_compile_without_warnings(prefix: Path, tmp_path: Path) -> None:
    """From the folder of sources alone."""
    sources = sorted(str(path) for path in (prefix / "share/msfp/src/msfp_3_1_1").glob("*.c"))
    assert len(sources) > 20
    run([*find_compiler().command, *STRICT.split(), "-fsyntax-only", *sources], tmp_path)


@needs("make", "pkg-config", "valgrind")
def test_valgrind_finds_nothing(prefix: Path) -> None:
    folder = prefix / "share/msfp/examples"
    run(["make", "-s", "example-static"], folder)
    command = ["valgrind", "-q", "--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=all", "./example-static"]
    printed_rows(run(command, folder))
    run(["make", "-s", "clean"], folder)


@needs("g++")
def test_the_headers_serve_cpp(prefix: Path, tmp_path: Path) -> None:
    (tmp_path / "use.cpp").write_text('#include "msfp_5_2_2.h"\nint n() { return msfp_5_2_2()->abi_version; }\n')
    command = ["g++", "-Wall", "-Wextra", "-Werror", "-pedantic", f"-I{prefix / 'include'}", "-fsyntax-only", "use.cpp"]
    assert run(command, tmp_path) == ""


# ---- the Fortran module has what the header has --------------------------------------------------------------------

KINDS = {
    "int": "integer(c_int)",
    "size_t": "integer(c_size_t)",
    "double": "real(c_double)",
    "msfp_piecewise": "type(msfp_piecewise)",
}


def structs_of_c(text: str) -> dict[str, list[tuple[str, str]]]:
    """Members of every struct of msfp.h: name, and type in Fortran."""
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    found = {}
    for body, name in re.findall(r"typedef struct(?: \w+)? \{(.*?)\n\} (\w+);", text, flags=re.DOTALL):
        members = []
        for line in (" ".join(part.split()) for part in body.split(";")):
            if function := re.search(r"\(\*(\w+)\)\(", line):
                members.append((function.group(1), "type(c_funptr)"))
            elif line:
                kind = line.removeprefix("const ").split()[0]
                for declared in line[line.index(kind) + len(kind) :].split(","):
                    pointer, plain = "*" in declared, re.sub(r"\[.*?\]", "", declared).replace("*", "").strip()
                    members.append((plain, "type(c_ptr)" if pointer else KINDS[kind]))
        found[name] = members
    return found


def structs_of_fortran(text: str) -> dict[str, list[tuple[str, str]]]:
    text = re.sub(r"&\n\s*", "", re.sub(r"!.*", "", text))
    found = {}
    for name, body in re.findall(r"type, bind\(c\) :: (\w+)\n(.*?)end type", text, flags=re.DOTALL):
        members = []
        for line in filter(None, (part.strip() for part in body.splitlines())):
            kind, _, declared = line.partition(" :: ")
            plain = re.sub(r"\([\d, ]+\)|= *[\w.]+", "", declared)
            members += [(member.strip(), kind) for member in plain.split(",")]
        found[name] = members
    return found


def test_the_fortran_module_has_the_types_of_the_header(prefix: Path) -> None:
    header = (prefix / "include/msfp.h").read_text(encoding="utf-8")
    module = (prefix / "share/msfp/msfp.f90").read_text(encoding="utf-8")
    c, fortran = structs_of_c(header), structs_of_fortran(module)
    assert set(c) == set(fortran) and len(c) == 13
    for name, members in c.items():
        assert fortran[name] == members, name
    constants = dict(re.findall(r"parameter :: (MSFP_\w+) = (\d+)", module))
    assert constants["MSFP_ABI_VERSION"] == str(ABI_VERSION)
    enumerated = set(re.findall(r"^    (MSFP_\w+)", header, flags=re.MULTILINE)) - {"MSFP_CALL_ERRORS"}
    seeds = {name for name in enumerated if name.startswith("MSFP_SEED")}
    assert enumerated - seeds <= set(constants) and len(enumerated) > 50


def test_the_fortran_module_has_the_functions_of_the_header(prefix: Path) -> None:
    """Their parameters by name and order, and whether C takes the value."""
    header = re.sub(r"/\*.*?\*/", "", (prefix / "include/msfp.h").read_text(encoding="utf-8"), flags=re.DOTALL)
    module = re.sub(r"&\n\s*", "", (prefix / "share/msfp/msfp.f90").read_text(encoding="utf-8"))
    api = header.partition("typedef struct msfp_api {")[2].partition("} msfp_api;")[0]
    functions = re.findall(r"\(\*(\w+)\)\(([^)]*)\);", api)
    assert functions
    for name, parameters in functions:
        given = [" ".join(text.split()) for text in parameters.split(",")]
        found = re.search(rf"(?:function|subroutine) f_{name}\(([^)]*)\) bind\(c\)(.*?)end ", module, re.DOTALL)
        assert found, name
        assert found[1].replace(" ", "").split(",") == [re.split(r"[ *]", text)[-1] for text in given], name
        for text in given:
            kind, word = text.removeprefix("const ").split(" ")[0], re.split(r"[ *]", text)[-1]
            (declared,) = re.findall(rf"(\S+), .*:: {word}(?:\(\*\))?$", found[2], re.MULTILINE)
            scalar = {"int": "c_int", "long": "c_long", "double": "c_double", "size_t": "c_size_t"}.get(kind)
            assert scalar is None or declared.endswith(f"({scalar})"), text
            assert (f":: {word}(*)" in found[2]) <= ("*" in text), text
        assert f"procedure(f_{name}), pointer, nopass :: {name} =>" in module
        assert f"call c_f_procpointer(model%api%{name}, model%{name})" in module


LEFT_OUT = """program left_out
   use msfp
   implicit none
   type(msfp_model) :: model
   type(msfp_method_stages) :: method
   type(c_ptr) :: bearing, message
   integer(c_int) :: status
   model = msfp_load(msfp_3_1_1())
   status = model%bearing_new(9.8d0, bearing=bearing, message=message)
   print "(2a)", msfp_string(model%status_name(status)), ": " // msfp_string(message)
   status = model%port_method(MSFP_METHOD_IMPLICIT, method)
   print "(i0, f8.4)", method%count, method%diagonal
end program left_out
"""


@needs("pkg-config", "gfortran")
def test_an_argument_that_fortran_leaves_out_is_null(prefix: Path, tmp_path: Path) -> None:
    (tmp_path / "left_out.f90").write_text(LEFT_OUT, encoding="utf-8")
    environment = {"PKG_CONFIG_PATH": str(prefix / "lib" / "pkgconfig")}
    library = run(["pkg-config", "--libs", "msfp"], tmp_path, **environment).split()
    module = str(prefix / "share/msfp/msfp.f90")
    flags = ["-std=f2018", "-Wall", "-Werror", "-pedantic", "-fcheck=all"]
    command = ["gfortran", *flags, module, "left_out.f90", *library, f"-Wl,-rpath,{prefix / 'lib'}", "-o", "left_out"]
    run(command, tmp_path)
    refused, method = run(["./left_out"], tmp_path).splitlines()
    assert refused.startswith("argument: ") and "bodies" in refused
    assert method.split() == ["3", f"{1 - 2**-0.5:.4f}"]


def test_every_line_of_the_fortran_files_fits(prefix: Path) -> None:
    for name in ("msfp.f90", "examples/example.f90"):
        lines = (prefix / "share/msfp" / name).read_text(encoding="utf-8").splitlines()
        assert max(len(line.partition("!")[0]) for line in lines) <= 132, name


# ---- what is refused, and what is left alone ---------------------------------------------------------------------


def test_a_library_takes_the_objects_that_another_one_compiled(prefix: Path, tmp_path: Path) -> None:
    """Of the planar (3,1,1), which is in the library of the prefix, nothing is compiled again."""
    spec = ModelSpec(Layout(3, 1, 1), Effects(dimension="planar"))
    build_library([spec], tmp_path, find_platform(None), lambda text, share: None)
    commands = (tmp_path / "build.log").read_text(encoding="utf-8")
    assert " -shared " in commands and " -c " not in commands


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Builds that write empty libraries without compiling."""

    def build(specs: Any, folder: Path, platform: Platform, progress: Any) -> BuiltLibrary:
        static, shared = folder / "libmsfp.a", folder / Path(platform.shared).name
        static.write_bytes(b"")
        shared.write_bytes(b"")
        names = [model_name(spec) for spec in specs]
        public = {"msfp.h": "h\n", **{f"{name}.h": f"{name}\n" for name in names}}
        sources = {name: {"run.c": "c\n"} for name in names}
        return BuiltLibrary(static, shared, None, public, sources)

    monkeypatch.setattr("msfp_gen.embedding.library.build_library", build)


def files_below(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    capsys.readouterr()
    assert cli.main(["export", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and err.count("\n") == 1
    return err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["5", "2", "2"], "give --output FILE for the rows of a run, or --prefix DIR for a C library"),
        (["5", "2", "--prefix", "lib"], "N M P = '5 2': give three whole numbers for each layout"),
        (["out.nc", "--prefix", "lib"], "N M P = 'out.nc': give three whole numbers"),
        (["5", "2", "1", "--prefix", "lib"], "layout.n = 5"),
        (["5", "2", "2", "5", "2", "2", "--prefix", "lib"], "layouts = 5 2 2, 5 2 2: give each layout once"),
        (["5", "2", "2", "--prefix", "lib", "-o", "x.csv"], "--output = 'x.csv': this is for the rows of a run"),
        (["5", "2", "2", "--prefix", "lib", "--columns", "gap"], "--columns = 'gap': this is for the rows of a run"),
        (["5", "2", "2", "--prefix", "lib", "--target", "vax"], "--target = 'vax': give one of windows-x86_64, macos-"),
        (["out.nc", "-o", "x.csv", "--target", "macos-arm64"], "--target = 'macos-arm64': this is for a C library"),
        (["5", "2", "2", "-o", "x.csv"], "RUN = '5 2 2': give one result, scene file or preset"),
        (["out.nc", "-o", "x.csv", "--uplift"], "RUN = 'out.nc': give one result, scene file or preset and no effects"),
    ],
)
def test_calls_that_are_neither_are_refused(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert words in refused(capsys, *arguments)
    assert not list(tmp_path.iterdir())


def test_a_second_export_replaces_the_first_and_nothing_else(quick: None, tmp_path: Path) -> None:
    prefix = tmp_path / "usr"
    (prefix / "include").mkdir(parents=True)
    (prefix / "include" / "own.h").write_text("mine\n")
    assert cli.main(["export", "5", "2", "2", "2", "1", "0", "--prefix", str(prefix)]) == 0
    assert (prefix / "include/msfp_2_1_0.h").exists() and (prefix / "share/msfp/src/msfp_2_1_0").is_dir()
    assert cli.main(["export", "5", "2", "2", "--prefix", str(prefix)]) == 0
    assert not (prefix / "include/msfp_2_1_0.h").exists() and not (prefix / "share/msfp/src/msfp_2_1_0").exists()
    assert (prefix / "include/own.h").read_text() == "mine\n" and (prefix / "include/msfp_5_2_2.h").exists()
    assert (prefix / "lib/libmsfp.so").readlink() == Path(f"libmsfp.so.{ABI_VERSION}")


def test_files_of_the_user_are_not_replaced(quick: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example = tmp_path / "share/msfp/examples/example.c"
    assert cli.main(["export", "5", "2", "2", "--prefix", str(tmp_path)]) == 0
    example.write_text("mine\n")
    before = files_below(tmp_path)
    line = refused(capsys, "5", "2", "2", "3", "1", "1", "--prefix", str(tmp_path))
    assert "share/msfp/examples/example.c is not as msfp-gen wrote it: move it away" in line
    assert files_below(tmp_path) == before
    example.unlink()
    assert cli.main(["export", "5", "2", "2", "3", "1", "1", "--prefix", str(tmp_path)]) == 0


def test_an_export_that_was_stopped_can_be_repeated(
    quick: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert cli.main(["export", "5", "2", "2", "--prefix", str(tmp_path)]) == 0
    written = []

    def stopped(path: Path, parts: Any) -> None:
        if len(written) == 5:
            raise KeyboardInterrupt
        written.append(path)
        path.write_bytes(b"".join(parts))

    with monkeypatch.context() as patch:
        patch.setattr("msfp_gen.embedding.library.write_bytes", stopped)
        assert cli.main(["export", "3", "1", "1", "--prefix", str(tmp_path)]) == 130
    assert cli.main(["export", "3", "1", "1", "--prefix", str(tmp_path)]) == 0
    assert (tmp_path / "include/msfp_3_1_1.h").exists() and not (tmp_path / "include/msfp_5_2_2.h").exists()


@pytest.mark.parametrize(
    "manifest",
    ["", "[]", '{"files": 3}', '{"files": {"../x": []}}', '{"files": {"/etc/x": []}}', '{"files": {"x": "y"}}'],
)
def test_a_damaged_manifest_is_refused(
    manifest: str, quick: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "share/msfp").mkdir(parents=True)
    (tmp_path / "share/msfp/manifest.json").write_text(manifest)
    before = files_below(tmp_path)
    assert "manifest.json is damaged" in refused(capsys, "5", "2", "2", "--prefix", str(tmp_path))
    assert files_below(tmp_path) == before


def test_a_prefix_that_is_a_file_is_refused(quick: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    assert "is a file; give a folder" in refused(capsys, "5", "2", "2", "--prefix", str(tmp_path / "file" / "below"))


def test_a_missing_archiver_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AR", "no-such-ar")
    with pytest.raises(CompileError, match=r"no archiver found \(looked for no-such-ar\): install binutils or name it"):
        export_library([ModelSpec(Layout.tfp())], tmp_path / "lib")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("layout", "effects"),
    [
        (Layout(2, 1, 0), Effects(dimension="planar", sliders="massless")),
        (Layout(3, 0, 2), Effects(friction="pvt", uplift=True)),
        (Layout(7, 3, 3), Effects(friction="custom", friction_law="mu * (1 - c1 * exp(-c2 * v))", top_rotation=True)),
    ],
)
def test_the_examples_fit_every_model(layout: Layout, effects: Effects, quick: None, tmp_path: Path) -> None:
    """Without compiling: as many numbers as the contract has names, and sound text."""
    spec = ModelSpec(layout, effects)
    found = values.example(spec)
    assert {len(row) for row in found.surfaces} == {len(contract.surface_values(effects))}
    assert len(found.bodies) == layout.n and len(found.surfaces) == layout.surfaces
    export_library([spec], tmp_path)
    for name in ("example.c", "example.f90", "Makefile", "CMakeLists.txt"):
        text = (tmp_path / "share/msfp/examples" / name).read_text(encoding="utf-8")
        assert "[[" not in text and "[%" not in text and text.endswith("\n")
    assert (
        effects.law is None
        or ", ".join(effects.law.columns) in (tmp_path / "share/msfp/examples/example.c").read_text()
    )
