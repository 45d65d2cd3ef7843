import copy
import dataclasses

import numpy as np
import pytest

from fingers_deploy.rotations import conjugate
from fingers_robot.reading import Health, ImuReading, Reading
from fingers_robot.safety import (
    Inputs,
    Mode,
    Operator,
    Proposal,
    initial_state,
    make_limits,
    step,
)
from fingers_robot.safety.detectors.policy import complement

DT = 0.002
CONTROL_STEPS = 10


class Rig:
    """A healthy hand and policy around the pure supervisor; faults are put on top.

    A fault is a function of the inputs of one step, and of time.
    """

    def __init__(self, limits, wiggle=(), seed=0):
        self.limits = limits
        self.state = initial_state(limits, 0.0, wiggle)
        self.rng = np.random.default_rng(seed)
        self.t, self.count = 0.0, 0
        low, high = limits.allowed_rad.T
        self.pos = np.clip(limits.rest_rad + 0.1, low + 0.01, high - 0.01)
        self.enabled = False
        self.proposed = None
        self.out = None
        self.inputs = None
        self.fault = None
        self.log = []
        self.events = []

    def healthy(self, operator=Operator.NONE):
        quat = conjugate(self.limits.v_quat_b)
        return Inputs(
            reading=Reading(self.t, self.pos.copy(), np.zeros(20)),
            imu=ImuReading(self.t, quat, 1e-3 * self.rng.standard_normal(3)),
            health=Health(
                t_s=self.t,
                enabled=self.enabled,
                disabled=not self.enabled,
                temperature_c=np.full(20, 40.0),
                bus_v=14.8,
                error_code=np.zeros(20, np.uint32),
                effort_limit_a=np.ones(20),
                pos_rad=self.pos.copy(),
            ),
            proposal=self.proposed,
            operator=operator,
            preflight_ok=True,
            control_tick=self.count // CONTROL_STEPS
            if self.count % CONTROL_STEPS == 0
            else -1,
        )

    def tick(self, operator=Operator.NONE):
        """One step of 2 ms; returns the outputs."""
        inputs = self.healthy(operator)
        if self.fault is not None:
            inputs = self.fault(inputs, self.t)
        self.inputs = inputs
        self.state, self.out = step(self.state, inputs, self.t, self.limits)
        self.log.append((self.t, self.state.mode, self.out))
        self.events += self.out.events
        self._hand()
        self._policy(inputs)
        self.count += 1
        self.t = self.count * DT
        return self.out

    def run(self, seconds, until=None):
        """Steps for some time, or until a mode is reached."""
        for _ in range(round(seconds / DT)):
            self.tick()
            if self.state.mode == until:
                return
        assert until is None, f"{until!r} not reached: {self.events}"

    def activate(self):
        self.run(0.1)
        self.tick(Operator.ARM)
        self.run(60, until=Mode.ACTIVE)
        self.run(0.3)
        return self

    def _hand(self):
        if self.out.enable is not None:
            self.enabled = self.out.enable
        if self.out.target_rad is not None and self.enabled:
            self.pos = self.pos + 0.2 * (self.out.target_rad - self.pos)
        self.pos = self.pos + 1e-5 * self.rng.standard_normal(20)

    def _policy(self, inputs):
        self.proposed = None
        if inputs.control_tick >= 0:
            target = self.state.target_rad
            if self.out.policy_runs:
                goal = self.limits.rest_rad + 0.1 * np.sin(2 * np.pi * self.t)
                low, high = self.limits.allowed_rad.T
                goal = np.clip(goal, low, high)
                target = target + np.clip(goal - target, -0.05, 0.05)
            self.proposed = Proposal(
                inputs.control_tick, complement(self.out.challenge), target
            )


@pytest.fixture(scope="session")
def limits(bundle):
    factory = np.asarray(bundle.manifest.interface.joint_limits_rad)
    factory = factory + np.array([-0.05, 0.05])
    return make_limits(bundle.manifest, factory)


@pytest.fixture(scope="session")
def make_rig(limits):
    def make(wiggle=(), seed=0, **changes):
        return Rig(dataclasses.replace(limits, **changes), wiggle, seed)

    return make


@pytest.fixture(scope="session")
def _activated(make_rig):
    return make_rig().activate()


@pytest.fixture
def rig(_activated):
    """A rig in mode ACTIVE, a fresh copy for each test."""
    return copy.deepcopy(_activated)
