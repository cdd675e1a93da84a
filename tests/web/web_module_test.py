#!/usr/bin/env python3
"""The tests of sdk/web/tandem in node, with the WebAssembly modules just built and sessions recorded just now.

web_module_test.py --recorder PATH --wasm FOLDER --folder FOLDER

A copy of sdk/web with its npm packages stays in FOLDER. Exit 0 passed, 1 failed, 77 not run: without npm or its registry.
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys

WEB = pathlib.Path(__file__).resolve().parents[2] / "sdk" / "web"
FILES = ("package.json", "package-lock.json", "tsconfig.json", "vite.config.ts", "tandem")
NOT_RUN = 77
SESSIONS = {
    "field": ["--scene", "half_pipe", "--bodies", "300", "--predictor", "field"],
    "orientations": ["--scene", "rubble", "--bodies", "60"],
    "lifecycle": ["--scene", "emitter", "--bodies", "200"],
    "restarted": ["--scene", "half_pipe", "--bodies", "250", "--epoch", "1700000001000"],
}


def copy(folder):
    """sdk/web as it is now; what npm installed stays."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in FILES:
        source, target = WEB / name, folder / name
        if source.is_dir():
            shutil.rmtree(target, ignore_errors=True)
            shutil.copytree(source, target)
        else:
            shutil.copy(source, target)


def install(folder):
    """The npm packages, as locked. Exits where they cannot be had."""
    for program in ("npm", "node"):
        if shutil.which(program) is None:
            print(f"not run: {program} is not installed")
            sys.exit(NOT_RUN)
    done = subprocess.run(
        ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts"], cwd=folder, capture_output=True, text=True, check=False
    )  # fmt: skip
    if done.returncode != 0:
        print(f"not run: npm cannot install the packages: {done.stderr.strip()[-300:]}")
        sys.exit(NOT_RUN)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for option in ("--recorder", "--wasm", "--folder"):
        parser.add_argument(option, type=pathlib.Path, required=True)
    options = parser.parse_args()
    copy(options.folder)
    install(options.folder)
    traces = options.folder / "traces"
    traces.mkdir(exist_ok=True)
    environment = {**os.environ, "TANDEM_WASM": str(options.wasm), "TANDEM_TRACES": str(traces)}
    try:
        for name, arguments in SESSIONS.items():
            subprocess.run([options.recorder, *arguments, traces / name], check=True)
        for command in (["tsc", "--noEmit"], ["vitest", "run"]):
            subprocess.run(["npx", "--no-install", *command], cwd=options.folder, env=environment, check=True)
    except subprocess.CalledProcessError as failure:
        print(f"FAILED: {failure}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
