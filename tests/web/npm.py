"""A copy of sdk/web with its npm packages in a build folder, so that nothing is left in the source tree."""

import os
import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
WEB = ROOT / "sdk" / "web"
FILES = ("package.json", "package-lock.json", ".npmrc", "tsconfig.json", "vite.config.ts", "tandem", "viewer")
NOT_RUN = 77


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
    """The npm packages, as locked. Exits where there are none to be had."""
    for program in ("npm", "node"):
        if shutil.which(program) is None:
            print(f"not run: {program} is not installed")
            sys.exit(NOT_RUN)
    installed = folder / "node_modules" / ".tandem-lock.json"
    lock = folder / "package-lock.json"
    if installed.exists() and installed.read_bytes() == lock.read_bytes():
        return
    done = subprocess.run(["npm", "ci"], cwd=folder, capture_output=True, text=True, check=False)
    if "EUSAGE" in done.stderr:
        print(f"FAILED: package-lock.json is not that of package.json:\n{done.stderr}", file=sys.stderr)
        sys.exit(1)
    if done.returncode != 0:
        print(f"not run: npm cannot install the packages: {done.stderr.strip()[-300:]}")
        sys.exit(NOT_RUN)
    shutil.copy(lock, installed)


def environment(wasm):
    """For the tests: where the WebAssembly modules are."""
    return {**os.environ, "TANDEM_WASM": str(wasm)}
