"""Builds the extension modules with CMake; pyproject.toml says the rest.

Needs what deploy/install-packages lists under [python], and nothing from a package index.
"""

import pathlib
import re
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/pip"


def version():
    header = (ROOT / "sdk/include/tandem/tandem.h").read_text(encoding="ascii")
    return ".".join(re.search(rf"TANDEM_VERSION_{part} (\d+)", header)[1] for part in ("MAJOR", "MINOR", "PATCH"))


class CMakeBuild(build_ext):
    """Both modules by one build, into the package."""

    def build_extension(self, _):
        build = pathlib.Path(self.build_temp).resolve()
        options = {
            "CMAKE_BUILD_TYPE": "Release",
            "Python3_EXECUTABLE": sys.executable,
            "TANDEM_BUILD_LAB": "OFF",
            "TANDEM_BUILD_SERVICES": "OFF",
            "TANDEM_BUILD_TESTS": "OFF",
            "TANDEM_BUILD_WEB": "OFF",
            "TANDEM_PYTHON_INSTALL_DIR": ".",
            "TANDEM_PYTHON_STATIC": "ON",
        }
        targets = ["tandem_python_client", "tandem_python_recording"]
        for command in (
            ["cmake", "-S", ROOT, "-B", build, "-G", "Ninja", *(f"-D{name}={value}" for name, value in options.items())],
            ["cmake", "--build", build, "--target", *targets],
            ["cmake", "--install", build, "--component", "python", "--strip", "--prefix", pathlib.Path(self.build_lib).absolute()],
        ):
            subprocess.run(list(map(str, command)), check=True)


BUILD.mkdir(parents=True, exist_ok=True)
setup(
    version=version(),
    ext_modules=[Extension("tandem._client", [])],
    cmdclass={"build_ext": CMakeBuild},
    options={"build": {"build_base": str(BUILD)}, "egg_info": {"egg_base": str(BUILD)}},
)
