"""Plants each bug of `bugs/` in a copy of the sources, builds the world with it, and lets it look for the bug.

    python3 planted.py [--build FOLDER] [--seeds N] [--only NAME,NAME] [--check]

Prints a table: the bug, the rule that it broke, and after how many seeds. A bug that N seeds (default 300) do not find fails. The copy and
its build stay in FOLDER (default: build/planted), so that the next run compiles only what a bug changes. --check looks only whether
every patch applies and changes one place. Exit 0 all found, 1 some not, 77 no git.
"""

import argparse
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
FINDING = re.compile(r"^seed (\d+): ([a-z ]+):", re.MULTILINE)


def run(*words, **more):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False, **more)


def check(patch):
    """What is wrong with a patch; empty if nothing is."""
    text = patch.read_text(encoding="utf-8")
    changed = [line for line in text.split("\n") if re.match(r"[-+](?![-+])", line)]
    files = re.findall(r"^\+\+\+ b/(\S+)", text, re.MULTILINE)
    if len(files) != 1 or len(changed) > 2:
        return f"{patch.name}: changes {len(files)} files and {len(changed)} lines, one expected"
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder) / files[0]
        copy.parent.mkdir(parents=True)
        shutil.copy(ROOT / files[0], copy)
        applied = run("git", "apply", patch, cwd=folder)
    return f"{patch.name}: does not apply; make it anew on this tree: {applied.stderr.strip()}" if applied.returncode else ""


def copy_sources(tree):
    """The files that git knows, with their times, so that nothing is compiled again without need."""
    names = run("git", "ls-files", cwd=ROOT).stdout.split("\n")
    for name in filter(None, names):
        source, target = ROOT / name, tree / name
        if source.is_file() and not (target.is_file() and target.read_bytes() == source.read_bytes()):
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target)


def build(tree):
    """The reason why the copy cannot be built; empty if it can."""
    if not (tree / "build/ci/build.ninja").is_file():
        configured = run("cmake", "--preset", "ci", cwd=tree)
        if configured.returncode:
            return configured.stderr
    built = run("cmake", "--build", "build/ci", "--target", "tandem_world", cwd=tree)
    return built.stdout[-2000:] if built.returncode else ""


def look(tree, seeds):
    """The rule that a bug broke and the seed, or None; a crash and a hang count."""
    try:
        found = run(tree / "build/ci/tests/fault/world/tandem_world", "--seeds", seeds, timeout=1800)
    except subprocess.TimeoutExpired:
        return "it hangs", seeds
    finding = FINDING.search(found.stdout)
    return (finding[2], int(finding[1])) if finding else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/planted")
    parser.add_argument("--seeds", type=int, default=300)
    parser.add_argument("--only", default="")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    if shutil.which("git") is None:
        print("no git, which applies the patches")
        return 77
    patches = [p for p in sorted((HERE / "bugs").glob("*.patch")) if not options.only or p.stem in options.only.split(",")]
    faults = [fault for fault in map(check, patches) if fault]
    if faults or options.check:
        print("\n".join(faults) if faults else f"{len(patches)} bugs can be planted")
        return 1 if faults else 0
    tree = options.build.resolve()
    copy_sources(tree)
    reason = build(tree)
    if reason:
        print(reason)
        return 1
    print("| bug | found by | after seeds |\n|---|---|---|", flush=True)
    missed = 0
    for patch in patches:
        file = re.search(r"^\+\+\+ b/(\S+)", patch.read_text(encoding="utf-8"), re.MULTILINE)[1]
        original = (tree / file).read_bytes()
        run("git", "apply", "--unsafe-paths", f"--directory={tree}", patch, cwd="/")
        reason = build(tree)
        found = None if reason else look(tree, options.seeds)
        missed += found is None
        result = f"{found[0]} | {found[1]}" if found else f"{'cannot be built' if reason else 'NOT FOUND'} | {options.seeds}"
        print(f"| {patch.stem.replace('_', ' ')} | {result} |", flush=True)
        (tree / file).write_bytes(original)
    print(f"{len(patches) - missed} of {len(patches)} found")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
