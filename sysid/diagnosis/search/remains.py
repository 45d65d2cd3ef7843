"""How much of an error remains with causes, in units of its noise."""

LEFT = 2.0
"""Mean squared error that may remain, in units of its noise: of the angle it is at most
1.6 of 26 joints without effects, and at least 2.2 of those with one that is not in the
catalogue (hidden mechanisms of two seeds)."""

REMAINING = 0.2
"""Share of the removable squared error that may remain of a complete explanation: its
equation is right to half of its trace. Of a friction that falls with speed 0.17 remains
about its reversals, of a slack cable behind shifted loads 0.15 to 0.9."""

LITTLE = 0.01
"""Share of a squared error below which next to nothing of it is left, although that is
more than noise; friction that cancels four fifths of a torque leaves 0.04."""


def leaves_much(before: float, after: float, noise: float = LEFT) -> bool:
    """Whether of an error before causes more is left than noise and model error.

    Args:
        before: mean squared error of the nominal model, in units of its noise [1].
        after: the same with the causes [1].
        noise: what noise may leave [1].
    """
    return after > noise and after - 1.0 > REMAINING * (before - 1.0)


def becomes_noise(before: float, after: float) -> bool:
    """e₀² > 2 > e₁², e₁² − 1 < 0.2 (e₀² − 1): much more than noise, then little more.

    An error that falls from just above twice its noise to just below crosses a line and
    is not explained.

    Args:
        before: e₀², mean squared error without a cause, in units of its noise [1].
        after: e₁², the same with it [1].

    Returns:
        Whether all but noise is explained.

    Source:
        Ours; `LEFT` and `REMAINING`.
    """
    return bool(before > LEFT > after and after - 1.0 < REMAINING * (before - 1.0))


def explains_effort(before: float, after: float, repeats: bool) -> bool:
    """Whether of the error of a logged effort little more than noise is left.

    Without repeats its noise is only what neighbouring samples do not share: where more
    than that is left, it must be next to nothing.

    Args:
        before: mean squared error without a cause, in units of its noise [1].
        after: the same with it [1].
        repeats: whether motions repeat.
    """
    next_to_nothing = not repeats and before > LEFT and after < LITTLE * before
    return bool(becomes_noise(before, after) or next_to_nothing)
