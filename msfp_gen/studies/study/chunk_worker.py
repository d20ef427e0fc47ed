"""The runs of one chunk, in a worker: one row each, as the bytes of a Parquet file."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from msfp_gen.common.inputs import Files, expecting
from msfp_gen.common.tables import parquet_bytes
from msfp_gen.errors import InputError, RunError
from msfp_gen.scene.scene import Scene
from msfp_gen.simulation.simulate import settle
from msfp_gen.studies.batch import ENDED, check_method, run_to_end
from msfp_gen.studies.pool import raise_if_stopped
from msfp_gen.studies.study.definition import Task
from msfp_gen.studies.study.quantities import Column, Keep
from msfp_gen.studies.study.scene_factory import INTENSITY, Recipe, SceneFactory

if TYPE_CHECKING:
    from msfp_gen.buildings.load import AnyScene

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


_factories: dict[str, SceneFactory] = {}  # of the last study only


def run_chunk(order: Order, task: Task) -> tuple[bytes, int]:
    """The part of a chunk as the bytes of a Parquet file, and how many of its runs failed.

    Raises ChangedFileError where a file is not as it was when the study was checked.
    """
    with expecting(order.files):
        return _chunk(order, task)


def _chunk(order: Order, task: Task) -> tuple[bytes, int]:
    factory = _factories.get(order.identity)
    if factory is None:
        factory = SceneFactory(order.recipe)
        _factories.clear()
        _factories[order.identity] = factory
    axes = order.recipe.axes
    rows = []
    for offset, (values, labels) in enumerate(task.rows(axes), start=1):
        at = {axis.name: label for axis, label in zip(axes, labels, strict=True)}
        intensity = order.recipe.intensity(at)
        numbers = {**{axis.name: at[axis.name] for axis in axes if axis.numeric}, **intensity}
        status, message, kept = _run(partial(factory.scene, values), order, numbers)
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

    return run_to_end(scene, settle(scene) if isinstance(scene, Scene) else scene, proceed=proceed)


def _part(order: Order, rows: list[dict[str, Any]], failed: int) -> bytes:
    """The columns of every part: run, axes, status, message, intensity, quantities."""
    axes = [Column(axis.name, "", not axis.numeric) for axis in order.recipe.axes]
    intensity = [Column(INTENSITY, "m/s^2")] if order.recipe.intensities else []
    texts = [Column("status", "", text=True), Column("message", "", text=True)]
    columns = [*axes, *texts, *intensity, *order.keep.columns()]
    types = {"run": "int64", **{name: "string" if text else "double" for name, _, text in columns}}
    values = {(name, unit): [row.get(name) for row in rows] for name, unit, _ in (Column("run", ""), *columns)}
    return parquet_bytes(values, types, {"digest": order.digest, "failed": str(failed)})
