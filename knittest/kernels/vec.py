"""Vectors as 3-tuples of floats; inlining turns them into plain scalars, so they cost nothing in vectorised loops."""

from numba import njit

from knittest.kernels.options import INLINE


@njit(**INLINE)
def add(u, v):
    """Sum u + v."""
    return u[0] + v[0], u[1] + v[1], u[2] + v[2]


@njit(**INLINE)
def sub(u, v):
    """Difference u - v."""
    return u[0] - v[0], u[1] - v[1], u[2] - v[2]


@njit(**INLINE)
def scale(factor, u):
    """Multiple of u."""
    return factor * u[0], factor * u[1], factor * u[2]


@njit(**INLINE)
def combine(p, u, q, v):
    """Linear combination p u + q v."""
    return p * u[0] + q * v[0], p * u[1] + q * v[1], p * u[2] + q * v[2]


@njit(**INLINE)
def dot(u, v):
    """Scalar product."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@njit(**INLINE)
def cross(u, v):
    """Vector product."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@njit(**INLINE)
def rotate(qw, qx, qy, qz, v):
    """Rotate ``v`` by the unit quaternion (qw, qx, qy, qz): v + 2 qw (q x v) + 2 q x (q x v)."""
    q = (qx, qy, qz)
    t = scale(2.0, cross(q, v))
    return add(add(v, scale(qw, t)), cross(q, t))
