import subprocess
import sys

_PROGRAM = """
import socket, sys, time
def refuse(*args, **kwargs):
    raise RuntimeError("network")
socket.socket = refuse
def watch(event, args):
    if event in ("pickle.find_class", "os.system", "subprocess.Popen"):
        raise RuntimeError(event)
sys.addaudithook(watch)
start = time.process_time()
import fingers_deploy
print(time.process_time() - start)
bundle = fingers_deploy.load_bundle(sys.argv[1])
controller = fingers_deploy.PolicyController(bundle, runtime="numpy")
controller.step([0.0] * 20, [0.0, 0.0, -1.0], [0.0] * 3, [0.0] * 3)
print(" ".join(sorted({name.partition(".")[0] for name in sys.modules})))
"""
_FOREIGN = "jax jaxlib jaxtyping mujoco brax flax onnx onnxruntime yaml"
_OURS = "rewards envs sysid fingers_mjx fingers_robot"


def _run(path):
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM, str(path)],
        capture_output=True,
        text=True,
        check=True,
    )
    seconds, modules = done.stdout.splitlines()
    return float(seconds), set(modules.split())


def test_loads_nothing_heavy_opens_no_socket_and_unpickles_nothing(bundle_dir):
    seconds, modules = _run(bundle_dir)
    assert modules & {*_FOREIGN.split(), *_OURS.split()} == set()
    assert "fingers_deploy" in modules and "numpy" in modules
    assert seconds <= 0.5
