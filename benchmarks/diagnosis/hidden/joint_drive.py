"""One drive of the hidden mechanism, stepped at 2 kHz in plain Python."""

import math
from bisect import bisect_right

import numpy as np
from scipy.stats import gamma

from benchmarks.diagnosis.hidden.truth import Joint

PRESLIDING_RAD = 2e-4
"""How far dry friction gives before it slips."""


class JointDrive:
    """Command path, servo and friction of one joint with their states.

    The low-pass is the trapezoidal rule of its differential equation; a profile brakes
    as late as whole steps allow; dry friction is a slipping spring, hysteresis a row of
    Jenkins elements, warmth a heat balance.
    """

    def __init__(
        self, joint: Joint, times: list[float], targets: list[float], h: float
    ):
        value = joint.value
        self.h, self.joint = h, joint
        self.times, self.targets = times, targets
        self.delay = joint.delay_s + value("transport_delay", "delay_s", 0.0)
        cutoff = value("lowpass_cutoff", "cutoff_hz", joint.lowpass_hz)
        self.smooths = math.isfinite(cutoff)
        wh = math.tan(min(math.pi * cutoff * h, 1.5))
        self.pole, self.weight = (1.0 - wh) / (1.0 + wh), wh / (1.0 + wh)
        self.slew = min(value("slew_limit", "speed_rad_s", math.inf), joint.slew_rad_s)
        self.up = value("directional_slew", "up_rad_s", math.inf)
        self.down = value("directional_slew", "down_rad_s", math.inf)
        self.jolt = h * value("acceleration_limit", "acceleration_rad_s2", math.inf)
        self.pace = 0.0
        self.grid = value("command_quantization", "step_rad", 0.0)
        self.kp = joint.kp * value("stiffness", "scale", 1.0)
        self.kd = joint.kd * value("damping", "scale", 1.0)
        self.k_int, self.fastest = joint.k_int, joint.ref_rad_s
        self.cascade = joint.k_int > 0.0 or math.isfinite(joint.ref_rad_s)
        self.integral = self.rise = 0.0
        self.zone = value("deadband", "half_width_rad", 0.0)
        self.start = value("start_torque", "torque_nm", 0.0)
        self.still = value("start_torque", "from_rad", 0.0)
        self.limit = min(value("torque_limit", "limit_nm", math.inf), joint.limit_nm)
        self.slope = value("torque_slope_limit", "slope_nm_s", math.inf)
        self.scale = value("encoder_scale", "scale", 1.0)
        self.offset = joint.offset_rad + value("encoder_offset", "offset_rad", 0.0)
        self.sine = value("encoder_eccentricity", "sine_rad", 0.0)
        self.cosine = value("encoder_eccentricity", "cosine_rad", 0.0)
        self.heat = value("thermal_derating", "fall_per_nm2s", 0.0)
        self.cool = value("thermal_derating", "cooling_per_s", 0.0)
        self.warmth = 0.0
        self.dry = _Bristle(joint, h)
        self.loop = _Jenkins(joint)
        self.catch = joint.effects.get("contact_catch")
        self.ripple = joint.effects.get("gear_ripple")
        self.slack = joint.effects.get("cable_slack")
        self.bend = 0.5 * value("asymmetric_viscous", "difference_nms", 0.0)
        self.viscous = value("viscous_friction", "damping_nms", 0.0)
        self.input = self.filtered = self.command = self._quantized(targets[0])
        self.asked = self.torque = 0.0
        self.order = _reordered(joint, times)

    def _quantized(self, target: float) -> float:
        if self.grid <= 0.0:
            return target
        return self.grid * math.floor(target / self.grid + 0.5)

    def _arrived(self, t: float) -> float:
        """The newest target that has arrived at time t; packets may have swapped."""
        last = bisect_right(self.times, t - self.delay) - 1
        return self.targets[self.order[max(last, 0)]]

    def encoder(self, q: float) -> float:
        """What the encoder reads at an angle [rad]."""
        if self.sine or self.cosine:
            q = q + self.sine * math.sin(q) + self.cosine * math.cos(q)
        return self.scale * q + self.offset

    def _encoder_speed(self, q: float, v: float) -> float:
        bend = self.sine * math.cos(q) - self.cosine * math.sin(q)
        return self.scale * (1.0 + bend) * v

    def drive(self, t: float, q: float, v: float, strength: float) -> float:
        """Returns the torque of the motor [N·m] at angle q, speed v of the motor."""
        target = self._quantized(self._arrived(t))
        mean = self.weight * (target + self.input)
        self.filtered = self.pole * self.filtered + mean if self.smooths else target
        self.input = target
        up, down = (self.h * min(self.slew, x) for x in (self.up, self.down))
        self.command += self._stride(self.filtered - self.command, up, down)
        error = self.command - self.encoder(q)
        if self.zone:
            error -= min(max(error, -self.zone), self.zone)
        asked = self._asked(error, self._encoder_speed(q, v))
        if abs(error) > self.still:
            asked += math.copysign(self.start, error)
        asked = self._limited(asked)
        if self.slope < math.inf:
            rise = self.slope * self.h
            asked = self.asked + min(max(asked - self.asked, -rise), rise)
        self.asked = asked
        # A warm winding and a low supply weaken what the servo asks for, limit and all.
        self.torque = torque = asked * strength / (1.0 + self.warmth)
        if self.heat:
            self.warmth += self.h * (self.heat * torque**2 - self.cool * self.warmth)
        return torque

    def _stride(self, away: float, up: float, down: float) -> float:
        """The next step of the command towards a goal that is so far away [rad].

        A way of n steps, each slower than the one before by d, is d n (n + 1) / 2 long:
        the longest first step of a way x that can still be braked is d n with that n.
        """
        if math.isinf(self.jolt):
            return min(max(away, -down), up)
        change = self.jolt * self.h
        steps = math.sqrt(0.25 + 2.0 * abs(away) / change) - 0.5
        # A way that is no whole number of steps is left for the last of them.
        wanted = min(change * steps, abs(away), up if away > 0.0 else down)
        wanted = math.copysign(wanted, away)
        self.pace = min(max(wanted, self.pace - change), self.pace + change)
        return self.pace

    def _asked(self, error: float, speed: float) -> float:
        """Torque by the servo's law [N·m]; of a cascade by its two loops."""
        if not self.cascade:
            return self.kp * error - self.kd * speed
        wanted = self.kp / self.kd * error
        slip = min(max(wanted, -self.fastest), self.fastest) - speed
        self.rise = self.h * self.k_int * slip
        return self.kd * slip + self.integral

    def _limited(self, asked: float) -> float:
        """Limits the torque; the integral stops where it would wind up."""
        given = min(max(asked, -self.limit), self.limit)
        if (asked - given) * self.rise <= 0.0:
            self.integral += self.rise
        return given

    def resist(self, q: float, v: float, load: float) -> float:
        """Returns the torque of everything passive at the joint [N·m]."""
        force = self.dry.force(v, self.torque, load) + self.loop.force(q)
        if self.bend:
            bend = self.bend if v > 0.0 else -self.bend
            force -= max(self.viscous + bend, 0.0) * v
        if self.ripple:
            r = self.ripple
            force += r["size_nm"] * math.sin(r["teeth"] * q)
            force += 0.6 * r["size_nm"] * math.sin(r["other_teeth"] * q + 1.0)
        if self.slack:
            over = self.slack["length_rad"] - q
            force += self.slack["stiffness_nm_rad"] * max(over, 0.0)
        if self.catch:
            force += _caught(self.catch, q, v)
        return force


