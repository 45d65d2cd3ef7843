"""The judge: a cause counts if the simulation with it predicts the motion better.

Equation errors find causes; but an effect may cancel a term of an equation, and then
the residual shrinks although nothing moves as it did. And an equation of means over
steps knows no moment at which a limit is met, so what fits it best may not move best.
So the simulation is fitted to the angle with and without the effect (`closed_loop`),
each time without the stretch that is predicted, and without the effect within the
tolerances of its parameters: an error that a parameter out of its tolerance would hide
is there. With their angle errors e₀ and e₁ there, and the means d_b of e₀² − e₁² over
its blocks,

    t = d̄ √B / s_d

must exceed `LEVEL`, and the log predictive likelihood must gain as much as a nominal
parameter that leaves its tolerance. And it must matter: the root mean square of the
error must fall by the share `LEAST_FALL`, or from clearly more than noise to about
that. Gains of a servo that are hardly known are those that the logged effort shows to
that model, if surer: loose ones would do in the simulation what the effect does.
Without the effect they may be those that it shows beside the effect, too, whichever
come nearer: what a gain does is no work of the effect. The likelihood need not gain
where the logged effort has no other explanation: what parameters a little out of their
tolerances hide of the angle, as a servo's damping hides friction, they do not hide of
the effort, whose error then must fall by `LEAST_FALL_OF_EFFORT`. An angle
that does not show the cause need not come nearer by `LEVEL` either, which chance would
decide: it must come nearer at all. Where the angle does show it, and `t` is for it, an
effort that falls so far is enough to matter, too, whatever is left of it.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.candidate import (
    CONVERGED,
    Model,
    fit_models,
    log_likelihood_gain,
)
from sysid.diagnosis.fits.nested import nearer_without
from sysid.diagnosis.fits.origins import at_nominal
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.fits.refolded import refolded
from sysid.diagnosis.fits.tolerances import within_tolerances
from sysid.diagnosis.likelihood.predictive_accuracy import t_of_blocks
from sysid.diagnosis.replay.band import EVERY, sample_rows
from sysid.diagnosis.search.remains import LEFT, becomes_noise, explains_effort
from sysid.diagnosis.search.selection import NOMINAL_THRESHOLD
from sysid.diagnosis.search.shown_gains import shown_gains
from sysid.diagnosis.simulated.closed_loop import simulated
from sysid.diagnosis.simulated.output_error import OutputProblem, output_error
from sysid.diagnosis.simulated.settled_output import settled_output

LEVEL = 1.0
"""Least t of a difference that counts."""

LEAST_FALL = 1.0 - 0.75**0.5
"""Least share of the held-out error of the simulated angle that goes with a cause: a
quarter of its square.

What is significant need not matter: of a long record of a quiet encoder a servo's cycle
is significant. Of errors with their weights, in 56 records of seven seeds of the wide
battery without an effect that shows, which are no evidence for it, at most 0.114 of the
root goes with an effect that the likelihood and t are for, and 0.076 to 0.227 with
right causes that a quarter of the root refused.
"""

LEAST_FALL_OF_EFFORT = 0.25
"""The same of the effort's error: it crosses a line of noise when it falls by less."""

TRIED = 5
"""Number of candidates of a stage that are judged, best first."""


