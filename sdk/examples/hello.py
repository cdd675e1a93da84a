"""Joins the session "default" on DDS domain 0, tilts gravity and prints where body 0 is."""

import sys
import time

import tandem

with tandem.Client() as client:
    try:
        client.wait_until_playing(10)
    except tandem.Error as error:
        sys.exit(f"no session to join: {error}")
    client.send_gravity((3, -9, 0))
    bodies = client.sample()
    for _ in range(5):
        time.sleep(1)
        client.sample(out=bodies)
        x, y, z = bodies.positions[0]
        print(f"frame {bodies.frame:.1f}: body 0 at {x:.2f} {y:.2f} {z:.2f}")
    sys.exit(client.status().hash_mismatches != 0)
