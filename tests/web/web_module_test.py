#!/usr/bin/env python3
"""The tests of sdk/web in node, with the WebAssembly modules just built and sessions recorded just now.

web_module_test.py --recorder PATH --worlds PATH --wasm FOLDER --folder FOLDER

A copy of sdk/web with its npm packages stays in FOLDER. Exit 0 passed, 1 failed, 77 not run: without npm or its registry.
"""

import argparse
import pathlib
import subprocess
import sys

import npm

SESSIONS = {
    "field": ["--scene", "half_pipe", "--bodies", "300", "--predictor", "field"],
    "orientations": ["--scene", "rubble", "--bodies", "60"],
    "lifecycle": ["--scene", "emitter", "--bodies", "200"],
    "other_codec": ["--scene", "half_pipe", "--bodies", "50", "--codec", "quantized", "--frames", "10"],
    "restarted": ["--scene", "half_pipe", "--bodies", "250", "--epoch", "1700000001000"],
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for option in ("--recorder", "--worlds", "--wasm", "--folder"):
        parser.add_argument(option, type=pathlib.Path, required=True)
    options = parser.parse_args()
    npm.copy(options.folder)
    npm.install(options.folder)
    traces = options.folder / "traces"
    traces.mkdir(exist_ok=True)
    environment = {**npm.environment(options.wasm), "TANDEM_TRACES": str(traces)}
    try:
        for name, arguments in SESSIONS.items():
            subprocess.run([options.recorder, *arguments, traces / name], check=True)
        subprocess.run([options.worlds, traces], check=True)
        for command in (["tsc", "--noEmit"], ["tsc", "--noEmit", "-p", "viewer"], ["vitest", "run"]):
            subprocess.run(["npx", "--no-install", *command], cwd=options.folder, env=environment, check=True)
    except subprocess.CalledProcessError as failure:
        print(f"FAILED: {failure}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
