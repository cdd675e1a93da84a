#!/usr/bin/env python3
"""deploy/container: what it builds, and a pod of it.

container_test.py root|podman [--packages DIR] [--cold N]

root     builds the root file systems, measures them, checks the manifest, and runs its pod without podman
podman   builds the images with buildah, and gives the manifest to `podman play kube`
--packages  what deploy/debian/build-package made [built if there are none]     --cold  times N starts of the pod until it plays
Exit 0 passed, 1 failed, 77 not run: needs root and the packages of the section container.
"""

import argparse
import json
import os
import pathlib
import shutil
import stat
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

NOT_RUN = 77
DEPLOYED = pathlib.Path(__file__).resolve().parents[3] / "deploy" / "container"
MOST_MB = 80
LIMIT_S = 60  # of any one wait; a busy machine is slow
IMAGES = {"localhost/tandem:latest": "tandem", "localhost/tandem-prometheus:latest": "prometheus"}


def get(address, timeout=2.0):
    """Status and text; status 0 without an answer."""
    try:
        with urllib.request.urlopen(f"http://{address}", timeout=timeout) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()
    except OSError as error:
        return 0, str(error)


def wait_for(condition, what, alive=()):
    began = time.monotonic()
    while not condition():
        assert time.monotonic() - began < LIMIT_S, f"{what}: not within {LIMIT_S} s"
        for container in alive:
            assert container.process.poll() is None, f"{what}: {container.name} has ended"
        time.sleep(0.01)


def measure(root):
    """Bytes as they are unpacked; files with several names count once."""
    seen = {}
    for path in [root, *root.rglob("*")]:
        status = path.lstat()
        seen[status.st_ino] = status.st_size
    return sum(seen.values())


def check_root(root, programs):
    """There is nothing in it but the programs and their data."""
    assert sorted(path.name for path in (root / "usr/bin").iterdir()) == sorted(programs), list((root / "usr/bin").iterdir())
    for path in root.rglob("*"):
        mode = path.lstat().st_mode
        assert stat.S_ISLNK(mode) or not mode & (stat.S_ISUID | stat.S_ISGID), f"{path} has rights of its owner"
        inside = "/" + str(path.relative_to(root))
        is_program = stat.S_ISREG(mode) and mode & 0o111 and ".so" not in path.name
        assert not is_program or inside in {f"/usr/bin/{program}" for program in programs}, f"another program: {inside}"
    licences = list((root / "usr/share/doc").glob("*/copyright"))
    assert len(licences) > 10 and (root / "var/lib/dpkg/status").read_text().count("Package: ") >= len(licences) - 1


def check_closed(pod):
    for container in pod.containers.values():
        rights = container.rights()
        assert set(rights["Uid"].split()) == {str(pod.user)} and set(rights["Gid"].split()) == {str(pod.user)}, rights
        assert int(rights["CapEff"], 16) == int(rights["CapBnd"], 16) == 0 and rights["NoNewPrivs"] == "1", rights
        assert not container.can_write("/x") and not container.can_write("/tmp/x") and not container.can_write("/etc/tandem/x")
    assert pod.containers["server"].can_write("/var/lib/tandemd/x")


def as_podman_runs(command):
    """Version 4.3."""
    return " ".join(command) + " || exit 1"


def check_probes(pod, described):
    for container in described["spec"]["containers"]:
        for kind in ("livenessProbe", "readinessProbe"):
            if kind in container:
                command, seconds = container[kind]["exec"]["command"], container[kind]["timeoutSeconds"]
                for words in (command, ["/bin/sh", "-c", as_podman_runs(command)]):
                    wait_for(lambda c=words, s=seconds, n=container["name"]: pod.containers[n].run(c, s * 10)[0] == 0, f"{container['name']}: {kind}")


def play(pod):
    """Return the seconds until the gateway plays the server's session."""
    began = time.monotonic()
    both = [pod.containers["server"], pod.containers["gateway"]]
    for container in both:
        container.start()
    wait_for(lambda: get("127.0.0.1:9731/readyz")[0] == 200, "a gateway that plays", both)
    return time.monotonic() - began