class Judge:
    """Compares simulations of one joint, and keeps fits and errors of its models.

    Args:
        problem: to whose residuals models are fitted.
        base: the nominal model.
    """

    def __init__(self, problem: Problem, base: Model):
        self.problem, self.base = problem, base
        self.valid = problem.data.valid & (problem.known != "controller")
        self.errors: dict[int, tuple[Model, np.ndarray]] = {}
        self.bounded: dict[int, tuple[Model, Model]] = {}
        self.fits: dict[int, tuple[Model, Model]] = {}
        self.served: dict[int, tuple[Model, Judge]] = {}
        self.pairs: dict[tuple[int, ...], tuple[tuple, tuple[Model, Model]]] = {}

    @property
    def sees(self) -> bool:
        """Whether there is a motion that can be simulated at all."""
        return bool(self.valid.any())

    @cached_property
    def output(self) -> Problem:
        """The error of the angle, of the noise that the nominal model leaves.

        Where the joint cannot follow targets alone, its equations.
        """
        if isinstance(self.problem, OutputProblem):
            return self.problem
        output = output_error(self.problem)
        if output is None:
            return self.problem
        output, fit = settled_output(output, self.base)
        self.fits[id(self.base)] = (self.base, refolded(output, fit))
        return output

    def serving(self, model: Model) -> "Judge":
        """Returns the judge to whom loose gains are those of a model of the effort.

        Args:
            model: fitted to the equations; itself, where gains are as sure or the
                angle alone was fitted.
        """
        if self.output is self.problem:
            return self
        if id(model) not in self.served:
            space, judge = shown_gains(self.problem, model), self
            if space is not self.problem.space:
                judge = Judge(replace(self.problem, space=space), self.base)
                judge.output = replace(self.output, space=space)
            self.served[id(model)] = (model, judge)
        return self.served[id(model)][1]

    def _serving_either(self, *models: Model) -> list["Judge"]:
        return list(dict.fromkeys(self.serving(model) for model in models))

    def moved(self, model: Model) -> Model:
        """Returns a model of the equations fitted to the angle."""
        output, fit = self.output, model
        if id(model) not in self.fits:
            if output is not self.problem:
                starts = [model.fit.theta, at_nominal(output, model)]
                sets = [model.effects] * len(starts)
                found = fit_models(output, sets, starts, rounds=CONVERGED, nearest=True)
                (fit,) = found
            self.fits[id(model)] = (model, refolded(output, fit))
        return self.fits[id(model)][1]

    def knows(self, model: Model, fit: Model) -> None:
        """Takes a fit of a model to the angle that was found elsewhere, if nearer."""
        if fit.fit.cost < self.moved(model).fit.cost:
            self.fits[id(model)] = (model, refolded(self.output, fit))
            self.bounded.pop(id(model), None)

    def nominal(self, model: Model) -> Model:
        """Returns `moved` with its other parameters fitted within their tolerances."""
        if id(model) not in self.bounded:
            fit = within_tolerances(self.output, self.moved(model))
            self.bounded[id(model)] = (model, fit)
        return self.bounded[id(model)][1]

    def error(self, model: Model) -> Float[np.ndarray, "m p"]:
        """E = y − ŷ(θ̂_{−g}), the error of the angle on held-out folds g [rad].

        Args:
            model: a fitted model.

        Source:
            Ours; `closed_loop.simulated` at the parameters without the fold.
        """
        if id(model) not in self.errors:
            problem = self.problem
            rows = sample_rows(len(problem.data.track.cmd))
            measured = np.asarray(problem.data.track.pos, float)
            each = (measured - simulated(problem, model.fold_theta))[:, rows]
            error = np.take_along_axis(each, problem.fold[None], 0)[0]
            self.errors[id(model)] = (model, np.nan_to_num(error, nan=np.inf))
        return self.errors[id(model)][1]

    def t_value(self, worse: Model, better: Model) -> float:
        """T of the block means of w² (e₀² − e₁²), see `t_of_blocks` [1].

        With the weights w of the likelihood: what a servo's cycle makes of an angle at
        full speed speaks for no cause.

        Args:
            worse: the model of e₀.
            better: that of e₁.
        """
        gained = self._squared(worse) - self._squared(better)
        size = max(1, round(self.problem.block_s / (EVERY * self.problem.data.dt)))
        return t_of_blocks(gained, self.valid, size)

    def fall(self, worse: Model, better: Model) -> float:
        """1 − √(Σ w² e₁² / Σ w² e₀²), what goes of the error of held-out angles [1].

        Args:
            worse: the model of e₀.
            better: that of e₁.

        Source:
            Ours; an effect size beside the test of `t_value`.
        """
        before, after = (self._squared_sum(m) for m in (worse, better))
        return 1.0 - float(np.sqrt(after / max(before, 1e-300)))

    def _squared_sum(self, model: Model) -> float:
        return float(self._squared(model)[self.valid].sum())

    def _squared(self, model: Model) -> Float[np.ndarray, "m p"]:
        """Returns w² e², of what diverges no more than counts anyway [rad²]."""
        output = self.output
        weight = output.weight[1] if isinstance(output, OutputProblem) else 1.0
        return weight**2 * np.minimum(self.error(model) ** 2, 1e12)

    def pair(self, smaller: Model, larger: Model) -> tuple[Model, Model]:
        """Returns what is compared: fits to the angle, the smaller within tolerances.

        Gains that are hardly known are to each model those that the effort shows; to
        the smaller one those of the larger, too, where it is nearer with them. That
        choice, by the error that is then compared, is for the smaller model.
        """
        judges = self._serving_either(smaller, larger)
        after = self.serving(larger).moved(larger)
        known = after, *(judge.moved(smaller) for judge in judges)
        key = tuple(map(id, known))  # a nearer fit found since makes another pair
        if key not in self.pairs:
            fits = [judge.without(smaller, after) for judge in judges]
            before = min(fits, key=self._squared_sum) if fits[1:] else fits[0]
            self.pairs[key] = known, (before, after)
        return self.pairs[key][1]

    def without(self, smaller: Model, after: Model) -> Model:
        """Returns `nominal`, of a fit to the angle that no larger model is nearer than.

        Args:
            smaller: the model.
            after: the larger one, fitted to the angle.
        """
        if self.output is not self.problem:
            fit = nearer_without(self.output, self.moved(smaller), after)
            self.knows(smaller, fit)
        return self.nominal(smaller)

    def confirms(self, smaller: Model, larger: Model) -> bool:
        """Whether the larger model predicts angles better, and by enough to matter."""
        if not self.sees:
            return True
        return self.prefers(smaller, larger) and self._matters(smaller, larger)

    def _matters(self, smaller: Model, larger: Model) -> bool:
        """Whether much goes of an error of angle or effort, or all but noise.

        An effort counts where it is explained, or where the angle shows the cause too.
        Noise is of repeats, or what neighbouring readings of the angle do not share: by
        the same noise the verdict would be that something is unexplained. Repeats show
        all of it, neighbours only a part: by these what is left may be noise.
        """
        worse, better = self.pair(smaller, larger)
        left = (larger.errors.max() / smaller.errors.max()) ** 0.5
        shown = self.explains(smaller, larger)
        if self.output is not self.problem:  # the effort is apart from the angle
            shown = shown or self.shows(smaller, larger)
        if shown and 1.0 - left > LEAST_FALL_OF_EFFORT:
            return True
        if self.fall(worse, better) > LEAST_FALL:
            return True
        before, after = worse.errors.max(), better.errors.max()
        if self.problem.repeat:
            return becomes_noise(before, after)
        known = isinstance(self.output, OutputProblem)
        return bool(known and before > LEFT > after)

    def prefers(self, smaller: Model, larger: Model) -> bool:
        """Whether the larger model predicts angles better than the smaller one."""
        if not self.sees:
            return True
        explained = self.explains(smaller, larger)
        # Where the effort is the proof, the angle need only come nearer at all.
        least = 0.0 if explained else LEVEL
        needed = explained or self.shows(smaller, larger)
        return needed and self.t_value(*self.pair(smaller, larger)) > least

    def shows(self, smaller: Model, larger: Model) -> bool:
        """Whether the likelihood of the angle gains enough with the larger model."""
        after = self.pair(smaller, larger)[1]
        # Any fit may end in a valley of its own: the best is the smaller model.
        judges = self._serving_either(smaller, larger)
        fits = [f(smaller) for judge in judges for f in (judge.moved, judge.nominal)]
        before = min(fits, key=lambda m: m.fit.cost)
        gain = log_likelihood_gain(before, after, self.output.samples)
        return gain > NOMINAL_THRESHOLD

    def explains(self, smaller: Model, larger: Model) -> bool:
        """Whether only the larger model leaves little more than noise in the effort.

        By the noise that was measured: what a first answer left is no measure of it.
        """
        problem = self.problem
        if isinstance(problem, OutputProblem) or not problem.data.effort.all():
            return False
        models = smaller, larger
        before, after = (float(np.max(m.errors * problem.inflated)) for m in models)
        return explains_effort(before, after, bool(problem.repeat))
