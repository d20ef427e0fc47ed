"""The derived equations alone as a Python module in a folder: `generate --equations`."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from msfp_gen.common.errors import InputError
from msfp_gen.embedding import values
from msfp_gen.embedding.library import check_guide
from msfp_gen.jit import cache
from msfp_gen.jit.build import BuildInfo, copy_module, replaceable_files
from msfp_gen.jit.compiler import compile_extension
from msfp_gen.specification.layout import ModelSpec

REFUSED = {
    "uplift": "the equations alone are of closed surfaces",
    "top_rotation": "the equations alone have a support at rest",
}


def check_effects(spec: ModelSpec) -> None:
    """Raise InputError for effects that the equations alone do not have."""
    for name, reason in REFUSED.items():
        if getattr(spec.effects, name):
            raise InputError(f"effects.{name} = True: {reason}; leave it out, or leave --equations out")
    if spec.effects.law is not None:
        raise InputError(
            f"effects.friction = {spec.effects.friction!r}: the equations alone have a constant coefficient; "
            "leave it out, or leave --equations out"
        )


def write_alone(spec: ModelSpec, folder: Path) -> BuildInfo:
    """Derive, emit and compile the equations of a model into `folder`, for a plain `import equations_5_2_2`.

    Each file is replaced in one rename, and files that msfp-gen did not write are never changed. Raises InputError as
    `check_effects`, and where the folder holds something else; CompileError.
    """
    from msfp_gen.generator.alone import equations_alone, module_name

    check_effects(spec)
    module, target, begin = module_name(spec), folder.absolute(), perf_counter()
    check_guide(target)
    replaceable = replaceable_files(target, module)
    generated = equations_alone(spec, values.example(spec))
    sources, compiling = generated.files, perf_counter()
    with TemporaryDirectory() as name:
        part = Path(name)
        code = {name: text for name, text in sources.items() if not name.endswith((".md", "setup.py"))}
        extension = compile_extension(code, module, part)
        for name, text in sources.items():
            (part / name).write_text(text, encoding="utf-8")
        manifest = cache.Manifest(
            module=module,
            spec=spec.key,
            key=cache.digest_files(sources),
            inputs={},
            extension=extension.name,
            files={path.name: cache.digest(path) for path in sorted(part.iterdir())},
            statements=generated.statements,
            operations=generated.operations,
            stages={**generated.stages, "compile": perf_counter() - compiling},
        )
        copy_module({name: part / name for name in manifest.files}, manifest, target, replaceable)
    return BuildInfo(
        path=target / manifest.extension,
        folder=target,
        module=module,
        spec=spec.key,
        cached=False,
        stages=manifest.stages,
        seconds=perf_counter() - begin,
        statements=manifest.statements,
        operations=manifest.operations,
    )
