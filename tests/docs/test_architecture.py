"""House rules of docs/architecture.md, read from the sources: imports run downward, one module prints, paths exist."""

import ast
import re
import subprocess
import sys
import tomllib
from functools import cache
from importlib.metadata import packages_distributions

import pytest
from support import ROOT

import msfp_gen
from msfp_gen.scene.system import kinds

LINKED = {"generator", "templates"}  # the same folders again, under their import names
PACKAGE = sorted(p for p in (ROOT / "msfp_gen").rglob("*.py") if not LINKED & set(p.relative_to(ROOT).parts))
CONSOLE = ROOT / "msfp_gen" / "cli" / "console.py"
GENERATOR = sorted((ROOT / "generator").glob("*.py"))
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]

# The packages and the modules beside them, lowest first: each imports only itself and what stands before it.
ORDER = (
    "common", "specification", "generator", "templates", "runtime", "jit", "motions", "scene",
    "model", "embedding", "results", "design", "figures", "simulation",
    "studies", "report", "auditing", "buildings", "", "cli", "__main__",
)  # fmt: skip  # "" is msfp_gen/__init__.py

# The guests of the core, and the guests that each of them imports; all import the core.
GUESTS = {
    "embedding": set(),
    "design": set(),
    "figures": {"design"},
    "studies": {"figures"},
    "report": {"figures", "studies", "design"},
    "auditing": {"figures", "report"},
    "buildings": {"figures", "report", "embedding"},
    "cli": {"auditing", "design", "embedding", "figures", "report", "studies"},
}

# What systems, their results, rows and characterisations derive from.
ROOTS_OF_KINDS = {"System", "OtherSystem", "SceneFields", "AnyResult", "Mounting", "BearingRows", "Characterisation"}
# Fields, keys of summaries, and tables of scene files that some kinds have and others have not.
KEYS_OF_KINDS = {"position", "bearings", "building", "mounting", "history", "events"}
# Functions outside `buildings` that ask for a kind by such a class or key, each with its reason.
KIND_SWITCHES = {
    "scene.file.source.load_bearing_scene": "states that a scene of one bearing is wanted",
    "studies.accuracy.timed_run.require_base_motion_only": "states that a method runs one bearing alone",
    "auditing.stated.stated_of": "states that a check is of one bearing",
    "cli.console.is_result": "the source of a command is a result or a scene",
    "auditing.momentum.momentum": "the position of a mass, in a table of any program",
}
# Functions outside `buildings` that ask whether a value has an attribute, each with its reason.
ATTRIBUTE_SWITCHES = {
    "scene.system.is_system": "states what a system is",
    "scene.system.require_field": "states that a kind of system has no such field",
    "results.quantities.value_at": "a path leads through tables and through attributes",
    "specification.layout.resolve": "`Auto` has some of the fields of `Effects`",
    "common.fields._rule": "a type hint may have a rule",
    "common.fields._is_sequence": "recognises arrays without importing NumPy",
    "studies.workers.pool_from": "an executor of any library may state its number of workers",
    "simulation.checkpoint.read_checkpoint": "what reading a damaged file raises",
    "results.files.<module>": "what reading a damaged file raises",
    "cli.console.<module>": "signals of the operating system",
    "common.cores.usable_cores": "a function of the operating system",
    "embedding.server.<module>": "an option of the operating system",
    "simulation.memory._of_machine": "a function of the operating system",
}

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
BROUGHT = {"markupsafe": "jinja2", "PIL": "matplotlib"}  # what a dependency requires itself
DEPENDENCIES, EXTRAS = PROJECT["dependencies"], PROJECT["optional-dependencies"]

# What `import msfp_gen` must never load.
HEAVY = {"sympy", "xarray", "matplotlib", "pint", "scipy", "h5netcdf", "h5py", "jinja2", "Cython"}
HEAVY |= {"pandas", "pyarrow", "loky"}
# Third-party modules that a module of the package may import when it is itself imported.
AT_IMPORT = {"numpy": None, "typer": {"cli"}}


