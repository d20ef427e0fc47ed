"""Why a run could not go on, in words: what each status means, where the run was, and what to do about it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from msfp_gen.model import Model
    from msfp_gen.scene import Scene

FAILURES = {
    "newton": "Newton's method did not converge at the smallest step: the bearing may have jammed (docs/model.md); "
    "lower the friction or the motion",
    "step": "the error control asks for a step below the smallest; loosen solver.rtol or check the motion for spikes",
    "irregular": "the equations lost regularity (the determinant changed sign, or a normal force has no bound): "
    "tilts and friction are too high for a unique motion here; lower the friction or the motion",
    "uplift": "the interface would have to pull; uplift is not modelled: increase the axial load or reduce the motion, "
    "or give effects.uplift = true",
    "angle": "a tilt nears 90 degrees, where the Euler angles are singular; check the capacity and the rims",
    "steps": "the allowed number of steps is used up; raise solver.max_steps",
    "finite": "a value is not finite",
    "memory": "no memory for more rows; give output_step",
    "interrupted": "interrupted",
    "parted": "a body is beside its place by more than the radius of its slider: the stack has come apart; reduce the "
    "motion or raise the load",
    "stiff": "the explicit method has reached its limit of stability, where its error estimate means nothing; "
    "use solver.method = 'implicit'",
    "guard": "what the model leaves out would matter from here on",
}
# What the number beside a failure is.
QUANTITIES = {
    "newton": "residual",
    "uplift": "P.t3 [N]",
    "angle": "angle [rad]",
    "parted": "aside [m]",
}
OF_THE_MOTION = (
    "newton",
    "step",
    "irregular",
    "uplift",
    "angle",
    "parted",
)  # what the bearing did, not what the run was allowed
FALLEN = 0.1  # [rad] a top plate that tilts further under a load no longer stands


def message(scene: Scene, model: Model, run: Any, status: str, why: str | None = None) -> str:
    """One line: when, where, why (None: what the status means), what to do, and the state that the run had reached."""
    _, surface, value = run.status
    where = f", surface {surface}" if surface else ""
    if surface and status in QUANTITIES:
        where += f", {QUANTITIES[status]} = {value:.4g}"
    said = f"stopped at t = {run.time:.6g} s of {scene.end:.6g} s{where}: {why or FAILURES.get(status, status)}"
    return said + (_state(scene, model, run) if status in OF_THE_MOTION and len(run.rows) else "")


def _state(scene: Scene, model: Model, run: Any) -> str:
    """The last row in words, and the remedy where it shows that the stack fell over."""
    row = model.unpack(run.rows[-1])
    angles = row["q"][:, :2]
    tilt, top = float(np.abs(angles).max()), float(np.abs(angles.sum(axis=0)).max())
    low, high = float(row["normal"].min()), float(row["normal"].max())
    text = (
        f" (last state: tilts up to {tilt:.3g} rad, N {low:.3g} to {high:.3g} N, rims up to {row['rim'].max():.3g} N)"
    )
    if top > FALLEN and not getattr(scene.top, "rotational_stiffness", 0.0):
        text += f"; the top plate has tilted by {top:.2g} rad: give it a rotational_stiffness [N m/rad]"
    return text
