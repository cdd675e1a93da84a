#!/usr/bin/env python3
"""Builds the viewer and opens it in Chromium, beside a real server and a real gateway.

viewer_test.py SCENARIO... --tandemd PATH --gateway PATH --wasm FOLDER --folder FOLDER [--tandem PATH]

With --tandem it runs the scenarios of audience_test.mjs, with nginx, instead of those of viewer_test.mjs. Pictures of the page stay
in FOLDER/pictures. Exit 0 passed, 1 failed, 77 not run: without npm, its registry, Chromium or nginx.
"""

import argparse
import os
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
    parser.add_argument("--tandem", type=pathlib.Path)
    options = parser.parse_args()
    chromium = shutil.which("chromium")
    if chromium is None:
        print("not run: chromium is not installed")
        return npm.NOT_RUN
    script, more = "viewer_test.mjs", []
    if options.tandem:
        nginx = shutil.which("nginx", path=f"{os.environ.get('PATH', '')}:/usr/sbin")
        if nginx is None:
            print("not run: nginx is not installed")
            return npm.NOT_RUN
        script = "audience_test.mjs"
        more = ["--tandem", options.tandem, "--nginx", nginx, "--configuration", npm.ROOT / "deploy" / "http"]
    npm.copy(options.folder)
    npm.install(options.folder)
    site = options.folder / "dist" / "viewer"
    try:
        subprocess.run(["npm", "run", "viewer"], cwd=options.folder, env=npm.environment(options.wasm), check=True)
        subprocess.run(
            [
                "node", HERE / script, *options.scenarios, "--tandemd", options.tandemd, "--gateway", options.gateway,
                "--site", site, "--packages", options.folder, "--chromium", chromium, "--pictures", options.folder / "pictures", *more,
            ],
            check=True,
        )  # fmt: skip
    except subprocess.CalledProcessError as failure:
        print(f"FAILED: {failure}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
