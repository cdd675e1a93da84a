"""The Python client of clients_test.py."""

import sys

import tandem


def main():
    session, domain, frames, inputs = sys.argv[1], *map(int, sys.argv[2:])
    with tandem.Client(session, domain, background=False) as client:
        client.wait_until_playing(60)
        sent = last = 0
        while True:
            client.update(0.1)
            status = client.status()
            if status.frame != last:
                print(f"{status.epoch},{status.frame},{status.state_hash:016x}")
            last = status.frame
            done = status.frames_applied >= frames and status.inputs_acted == sent == inputs
            if done or status.inputs_refused + status.inputs_unknown + status.hash_mismatches + status.resyncs:
                break
            if sent < inputs and status.frames_applied > sent * frames // inputs:
                client.send_gravity((sent % 3 - 1, -9, 0))
                sent += 1
    print(
        f"{status.frames_applied} frames, {status.inputs_acted} of {sent} inputs acted, "
        f"{status.hash_mismatches} mismatches, {status.resyncs} resyncs",
        file=sys.stderr,
    )
    return 0 if done and status.hash_mismatches == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
