"""A joint that another one pulls along: shared tendon, linkage or cable."""

from envs.actuator.effect import EffectKind, Parameter, Params, Stage, normal


def _act(params: Params, state, x, dt):
    """Pulls by the other joint's angle and by its effort.

    A pair with the same κ both ways has the potential −κ q_i q_j; one way alone is
    driven by the other joint's motor.
    """
    pull = params["stiffness_nm_rad"] * x.around.other_q
    share = params["effort_share"] * x.around.other_nm
    return state, x.replace(passive=x.passive + pull + share)


EFFECT = EffectKind(
    name="joint_coupling",
    equation="τ_c = κ q_j + b τ_j, of one other joint j",
    parameters={
        "stiffness_nm_rad": Parameter(
            "N·m/rad", -20.0, 20.0, normal(0.0, 0.05), identity=0.0
        ),
        "effort_share": Parameter("1", -1.0, 1.0, normal(0.0, 0.1), identity=0.0),
    },
    acts={Stage.FRICTION: _act},
    confusable_with={
        "compliance": "the joint alone: the spring remains",
        "mount_tilt": "move the other joint alone",
        "payload_mass": "move the other joint alone, without load",
    },
    source="L. Birglen, T. Laliberté, C. Gosselin, Underactuated Robotic Hands, "
    "Springer 2008 (transmission of torque between the joints of a finger)",
    needs=("other_q", "other_nm"),
)
