"""Random stacks and states, and a few turns of space, for the tests of and against the reference."""

from __future__ import annotations

import numpy as np

from . import forces
from .kinematics import Base, State, points, rotation
from .parameters import Array, Stack, random_stack
from .stack import Load

LAYOUTS = [(2, 1, 0), (2, 0, 1), (3, 1, 1), (5, 2, 2), (5, 3, 1)]


def random_state(rng: np.random.Generator, n: int) -> State:
    shape = (n - 1, 3)
    base = Base(*(rng.uniform(-size, size, 3) for size in (0.1, 1.0, 5.0, 0.1, 0.5, 2.0)))
    return State(rng.uniform(-0.08, 0.08, shape), rng.uniform(-0.5, 0.5, shape), rng.uniform(-3.0, 3.0, shape), base)


def random_case(layout: tuple[int, int, int], seed: int) -> tuple[Stack, State, Array, Load]:
    rng = np.random.default_rng([*layout, seed])
    stack, state = random_stack(rng, *layout), random_state(rng, layout[0])
    h = rng.uniform(-0.7, 0.7, (layout[0] - 1, 2))
    return stack, state, h, Load(np.array([8e2, -5e2, -1e4]), rng.uniform(-50.0, 50.0, 3))


def rim_of(stack: Stack, state: State) -> forces.Rim:
    turn = rotation(state)
    return forces.rim(stack, turn, points(stack, state, turn).r)


QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
MIRROR = np.diag([1.0, -1.0, 1.0])
SOME = np.array([[np.cos(0.7), -np.sin(0.7), 0.0], [np.sin(0.7), np.cos(0.7), 0.0], [0.0, 0.0, 1.0]])
