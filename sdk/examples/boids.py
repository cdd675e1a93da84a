"""Boids: a flock in numpy, streamed to any number of clients. They turn the wind (gravity) and push."""

import sys

import numpy as np
import tandem

n, box, reach, dt = 5000, 50.0, 3.0, 1 / 60
rng = np.random.default_rng(1)
p = rng.uniform(-box, box, (n, 3)).astype(np.float32)
v = rng.normal(0, 5, (n, 3)).astype(np.float32)
wind = np.zeros(3, np.float32)


def cells(p, v):  # mean velocity and position of each boid's cell of a grid
    c = ((p + box) / reach).astype(int).clip(0, 63)
    key = (c[:, 0] * 64 + c[:, 1]) * 64 + c[:, 2]
    count = np.bincount(key, minlength=64**3)[key, None]
    return (np.stack([np.bincount(key, a[:, d], 64**3)[key] for d in range(3)], 1) / count for a in (v, p))


with tandem.Server(n, dt, name="boids", types=[tandem.Type("boid", radius=0.3)], options=sys.argv[1:]) as server:
    server.start(position=p, velocity=v)
    for frame in server.frames():  # one turn a frame, at the server's pace
        for each in frame.inputs:
            if each.kind == "gravity":
                wind = each.values.astype(np.float32)
            if each.kind == "push":
                v[np.linalg.norm(p - each.centre, axis=1) < each.radius] += each.velocity
        flock, centre = cells(p, v)
        v += (dt * (2 * (flock - v) + 0.5 * (centre - p) - 0.02 * p + wind)).astype(np.float32)
        p += dt * v
        frame.write(position=p, velocity=v)
