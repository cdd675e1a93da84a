#!/usr/bin/env python3
"""Builds sdk/examples/mujoco as a stranger would, and lets `tandem engine-check` judge it. Skipped without libmujoco-dev."""

import pathlib
import subprocess
import sys
import tempfile

EXAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sdk/examples/mujoco"


def main():
    tool = sys.argv[1]
    if not pathlib.Path("/usr/include/mujoco/mujoco.h").exists():
        print("libmujoco-dev is not installed")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["cmake", "-S", EXAMPLE, "-B", folder, "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_C_FLAGS=-Werror"], check=True, timeout=60)
        subprocess.run(["cmake", "--build", folder], check=True, timeout=120)
        for more in ([], ["--network"]):
            command = [tool, "engine-check", "--frames", "120", *more, "--", f"{folder}/mujoco_engine", EXAMPLE / "pile.xml"]
            said = subprocess.run(command, check=True, timeout=120, capture_output=True, text=True).stdout
            print(said)
            assert "54 slots" in said and "the same to the bit" in said and "keeps the rules" in said, said
            assert "note:" not in said, said
    return 0


if __name__ == "__main__":
    sys.exit(main())
