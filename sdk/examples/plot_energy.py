"""Plots the kinetic energy and the centre of mass of a live session.

    plot_energy.py [--session NAME] [--domain N] [--seconds S] [--out FILE.png] [--show]

All bodies count with mass 1, because a session has no masses. Needs python3-matplotlib.
"""

import argparse
import time

import matplotlib

import tandem

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--session", default="default")
parser.add_argument("--domain", type=int, default=0)
parser.add_argument("--seconds", type=float, default=10)
parser.add_argument("--out", default="energy.png")
parser.add_argument("--show", action="store_true", help="open a window, too")
options = parser.parse_args()
if not options.show:
    matplotlib.use("Agg")  # draws without a screen
import matplotlib.pyplot as plt  # noqa: E402  # after the choice above

# %% Measure, some 30 times a second
times, energies, centres = [], [], []
with tandem.Client(options.session, options.domain, observe=True) as client:
    client.wait_until_playing(10)
    scene, bodies = client.scene(), tandem.Sample(["positions", "velocities", "alive"])
    start = time.monotonic()
    while (now := time.monotonic()) < start + options.seconds:
        client.sample(tandem.SampleMode.INTERPOLATE, out=bodies)  # agreed frames: no guesses
        velocities = bodies.velocities[bodies.alive]
        times.append(bodies.frame / scene.frame_rate_hz)
        energies.append(0.5 * (velocities**2).sum())
        centres.append(bodies.positions[bodies.alive].mean(axis=0))
        time.sleep(1 / 30)
print(f"{len(times)} samples of {bodies.alive_count} bodies, kinetic energy {energies[0]:.1f} to {energies[-1]:.1f}")

# %% Draw
figure, (above, below) = plt.subplots(2, sharex=True, figsize=(8, 6), layout="constrained")
above.plot(times, energies)
above.set_ylabel("kinetic energy, m = 1")
above.set_title(f"{scene.name}: {bodies.alive_count} bodies, session '{options.session}'")
below.plot(times, centres, label=["x", "y", "z"])
below.set_ylabel("centre of mass")
below.set_xlabel("time of the session, s")
below.legend()
figure.savefig(options.out)
if options.show:
    plt.show()
