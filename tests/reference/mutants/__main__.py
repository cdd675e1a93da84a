"""Checks the test vectors: python3 mutants [--list] [--only N or words ...].

A mutant is the decoder as somebody would write it who misreads one rule. Each is made of a copy of the package and checks the
vectors; one of them must disagree. A mutant that survives is a rule that no vector watches. A few change nothing that is agreed
on; they stand apart with the reason, and must survive.

Exit status: 0 every mutant is caught, 1 one survives or cannot be made, 2 usage.
"""

import argparse
import pathlib
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import of_bytes
import of_contact
import of_hard
import of_rigid
import of_steps
import of_tracker

REFERENCE = pathlib.Path(__file__).resolve().parents[1]
VECTORS = REFERENCE.parents[1] / "idl" / "vectors"
AT_ONCE = 2
# All vectors take a second; a mutant may be slower, or never end.
PATIENCE_S = 120
AGREES, DISAGREES = 0, 3  # exit statuses of --check; Python's own for an error is 1


@dataclass
class Mutant:
    """A change of one module of the decoder."""

    module: str
    what: str  # what the stranger does
    old: str  # stands once in the module
    new: str
    equivalent: str = ""  # why no agreed state depends on it


FILES = of_steps, of_contact, of_hard, of_rigid, of_bytes, of_tracker
MUTANTS = [Mutant(*words) for file in FILES for words in file.MUTANTS]
MUTANTS += [Mutant(*words) for words in of_steps.EQUIVALENT]


def change(folder, mutant):
    """Change the copy of the package in a folder; what is wrong with the mutant, or None."""
    path = folder / "tandem_reference" / f"{mutant.module}.py"
    source = path.read_text(encoding="utf-8")
    if source.count(mutant.old) != 1:
        return f"its old text stands {source.count(mutant.old)} times in {path.name}"
    if mutant.old == mutant.new:
        return "its new text is the old one"
    path.write_text(source.replace(mutant.old, mutant.new), encoding="utf-8")
    return None


def outcome_of(mutant):
    """(whether it is as it has to be, what happened); without a mutant, of the decoder itself."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(REFERENCE / "tandem_reference", pathlib.Path(folder) / "tandem_reference")
        fault = change(pathlib.Path(folder), mutant) if mutant else None
        if fault:
            return False, f"WRONG: {fault}"
        command = [sys.executable, "-B", __file__, "--check", folder]
        try:
            run = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        except subprocess.TimeoutExpired:
            return mutant is not None and not mutant.equivalent, f"caught: it does not end in {PATIENCE_S} s"
    survives = mutant is None or bool(mutant.equivalent)
    if run.returncode == AGREES:
        return survives, f"equivalent: {mutant.equivalent}" if mutant and survives else "SURVIVES"
    said = (run.stdout + run.stderr).strip().splitlines()[-1:]
    if run.returncode == DISAGREES:
        return not survives, f"{'NOT EQUIVALENT, ' if survives else ''}caught by {said[0]}"
    return False, f"WRONG: {said}"


def check(folder):
    """Check the vectors with the package in a folder, the smallest first; the exit status."""
    sys.path.insert(0, folder)
    from tandem_reference import vectors

    assert vectors.__file__.startswith(folder), vectors.__file__
    for file in sorted(VECTORS.glob("*.txt"), key=lambda file: (file.stat().st_size, file.name)):
        try:
            vectors.Vector(file.read_text(encoding="utf-8")).check()
        except NameError:  # the mutant is badly written
            raise
        except Exception as error:  # a mutant may fail in any way
            print(f"{file.name}: {error!r}"[:160])
            return DISAGREES
    return AGREES


def chosen(words):
    """(number, mutant) of those that the command line names by numbers or by words of their description."""
    for number, mutant in enumerate(MUTANTS, 1):
        if not words or any(word == str(number) or (not word.isdigit() and word in mutant.what) for word in words):
            yield number, mutant


def main():
    """The exit status of a command line."""
    parser = argparse.ArgumentParser(prog="mutants", description="Checks that the test vectors tell wrong decoders from a right one.")
    parser.add_argument("--list", action="store_true", help="only list the mutants")
    parser.add_argument("--only", nargs="+", metavar="N", help="numbers, or words of the descriptions")
    parser.add_argument("--check", metavar="FOLDER", help="check the vectors with the package there")
    arguments = parser.parse_args()
    if arguments.check:
        return check(arguments.check)
    picked = list(chosen(arguments.only))
    if arguments.list or not picked:
        for number, mutant in picked:
            print(f"{number:3} {mutant.module}: {mutant.what}")
        return 0 if picked else 2
    good, said = outcome_of(None)
    if not good:
        print(f"the decoder itself disagrees with the vectors, {said}")
        return 1
    failed = 0
    with ThreadPoolExecutor(AT_ONCE) as pool:
        outcomes = pool.map(lambda one: outcome_of(one[1]), picked)
        for (number, mutant), (good, said) in zip(picked, outcomes):
            print(f"{number:3} {mutant.module}: {mutant.what}: {said}", flush=True)
            failed += not good
    same = sum(bool(mutant.equivalent) for _, mutant in picked)
    print(f"{len(picked) - same} mutants and {same} equivalent ones, {failed} of all not as they have to be")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