def run_pod(roots, folder, cold):
    """In namespaces of its own."""
    from manifest import load
    from pod import Pod, shell

    shell("ip", "link", "set", "lo", "up")
    described, maps = load(DEPLOYED / "pod.yaml")
    for number in range(cold):
        (folder / str(number)).mkdir()
        with Pod(described, maps, roots, folder / str(number)) as pod:
            print(f"start {number + 1}: playing after {play(pod):.2f} s", flush=True)
    (folder / "pod").mkdir()
    with Pod(described, maps, roots, folder / "pod") as pod:
        print(f"server and gateway play {play(pod):.2f} s after their start", flush=True)
        pod.containers["prometheus"].start()
        check_probes(pod, described)
        check_closed(pod)
        scraped = "127.0.0.1:9090/api/v1/query?query=count(tandem_ready==1)"
        wait_for(lambda: '"2"]' in get(scraped)[1], "Prometheus, which sees both")
        assert "TandemLinkLoss" in get("127.0.0.1:9090/api/v1/rules")[1]
        assert get("127.0.0.1:8080/healthz")[0] == 200
        wait_for(lambda: any((pod.volumes["checkpoints"] / "arena").glob("*")), "a checkpoint")
        server = pod.containers["server"]
        probe = described["spec"]["containers"][0]["livenessProbe"]["exec"]["command"]
        server.process.send_signal(19)
        code, said = server.run(probe)
        assert code == 1 and "nothing came in time" in said, (code, said)
        server.process.send_signal(18)
        for name in ("gateway", "server", "prometheus"):
            assert pod.stop(name) == 0, name
    print("the pod ran as the manifest says: user, capabilities, read-only roots, volumes, probes, SIGTERM")


def check_refusals():
    """The checks see what they are for."""
    import copy

    from manifest import CONTAINER, POD, Wrong, check_fields, check_promises, load

    pod, maps = load(DEPLOYED / "pod.yaml")
    for change in (
        lambda wrong: wrong["spec"].update(hostNetworks=True),
        lambda wrong: wrong["spec"]["containers"][0].update(args="--config"),
        lambda wrong: wrong["spec"]["containers"][0]["livenessProbe"].update(periodSeconds="10"),
        lambda wrong: wrong["spec"]["containers"][1]["securityContext"].update(readOnlyRootFilesystem=False),
        lambda wrong: wrong["spec"]["containers"][0]["volumeMounts"][0].update(name="nothing"),
        lambda wrong: wrong["spec"]["securityContext"].update(runAsUser=0),
    ):
        wrong = copy.deepcopy(pod)
        change(wrong)
        try:
            check_fields(wrong, POD, "pod")
            check_promises(wrong, maps)
        except Wrong:
            continue
        raise AssertionError("a wrong manifest passed")
    assert {field for container in pod["spec"]["containers"] for field in container} == set(CONTAINER), "fields that no container uses"
    print("the manifest: every field is known, of its type, and used as promised")


def run_root(options, folder):
    check_refusals()
    roots = folder / "roots"
    subprocess.run([DEPLOYED / "build", *options.more, "--roots", roots], check=True)
    check_root(roots / "tandem", ["tandemd", "tandem-gateway", "dash"])
    check_root(roots / "prometheus", ["prometheus", "promtool", "dash"])
    megabytes = measure(roots / "tandem") / 1e6
    assert megabytes < MOST_MB, f"{megabytes:.1f} MB"
    print(f"the image of server and gateway has {megabytes:.1f} MB", flush=True)
    inside = ("unshare", "--mount", "--net", "--ipc", "--uts", "--pid", "--fork", "--kill-child", "--mount-proc")
    done = subprocess.run([*inside, sys.executable, "-B", __file__, "inside", "--folder", folder, "--cold", str(options.cold)], check=False)
    return done.returncode


def last_line(done):
    return ((done.stdout + done.stderr).strip().splitlines() or ["no word"])[-1]


