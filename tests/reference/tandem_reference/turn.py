"""The turn: how an angular velocity changes an orientation in a step."""

import numpy as np

from .integers import clamp

ONE = 2**30  # of a quaternion's component
MOST_W = 2**29
NORM_SLACK = 2**48  # of a squared norm of 2^58


def is_quaternion(q):
    """Whether the rows x, y, z, w are a quaternion, for each column."""
    norm = ((q * q) >> 2).sum(axis=0)
    return np.all(np.abs(q) <= ONE, axis=0) & (np.abs(norm - 2**58) <= NORM_SLACK)


def is_spin(w):
    """Whether the rows x, y, z are an angular velocity that a state may hold, for each column."""
    short = np.all(np.abs(w) <= MOST_W, axis=0)
    return short & ((w * w * short).sum(axis=0) <= MOST_W**2)


def limited(w):
    """Angular velocities whose components are halved together until they are in range."""
    w = w.copy()
    while not np.all(fits := is_spin(w)):
        w[:, ~fits] >>= 1
    return w


def turned_by(q, by):
    """The quaternions turned by rotation vectors of any length, and which of these were too long for one turn."""
    step = limited(by)
    far = np.any(step != by, axis=0)
    after = turned(q, step)
    after[:, far] = turned(after[:, far], step[:, far])
    return after, far


def times(a, b):
    """A product of numbers of which one is in 2^-28."""
    return (a * b) >> 28


def series(t, divisors):
    """1 - t/d1 (1 - t/d2 (1 - ..)), the last divisor first."""
    n = np.full_like(t, ONE)
    for divisor in divisors:
        n = ONE - times(times(n, t), (2**28 + divisor // 2) // divisor)
    return n


def to_unit(x):
    """Round 30 bits away; keep within +-1."""
    return clamp((x + 2**29) >> 30, ONE)


def turned(q, w):
    """The quaternions (rows x, y, z, w) turned by the angular velocities (rows x, y, z)."""
    t = times(w, w).sum(axis=0) >> 2
    x, y, z = (w * series(t, (110, 72, 42, 20, 6))) >> 29
    c = series(t, (90, 56, 30, 12, 2))
    a, b, d, e = q
    r = to_unit(np.stack([
        c * a + x * e + y * d - z * b,
        c * b - x * d + y * e + z * a,
        c * d + x * b - y * a + z * e,
        c * e - x * a - y * b - z * d,
    ]))  # fmt: skip
    norm = ((r * r) >> 2).sum(axis=0)
    return to_unit(r * (3 * 2**29 - ((norm + 2**28) >> 29)))