def name_of(path):
    """Dotted name of a module."""
    inside = path.relative_to(ROOT).with_suffix("")
    parts = ("msfp_gen", *inside.parts) if inside.parts[0] == "generator" else inside.parts
    return ".".join(parts).removesuffix(".__init__")


def type_checking(node):
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


@cache
def tree_of(path):
    """The syntax tree of a file; each is read once."""
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imports_of(path, *, late):
    """Modules that a file imports, made absolute: when it is imported itself, or (late) ever, for types too."""
    found, todo = set(), list(tree_of(path).body)
    package = name_of(path) if path.name == "__init__.py" else name_of(path).rpartition(".")[0]
    while todo:
        node = todo.pop()
        if not late and (type_checking(node) or isinstance(node, ast.FunctionDef)):
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package.rsplit(".", node.level - 1)[0] if node.level else ""
            module = ".".join(part for part in (base, node.module) if part)
            names = {f"{module}.{alias.name}" for alias in node.names}
            found |= names if names <= set(MODULES) else {module, *names}  # a package is not what it holds
        todo += list(ast.iter_child_nodes(node))
    return frozenset(found)


MODULES = {name_of(path): path for path in (*PACKAGE, *GENERATOR)}
PACKAGES = sorted({name.split(".")[1] for name, path in MODULES.items() if path.parent.name != "msfp_gen"})


def ours(path, *, late):
    """The modules of the package that a file imports."""
    return {name for name in imports_of(path, late=late) if name in MODULES} - {name_of(path)}


def place(name):
    """How high a module stands, by the package it lies in."""
    return ORDER.index(name.removeprefix("msfp_gen").lstrip(".").partition(".")[0])


def test_the_reader_of_imports_sees_them():
    assert "msfp_gen.common.errors" in ours(ROOT / "msfp_gen" / "specification" / "layout.py", late=False)
    for name in ("derive", "specification.layout"):  # in a function, and for types
        module = name if "." in name else f"generator.{name}"
        assert f"msfp_gen.{module}" in ours(ROOT / "generator" / "__init__.py", late=True)
        assert f"msfp_gen.{module}" not in ours(ROOT / "generator" / "__init__.py", late=False)
    assert "scipy" not in {m.partition(".")[0] for p in PACKAGE for m in imports_of(p, late=False)}


def test_packages_import_downward():
    """Imports for types and in functions count."""
    back = [
        f"{name} imports {other}"
        for name, path in MODULES.items()
        for other in sorted(ours(path, late=True))
        if place(other) > place(name)
    ]
    assert not back, back


# What derives, emits, builds and runs; the packages above it are its guests.
CORE = (
    "common", "specification", "generator", "templates", "runtime", "jit", "motions", "scene", "model", "results",
    "simulation",
)  # fmt: skip


# What imports a module that a text names, or finds one that is imported already.
BY_TEXT = {"import_module", "__import__", "resolve_name", "runpy", "modules"}


def loads_by_text(tree):
    """Names and attributes of a module that load modules whose names are texts."""
    names = ("attr", "id", "name")  # of attributes, names and imported names
    return {getattr(node, name, "") for node in ast.walk(tree) for name in names} & BY_TEXT


def test_the_core_imports_no_satellite():
    """Imports in functions, for types, of the package itself, and of a module that a text names count."""
    for name, path in MODULES.items():
        if name.count(".") and name.split(".")[1] in CORE:
            above = [other for other in ours(path, late=True) if f"{other}.".split(".")[1] not in CORE]
            assert not above, f"{name} imports {above}"
            assert not loads_by_text(tree_of(path)), f"{name} imports a module that a text names"
    source = "__import__(x)\nimportlib.import_module(x)\npkgutil.resolve_name(x)\nsys.modules[x]\nrunpy.run_module(x)"
    assert loads_by_text(ast.parse(source)) == BY_TEXT


