"""The closed loop, stepped under what a person asks for."""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Float

from envs.hand.drive.chain import chain_drive
from envs.hand.hand_file import HandFile
from envs.hand.model import PHYSICS_DT_S, V_SITE
from envs.tasks.gait import Walking
from fingers_mjx.play.player import Episode, Player, varied_model
from fingers_mjx.play.viewer.switches import own_effects, switched
from fingers_mjx.play.viewer.view import Arrows, View, view_of
from fingers_mjx.play.viewer.wishes import Wishes

PUSH_S = 0.1
LYING_S = 2.0
"""How long a hand that fell lies there before the next episode begins."""

MakePlayer = Callable[[HandFile], Player]


class Live:
    """One episode after the other, one control step at a time.

    Args:
        make: makes the player of the policy in worlds of a hand.
        hand: the hand, whose own effects are on at the start.
        seed: of the episodes.

    Attributes:
        time_s: since the episode began.
        start_pose: of the palm at that time, as `pose`.
    """

    def __init__(self, make: MakePlayer, hand: HandFile, seed: int = 0):
        self._make, self._hand, self._key = make, hand, jax.random.key(seed)
        self._own = self._effects = own_effects(hand)
        self._plain = self._player = make(hand)
        self._switched: Player | None = None
        self._episodes = self._resets = self._push_steps = self._lying = 0
        self._push_v = np.zeros(3)
        self._begin()

    @property
    def dt_s(self) -> float:
        """Control interval [s]."""
        return self._plain.env.dt

    @property
    def model(self) -> mujoco.MjModel:
        """What the bodies look like."""
        return self._plain.env.mj_model

    @property
    def fell(self) -> bool:
        """Whether the hand lies where it fell."""
        return self._lying > 0

    @property
    def pose(self) -> Float[np.ndarray, "7"]:
        """Position [m] and orientation of the palm, w x y z."""
        return self._episode.data.qpos[:7].copy()

    def compiles_for(self, wishes: Wishes) -> bool:
        """Whether the next step makes another program first."""
        new = dict(wishes.effects) != self._own
        return new and self._switched is None

    def step(self, wishes: Wishes) -> View | None:
        """Advances by a control step; None while time stands still.

        Args:
            wishes: of the person; a change of the effects may take seconds, in which
                another program is compiled.
        """
        if wishes.resets != self._resets:
            self._resets = wishes.resets
            self._begin()
        if dict(wishes.effects) != self._effects:
            self._switch(dict(wishes.effects))
        if wishes.paused:
            return None
        if self.fell:
            return self._lie()
        return self._advance(wishes)

    def _advance(self, wishes: Wishes) -> View:
        episode = self._episode
        self._note_command(wishes.command)
        force_w = self._push(wishes)
        row = self._player.step(episode, wishes.command_v)
        self.time_s += self.dt_s
        self._lying = int(bool(row.done))
        view = view_of(episode, row)
        palm_w = episode.data.xpos[self._player.env.spec.palm_body]
        push = Arrows(palm_w[None].copy(), force_w[None])
        return dataclasses.replace(view, push=push) if force_w.any() else view

    def _note_command(self, command: tuple[float, float, float] | None) -> None:
        """Begins the gait's memories anew with a new command, as training does."""
        episode, task = self._episode, self._player.env.task
        if command is None or not isinstance(task, Walking):
            return
        if not np.array_equal(np.array(command, np.float32), episode.memory.command):
            fresh = task.begin_with_command()
            episode.memory = dataclasses.replace(episode.memory, **fresh)

    def _push(self, wishes: Wishes) -> Float[np.ndarray, "3"]:
        """Applies what is left of a push to the palm; returns its force [N]."""
        if wishes.push is not None:
            self._push_v, self._push_steps = wishes.push_v, round(PUSH_S / self.dt_s)
        force_w = np.zeros(3)
        if self._push_steps > 0:
            self._push_steps -= 1
            v_to_w = self._episode.data.site(V_SITE).xmat.reshape(3, 3)
            force_w = v_to_w @ self._push_v
        palm = self._player.env.spec.palm_body
        self._episode.data.xfrc_applied[palm, :3] = force_w
        return force_w

    def _lie(self) -> None:
        """Waits where the hand fell, and then begins anew."""
        self._lying += 1
        if self._lying > LYING_S / self.dt_s:
            self._begin()

    def _begin(self) -> None:
        key = jax.random.fold_in(self._key, self._episodes)
        self._episodes += 1
        self._lying = self._push_steps = 0
        self._episode, self.time_s = self._player.begin(key), 0.0
        mujoco.mj_forward(self._episode.model, self._episode.data)
        self.start_pose = self.pose

    def _switch(self, effects: dict[str, float]) -> None:
        """Goes on in the same pose with other effects."""
        self._effects = effects
        if effects == self._own:
            player = self._plain
        else:
            self._switched = self._switched or self._make(switched(self._hand, {}))
            player = self._switched
            use_effects(player, switched(self._hand, effects))
        if player is not self._player:
            self._episode = carried_over(self._episode, self._player, player)
            self._player = player


def use_effects(player: Player, hand: HandFile) -> None:
    """Lets a player's drive have the effects of a hand, without compiling anew.

    Args:
        player: of a hand with the same effects in other sizes.
        hand: has the sizes.
    """
    env = player.env
    chain = chain_drive(hand, env.mj_model, env.plant.n_substeps, PHYSICS_DT_S)
    assert chain is not None
    player.set_effects(chain.params)


def carried_over(episode: Episode, old: Player, new: Player) -> Episode:
    """Returns an episode of another player that goes on where this one is.

    The drive starts at rest: another chain has other filters.

    Args:
        episode: to go on from.
        old: its player.
        new: the player of the result, with the shim of the old one from now on.
    """
    model = varied_model(new.env, episode.memory.world)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = episode.data.qpos, episode.data.qvel
    mujoco.mj_forward(model, data)
    new.take_over(old)
    q = jnp.asarray(data.qpos[new.env.spec.joint_qpos], jnp.float32)
    target = jnp.asarray(new.controller.target_rad, jnp.float32)
    drive = new.env.plant.drive.begin(target, q)
    return Episode(model, data, dataclasses.replace(episode.memory, drive=drive))
