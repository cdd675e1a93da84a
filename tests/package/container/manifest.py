"""The manifest as data, checked: every field is one that Kubernetes 1.26 and podman 4.3 know, of the right type."""

import yaml

PROBE = {"exec": {"command": [str]}, "periodSeconds": int, "timeoutSeconds": int, "failureThreshold": int}
CONTAINER = {
    "name": str, "image": str, "imagePullPolicy": str, "command": [str], "args": [str],
    "ports": [{"name": str, "containerPort": int, "hostIP": str, "hostPort": int}],
    "volumeMounts": [{"name": str, "mountPath": str, "readOnly": bool}],
    "securityContext": {"readOnlyRootFilesystem": bool, "allowPrivilegeEscalation": bool, "capabilities": {"drop": [str]}},
    "resources": {"limits": {"memory": str}, "requests": {"cpu": str, "memory": str}},
    "livenessProbe": PROBE, "readinessProbe": PROBE,
}  # fmt: skip
POD = {
    "apiVersion": str, "kind": str, "metadata": {"name": str, "labels": {"app": str}},
    "spec": {
        "automountServiceAccountToken": bool, "restartPolicy": str, "terminationGracePeriodSeconds": int,
        "securityContext": {"runAsNonRoot": bool, "runAsUser": int, "runAsGroup": int, "fsGroup": int, "seccompProfile": {"type": str}},
        "volumes": [{"name": str, "configMap": {"name": str}, "emptyDir": {}}],
        "containers": [CONTAINER],
    },
}  # fmt: skip


class Wrong(Exception):
    """A field that is unknown, of another type, or against what the manifest promises."""


def check_fields(value, known, where):
    if isinstance(known, dict):
        if not isinstance(value, dict):
            raise Wrong(f"{where} is no mapping")
        for name in value:
            if name not in known:
                raise Wrong(f"{where}.{name}: there is no such field")
            check_fields(value[name], known[name], f"{where}.{name}")
    elif isinstance(known, list):
        if not isinstance(value, list):
            raise Wrong(f"{where} is no list")
        for number, each in enumerate(value):
            check_fields(each, known[0], f"{where}[{number}]")
    elif type(value) is not known:
        raise Wrong(f"{where} is {value!r}, but has to be of type {known.__name__}")


def check_promises(pod, maps):
    """What no type says: names that are used exist, and every container is closed."""
    spec = pod["spec"]
    if not spec["securityContext"]["runAsNonRoot"] or spec["securityContext"]["runAsUser"] < 1000:
        raise Wrong("the pod runs as root")
    volumes = {volume["name"]: volume for volume in spec["volumes"]}
    if any(volume["configMap"]["name"] not in maps for volume in volumes.values() if "configMap" in volume):
        raise Wrong("a volume names a ConfigMap that is not there")
    for container in spec["containers"]:
        name, closed = container["name"], container["securityContext"]
        if not closed["readOnlyRootFilesystem"] or closed["allowPrivilegeEscalation"] or closed["capabilities"]["drop"] != ["ALL"]:
            raise Wrong(f"{name} is not closed")
        for mount in container.get("volumeMounts", []):
            if mount["name"] not in volumes:
                raise Wrong(f"{name} mounts {mount['name']}, which is no volume")
        if "livenessProbe" not in container or "memory" not in container["resources"]["limits"]:
            raise Wrong(f"{name} has no probe or no limit")


def load(path):
    """Return the pod and the data of ConfigMaps by name. Raises Wrong."""
    with open(path, encoding="utf-8") as file:
        documents = list(yaml.safe_load_all(file))
    maps = {each["metadata"]["name"]: each["data"] for each in documents if each["kind"] == "ConfigMap"}
    (pod,) = [each for each in documents if each["kind"] != "ConfigMap"]
    if (pod["apiVersion"], pod["kind"]) != ("v1", "Pod"):
        raise Wrong("this is no pod")
    check_fields(pod, POD, "pod")
    check_promises(pod, maps)
    return pod, maps