def test_guests_import_the_core_and_the_guests_that_are_listed():
    for package, others in GUESTS.items():
        files = [path for name, path in MODULES.items() if name.split(".")[1:2] == [package]]
        found = {other.split(".")[1] for path in files for other in ours(path, late=True) if other.count(".")}
        assert found - set(CORE) - {package} == others, package


def test_the_diagram_of_the_packages_has_their_imports():
    """Every arrow is an import of at least one module, and every import between guests is an arrow."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    drawn = set()
    for line in re.search(r"```mermaid\nflowchart TB\n(.*?)```", text, re.DOTALL)[1].splitlines():
        if "-." not in line:
            left, right = line.split("-->")
            drawn |= {(left.strip(), other.split("[")[0].strip()) for other in right.split("&")}
    arrows = {
        (name.split(".")[1], other.split(".")[1])
        for name, path in MODULES.items()
        for other in ours(path, late=True)
        if name.count(".") and other.count(".")
    }
    assert drawn <= arrows, drawn - arrows
    assert {(package, other) for package, others in GUESTS.items() for other in others} <= drawn


def classes_of_kinds():
    """Name -> folder of every class of a system, a result, its rows or its characterisation."""
    nodes = [(path.parent, node) for path in MODULES.values() for node in ast.walk(tree_of(path))]
    defined = {node.name: (folder, node.bases) for folder, node in nodes if isinstance(node, ast.ClassDef)}
    found = set(ROOTS_OF_KINDS)
    while more := {name for name, (_, bases) in defined.items() if found & set(map(ast.unparse, bases))} - found:
        found |= more
    return {name: defined[name][0] for name in found}


def classes_asked(node):
    """Names of the classes that a call, a comparison of types or a pattern asks for."""
    match node:
        case ast.Call(func=ast.Name("isinstance" | "issubclass"), args=[_, kinds]):
            asked = [kinds]
        case ast.Compare() if "type(" in ast.unparse(node):
            asked = [node.left, *node.comparators]
        case ast.MatchClass():
            asked = [node.cls]
        case _:
            asked = []
    return {getattr(part, "id", getattr(part, "attr", "")) for one in asked for part in ast.walk(one)}


def keys_asked(node):
    """Texts for which a call asks whether something has them, or with which an expression is compared."""
    match node:
        case ast.Call(func=ast.Name("getattr" | "hasattr") | ast.Attribute(attr="get"), args=asked):
            pass
        case ast.Compare():
            asked = [node.left, *node.comparators]
        case ast.MatchValue():
            asked = [node.value]
        case _:
            asked = []
    parts = [part for one in asked for part in (one.elts if isinstance(one, ast.Tuple | ast.List | ast.Set) else [one])]
    return {part.value for part in parts if isinstance(part, ast.Constant)}


def asks_for_an_attribute(node):
    """Whether an expression depends on whether a value has an attribute, of any name."""
    match node:
        case ast.Call(func=ast.Name("hasattr")) | ast.Call(func=ast.Name("getattr"), args=[_, _, _]):
            return True
        case ast.Attribute(attr="__dataclass_fields__" | "model_fields") | ast.Name("AttributeError"):
            return True
    return False


def places_that_ask(node, asks, place="<module>"):
    """The functions, by name, with a part for which `asks` is true; errors that they raise are left out."""
    place = node.name if isinstance(node, ast.FunctionDef) else place
    if asks(node):
        yield place
    for inner in ast.iter_child_nodes(node):
        if not isinstance(inner, ast.Raise):
            yield from places_that_ask(inner, asks, place)


def places_outside_buildings(asks):
    """Dotted names of the functions outside `buildings` that ask. asks: gives for a folder what finds it in a part."""
    for name, path in MODULES.items():
        if not name.startswith("msfp_gen.buildings"):
            inside = name.removeprefix("msfp_gen.")
            yield from (f"{inside}.{place}" for place in places_that_ask(tree_of(path), asks(path.parent)))


def asking_for(classes):
    """What says whether a part asks for one of these classes or for a key of a kind."""
    return lambda node: bool(classes_asked(node) & classes or keys_asked(node) & KEYS_OF_KINDS)


def test_few_functions_ask_for_the_kind_of_a_system():
    """What a system or a result can do stands in its class, in its `Kind`, or in functions that kinds register for."""
    classes = classes_of_kinds()
    assert {"Scene", "BuildingScene", "Result", "BuildingResult", "History", "BuildingCharacterisation"} <= set(classes)
    found = places_outside_buildings(lambda own: asking_for({kind for kind in classes if classes[kind] != own}))
    assert set(found) == set(KIND_SWITCHES)
    for name, path in MODULES.items():
        texts = {node.value for node in ast.walk(tree_of(path)) if isinstance(node, ast.Constant)}
        assert name.startswith("msfp_gen.buildings") or not texts & set(kinds()), f"{name} names a kind"


def test_few_functions_ask_whether_a_value_has_an_attribute():
    """A system, a result or a top has every attribute that is asked of it; one that it lacks may stand for its kind."""
    assert set(places_outside_buildings(lambda _: asks_for_an_attribute)) == set(ATTRIBUTE_SWITCHES)


def test_what_a_building_says_of_its_bearings_stays_in_the_results():
    """Others ask a result for what it has."""
    for name, path in MODULES.items():
        if not name.startswith(("msfp_gen.buildings", "msfp_gen.results")):
            assert ".mounting" not in path.read_text(encoding="utf-8"), name


SWITCHES = """
def _(result):
    isinstance(result, (Result, int))
    type(result) is Result
    issubclass(result, results.Result)
    "position" in result
    result.get("bearings")
    getattr(result, "history", result)
    match result:
        case Result():
            pass
        case "building":
            pass
