"""Algebra of 3-vectors of SymPy expressions, with components along E1, E2, E3 or along a local basis."""

from __future__ import annotations

import sympy as sp

from .program import Vector

ZERO: Vector = (sp.Integer(0), sp.Integer(0), sp.Integer(0))


def add(*vectors: Vector) -> Vector:
    """Sum of vectors."""
    x, y, z = (sp.Add(*components) for components in zip(*vectors, strict=True))
    return (x, y, z)


def scale(factor: sp.Expr, vector: Vector) -> Vector:
    """Scalar times vector."""
    return (factor * vector[0], factor * vector[1], factor * vector[2])


def subtract(a: Vector, b: Vector) -> Vector:
    """Difference a - b."""
    return add(a, scale(sp.Integer(-1), b))


def dot(a: Vector, b: Vector) -> sp.Expr:
    """Scalar product."""
    return sp.Add(*(p * q for p, q in zip(a, b, strict=True)))


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def combine(basis: tuple[Vector, Vector, Vector], components: Vector) -> Vector:
    """Vector with the given components along `basis`."""
    return add(*(scale(c, t) for c, t in zip(components, basis, strict=True)))


def project(basis: tuple[Vector, Vector, Vector], vector: Vector) -> Vector:
    """Components of a vector along `basis`."""
    return (dot(basis[0], vector), dot(basis[1], vector), dot(basis[2], vector))
