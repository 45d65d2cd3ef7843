"""What is measured: jobs, each with the workers that do it, and the seed of all."""

from dataclasses import dataclass

from benchmarks.comparison.peers import OURS

SEED = 0
SIZES = {"cpu": (64, 256, 512), "gpu": (512, 2048, 8192, 32768)}
"""Worlds by device."""
FIRST_WORLDS = {"cpu": 64, "gpu": 2048}
"""Worlds of the first iteration by device; those of CPUs compile alike."""

STAND_WORLDS = {"cpu": 64, "gpu": 4096}
"""Worlds of the training to a standing policy: those of our presets."""

WALKING = "a training to walk, of eight minutes"


@dataclass(frozen=True)
class Worker:
    """A process that measures.

    Attributes:
        peer: as the table names it.
        environment: of which peer it is run in.
        module: in `benchmarks.comparison.workers`.
        options: beside those that all workers are given.
    """

    peer: str
    environment: str
    module: str
    options: tuple[str, ...] = ()


@dataclass(frozen=True)
class Job:
    """A measurement of one or more peers.

    Attributes:
        name: of its rows.
        kind: `turns` for rates by turns, `start` for seconds from the start of the
            process to its message, `report` for figures that the workers name, `learn`
            for those of a training from its start, with nothing compiled before.
        quantity: what the figures are; workers of `report` and `learn` name their own.
        workers: the first is what the others are held against.
        worlds: stepped side by side.
        starts: of each worker, at most.
    """

    name: str
    kind: str
    quantity: str
    workers: tuple[Worker, ...]
    worlds: int
    starts: int = 3


def ours(module: str, backend: str) -> Worker:
    """Returns a worker of this project on a physics backend."""
    named = {"cpu": "C MuJoCo", "jax": "MJX", "warp": "Warp"}[backend]
    return Worker(f"{OURS} ({named})", OURS, module, ("--backend", backend))


def playground(module: str, impl: str) -> Worker:
    """Returns a worker of MuJoCo Playground on an implementation of MJX."""
    peer = f"MuJoCo Playground, Brax PPO (MJX on {impl})"
    return Worker(peer, "playground", module, ("--backend", impl))


def jobs(device: str) -> tuple[Job, ...]:
    """Returns all measurements that make sense on a device."""
    backends = ("cpu", "jax") if device == "cpu" else ("warp",)
    impls = ("jax",) if device == "cpu" else ("warp", "jax")
    fast = tuple(ours("ours.speed", name) for name in backends)
    first = (ours("ours.first", backends[0]), playground("playground.first", impls[0]))
    stand = (ours("ours.stand", backends[0]), playground("playground.stand", impls[0]))
    fast += tuple(playground("playground.speed", impl) for impl in impls)
    mjlab = Worker("mjlab, RSL-RL PPO", "mjlab", "mjlab.speed")
    # Rates on CPUs keep the jobs that their rows were taken in.
    alone = SIZES[device] if device == "cpu" else ()
    fast += (mjlab,) if device == "gpu" else ()
    mjlab_first = Worker(mjlab.peer, "mjlab", "mjlab.first")
    mjlab_stand = (Worker(mjlab.peer, "mjlab", "mjlab.stand"),)
    resumed = (
        ours("ours.resume", backends[0]),
        playground("playground.resume", impls[0]),
        Worker(mjlab.peer, "mjlab", "mjlab.resume"),
    )
    unilab = Worker("UniLab, RSL-RL PPO", "unilab", "unilab_first")
    fits = Worker("mujoco.sysid", "sysid", "sysid_fit")
    speed = "control steps per second of all worlds together"
    until = "seconds from the start of the process to the first PPO iteration done"
    stands = (
        "seconds from the start of the process to ended episodes of 10 s on average"
    )
    return (
        Job("first", "start", until, first, FIRST_WORLDS[device]),
        *(Job(f"speed-{n}", "turns", speed, fast, n) for n in SIZES[device]),
        *(Job(f"mjlab-speed-{n}", "turns", speed, (fast[0], mjlab), n) for n in alone),
        Job("stand", "start", stands, stand, STAND_WORLDS[device], starts=1),
        Job(
            "mjlab-stand", "start", stands, mjlab_stand, STAND_WORLDS[device], starts=1
        ),
        *_walks(device, mjlab.peer),
        Job("resume", "report", "resumption and export", resumed, 64),
        Job("sysid", "report", "parameters of one joint", (fits,), 1),
        Job("unilab-first", "start", until, (unilab,), FIRST_WORLDS[device]),
        Job("mjlab-first", "start", until, (mjlab_first,), FIRST_WORLDS[device]),
    )


def _walks(device: str, mjlab: str) -> tuple[Job, ...]:
    """Returns the trainings to walk; a few cores of a CPU make no gait in the time."""
    if device == "cpu":
        return ()
    named = {
        "walk": ours("ours.walk", "warp"),
        "straight-walk": ours("ours.straight", "warp"),
        "playground-walk": playground("playground.walk", "warp"),
        "mjlab-walk": Worker(mjlab, "mjlab", "mjlab.walk"),
    }
    worlds = STAND_WORLDS[device]
    return tuple(Job(n, "learn", WALKING, (w,), worlds) for n, w in named.items())
