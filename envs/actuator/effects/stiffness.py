"""Position gain other than assumed."""

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    return state, x.replace(kp=x.kp * params["scale"])


EFFECT = EffectKind(
    name="stiffness",
    equation="kp = s kp₀",
    parameters={"scale": Parameter("1", 0.02, 50.0, lognormal(1.0, 1.5), identity=1.0)},
    acts={Stage.GAINS: _act},
    confusable_with={
        "armature": "a known load or the effort: without one only ratios are seen",
        "payload_mass": "effort at rest: a load changes it, a gain does not",
        "start_torque": "amplitude: a start torque does not grow with the error",
        "deadband": "holds under two loads: a gain gives an error like the load",
        "encoder_scale": "full range without load: a gain error leaves no error there",
        "torque_limit": "amplitude: a limit leaves small motions alone",
        "load_friction": "loaded motion both ways: friction opens a loop",
        "compliance": "chirp past the resonance: a spring turns the phase once more",
        "finger_weakness": "amplitude: weakness also lowers the limit",
        "supply_sag": "one joint alone against all together",
        "thermal_derating": "the same motion before and after a warm-up, and "
        "after a pause",
    },
    source="Paper, Table I (stiffness 15–22 times nominal, from frequency sweeps)",
)
