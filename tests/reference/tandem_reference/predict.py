"""The predicted step: what a frame becomes before its delta."""

from dataclasses import dataclass

import numpy as np

from . import contact, hard, rigid, turn
from .state import MOST_C, MOST_P, MOST_V


@dataclass(frozen=True)
class Drive:
    """Gravity in 1/64 unit per frame^2, damping in 1/65536."""

    gravity: tuple
    damping: int


def step(state, stream, values, drive, before=None):
    """Turn the agreed state of a frame into the predicted state of the next, in place.

    values: the parameters in force; before: the drive of the frame before, where it was another.
    """
    decay = values[4]
    gravity = np.array(drive.gravity, np.int64).reshape(3, 1)
    state.rest &= ~np.any(state.c + gravity != 0, axis=0)
    moving = np.flatnonzero(state.alive & ~state.rest)
    if stream.predictor == "ballistic":
        force_free_step(state, moving, gravity, decay, drive.damping)
    elif stream.predictor == "hard":
        hard.step(state, stream.world, values, gravity, (before or drive).gravity, drive.damping)
    elif stream.predictor == "rigid":
        rigid.step(state, stream.world, values, gravity, (before or drive).gravity, drive.damping)
        return
    else:
        contact.step(state, stream.world, moving, gravity, decay, drive.damping)
    if state.orientation:
        state.q[:, moving] = turn.turned(state.q[:, moving], state.w[:, moving])


def force_free_step(state, moving, gravity, decay, damping):
    """`ballistic`: the bodies do not feel anything but the drive."""
    p, v, c = state.p[:, moving], state.v[:, moving], state.c[:, moving]
    v += gravity + c
    c -= (c * decay + 2**15) >> 16
    v -= (v * damping + 2**15) >> 16
    v = np.clip(v, -MOST_V, MOST_V)
    c = np.clip(c, -MOST_C, MOST_C)
    p += (v + 32) >> 6
    p = np.clip(p, -MOST_P, MOST_P)
    state.p[:, moving], state.v[:, moving], state.c[:, moving] = p, v, c
