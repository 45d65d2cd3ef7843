"""The standing hand as an environment of mjlab, made of its own managers' terms.

Actions move targets around the stance; the reward pays for staying up. The model and
its floor are those that MuJoCo Playground is given; observations are joints, gravity
and the last action, for walking the palm's velocities too. Neither delay, filter,
history nor randomized models.
"""

# pyright: reportMissingImports=false
import functools
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

import mujoco
import torch
from mjlab.actuator.xml_actuator import XmlActuatorCfg
from mjlab.entity import EntityArticulationInfoCfg, EntityCfg
from mjlab.envs import ManagerBasedRlEnv, ManagerBasedRlEnvCfg, mdp
from mjlab.envs.mdp.actions import JointPositionActionCfg
from mjlab.managers.event_manager import EventTermCfg
from mjlab.managers.observation_manager import ObservationGroupCfg, ObservationTermCfg
from mjlab.managers.reward_manager import RewardTermCfg
from mjlab.managers.termination_manager import TerminationTermCfg
from mjlab.rl import (
    MjlabOnPolicyRunner,
    RslRlModelCfg,
    RslRlOnPolicyRunnerCfg,
    RslRlPpoAlgorithmCfg,
    RslRlVecEnvWrapper,
)
from mjlab.scene import SceneCfg
from mjlab.sim import MujocoCfg, SimulationCfg
from mjlab.utils.lab_api.math import quat_apply, quat_apply_inverse
from mjlab.utils.torch import configure_torch_backends

from benchmarks.comparison.workers.ppo_settings import SETTINGS
from benchmarks.comparison.workers.walking import (
    ACTION_RATE,
    ALIVE,
    COMMAND_MPS,
    LOWEST_M,
    START_RAD,
    TRACKING,
    WIDTH_MPS,
)

ACTION_SCALE = 0.3
SPEED = "speed_mps"
"""Of the palm along the command, in what a step of a walking hand gives beside all."""


def make_env(
    mjcf: Path, worlds: int, device: str, seed: int, walks: bool = False
) -> RslRlVecEnvWrapper:
    """Makes worlds of the hand, wrapped for its learner.

    Args:
        mjcf: the standing hand with its key frame.
        worlds: stepped side by side.
        device: of Torch.
        seed: of the environment.
        walks: whether the reward pays for walking straight forward too.
    """
    configure_torch_backends()
    terms = {
        name: ObservationTermCfg(func=getattr(mdp, name))
        for name in ("joint_pos_rel", "joint_vel_rel", "projected_gravity")
    }
    terms["last_action"] = ObservationTermCfg(func=mdp.last_action)
    if walks:
        for name in ("base_lin_vel", "base_ang_vel"):
            terms[name] = ObservationTermCfg(func=getattr(mdp, name))
    config = ManagerBasedRlEnvCfg(
        scene=SceneCfg(num_envs=worlds, entities={"robot": _entity(mjcf)}),
        observations={
            "actor": ObservationGroupCfg(terms),
            "critic": ObservationGroupCfg({**terms}),
        },
        actions={
            "joints": JointPositionActionCfg(
                entity_name="robot", actuator_names=(".*",), scale=ACTION_SCALE
            )
        },
        events={
            "scene": EventTermCfg(func=mdp.reset_scene_to_default, mode="reset"),
            "joints": EventTermCfg(
                func=mdp.reset_joints_by_offset,
                mode="reset",
                params={
                    "position_range": (-START_RAD, START_RAD),
                    "velocity_range": (0.0, 0.0),
                },
            ),
        },
        rewards=_rewards(walks),
        terminations=_terminations(walks),
        sim=SimulationCfg(
            nconmax=48,
            njmax=128,
            mujoco=MujocoCfg(timestep=0.005, iterations=20, ls_iterations=20),
        ),
        decimation=4,
        episode_length_s=20.0,
        seed=seed,
    )
    return RslRlVecEnvWrapper(ManagerBasedRlEnv(cfg=config, device=device))