def check_made(podman):
    """podman has understood each field that closes a container, and the probes."""
    from manifest import load

    described, _ = load(DEPLOYED / "pod.yaml")
    for container in described["spec"]["containers"]:
        found = json.loads(podman("inspect", f"tandem-arena-{container['name']}").stdout)[0]
        settings, host = found["Config"], found["HostConfig"]
        assert settings["User"] == "10001:10001" and host["ReadonlyRootfs"] and "no-new-privileges" in host["SecurityOpt"], found
        assert settings["Entrypoint"] in (container["command"], " ".join(container["command"])) and settings["Cmd"] == container["args"], found
        assert " ".join(settings["Healthcheck"]["Test"][1:]) == as_podman_runs(container["livenessProbe"]["exec"]["command"]), settings
        assert {mount["Destination"] for mount in found["Mounts"]} == {mount["mountPath"] for mount in container.get("volumeMounts", [])}, found
    print("podman makes the pod, with users, roots, volumes and probes as the manifest says")


def run_podman(options, folder):
    (folder / "storage.conf").write_text(
        f'[storage]\ndriver = "vfs"\ngraphroot = "{folder}/graph"\nrunroot = "{folder}/run"\n', "utf-8"
    )
    os.environ["CONTAINERS_STORAGE_CONF"] = str(folder / "storage.conf")
    os.environ["BUILDAH_ISOLATION"] = "chroot"
    subprocess.run([DEPLOYED / "build", *options.more], check=True)
    subprocess.run(["podman", "image", "ls"], check=True)
    podman = lambda *words: subprocess.run(["podman", *map(str, words)], capture_output=True, text=True, check=False)  # noqa: E731
    if (trial := podman("pod", "create")).returncode != 0:
        print(f"not run: podman cannot make a pod here: {last_line(trial)}")
        return NOT_RUN
    podman("pod", "rm", trial.stdout.strip())
    made = podman("play", "kube", "--start=false", DEPLOYED / "pod.yaml")
    try:
        assert made.returncode == 0, last_line(made)
        check_made(podman)
    finally:
        podman("play", "kube", "--down", DEPLOYED / "pod.yaml")
    trial = podman("run", "--rm", "--network", "none", "--no-healthcheck", "localhost/tandem:latest", "--version")
    if trial.returncode != 0:
        print(f"podman made the pod, but it was not run: no container can be started here: {last_line(trial)}")
        return NOT_RUN
    try:
        played = podman("play", "kube", DEPLOYED / "pod.yaml")
        assert played.returncode == 0, last_line(played)
        wait_for(lambda: get("127.0.0.1:8080/healthz")[0] == 200, "the gateway")
        wait_for(lambda: '"2"]' in get("127.0.0.1:9090/api/v1/query?query=count(tandem_ready==1)")[1], "Prometheus, which sees both")
    finally:
        podman("play", "kube", "--down", DEPLOYED / "pod.yaml")
    print("podman play kube: server and gateway play, Prometheus sees both")
    return 0


def missing():
    try:
        import yaml  # noqa: F401
    except ImportError:
        return "python3-yaml"
    return next((each for each in ("mmdebstrap", "dpkg-scanpackages", "unshare", "ip") if not shutil.which(each)), None)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", choices=("root", "podman", "inside"))
    parser.add_argument("--packages")
    parser.add_argument("--cold", type=int, default=0)
    parser.add_argument("--folder", type=pathlib.Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    options.more = ["--packages", options.packages] if options.packages else []
    if options.scenario == "inside":
        run_pod({image: options.folder / "roots" / name for image, name in IMAGES.items()}, options.folder, options.cold)
        return 0
    if os.geteuid() != 0:
        print("not run: needs root")
        return NOT_RUN
    wanted = missing() or (options.scenario == "podman" and next((each for each in ("podman", "buildah") if not shutil.which(each)), None))
    if wanted:
        print(f"not run: {wanted} is missing (deploy/install-packages container)")
        return NOT_RUN
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        folder.chmod(0o755)
        return {"root": run_root, "podman": run_podman}[options.scenario](options, folder)


if __name__ == "__main__":
    sys.exit(main())
