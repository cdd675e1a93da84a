#!/usr/bin/env python3
"""Does what README.md tells a newcomer, with nothing but the installed tree: its programs are built, meet and play, Python
imports, the gateway says how to get a page and serves one; and the snippets of sdk/README.md, services/README.md and
sdk/python/README.md with them.

    readme_test.py BUILD_DIR PYTHON

Each code block is taken from the page as it stands. Exit 0 passed, 1 failed.
"""

import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
FRAME = re.compile(r"frame [\d.]+: body 0 at height -?[\d.]+")


def blocks(page, language):
    """The code blocks of a page in one language."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(rf"(?ms)^```{language}\n(.*?)^```$", text)


def check(good, what):
    if not good:
        sys.exit(f"failed: {what}")


def run(command, **options):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=100, **options)
    check(done.returncode == 0, f"{shlex.join(map(str, command))}:\n{done.stdout}")
    return done.stdout


def install(build, home):
    """Runs the page's own commands, on this build, into HOME; and moves the tree, as anybody may."""
    text = "".join(blocks("README.md", "") + blocks("services/README.md", ""))
    lines = [line.split("#")[0] for line in text.splitlines() if line.startswith("cmake --install")]
    check(len(lines) == 3, f"two lines of README.md and one of services/README.md install, not {lines}")
    for line in lines:
        words = shlex.split(line.replace("build/release", str(build)).replace("$HOME", str(home)))
        run(words if "--prefix" in words else [*words, "--prefix", home / "tandem"])
    (home / "tandem").rename(home / "moved")
    return home / "moved"


def environment(prefix):
    """What the page's line of `export` sets, for the tree where it is now."""
    (line,) = re.findall(r"(?m)^export (.*)$", "".join(blocks("README.md", "")))
    script = f"export {line}; env -0".replace("$HOME/tandem", str(prefix))
    words = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True).stdout.split("\0")
    return dict(word.split("=", 1) for word in words if "=" in word)


def build_programs(prefix, folder):
    """The project of README.md, and the other pages' lines of CMake beside it."""
    client, server, engine = blocks("README.md", "cpp")
    (project,) = blocks("README.md", "cmake")
    (of_sdk,) = blocks("sdk/README.md", "cmake")
    (of_services,) = blocks("services/README.md", "cmake")
    for name, text in [("client", client), ("server", server), ("my_engine", engine)]:
        (folder / name).with_suffix(".hpp" if name == "my_engine" else ".cpp").write_text(text)
    # A program that is server and client at once includes both headers, in any order.
    both = "#include <tandem/client.hpp>\n#include <tandem/host.hpp>\n"
    (folder / "both.cpp").write_text(both + "int main() { return tandem::Columns{}.capacity; }\n")
    others = "add_executable(my_client EXCLUDE_FROM_ALL client.cpp)\nadd_executable(my_server EXCLUDE_FROM_ALL server.cpp)\n"
    joint = "add_library(both OBJECT both.cpp)\ntarget_link_libraries(both PRIVATE tandem::host tandem::tandem)\n"
    (folder / "CMakeLists.txt").write_text(project + others + of_sdk + of_services + joint)
    build = folder / "build"
    run(["cmake", "-G", "Ninja", "-S", folder, "-B", build, f"-DCMAKE_PREFIX_PATH={prefix}"])
    run(["cmake", "--build", build])
    # `host` alone brings the client's library, too.
    alone = folder / "alone"
    alone.mkdir()
    (alone / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.25)\nproject(alone LANGUAGES CXX)\nfind_package(tandem REQUIRED COMPONENTS host)\n"
        "if(NOT TARGET tandem::tandem)\n  message(FATAL_ERROR none)\nendif()\n"
    )
    run(["cmake", "-G", "Ninja", "-S", alone, "-B", alone / "build", f"-DCMAKE_PREFIX_PATH={prefix}"])
    return build


def play(build, variables):
    """The client of the page plays its server, while Python does, which sees the floor as well."""
    server = subprocess.Popen([build / "server"], env=variables)
    try:
        client = subprocess.Popen([build / "client"], env=variables, stdout=subprocess.PIPE, text=True)
        script = blocks("sdk/python/README.md", "python")[0].split("with tandem.Recording")[0]
        script = script.replace("    print([", "    solids = client.geometry()\n    print([") + "print(len(solids))\n"
        said = run([PYTHON, "-c", script], env=variables, cwd="/")
        check(said.splitlines()[-1] == "1", f"the floor of `scenery` is not in the session's scene: {said}")
        lines = client.communicate(timeout=60)[0].splitlines()
        check(client.returncode == 0 and len(lines) == 5 and all(map(FRAME.fullmatch, lines)), f"the client: {lines}")
        check(server.poll() is None, f"the server ended with {server.returncode}")
    finally:
        server.terminate()
        server.wait()


def page(prefix, variables):
    """What a browser gets of the installed gateway."""
    gateway = subprocess.Popen(
        [prefix / "bin" / "tandem-gateway", "--port", "0"], env=variables, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        log = ""
        for line in gateway.stdout:
            log += line
            if address := re.search(r"http://127\.0\.0\.1:\d+/", line):
                break
        try:
            with urllib.request.urlopen(address[0], timeout=10) as answer:
                return answer.read().decode(), log
        except urllib.error.HTTPError as error:
            return error.read().decode(), log
    finally:
        gateway.terminate()
        gateway.communicate()


def main():
    global PYTHON
    build = pathlib.Path(sys.argv[1]).resolve()
    PYTHON = sys.argv[2]
    hello = (ROOT / "sdk/examples/hello_c/main.c").read_text(encoding="utf-8")
    check(blocks("sdk/README.md", "c") == [hello], "sdk/README.md shows hello_c, which package_sdk builds and runs, as it is")
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        prefix = install(build, folder)
        variables = environment(prefix)
        variables["CYCLONEDDS_URI"] = (
            "<CycloneDDS><Domain id='any'><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces></General>"
            f"<Discovery><Tag>tandem-readme-{os.getpid()}</Tag></Discovery></Domain></CycloneDDS>"
        )
        began = time.monotonic()
        play(build_programs(prefix, folder), variables)
        viewer = prefix / "share" / "tandem" / "viewer"
        if viewer.exists():
            viewer.rename(folder / "viewer")
        answer, log = page(prefix, variables)
        check("deploy/build-viewer" in answer and "deploy/build-viewer" in log, f"the gateway's page without one: {answer}\n{log}")
        viewer.mkdir(parents=True)
        (viewer / "index.html").write_text("a page")
        answer, log = page(prefix, variables)
        check(answer == "a page", f"the gateway serves the installed page: {answer}\n{log}")
        print(f"what the pages tell was done, in {time.monotonic() - began:.0f} s after the installation")


if __name__ == "__main__":
    main()