def velocity(env: ManagerBasedRlEnv) -> tuple[torch.Tensor, torch.Tensor]:
    """Returns the palm's planar velocity along and across its heading [m/s].

    Args:
        env: whose worlds began with their heading along x of the world.
    """
    data = env.scene["robot"].data
    start_w = data.default_root_state[:, 3:7]
    forward_w = torch.zeros_like(data.root_link_lin_vel_w)
    forward_w[:, 0] = 1.0
    ahead = quat_apply(data.root_link_quat_w, quat_apply_inverse(start_w, forward_w))
    ahead = torch.nn.functional.normalize(ahead[:, :2], dim=1)
    vel_w = data.root_link_lin_vel_w[:, :2]
    across = vel_w[:, 1] * ahead[:, 0] - vel_w[:, 0] * ahead[:, 1]
    return (vel_w * ahead).sum(dim=1), across


def _terminations(walks: bool) -> dict[str, TerminationTermCfg]:
    height = {"minimum_height": LOWEST_M}
    ends = {
        "time_out": TerminationTermCfg(func=mdp.time_out, time_out=True),
        "low": TerminationTermCfg(func=mdp.root_height_below_minimum, params=height),
    }
    if walks:
        ends["nan"] = TerminationTermCfg(func=mdp.nan_detection)
    return ends


def _rewards(walks: bool) -> dict[str, RewardTermCfg]:
    paid = {
        "alive": RewardTermCfg(func=mdp.is_alive, weight=ALIVE),
        "smooth": RewardTermCfg(func=mdp.action_rate_l2, weight=ACTION_RATE),
    }
    if walks:
        paid["tracking"] = RewardTermCfg(func=_tracking, weight=TRACKING)
    return paid


def _tracking(env: ManagerBasedRlEnv) -> torch.Tensor:
    along, across = velocity(env)
    env.extras[SPEED] = torch.nan_to_num(along)
    return torch.exp(-((along - COMMAND_MPS) ** 2 + across**2) / WIDTH_MPS**2)


def make_runner(
    env: RslRlVecEnvWrapper,
    folder: Path,
    seed: int,
    layers: Sequence[int] = tuple(SETTINGS["layers"]),
):
    """Makes its learner with the settings that all are given and its own others."""
    model = functools.partial(
        RslRlModelCfg,
        hidden_dims=tuple(layers),
        activation="elu",
        obs_normalization=True,
    )
    noise = {
        "class_name": "GaussianDistribution",
        "init_std": 1.0,
        "std_type": "scalar",
    }
    config = RslRlOnPolicyRunnerCfg(
        actor=model(distribution_cfg=noise),
        critic=model(),
        algorithm=RslRlPpoAlgorithmCfg(
            num_learning_epochs=SETTINGS["epochs"],
            num_mini_batches=SETTINGS["minibatches"],
        ),
        num_steps_per_env=SETTINGS["unroll"],
        logger="tensorboard",
        upload_model=False,
        seed=seed,
    )
    folder.mkdir(parents=True, exist_ok=True)
    return MjlabOnPolicyRunner(env, asdict(config), str(folder), str(env.device))


def versions() -> str:
    """Names what trains, with the versions that are installed."""
    learner = f"mjlab {version('mjlab')}, rsl-rl-lib {version('rsl-rl-lib')}"
    return f"{learner}, warp {version('warp-lang')}, torch {version('torch')}"


def _entity(mjcf: Path) -> EntityCfg:
    model = mujoco.MjModel.from_xml_path(str(mjcf))
    pose = model.keyframe("stance").qpos
    joints = {
        model.joint(i).name: float(pose[model.joint(i).qposadr[0]])
        for i in range(1, model.njnt)
    }
    return EntityCfg(
        spec_fn=functools.partial(_spec, mjcf),
        articulation=EntityArticulationInfoCfg(
            actuators=(XmlActuatorCfg(target_names_expr=(".*",)),)
        ),
        init_state=EntityCfg.InitialStateCfg(
            pos=tuple(pose[:3].tolist()),
            rot=tuple(pose[3:7].tolist()),
            joint_pos=joints,
        ),
    )


def _spec(mjcf: Path) -> mujoco.MjSpec:
    spec = mujoco.MjSpec.from_file(str(mjcf))
    for key in list(spec.keys):
        spec.delete(key)
    return spec
