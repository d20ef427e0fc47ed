"""The runs of one chunk, in a worker: one row each, as the bytes of a Parquet file."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import lru_cache, partial
from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple

from msfp_gen.common.inputs import Files, expecting
from msfp_gen.errors import InputError, RunError
from msfp_gen.model.model import build_model
from msfp_gen.scene.scene import Scene
from msfp_gen.simulation.batch import check_method, raise_if_stopped, run_to_end, specs_of
from msfp_gen.simulation.simulate import settle
from msfp_gen.studies.study.definition import Task
from msfp_gen.studies.study.quantities import Keep
from msfp_gen.studies.study.recipe import INTENSITY, Recipe, SceneMaker

if TYPE_CHECKING:
    from msfp_gen.buildings.load import AnyScene

ENDED = ("ok", "stopped")  # statuses of runs that did not fail
BAD_SCENE, OUT_OF_TIME = "input", "limit"  # statuses of a study, beside those of a run


class Order(NamedTuple):
    """What workers need for any chunk of a study.

    identity: of the whole study. digest: of what its parts have in common. files: path -> sha256 of those that its
    scenes open.
    """

    identity: str
    digest: str
    recipe: Recipe
    files: Files
    keep: Keep
    run_seconds: float | None


class _OutOfTimeError(Exception):
    """Ends a run at the limit of its wall time."""


_makers: dict[str, SceneMaker] = {}  # of the last study only


def run_chunk(order: Order, task: Task) -> tuple[bytes, int]:
    """The part of a chunk as the bytes of a Parquet file, and how many of its runs failed.

    Raises ChangedFileError where a file is not as it was when the study was checked.
    """
    with expecting(order.files):
        return _chunk(order, task)


def _chunk(order: Order, task: Task) -> tuple[bytes, int]:
    maker = _makers.get(order.identity)
    if maker is None:
        maker = SceneMaker(order.recipe)
        _makers.clear()
        _makers[order.identity] = maker
    axes = order.recipe.axes
    rows = []
    for offset, (values, labels) in enumerate(task.rows(axes), start=1):
        at = {axis.name: label for axis, label in zip(axes, labels, strict=True)}
        intensity = order.recipe.intensity(at)
        numbers = {**{axis.name: at[axis.name] for axis in axes if axis.numeric}, **intensity}
        status, message, kept = _run(partial(maker.scene, values), order, numbers)
        rows.append({"run": task.first + offset, **at, "status": status, "message": message, **intensity, **kept})
    failed = sum(row["status"] not in ENDED for row in rows)
    return _part(order, rows, failed), failed


def _run(make: Callable[[], AnyScene], order: Order, at: dict[str, float]) -> tuple[str, str, dict[str, Any]]:
    """Status, message and quantities of one run."""
    try:
        scene = make()
        check_method(scene)
    except InputError as error:
        return BAD_SCENE, str(error), {}
    try:
        result = _result(scene, order.run_seconds)
    except RunError as error:  # failed before its first row
        return error.status, str(error), {}
    except _OutOfTimeError:
        return OUT_OF_TIME, f"ended after {order.run_seconds:g} s of wall time; see limits.run_seconds", {}
    kept, problem = order.keep.values(result, at)
    return result.status, result.message or problem, kept


def _result(scene: AnyScene, seconds: float | None) -> Any:
    end = None if seconds is None else time.monotonic() + seconds

    def proceed(reached: float, of: float) -> None:
        raise_if_stopped(reached, of)
        if end is not None and time.monotonic() > end and reached < of:
            raise _OutOfTimeError

    return run_to_end(scene, settle(scene) if isinstance(scene, Scene) else scene, False, proceed)


def build_models(scenes: list[AnyScene]) -> None:
    """Build the models with which these scenes start, unless the cache of this host has them."""
    for spec in dict.fromkeys(spec for scene in scenes for spec in specs_of(scene)):
        build_model(spec.layout, spec.effects)


def _part(order: Order, rows: list[dict[str, Any]], failed: int) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = _schema(order.recipe, order.keep)
    about = {"digest": order.digest, "failed": str(failed)}
    columns = [pa.array([row.get(field.name) for row in rows], field.type) for field in schema]
    content = BytesIO()
    pq.write_table(pa.table(columns, schema=schema.with_metadata(about)), content, write_page_checksum=True)
    return content.getvalue()


@lru_cache(maxsize=4)
def _schema_of(names: tuple[tuple[str, str, bool], ...]) -> Any:
    import pyarrow as pa

    kinds = {True: pa.string(), False: pa.float64()}
    fields = [pa.field(name, kinds[text], metadata={"units": unit}) for name, unit, text in names]
    return pa.schema([pa.field("run", pa.int64()), *fields])


def _schema(recipe: Recipe, keep: Keep) -> Any:
    """Columns of every part: run, axes, status, message, quantities."""
    axes = [(axis.name, "", not axis.numeric) for axis in recipe.axes]
    texts = [("status", "", True), ("message", "", True)]
    intensity = [(INTENSITY, "m/s^2", False)] if recipe.intensities else []
    return _schema_of((*axes, *texts, *intensity, *(tuple(column) for column in keep.columns())))