def _caught(catch, q: float, v: float) -> float:
    """A latch at one angle: it pulls toward its middle and damps, and lets go."""
    away = q - catch["angle_rad"]
    reach = catch["reach_rad"]
    if abs(away) > reach:
        return 0.0
    return -catch["size_nm"] * math.sin(math.pi * away / reach) - catch["damping"] * v


def _reordered(joint: Joint, times: list[float]) -> list[int]:
    """Which target each packet brings: now and then two change places."""
    order = list(range(len(times)))
    every = joint.effects.get("packet_reorder", {}).get("every", 0.0)
    if every:
        for i in range(1, len(times) - 1):
            if (i * 0.6180339887) % 1.0 < 1.0 / every:
                order[i], order[i + 1] = order[i + 1], order[i]
    return order


class _Bristle:
    """Dry friction as a stiff damped spring whose end slips (Prandtl's element).

    The spring is as long as it has been pulled, at most to where it bears the bound of
    the direction that it resists.
    """

    def __init__(self, joint: Joint, h: float):
        value = joint.value
        self.h = h
        self.half = 0.5 * value("asymmetric_friction", "difference_nm", 0.0)
        self.base = value("coulomb_friction", "torque_nm", 0.0) if self.half else 0.0
        self.extra = value("stribeck_friction", "extra_nm", 0.0)
        self.speed = value("stribeck_friction", "speed_rad_s", 1.0)
        self.drive_share = value("load_friction", "drive_share", 0.0)
        self.load_share = value("load_friction", "load_share", 0.0)
        share = max(self.drive_share, self.load_share)
        largest = self.base + abs(self.half) + self.extra + 0.1 * share
        self.stiffness = min(largest / PRESLIDING_RAD, 0.3 * joint.armature / h**2)
        self.damping = math.sqrt(self.stiffness * joint.armature)
        self.z = 0.0

    def force(self, v: float, torque: float, load: float) -> float:
        """Friction [N·m] at a speed, under the motor's torque and the load."""
        if not self.stiffness:
            return 0.0
        bound = self.extra * math.exp(-((v / self.speed) ** 2)) + self.base
        bound += abs(self.drive_share * torque - self.load_share * load)
        most = max(bound + self.half, 0.0) / self.stiffness
        least = -max(bound - self.half, 0.0) / self.stiffness
        pulled = self.z + self.h * v
        self.z = min(max(pulled, least), most)
        damping = self.damping * v if pulled == self.z else 0.0
        return -self.stiffness * self.z - damping


class _Jenkins:
    """Hysteresis as springs with slipping ends, softest last (Iwan 1966)."""

    def __init__(self, joint: Joint):
        value = joint.value
        self.size = value("hysteresis", "torque_nm", 0.0)
        reach = value("hysteresis", "range_rad", 1.0)
        # Slip distances whose sum is Dahl's curve 1 − exp(−x / reach) on first loading.
        quantiles = (np.arange(16) + 0.5) / 16
        self.slip = (reach * gamma.ppf(quantiles, 2.0)).tolist()
        self.anchor: list[float] | None = None

    def force(self, q: float) -> float:
        if not self.size:
            return 0.0
        if self.anchor is None:
            self.anchor = [q] * len(self.slip)
        total = 0.0
        for i, slip in enumerate(self.slip):
            stretch = min(max(q - self.anchor[i], -slip), slip)
            self.anchor[i] = q - stretch
            total += stretch / slip
        return -self.size * total / len(self.slip)
