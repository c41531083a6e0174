# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Our method with something changed: the ablations of the paper, as options and exchanged stages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vigg_ros.acceptance.agreement import Candidate, Pair, assess
from vigg_ros.acceptance.checks import frame_objection
from vigg_ros.acceptance.ranking import best_and_competitors, judge, polish
from vigg_ros.bench.frame_cache import timed_stages
from vigg_ros.bench.methods import Method, MethodAnswer, Task
from vigg_ros.bench.pairs import FramePair
from vigg_ros.registration import Config, Evidence, Features, Outcome, Reason, Registration, Rejection, register
from vigg_ros.registration.cliques import Hypotheses, distinct, propose
from vigg_ros.registration.config import PAPER
from vigg_ros.registration.geometric import match_global, sample
from vigg_ros.registration.local_match import refit
from vigg_ros.registration.matches import Matches, concatenate
from vigg_ros.registration.rigid import transform, weighted_svd
from vigg_ros.registration.stages import stage
from vigg_ros.registration.vigg import align_by_all, follow
from vigg_ros.registration.visual import match_visual
from vigg_ros.report.trajectory_errors import rotation_error_deg, translation_error_m

TRUE_CLIQUE_DEG, TRUE_CLIQUE_THRESHOLDS = 15.0, 3.0
"""Within this angle, and so many inlier thresholds, a clique counts as unambiguous: the recall's limits indoors."""

MAX_ICP_ROUNDS = 30


@dataclass(frozen=True, slots=True)
class Variation:
    """What is different from the method that it is a variation of."""

    what: str
    options: Mapping[str, Any] = field(default_factory=dict)
    """Changes to the configuration, by dotted name."""
    noise_m: float = 0.0
    """Standard deviation of what is added to each coordinate of the source's visual matches."""
    only_true_cliques: bool = False
    within_view: bool = False
    guide: Literal["vgm", "refit", "icp"] = "vgm"
    """What follows the choice of a clique."""

    @property
    def exchanges_stages(self) -> bool:
        """Whether it is more than a configuration."""
        return self.noise_m > 0 or self.only_true_cliques or self.guide != "vgm"


def _sweep(name: str, what: str, option: str, *values: float) -> dict[str, Variation]:
    """A variation for each value of an option."""
    return {f"{name}-{value:g}": Variation(what.format(f"{value:g}"), {option: value}) for value in values}


VARIATIONS = {
    "no-guidance": Variation(
        "cliques chosen by visual matches alone, and no local matching",
        {"cliques.geometric_guidance": False, "local_match.iterations": 0},
    ),
    "no-gvca": Variation("cliques chosen by visual matches alone", {"cliques.geometric_guidance": False}),
    "no-vgm": Variation("no local matching: the chosen clique's motion", {"local_match.iterations": 0}),
    "no-ambiguity": Variation("only cliques near the true motion", only_true_cliques=True),
    "noise-0.01": Variation("1 cm of noise on the visual matches", noise_m=0.01),
    "noise-0.025": Variation("2.5 cm of noise on the visual matches", noise_m=0.025),
    "refit": Variation("post-refinement on all global matches in place of local matching", guide="refit"),
    "icp": Variation("point-to-point ICP in place of local matching", guide="icp"),
    "within-view": Variation("scans clipped to the camera's view", within_view=True),
    **_sweep("iterations", "{} rounds of local matching", "local_match.iterations", 0, 3, 5),
    **_sweep("gamma2", "zones of gamma^2 = {}", "local_match.gamma_squared", 2.0, 5.0, 10.0, 20.0),
    **_sweep("zone", "zones of {} m always", "local_match.fixed_zone_m", 0.05, 0.1, 0.2, 0.3, 0.6, 1.2),
    **_sweep("sample", "{} sampled source points", "geometric.sample_k", 1000, 2500, 5000, 10000),
}
"""The paper's ablations, by name."""

NO_VARIATION = Variation("nothing changed")

DEFAULT_METHOD = "default"
"""The configuration as given. It has no variations: where images leave no doubt they would change nothing."""

BASE_METHODS: dict[str, tuple[str, Mapping[str, Any]]] = {
    "whole": ("the whole method on every pair, whether the images leave doubt or not", {"geometric.always": True}),
    "paper": ("the paper's method as published", PAPER),
}


def ablation(base: str, name: str) -> Method:
    """The method ``base`` or ``base:name``, or DEFAULT_METHOD; KeyError for others."""
    if base == DEFAULT_METHOD and not name:
        return Method(DEFAULT_METHOD, "the configuration as given", _VariedMethod({}, NO_VARIATION))
    described, options = BASE_METHODS[base]
    variation = VARIATIONS[name] if name else NO_VARIATION
    what = f"{described}: {variation.what}" if name else described
    return Method(f"{base}:{name}" if name else base, what, _VariedMethod(options, variation))


