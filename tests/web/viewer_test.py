#!/usr/bin/env python3
"""Builds the viewer and opens it in Chromium, beside a real server and a real gateway.

viewer_test.py SCENARIO... --tandemd PATH --gateway PATH --wasm FOLDER --folder FOLDER

Pictures of the page stay in FOLDER/pictures. Exit 0 passed, 1 failed, 77 not run: without npm, its registry or Chromium.
"""

import argparse
import pathlib
import shutil
import subprocess
import sys

import npm

HERE = pathlib.Path(__file__).resolve().parent


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", nargs="+")
    for option in ("--tandemd", "--gateway", "--wasm", "--folder"):
        parser.add_argument(option, type=pathlib.Path, required=True)
    options = parser.parse_args()
    chromium = shutil.which("chromium")
    if chromium is None:
        print("not run: chromium is not installed")
        return npm.NOT_RUN
    npm.copy(options.folder)
    npm.install(options.folder)
    site = options.folder / "dist" / "viewer"
    try:
        subprocess.run(["npm", "run", "viewer"], cwd=options.folder, env=npm.environment(options.wasm), check=True)
        subprocess.run(
            [
                "node", HERE / "viewer_test.mjs", *options.scenarios, "--tandemd", options.tandemd, "--gateway", options.gateway,
                "--site", site, "--packages", options.folder, "--chromium", chromium, "--pictures", options.folder / "pictures",
            ],
            check=True,
        )  # fmt: skip
    except subprocess.CalledProcessError as failure:
        print(f"FAILED: {failure}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
