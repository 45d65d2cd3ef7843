#!/bin/sh
# The shim's tests on 64-bit Arm, under QEMU's emulation of the Raspberry Pi's core.
#
#     sh deploy/benchmarks/on_arm.sh FOLDER [arguments of pytest]
#
# On Debian or Ubuntu, without administrator's rights and without changing the system: an
# emulator and an Arm Python of the distribution are unpacked into FOLDER, wheels for Arm
# beside them. ONNX Runtime crashes under this emulator and is left out: NumPy runs the
# policy. Tests of properties, with their hundreds of examples, would take an hour. Needs
# apt-get, dpkg-deb and uv.
set -eu
folder=$1
shift
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
root=$(cd "$(dirname "$0")/../.." && pwd)

if [ ! -x "$folder/emulator/usr/bin/qemu-aarch64-static" ]; then
    mkdir -p "$folder/state/lists/partial" "$folder/cache/archives/partial" "$folder/emulator"
    (cd "$folder/emulator" && apt-get -q download qemu-user-static && dpkg-deb -x ./*.deb .)
    touch "$folder/status"
    apt() {
        apt-get -q -o Dir::State="$folder/state" -o Dir::State::status="$folder/status" \
            -o Dir::Cache="$folder/cache" -o Debug::NoLocking=1 \
            -o APT::Architecture=arm64 -o APT::Architectures::=arm64 "$@"
    }
    apt update
    apt -y --no-install-recommends --download-only install python3.11 libstdc++6
    for package in "$folder"/cache/archives/*.deb; do
        dpkg-deb -x "$package" "$folder/system"
    done
    onnx=$(grep -A1 '^name = "onnx"' "$root/uv.lock" | sed -n 's/version = "\(.*\)"/\1/p')
    uv pip install --quiet --target "$folder/wheels" --only-binary :all: \
        --python-platform aarch64-unknown-linux-gnu --python-version 3.11 \
        "$(grep -o '^numpy==[0-9.]*' "$root/deploy/robot.txt")" "onnx==$onnx" \
        pytest pytest-timeout hypothesis jaxtyping pyyaml
fi

# PYTHONHOME and not a virtual environment: the emulated system has no programs but this.
export PYTHONHOME="$folder/system/usr" PYTHONPATH="$folder/wheels:$root/deploy:$root"
cd "$root/deploy/tests"
exec "$folder/emulator/usr/bin/qemu-aarch64-static" -cpu cortex-a53 -L "$folder/system" \
    "$folder/system/usr/bin/python3.11" -m pytest -p no:cacheprovider \
    --import-mode=importlib -o addopts= -o timeout=1800 -c "$root/pyproject.toml" \
    test_action.py test_observation.py test_controller.py test_policy.py \
    test_manifest.py test_bundle.py \
    --deselect deploy/tests/test_bundle.py::test_a_policy_that_runs_does_not_see_its_file_change \
    --deselect deploy/tests/test_controller.py::test_closes_the_loop_as_defined \
    --deselect deploy/tests/test_controller.py::test_runtimes_agree_over_an_episode \
    -k 'not onnxruntime and not property' "$@"
