"""Integer arithmetic of the specification on arrays of 64-bit numbers."""

import numpy as np


def clamp(values, most):
    """Keep values within -most .. most."""
    return np.clip(values, -most, most)


def root(values):
    """The largest integers whose squares are at most the values (0 .. 2^62)."""
    guess = np.sqrt(values.astype(np.float64)).astype(np.int64)
    guess -= guess * guess > values
    guess += (guess + 1) * (guess + 1) <= values
    return guess


def towards_zero(a, b):
    """a / b rounded towards zero; b is positive."""
    quotient = np.abs(a) // b
    return np.where(a < 0, -quotient, quotient)
