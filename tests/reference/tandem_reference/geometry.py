"""Contacts of bodies with planes, boxes and balls."""

import numpy as np

from .integers import clamp, root, towards_zero

UP = np.array([[0], [2**14], [0]], np.int64)


def plane(p, r, shape):
    """Return `height`, and `out` in 2^-14, of every body at one plane."""
    normal, offset = np.array(shape[:3], np.int64).reshape(3, 1), shape[3]
    height = r - (((normal * p).sum(axis=0) >> 30) - offset)
    return height, np.broadcast_to(normal >> 16, p.shape)


def ball(p, r, shape):
    """Return the same at a ball; the height is 0 where a body is out of reach on an axis."""
    away = p - np.array(shape[:3], np.int64).reshape(3, 1)
    most = shape[3] + r
    near = np.all(np.abs(away) < most, axis=0)
    away = np.where(near, away, 0)
    far = root((away * away).sum(axis=0))
    out = np.where(far == 0, UP, towards_zero(away * 2**14, np.maximum(far, 1)))
    return np.where(near, most - far, 0), out


def box(p, r, shape):
    """Return the same at a box."""
    numbers = np.array(shape, np.int64)
    centre, half, axes = numbers[:3].reshape(3, 1), numbers[3:6].reshape(3, 1), numbers[6:].reshape(3, 3)
    away = p - centre
    local = np.stack([(axis.reshape(3, 1) * away).sum(axis=0) >> 30 for axis in axes])
    beyond = local - np.clip(local, -half, half)
    near = np.all(np.abs(beyond) < r, axis=0)
    beyond = np.where(near, beyond, 0)
    inside = np.all(beyond == 0, axis=0)

    to_face = half - np.abs(local)
    nearest = to_face.argmin(axis=0)
    chosen = np.arange(3).reshape(3, 1) == nearest
    face_inside = np.where(chosen, np.where(local < 0, -(2**14), 2**14), 0)
    height_inside = r + to_face.min(axis=0)

    far = root((beyond * beyond).sum(axis=0))
    face_outside = towards_zero(beyond * 2**14, np.maximum(far, 1))

    face = np.where(inside, face_inside, face_outside)
    height = np.where(inside, height_inside, r - far)
    out = sum(axes[i].reshape(3, 1) * face[i] for i in range(3)) >> 30
    return np.where(near, height, 0), out


def contacts(world, p, radius):
    """Yield for every shape that touches bodies: those bodies, the depths, the directions in 2^-12."""
    for measure, shapes in ((plane, world.planes), (box, world.boxes), (ball, world.balls)):
        for shape in shapes:
            height, out = measure(p, radius, shape)
            touched = np.flatnonzero(height > 0)
            if len(touched):
                depth = np.minimum(height[touched] >> world.shift, 2**14)
                yield touched, depth, clamp((-out[:, touched]) >> 2, 2**12)
