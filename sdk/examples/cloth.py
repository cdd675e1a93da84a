"""A cloth of springs in numpy, in a browser: two corners hold it, the wind blows, and whoever looks on turns gravity and pushes."""

import sys

import numpy as np
import tandem

side, rest, dt, steps, stiff = 40, 0.25, 1 / 60, 8, 4000.0
y, x = np.mgrid[:side, :side]
start = np.stack([(x - side / 2) * rest, 6.0 - 0 * x, y * rest], -1).reshape(-1, 3)
p, v = start.copy(), np.zeros_like(start)
held = [0, side - 1]
index = np.arange(side * side).reshape(side, side)
near = [(index[:, :-1], index[:, 1:], 1), (index[:-1], index[1:], 1), (index[:-1, :-1], index[1:, 1:], 2**0.5), (index[1:, :-1], index[:-1, 1:], 2**0.5)]
a, b = (np.concatenate([each[k].ravel() for each in near]) for k in (0, 1))
length = np.concatenate([np.full(each[0].size, rest * each[2]) for each in near])
gravity = np.array([0, -9.81, 0])


def forces(time):
    d, slip = p[b] - p[a], v[b] - v[a]
    now = np.linalg.norm(d, axis=1)
    along = d / now[:, None]
    pull = (stiff * (now - length) + 4 * (slip * along).sum(1))[:, None] * along
    wind = 1.5 * np.array([0.3 * np.sin(1.3 * time), 0, 1 + np.sin(0.7 * time)])
    return gravity + wind - 0.3 * v + np.stack([np.bincount(a, pull[:, k], side * side) - np.bincount(b, pull[:, k], side * side) for k in range(3)], 1)


with tandem.Server(side * side, dt, name="cloth", gravity=gravity, types=[tandem.Type("knot", radius=0.15, colour="#3070D0")],
                   view="--no-view" not in sys.argv, options=[word for word in sys.argv[1:] if word != "--no-view"]) as server:  # fmt: skip
    server.start(position=p, velocity=v)
    print(f"look at {server.url}" if server.url else "streams", flush=True)
    for frame in server.frames():
        for each in frame.inputs:
            if each.kind == "gravity":
                gravity = each.values
            if each.kind == "push":
                v[np.linalg.norm(p - each.centre, axis=1) < each.radius] += each.velocity
        for i in range(steps):
            v += dt / steps * forces(frame.number * dt)
            v[held] = 0
            p += dt / steps * v
        frame.write(position=p, velocity=v)