"""


def test_the_reader_of_switches_sees_them():
    asks = asking_for({"Result"})
    assert list(places_that_ask(ast.parse(SWITCHES), asks)) == ["_"] * 8
    assert not list(places_that_ask(ast.parse("result.history == Result(1)\nresult['position']"), asks))


ATTRIBUTES = """
def _(system):
    hasattr(system, "stop")
    getattr(system, "stop", None)
    "stop" in system.__dataclass_fields__
    "stop" in type(system).model_fields
    suppress(AttributeError)
    try:
        system.stop
    except (KeyError, AttributeError):
        raise AttributeError("stop")
"""


def test_the_reader_of_attributes_sees_them():
    assert list(places_that_ask(ast.parse(ATTRIBUTES), asks_for_an_attribute)) == ["_"] * 6
    assert not list(places_that_ask(ast.parse("getattr(system, name)"), asks_for_an_attribute))


def test_a_run_loads_the_core_alone():
    """The model is in the cache: its build loads SymPy and Cython. The command adds its own package."""
    msfp_gen.simulate(msfp_gen.load_scene("fenz-test2"))
    code = "msfp_gen.simulate(msfp_gen.load_scene('fenz-test2'))"
    command = "from msfp_gen.cli import main; sys.argv = ['msfp-gen', 'run', 'fenz-test2']; main()"
    for work, more in ((code, set()), (command, {"cli"})):
        script = f"import atexit, sys, msfp_gen; atexit.register(lambda: print(*sys.modules)); {work}"
        lines = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
        loaded = lines.splitlines()[-1].split()
        packages = {name.split(".")[1] for name in loaded if name.startswith("msfp_gen.")}
        assert packages <= set(CORE) | more, packages - set(CORE)
        assert not HEAVY & set(loaded)


def test_no_modules_import_each_other_in_a_circle():
    """Imports for types and in functions count between packages; in one package a class may call what knows it."""
    left = {
        name: {other for other in ours(path, late=True) if place(other) != place(name)} | ours(path, late=False)
        for name, path in MODULES.items()
    }
    while left:
        free = {name for name, needs in left.items() if not needs & set(left)}
        assert free, f"a circle of imports among {sorted(left)}"
        left = {name: needs for name, needs in left.items() if name not in free}


def test_errors_and_version_are_leaves():
    for name in ("errors", "version"):
        assert not ours(ROOT / "msfp_gen" / "common" / f"{name}.py", late=True)


def test_nothing_imports_the_command_line():
    for path in (*PACKAGE, *GENERATOR):
        if path.name != "__main__.py" and path.parent.name != "cli":
            assert not any(name.startswith("msfp_gen.cli") for name in imports_of(path, late=True)), path.name


def test_generator_knows_little_of_the_package():
    for path in GENERATOR:
        allowed = ("msfp_gen.specification", "msfp_gen.common.version", "msfp_gen.common.errors", "msfp_gen.generator")
        assert all(name.startswith(allowed) for name in ours(path, late=True)), path.name


def test_generator_is_pure():
    """No files but templates and headers of the runtime, which are read as package data; no processes."""
    for path in GENERATOR:
        assert not imports_of(path, late=True) & {"os", "pathlib", "subprocess", "tempfile", "shutil"}, path.name
        assert "open" not in calls(path), path.name


def calls(path):
    """Plain names that a file calls."""
    nodes = ast.walk(tree_of(path))
    return {node.func.id for node in nodes if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}


def streams(path):
    """Streams of the process that a file touches."""
    nodes = ast.walk(tree_of(path))
    return {ast.unparse(node) for node in nodes if isinstance(node, ast.Attribute)} & {"sys.stdout", "sys.stderr"}


def test_only_the_command_line_prints():
    for path in (*PACKAGE, *GENERATOR):
        if path != CONSOLE:
            assert "print" not in calls(path) and not streams(path), f"{path.name} prints"
    assert streams(CONSOLE)


def test_modules_import_no_heavy_library_at_import():
    for path in PACKAGE:
        for module in imports_of(path, late=False):
            top = module.partition(".")[0]
            if top in sys.stdlib_module_names or top == "msfp_gen":
                continue
            where = AT_IMPORT.get(top, set())
            allowed = where is None or bool({path.stem, path.parent.name} & where)
            assert allowed, f"{path.name} imports {top} when it is imported"


def test_import_of_the_package_is_light():
    code = "import sys, msfp_gen; print(*sorted({m.partition('.')[0] for m in sys.modules}))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not HEAVY & set(run.stdout.split())


def distributions(requirements):
    """Names of what requirements install."""
    return {re.split(r"[^A-Za-z0-9-]", text)[0].lower() for text in requirements}


def test_every_library_is_installed_with_the_package_or_by_a_command_that_is_stated():
    """A module of an extra has a `require`, whose command installs it by its name; all others are dependencies."""
    of_modules = packages_distributions()
    named = {
        module for path in PACKAGE for module in re.findall(r'require\("(\w+)", "', path.read_text(encoding="utf-8"))
    }
    of_extras = [name for extra in EXTRAS.values() for name in extra]
    assert named and {module.lower() for module in named} <= distributions(of_extras)
    for path in PACKAGE:
        for top in {module.partition(".")[0] for module in imports_of(path, late=True)}:
            if top in sys.stdlib_module_names or top == "msfp_gen":
                continue
            installed = of_extras if top in named else DEPENDENCIES
            needed = {name.lower().replace("_", "-") for name in of_modules.get(BROUGHT.get(top, top), [top])}
            assert needed & distributions(installed), f"{path.name} imports {top}, which nothing installs"


def test_every_dependency_has_its_sentence():
    names = distributions([*DEPENDENCIES, *(name for extra in EXTRAS.values() for name in extra)])
    names -= {"sympy", "numpy", "scipy", "cython", "pytest"}
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([\w, -]+?)(?: \(tests\))? \| .+ \|$", page, flags=re.MULTILINE)
    told = {name.strip().lower() for row in rows for name in row.split(",")}
    assert names <= told, f"docs/architecture.md says nothing of {sorted(names - told)}"


def test_every_package_is_on_the_map():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    names = [f"{name}/" for name in (*PACKAGES, *(f"runtime/{folder}" for folder in LAYERS))]
    missing = sorted(name for name in names if f"{name}`" not in page)
    assert not missing, f"docs/architecture.md does not name {missing}"


# The folders of the runtime, lowest first, and the headers that each may include beside its own.
LAYERS = ("equations", "steppers", "run", "port", "api")
GRADIENTS = (
    "gradients",
    {"run.h", "gradients.h", "msfp_gradient_kernels.h", "msfp_directions.h"},
)  # beside `api`, of some models
RUNTIME = ROOT / "msfp_gen" / "runtime"
GENERATED = {"msfp_model.h", "msfp_kernels.h", "msfp_schedule.h"}
OF_ENDS = {"msfp_schedule.h", "msfp_by_ends.h"}
OF_THE_TABLE = {"msfp_fields.h", "msfp_checks.h"}  # what the table of functions states about the model, and checks
SOURCES = sorted(RUNTIME.rglob("*.[ch]"))


def test_runtime_includes_one_way():
    """api -> port -> run -> steppers -> equations -> generated headers; those beside the folders none of ours."""
    for path in SOURCES:
        check_includes(path)


def check_includes(path):
    included = set(re.findall(r'^#include "(.+)"$', path.read_text(encoding="utf-8"), flags=re.MULTILINE))
    if path.parent == RUNTIME:
        assert not included
        return
    if path.parent.name == GRADIENTS[0]:
        assert included and included <= GRADIENTS[1], path.name
        return
    layer = LAYERS.index(path.parent.name)
    below = {f"{name}.h" for name in LAYERS[max(layer - 1, 0) : layer + 1]} - {path.name}
    generated = {"equations": GENERATED, "port": OF_ENDS, "api": OF_THE_TABLE}.get(path.parent.name, set())
    assert included and included <= below | generated, path.name


FOLDERS_OF_C = ("runtime", "embedding/assets/fmi", "buildings/compiled")
FUNCTION = re.compile(r"^(?!.*\bstatic\b|MSFP_INLINE|typedef)\w[\w *]*?\b(\w+)\([^;{}]*\)\s*\{", flags=re.MULTILINE)


def calls_between(paths):
    """C file -> the others of which it names a function."""
    texts = {p: re.sub(r"/\*.*?\*/", "", p.read_text(encoding="utf-8"), flags=re.DOTALL) for p in paths}
    defined = {path: set(FUNCTION.findall(text)) for path, text in texts.items()}
    words = {path: set(re.findall(r"(?<![.>\w])\w+", text)) for path, text in texts.items()}  # no fields
    return {path: {q for q in paths if words[path] & defined[q] - defined[path]} for path in paths}, defined


@pytest.mark.parametrize("folder", FOLDERS_OF_C)
def test_no_files_of_c_call_each_other_in_a_circle(folder):
    """Of the folders of the runtime each calls what stands before it, `gradients` only what stands before `port`."""
    left, defined = calls_between([*(ROOT / "msfp_gen" / folder).rglob("*.c")])
    assert all(defined.values())
    order = ("equations", "steppers", "run", GRADIENTS[0], "port", "api")
    for path, others in left.items() if folder == "runtime" else ():
        place = order.index(path.parent.name)
        back = [other.name for other in others if order.index(other.parent.name) > place]
        assert not back, f"{path.name} calls {back}"
    while left:
        free = {path for path, needs in left.items() if not needs & set(left)}
        assert free, f"a circle of calls among {sorted(path.name for path in left)}"
        left = {path: needs for path, needs in left.items() if path not in free}


def test_gradients_follow_a_run_through_three_hooks():
    """The rest of what they need are data of the run."""
    below = [path for layer in LAYERS[:-1] for path in (RUNTIME / layer).iterdir()]
    texts = [path.read_text(encoding="utf-8") for path in below]
    called = re.findall(r"MSFP_HOOK\(run, (\w+)\(", "".join(texts))
    assert set(called) == {"stage_solved", "step_accepted", "jumped"}
    assert not [path.name for path, text in zip(below, texts, strict=True) if "run->gradients" in text]


def test_names_of_runtime_files_are_unique():
    """Generated sources lie in one folder."""
    assert len({path.name for path in SOURCES}) == len(SOURCES)
    assert {path.parent.name for path in SOURCES} == {"runtime", *LAYERS, GRADIENTS[0]}


def test_headers_of_the_runtime_define_only_prefixed_macros():
    headers = [*RUNTIME.rglob("*.h"), *(ROOT / "templates").glob("*.h.jinja")]
    assert headers
    for path in headers:
        text = path.read_text(encoding="utf-8").replace("{{ name | upper }}", "MSFP_N_M_P")
        macros = re.findall(r"^\s*#\s*define\s+(\w+)", text, flags=re.MULTILINE)
        assert macros and not [m for m in macros if not m.lower().startswith("msfp_")], path.name


def test_paths_in_the_docs_exist():
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        links = {target.partition("#")[0] for target in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in target}
        for target in links - {""}:
            assert (page.parent / target).exists(), f"{page.name} links to {target}"
        named = re.findall(r"`((?:docs|tests|generator|templates|msfp_gen|benchmarks|build)/[\w./-]*)`", text)
        for name in set(named) - {"build/models/"}:  # made by the first build
            assert (ROOT / name).exists(), f"{page.name} names {name}"
        scripts = re.findall(r"python ((?:docs|benchmarks)/\w+\.py)", text)
        for name in scripts:
            assert (ROOT / name).is_file(), f"{page.name} runs {name}"


def test_anchors_in_the_docs_exist():
    for page in PAGES:
        for target, anchor in re.findall(r"\]\(([^)\s#]*)#([^)\s]+)\)", page.read_text(encoding="utf-8")):
            text = (page.parent / target if target else page).read_text(encoding="utf-8")
            titles = re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE)
            slugs = {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}
            assert anchor in slugs, f"{page.name} links to {target}#{anchor}"


def test_tests_named_in_the_docs_exist():
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py")]
    defined = {name for source in sources for name in re.findall(r"def (test_\w+)\(", source)}
    for page in PAGES:
        for name in re.findall(r"`(test_\w+)`", page.read_text(encoding="utf-8")):
            assert name in defined, f"{page.name} names {name}"


def test_files_of_tests_named_anywhere_exist():
    files = {path.name for path in (ROOT / "tests").rglob("test_*.py")}
    scripts = [ROOT / "Makefile", *sorted((ROOT / "tests").glob("*.sh"))]
    for page in [*PAGES, *scripts]:
        for name in re.findall(r"\b(test_\w+\.py)\b", page.read_text(encoding="utf-8")):
            assert name in files, f"{page.name} names {name}"


def test_paths_of_the_project_file_exist():
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    folders = [*tools["setuptools"]["package-dir"].values(), *tools["pytest"]["ini_options"]["testpaths"]]
    folders += [package.replace(".", "/") for package in tools["setuptools"]["packages"]]
    for folder in folders:
        assert (ROOT / folder).is_dir(), folder
    found = {name for name, path in MODULES.items() if path.name == "__init__.py"} | {"msfp_gen.templates"}
    assert set(tools["setuptools"]["packages"]) == found
