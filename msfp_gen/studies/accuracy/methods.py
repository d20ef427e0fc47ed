"""The methods of integration that are compared, as a table: a new method is one more row."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from msfp_gen.errors import InputError
from msfp_gen.studies.accuracy.library import run_library
from msfp_gen.studies.accuracy.trial import Trial, refused_trial, run_native

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene


@dataclass(frozen=True)
class Method:
    """A method of integration.

    Attributes:
        name: as in options and output.
        family: methods of one family share their formulas or their code, so their agreement confirms little.
        about: one line of description.
        run: (scene, rtol, limit of wall time [s]) -> Trial; raises InputError if it cannot run the scene.
    """

    name: str
    family: str
    about: str
    run: Callable[[Scene, float, float], Trial]

    def attempt(self, scene: Scene, rtol: float, limit: float) -> Trial:
        """Run `scene`; a scene that the method cannot run gives a trial with status "refused"."""
        try:
            return self.run(scene, rtol, limit)
        except InputError as error:
            return refused_trial(self.name, rtol, scene, str(error))


def _native(name: str, family: str, about: str) -> Method:
    return Method(name, family, about, partial(run_native, name))


def _library(name: str, about: str) -> Method:
    return Method(name, name, f"SciPy: {about}", partial(run_library, name))


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        _native("implicit", "implicit", "the default: TR-BDF2, order 2, L-stable"),
        _native("esdirk4", "implicit", "ESDIRK4(3), order 4, L-stable: the same condensed equations and Newton steps"),
        _native("dopri5", "dopri5", "PEER 2017/07: Dormand-Prince 5(4), Newton on all 6(n-1) balances"),
        _library("Radau", "Radau IIA, order 5, L-stable"),
        _library("BDF", "backward differences, orders 1 to 5"),
        _library("LSODA", "Adams and backward differences, switching"),
        _library("DOP853", "Dormand-Prince 8(5,3), explicit"),
    )
}


def methods_named(names: list[str] | None) -> list[Method]:
    """Methods by name; all of them for None. Raises InputError for an unknown name."""
    for name in names or ():
        if name not in METHODS:
            raise InputError(f"methods = {name!r}: give some of {', '.join(METHODS)}")
    return [METHODS[name] for name in names or METHODS]
