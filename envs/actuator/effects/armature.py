"""Inertia of rotor and gears, seen at the joint."""

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    return state, x.replace(inertia=x.inertia + params["inertia_kgm2"])


EFFECT = EffectKind(
    name="armature",
    equation="I = I₀ + J, J = N² J_rotor",
    parameters={
        "inertia_kgm2": Parameter("kg·m²", 0.0, 1.0, lognormal(1e-3, 4.0), identity=0.0)
    },
    acts={Stage.INERTIA: _act},
    confusable_with={
        "stiffness": "a known load or the effort: without one only ratios are seen",
        "payload_mass": "holds in several postures: rotors have no weight there",
        "transport_delay": "chirp: inertia bends the gain",
        "compliance": "chirp past the resonance: a spring turns the phase once more",
    },
    source="MuJoCo XML reference, joint armature (rotor inertia times the square of "
    "the gear ratio)",
)
