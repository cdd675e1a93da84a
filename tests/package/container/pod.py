"""Runs a pod in namespaces of this process, as a runtime of containers would: no cgroups, no seccomp."""

import ctypes
import os
import signal
import subprocess
import time

LIBC = ctypes.CDLL(None, use_errno=True)
PR_CAPBSET_DROP, PR_SET_NO_NEW_PRIVS = 24, 38
LAST_CAPABILITY = 63
DEVICES = ("null", "zero", "full", "random", "urandom")


def shell(*words):
    subprocess.run(words, check=True)


class Container:
    """A view of the image's root, read-only, with the volumes that the manifest mounts."""

    def __init__(self, described, root, view, volumes, user):
        self.name, self.user, self.view, self.process = described["name"], user, str(view), None
        self.command = described["command"] + described.get("args", [])
        self.log = f"{view}.log"
        os.makedirs(view)
        shell("mount", "--bind", root, view)
        mounts = [(mount, f"{view}{mount['mountPath']}") for mount in described.get("volumeMounts", [])]
        for _, at in mounts:
            os.makedirs(at, exist_ok=True)  # in the root below: runtimes do so in a layer of the container
        shell("mount", "-o", "remount,bind,ro,nosuid,nodev", view)
        shell("mount", "-t", "proc", "proc", f"{view}/proc")
        shell("mount", "-t", "tmpfs", "-o", "mode=755,size=64k", "dev", f"{view}/dev")
        for device in DEVICES:
            with open(f"{view}/dev/{device}", "wb"):
                pass
            shell("mount", "--bind", f"/dev/{device}", f"{view}/dev/{device}")
        shell("mount", "-o", "remount,ro", f"{view}/dev")
        for mount, at in mounts:
            shell("mount", "--bind", volumes[mount["name"]], at)
            shell("mount", "-o", f"remount,bind,nosuid,nodev,noexec{',ro' if mount.get('readOnly') else ''}", at)

    def enter(self):
        """In a child, before it becomes the program: root is changed, and all rights are given up."""
        os.chroot(self.view)
        os.chdir("/")
        for capability in range(LAST_CAPABILITY + 1):
            LIBC.prctl(PR_CAPBSET_DROP, capability, 0, 0, 0)
        os.setgroups([])
        os.setgid(self.user)
        os.setuid(self.user)
        if LIBC.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0:
            os._exit(99)

    def start(self):
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(self.command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env={}, preexec_fn=self.enter)

    def run(self, command, seconds=10):
        """Return the exit code and what it wrote."""
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, text=True, env={}, preexec_fn=self.enter, timeout=seconds, check=False
        )
        return done.returncode, (done.stdout + done.stderr).strip()

    def can_write(self, path):
        child = os.fork()
        if child == 0:
            self.enter()
            try:
                os.close(os.open(path, os.O_WRONLY | os.O_CREAT))
                os._exit(0)
            except OSError:
                os._exit(1)
        return os.waitpid(child, 0)[1] == 0

    def rights(self):
        """What the kernel says of the process."""
        with open(f"/proc/{self.process.pid}/status", encoding="ascii") as status:
            return dict(line.rstrip("\n").split(":\t", 1) for line in status if ":\t" in line)

    def said(self):
        if self.process is None:
            return ""
        with open(self.log, errors="replace", encoding="utf-8") as log:
            return log.read()


class Pod:
    """All containers of a manifest, for a `with`."""

    def __init__(self, pod, maps, roots, folder):
        spec = pod["spec"]
        self.user, self.grace_s = spec["securityContext"]["runAsUser"], spec["terminationGracePeriodSeconds"]
        volumes = {}
        for volume in spec["volumes"]:
            at = volumes[volume["name"]] = folder / volume["name"]
            at.mkdir()
            for name, text in maps[volume["configMap"]["name"]].items() if "configMap" in volume else ():
                (at / name).write_text(text, "utf-8")
            if "emptyDir" in volume:
                os.chown(at, 0, spec["securityContext"]["fsGroup"])
                at.chmod(0o2770)
        self.volumes = volumes
        self.containers = {
            each["name"]: Container(each, roots[each["image"]], folder / f"root-{each['name']}", volumes, self.user)
            for each in spec["containers"]
        }

    def stop(self, name):
        """As a runtime does: SIGTERM, and time to end. Return the exit code."""
        process = self.containers[name].process
        process.send_signal(signal.SIGTERM)
        return process.wait(self.grace_s)

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        for container in self.containers.values():
            if container.process and container.process.poll() is None:
                container.process.kill()
                container.process.wait()
            if kind is not None:
                print(f"--- {container.name}\n{container.said()[-2000:]}")
        time.sleep(0.1)
