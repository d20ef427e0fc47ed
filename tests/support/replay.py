"""Everything that `simulate` hands to the compiled run of a scene, as numbers for `c/replay.c`."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np

from msfp_gen import Scene, build_model
from msfp_gen.model.model import Model
from msfp_gen.simulation.start import start_compiled_run
from support import ROOT

REPLAY = ROOT / "tests" / "support" / "c" / "replay.c"


def inputs(scene: Scene) -> str:
    """Everything that `simulate` would hand to the compiled run, as numbers in a row."""
    model = build_model(scene.bearing.layout, scene.effects)
    seen: list[Any] = []

    made: list[tuple[Any, Any]] = []  # stacks, each with the values it was made of: seats at the start need one too

    def stack(*values: Any) -> Any:
        made.append((model.extension.Stack(*values), values))
        return made[-1][0]

    def run(own: Any, *arrays: Any, **options: Any) -> None:
        seen.extend(next(values for one, values in made if one is own))
        motion_knots, motion, load_knots, load, jumps, q, v, f = arrays
        seen.extend([len(motion), motion_knots, motion, len(load), load_knots, load, len(jumps), jumps, q, v, f])
        names = ("rtol", "atol_angle", "max_steps", "duration", "output_step", "sampled")
        seen.extend([model.extension.METHODS[options["method"]], *(options[name] for name in names)])
        seen.extend([len(options["stops"]), options["stops"]])
        seen.extend([len(options["span_ends"]), options["span_ends"], options["span_steps"]])

    recorder: Any = ModuleType("recorder")
    recorder.Stack, recorder.Run = stack, run
    start_compiled_run(scene, Model(model.spec, recorder, model.info), scene.effect_selection, scene.end, None, ())
    words = [np.atleast_1d(np.asarray(value)).ravel() for value in seen]
    return "\n".join(
        " ".join(repr(x.item()) for x in row.astype(row.dtype if row.dtype != bool else int)) for row in words
    )
