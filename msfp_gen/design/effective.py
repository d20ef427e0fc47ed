"""Effective stiffness, period and damping of a bearing by its published backbone, in closed form (docs/bearing.md)."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from msfp_gen.common.errors import InputError
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.fidelity import Backbone, Link, main_regime, series_links


@dataclass(frozen=True)
class Effective:
    """Properties of the loop between -displacement and displacement, all per unit of axial load W.

    displacement: D [m]. force: F/W at D [-]. stiffness: k_eff/W = F/(W D) [1/m]. period: 2 pi sqrt(W/(g k_eff)) [s].
    energy: area of the loop over W [m]. damping: area/(2 pi F D) [-].
    """

    displacement: float
    force: float
    stiffness: float
    period: float
    energy: float
    damping: float


def published_backbone(bearing: Bearing) -> Backbone:
    """The published backbone of a bearing with level plates.

    The slider of a stack of one surface up and one down is rigid: it turns on both at once, as one link. Raises
    InputError where the faces of the innermost slider of another stack have different friction at the pivot.
    """
    links = series_links(bearing, rims=True, arms=True)
    layout = bearing.layout
    if not (layout.m and layout.p):
        return Backbone(tuple(links), 0.0)
    lower, upper = (next(link for link in links if link.surface == layout.m - 1 + k) for k in (0, 1))
    if layout.m == layout.p == 1:
        share = lower.share + upper.share
        friction = (lower.friction * lower.share + upper.friction * upper.share) / share
        stiffest = min((lower, upper), key=lambda link: link.limit)
        return Backbone((_one(stiffest, share, friction),), 0.0)
    if abs(lower.friction - upper.friction) > 1e-9 * max(lower.friction, upper.friction):
        raise InputError(
            f"bearing: friction at the pivot of surfaces {lower.surface + 1} and {upper.surface + 1} = "
            f"{lower.friction:.4g}, {upper.friction:.4g}: their slider turns on both at once; the published formulas "
            "need equal values"
        )
    return Backbone(tuple(links), 0.0)


def _one(link: Link, share: float, friction: float) -> Link:
    """The link of a rigid slider between two dishes; the first reaches its rim at the limit of `link`."""
    return Link(None, link.surface, link.radius, share, share, friction, link.limit, link.yielding, link.rim)


def effective(backbone: Backbone, displacement: float, gravity: float) -> Effective:
    """Effective properties at a displacement [m].

    The loop belongs to links in series, each of friction and a pendulum: one that tilts to theta dissipates
    4 mu W share theta in a cycle. Raises InputError for a displacement beyond the last rim.
    """
    if not 0 < displacement <= backbone.capacity * (1 + 1e-9):
        raise InputError(
            f"displacement = {displacement:g} [m]: give more than 0, at most the capacity {backbone.capacity:.6g} [m]"
        )
    force = float(np.interp(displacement, *backbone.points))
    pairs = zip(backbone.links, backbone.tilts(force), strict=True)
    energy = sum(4 * link.friction * link.share * tilt for link, tilt in pairs)
    period = 2 * pi * sqrt(displacement / (gravity * force))
    damping = energy / (2 * pi * force * displacement)
    return Effective(displacement, force, force / displacement, period, energy, damping)


def regimes(backbone: Backbone) -> list[tuple[float, float, float, float]]:
    """The straight parts of a backbone: first and last displacement [m], force over load at the first, slope [1/m]."""
    u, force = backbone.points
    slopes = np.diff(force) / np.diff(u)
    return [(float(a), float(b), float(f), float(k)) for a, b, f, k in zip(u, u[1:], force, slopes, strict=False)]


def characteristic(backbone: Backbone) -> tuple[float, float]:
    """Zero-displacement force over load, and radius [m], of the longest sliding regime: F/W = mu + u/R."""
    return main_regime(backbone)[:2]
