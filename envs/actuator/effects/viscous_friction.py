"""Friction in proportion to speed."""

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, lognormal


def _act(params: Params, state, x, dt):
    return state, x.replace(viscous=x.viscous + params["damping_nms"])


EFFECT = EffectKind(
    name="viscous_friction",
    equation="τ_f = −b q̇",
    parameters={
        "damping_nms": Parameter(
            "N·m·s/rad", 0.0, 10.0, lognormal(0.02, 3.0), identity=0.0
        )
    },
    acts={Stage.FRICTION: _act},
    confusable_with={
        "damping": "drive off: friction remains",
        "slew_limit": "effort at constant speed",
        "asymmetric_viscous": "ramps in both directions at several speeds",
        "lowpass_cutoff": "set the firmware's filter to another cutoff",
    },
    source="B. Armstrong-Hélouvry et al., A Survey of Models, Analysis Tools and "
    "Compensation Methods for the Control of Machines with Friction, Automatica 1994",
)
