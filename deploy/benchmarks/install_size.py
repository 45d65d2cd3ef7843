"""What the shim takes on a disk, and how long it takes to import (processor time).

    python deploy/benchmarks/install_size.py

builds the wheel and installs it into fresh environments, without and with ONNX Runtime;
on Debian also beside the NumPy of the system, which is smaller than that of PyPI.
"""

import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROBOT = "aarch64-manylinux_2_28"
DEBIAN = ("python3-numpy", "libblas3", "liblapack3", "libgfortran5", "libquadmath0")
ONNX = ("onnxruntime<1.29", "flatbuffers", "packaging", "protobuf")
DEPLOY = Path(__file__).parents[1]
_IMPORT = """
import time
start = time.process_time()
import fingers_deploy
print(time.process_time() - start)
"""


def _run(*program: str | Path, env: dict[str, str] | None = None) -> str:
    done = subprocess.run(
        [str(word) for word in program],
        check=True,
        capture_output=True,
        text=True,
        env={**os.environ, **(env or {})},
    )
    return done.stdout


def size_mb(folder: Path) -> float:
    """Size of the files of a folder, 10⁶ bytes."""
    files = (f for f in folder.rglob("*") if f.is_file() and not f.is_symlink())
    return round(sum(file.stat().st_size for file in files) / 1e6, 1)


def measure(wheel: Path, extra: str, folder: Path) -> dict:
    """Installs the wheel with an extra; returns sizes and time of import."""
    _run("uv", "venv", "-q", "--python", sys.executable, folder)
    python = folder / "bin" / "python"
    _run("uv", "pip", "install", "-q", "--python", python, f"{wheel}{extra}")
    site = next((folder / "lib").glob("python*")) / "site-packages"
    return {
        "machine": platform.machine(),
        **_sizes(site, extra),
        "import_s": _import_s(python),
    }


def measure_debian(wheel: Path, extra: str, folder: Path) -> dict:
    """The same beside the NumPy of Debian, with the libraries that it needs."""
    system, site = folder / "system", folder / "site"
    system.mkdir(parents=True)
    subprocess.run(
        ["apt-get", "download", "-q", *DEBIAN],
        cwd=system,
        check=True,
        capture_output=True,
    )
    for package in system.glob("*.deb"):
        _run("dpkg", "-x", package, system)
        package.unlink()
    more = ONNX if extra else ()
    python = Path("/usr/bin/python3")
    _run(
        *("uv", "pip", "install", "-q", "--python", python, "--target", site),
        *("--no-deps", wheel, *more),
    )
    libraries = {str(file.parent) for file in system.rglob("lib*.so.*")}
    paths = [system / "usr" / "lib" / "python3" / "dist-packages", site]
    env = {
        "LD_LIBRARY_PATH": ":".join(sorted(libraries)),
        "PYTHONPATH": ":".join(map(str, paths)),
    }
    size = size_mb(system) + size_mb(site)
    return {
        "machine": f"{platform.machine()}, NumPy of the system (Debian)",
        **_sizes(site, extra),
        "installed_mb": round(size, 1),
        "import_s": _import_s(python, env),
    }


def _import_s(python: Path, env: dict[str, str] | None = None) -> float:
    """Median time of an import after the first one [s]."""
    _run(python, "-c", _IMPORT, env=env)
    times = sorted(float(_run(python, "-c", _IMPORT, env=env)) for _ in range(5))
    return round(times[2], 3)


def measure_robot(wheel: Path, extra: str, folder: Path) -> dict:
    """The same for the robot's computer, whose wheels are only unpacked here."""
    _run(
        *("uv", "pip", "install", "-q", "--python", sys.executable),
        *("--target", folder, "--python-platform", ROBOT, "--only-binary", ":all:"),
        f"{wheel}{extra}",
    )
    return {"machine": ROBOT.partition("-")[0], **_sizes(folder, extra)}


def _sizes(site: Path, extra: str) -> dict:
    sizes = {entry.name: size_mb(entry) for entry in site.iterdir() if entry.is_dir()}
    # What no policy needs: tests, and libraries to link other programs with.
    spare = [f for d in site.rglob("tests") if d.is_dir() for f in d.rglob("*")]
    spare += [*site.rglob("*.a"), *site.rglob("*.pyi")]
    return {
        "extra": extra or "none",
        "of_that_tests_and_stubs_mb": round(
            sum(f.stat().st_size for f in set(spare) if f.is_file()) / 1e6, 1
        ),
        "installed_mb": size_mb(site),
        "largest_mb": dict(sorted(sizes.items(), key=lambda x: -x[1])[:6]),
        "fingers_deploy_mb": sizes["fingers_deploy"],
    }


def main() -> int:
    """Runs the measurement and prints it as JSON."""
    with tempfile.TemporaryDirectory() as folder:
        base = Path(folder)
        # From a copy: a build leaves its folder beside the sources.
        spare = shutil.ignore_patterns("build", "*.egg-info", "tests")
        shutil.copytree(DEPLOY, base / "deploy", ignore=spare)
        _run("uv", "build", "-q", "--wheel", base / "deploy", "-o", base / "dist")
        wheel = next((base / "dist").glob("*.whl"))
        results = [
            measure(wheel, extra, base / f"venv{i}")
            for i, extra in enumerate(("", "[onnx]"))
        ] + [
            measure_robot(wheel, extra, base / f"robot{i}")
            for i, extra in enumerate(("", "[onnx]", "[onnx,hand]"))
        ]
        if shutil.which("apt-get"):
            results += [
                measure_debian(wheel, extra, base / f"debian{i}")
                for i, extra in enumerate(("", "[onnx]"))
            ]
    print(json.dumps(results, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