@dataclass(frozen=True, slots=True)
class _VariedMethod:
    """Registers as the base does, with the variation."""

    base: Mapping[str, Any]
    variation: Variation

    def __call__(self, task: Task) -> MethodAnswer:
        config = task.config.replace(self.base).replace(self.variation.options)
        target, source, features_ms = task.features(config, within_view=self.variation.within_view)

        def work() -> Outcome:
            if self.variation.exchanges_stages:
                return register_varied((target, source), config, self.variation, task.pair)
            return register(target, source, config)

        outcome, timings_ms = timed_stages(work)
        timings = {"extraction": features_ms, **timings_ms}
        if isinstance(outcome, Registration):
            return MethodAnswer(outcome.T_target_source, "", timings, outcome.covariance)
        return MethodAnswer(None, outcome.reason.value, timings)


def register_varied(
    features: tuple[Features, Features], config: Config, variation: Variation, frame_pair: FramePair
) -> Outcome:
    """The whole of ``register`` on the features of target and source, with stages exchanged."""
    target, source = features
    evidence = Evidence()
    objection = frame_objection(target, source, config)
    if objection:
        return Rejection(*objection, evidence)
    visual = match_visual(target.fine_keypoints, source.fine_keypoints, config.visual)
    visual = with_noise(visual, variation.noise_m, seed=_seed(frame_pair, config))
    geometric = match_global(target.landmarks, source.landmarks, config.geometric, seed=config.seed)
    pair = Pair(target, source, visual, geometric, config, in_full=True)
    if variation.only_true_cliques or variation.guide != "vgm":
        return _align_varied(pair, variation, frame_pair)
    return align_by_all(pair, evidence)


def _align_varied(pair: Pair, variation: Variation, frame_pair: FramePair) -> Outcome:
    """``align_by_all`` with hypotheses filtered by the truth, or with another step behind the choice of a clique."""
    hypotheses = propose(pair.visual, pair.geometric, pair.config.cliques)
    if variation.only_true_cliques:
        hypotheses = near_truth(hypotheses, frame_pair.T_target_source, pair.config.cliques.inlier_threshold_m)
    if variation.guide == "vgm":
        candidates = follow(pair, hypotheses)
    else:
        candidates = _follow_otherwise(pair, hypotheses, variation.guide)
    if not candidates:
        return Rejection(Reason.TOO_FEW_MATCHES, "no clique is left", Evidence())
    best = best_and_competitors(candidates, pair.config)
    return judge(pair, polish(pair, [candidate.T_target_source for candidate in best]), Evidence())


def _follow_otherwise(pair: Pair, hypotheses: Hypotheses, guide: str) -> list[Candidate]:
    threshold_m = pair.config.cliques.inlier_threshold_m
    few = distinct(hypotheses, pair.config.acceptance.candidates, threshold_m)
    if guide == "refit":
        matches = concatenate(pair.visual, pair.geometric)
        return [assess(pair, refit(matches, T, threshold_m)) for T in few.T_target_source]
    rows = sample(len(pair.source.surface), pair.config.geometric.sample_k, pair.config.seed)
    target, source = pair.target.surface.points, pair.source.surface.points[rows]
    return [assess(pair, icp(target, source, T, threshold_m)) for T in few.T_target_source]


def with_noise(matches: Matches, sigma_m: float, *, seed: int) -> Matches:
    """The matches with Gaussian noise on the source's points."""
    if sigma_m == 0:
        return matches
    noise = np.random.default_rng(seed).normal(0.0, sigma_m, matches.source.shape)
    return replace(matches, source=matches.source + noise)


def near_truth(hypotheses: Hypotheses, T_true: NDArray[np.float64], threshold_m: float) -> Hypotheses:
    """The hypotheses that are nearly right."""
    limit_m = TRUE_CLIQUE_THRESHOLDS * threshold_m
    errors = [(rotation_error_deg(T, T_true), translation_error_m(T, T_true)) for T in hypotheses.T_target_source]
    rows = [i for i, (angle_deg, shift_m) in enumerate(errors) if angle_deg < TRUE_CLIQUE_DEG and shift_m < limit_m]
    return Hypotheses(hypotheses.T_target_source[rows], hypotheses.score[rows])


@stage("local matches")
def icp(
    target: NDArray[np.floating], source: NDArray[np.floating], T_target_source: NDArray[np.float64], threshold_m: float
) -> NDArray[np.float64]:
    """Point-to-point ICP of (N, 3) onto (M, 3): nearest points within the threshold, until they stay the same."""
    tree = cKDTree(target)
    before = np.empty(0, np.int64)
    for _ in range(MAX_ICP_ROUNDS):
        distance, nearest = tree.query(transform(T_target_source, source), distance_upper_bound=threshold_m)
        if np.array_equal(nearest, before):
            break
        near, before = np.isfinite(distance), nearest
        fitted, determined = weighted_svd(target[nearest[near]], source[near], np.ones(np.count_nonzero(near)))
        if not determined:
            break
        T_target_source = fitted
    return T_target_source


def _seed(frame_pair: FramePair, config: Config) -> int:
    """The same for the same pair, whatever else is run."""
    return config.seed + sum((i + 1) * ord(c) for i, c in enumerate(frame_pair.name))
