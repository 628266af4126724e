"""Recognises which impairment a walk resembles, which side is impaired, and how strong the limp is.

Two recognisers learnt from people's walks (profile.py), each compared with the same person's normal walk by
features. The people imitated impairments of the right leg. Their mirrored walks are the examples with an
impaired left leg.

The linear recogniser (`recognise`) is a classifier of strong limps. The graded one (`grade_walk`) also knows
mild limps, a guarded arm and a leaning trunk. For it, the limps that people imitated have the strength 1 on
average, and strength 0.5 is half way from the normal walk to this limp. The features of a limp of strength s
are modelled by a Gaussian distribution. Its mean is s times the mean over people. Its covariance is s^2 times
the covariance over people, plus the covariance of healthy walks.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path

import numpy as np
from scipy.special import softmax

from hobble.core.clip import Clip
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.gait import profile
from hobble.gait.cycles import WalkCycles, measure_clip
from hobble.gait.profile import ARMS, LEFT, NORMAL, RIGHT, TRUNK, TRUNK_FORWARD, TRUNK_LEFT, Profile, features

SIDES = (RIGHT, LEFT)
HEALTHY_FILE = Path(__file__).with_name("healthy.npz")
GUARDED_ARM, LEANING = "guarded_arm", "leaning_trunk"
# Direction in which the trunk leans -> its (forward, left) components.
LEANS = {"forward": (1, 0), "backward": (-1, 0), "to the left": (0, 1), "to the right": (0, -1)}
# Label -> the parts of the body that may hurt. Pain in thigh, shank or foot looks the same in the data.
# Pain anywhere in an arm is recognised only by the swing of the arm.
PARTS: Mapping[str, tuple[str, ...]] = {
    NORMAL: (),
    "antalgic": ("thigh", "shank", "foot"),
    "stiff_legged": ("thigh", "shank"),
    "steppage": ("shank", "foot"),
    "trendelenburg": ("pelvis", "hip"),
    "lurch": ("hip", "back"),
    GUARDED_ARM: ("shoulder", "upper arm", "forearm", "hand"),
    LEANING: ("back",),
}
LEAST_CYCLES = 3  # a window must have this many cycles of both legs together, and at least one of each leg
# The share by which a linear classifier shrinks its covariance towards the diagonal. For captured motion, of
# the values 0.02 to 0.8 the first recognises left-out motion best. Of people there are only 120 examples.
SHRINKAGE, SHRINKAGE_OF_PEOPLE = 0.02, 0.2
CONSTANT_SPREAD = 1e-9  # features with a smaller spread, relative to their size, are constant and ignored
# The spread of a feature within classes counts as at least this share of its spread over all examples.
# Otherwise a feature that is constant within classes would decide alone.
LEAST_SPREAD_SHARE = 0.02
# Of the graded recogniser. A walk is compared with limps of these strengths, all equally likely.
STRENGTHS = np.array([0.15, 0.3, 0.45, 0.6, 0.8, 1.0, 1.2])
HEALTHY_SPREAD = 2.5  # factor on the covariance of healthy walks, because an unknown figure may vary more
GRADED_SHRINKAGE = 0.5  # share by which both covariances are shrunk towards their diagonals


@dataclass(frozen=True)
class Answer:
    """What a recogniser says of a walk.

    label: a key of PARTS. side: "right", "left", or None for a normal walk or a leaning trunk. probabilities:
    label -> probability, both sides together; their sum is 1. probability_by_side: (label, side or direction
    of the lean) -> probability.

    Of the graded recogniser only. strength: 0 for normal; 1 is the mean of the people who imitated the
    impairment. distance: how far the walk is from the mean of the likeliest limp or of healthy walks, in
    standard deviations (root mean square over the features). For people who were left out of the learning,
    the distance is 0.7 on average and at most 1.5; beyond 1.5 the label is less reliable.
    """

    label: str
    side: str | None
    probabilities: Mapping[str, float] = field(repr=False)
    probability_by_side: Mapping[tuple[str, str], float] = field(repr=False)
    strength: float = float("nan")
    distance: float = float("nan")

    @property
    def name(self) -> str:
        """Label and side, such as "antalgic right"."""
        return f"{self.label} {self.side}" if self.side else self.label

    @property
    def parts(self) -> tuple[str, ...]:
        """The parts of the body that may hurt."""
        return PARTS[self.label]

    @property
    def is_impaired(self) -> bool:
        """Whether the walk is more likely impaired than normal."""
        return self.probabilities[NORMAL] < 0.5


@dataclass(frozen=True)
class WalkComparison:
    """Measurements of a clip and the recognisers' answers.

    cycles: number of the clip's cycles. answer, grade: what the linear and the graded recogniser say of the
    whole clip. window_answers, window_grades: what they say of each window, a stretch of a few seconds.
    effects: "right" or "left" -> the result of `measure_effects` if this side is hurt.
    """

    cycles: int
    answer: Answer
    grade: Answer
    window_answers: Sequence[Answer] = field(repr=False)
    window_grades: Sequence[Answer] = field(repr=False)
    effects: Mapping[str, Mapping[str, float]] = field(repr=False)


def compare_clip(clip: Clip, healthy: Profile, seconds: float = 4.0) -> WalkComparison:
    """Compare a clip with a healthy profile: the whole clip, and each window of `seconds` seconds.

    Raises HobbleError if the clip has no cycle.
    """
    return compare_walk(measure_clip(clip), len(clip), healthy, seconds)


def compare_walk(walk: WalkCycles, frames: int, healthy: Profile, seconds: float = 4.0) -> WalkComparison:
    """Compare the cycles of a motion of `frames` frames with a healthy profile. See `compare_clip`."""
    whole = profile.profile_of_walk(walk)
    windows = [profile.profile_of_walk(part) for _, part in windows_with_cycles(walk, frames, seconds)]
    return WalkComparison(
        len(walk),
        recognise(whole, healthy),
        grade_walk(whole, healthy),
        [recognise(window, healthy) for window in windows],
        [grade_walk(window, healthy) for window in windows],
        {side: profile.measure_effects(whole, healthy, side) for side in SIDES},
    )


def windows_with_cycles(walk: WalkCycles, frames: int, seconds: float = 4.0) -> list[tuple[int, WalkCycles]]:
    """(first frame, cycles) of each window of a clip that has LEAST_CYCLES or more cycles.

    A window begins every second and lasts `seconds` seconds. frames: number of frames of the clip.
    """
    length = round(seconds * walk.fps)
    starts = range(0, max(frames - length, 0) + 1, max(1, round(walk.fps)))
    parts = ((start, walk.within(start, start + length)) for start in starts)
    return [
        (start, part)
        for start, part in parts
        if len(part) and len(part.right) + len(part.left) >= LEAST_CYCLES
    ]


def shares_of_answers(answers: Sequence[Answer]) -> dict[str, float]:
    """Answer, such as "antalgic right" -> its share of the answers."""
    return {name: count / len(answers) for name, count in Counter(a.name for a in answers).items()}


def examples_of_people(numbers: Iterable[int] | None = None) -> tuple[Array, list[str]]:
    """Features (n, D) and classes of the n walks of some people: each walk as it is, and mirrored.

    numbers: which people, from 0; None: all. A class is "normal", or "antalgic right" and so on.
    """
    people = profile.read_people()
    values, classes = [], []
    for person in people if numbers is None else (people[number] for number in numbers):
        healthy, mirrored = person[NORMAL], profile.mirror_profile(person[NORMAL])
        for gait, walk in person.items():
            for side, w, h in ((RIGHT, walk, healthy), (LEFT, profile.mirror_profile(walk), mirrored)):
                values.append(list(features(w, h).values()))
                classes.append(gait if gait == NORMAL else f"{gait} {side}")
    return np.array(values), classes


@dataclass(frozen=True)
class Discriminant:
    """A linear classifier of K classes. It finds the class whose mean is nearest.

    Distances are measured in units of the spread of the examples within their classes. classes: their K
    names. weights: (D, K). offset: (K,). For n examples with values (n, D) of D features, the scores of the
    classes are values @ weights + offset.
    """

    classes: tuple[str, ...]
    weights: Array = field(repr=False)
    offset: Array = field(repr=False)

    def scores(self, values: Array) -> Array:
        """(n, K) log likelihood of each class, up to a term that all classes share.

        All classes have the same prior probability.
        """
        return values @ self.weights + self.offset

    def likeliest_classes(self, values: Array) -> list[str]:
        """The likeliest class for each row of values (n, D)."""
        return [self.classes[k] for k in np.argmax(self.scores(values), axis=1)]


def learn(values: Array, labels: Sequence[str], shrinkage: float = SHRINKAGE) -> Discriminant:
    """Learn from values (n, D) and their labels. Raises ValueError for fewer than two classes.

    The result is Fisher's linear discriminant with the pooled covariance of standardised values. Each class
    has the same weight, however many examples it has. shrinkage: the share, 0 to 1, by which the covariance
    is shrunk towards its diagonal.
    """
    names, class_index, examples_of_class = np.unique(labels, return_inverse=True, return_counts=True)
    if len(names) < 2:
        raise ValueError(f"there must be two classes or more, but the labels name {len(names)}")
    means = np.stack([values[class_index == k].mean(axis=0) for k in range(len(names))])
    deviations = values - means[class_index]
    example_weight = 1 / (len(names) * examples_of_class[class_index])
    overall_spread = values.std(axis=0)
    spread = np.maximum(np.sqrt(example_weight @ deviations**2), LEAST_SPREAD_SHARE * overall_spread)
    varies = overall_spread > CONSTANT_SPREAD * (1 + np.abs(values).max(axis=0))
    scaled = deviations[:, varies] / spread[varies]
    weighted = scaled * example_weight[:, None]
    covariance = (1 - shrinkage) * weighted.T @ scaled + shrinkage * np.eye(varies.sum())
    # For each class, weights = inverse covariance @ mean, and offset = -mean @ weights / 2.
    weights = np.zeros((values.shape[1], len(names)))
    weights[varies] = (
        np.linalg.solve(covariance, (means[:, varies] / spread[varies]).T) / spread[varies, None]
    )
    return Discriminant(tuple(map(str, names)), weights, -0.5 * np.sum(means.T * weights, axis=0))


@cache
def classifier_of_all_people() -> Discriminant:
    """The classifier that learnt from all people in `people.npz`."""
    return learn(*examples_of_people(), shrinkage=SHRINKAGE_OF_PEOPLE)


def recognise(walk: Profile, healthy: Profile, discriminant: Discriminant | None = None) -> Answer:
    """The impairment of a walk, relative to the figure's healthy walk, by the linear recogniser.

    discriminant: a classifier of the classes in `examples_of_people`; None: the one that learnt from all
    people.
    """
    discriminant = discriminant or classifier_of_all_people()
    scores = discriminant.scores(np.array([list(features(walk, healthy).values())]))[0]
    return _answer([_kind_of_class(name) for name in discriminant.classes], softmax(scores))


@dataclass(frozen=True)
class Grader:
    """The limps and the healthy walks with which the graded recogniser compares a walk.

    kinds: (label, side or direction of the lean) -> mean (D,) and covariance (D, D) of the D features at
    strength 1, over people. healthy: (D, D) covariance of healthy walks.
    """

    kinds: Mapping[tuple[str, str], tuple[Array, Array]] = field(repr=False)
    healthy: Array = field(repr=False)

    @cached_property
    def _densities(self) -> tuple[Array, Array, Array]:
        """n Gaussian distributions: one of healthy walks, then one for each of `kinds` and each of STRENGTHS.

        Returns their means (n, D), whitening matrices (n, D, D), and the logarithm (n,) of peak density times
        prior probability, up to a term that all n share.
        """
        limps = [(s * mean, s**2 * spread) for mean, spread in self.kinds.values() for s in STRENGTHS]
        means, spreads = zip((np.zeros(len(self.healthy)), 0 * self.healthy), *limps, strict=True)
        factors = np.linalg.cholesky(self.healthy + np.array(spreads))
        log_peaks = -np.log(np.diagonal(factors, axis1=1, axis2=2)).sum(axis=1)
        log_peaks[1:] -= np.log(len(limps))  # healthy and impaired have equal priors, and so do all limps
        return np.array(means), np.linalg.inv(factors), log_peaks

    def grade(self, walk: Profile, healthy: Profile) -> Answer:
        """What hurts in a walk, relative to the figure's healthy walk."""
        x = np.array(list(features(walk, healthy).values()))
        means, whitening, log_peaks = self._densities
        squared_distances = np.sum(np.einsum("nij,nj->ni", whitening, x - means) ** 2, axis=1)
        scores = log_peaks - 0.5 * squared_distances
        probabilities = softmax(scores)
        of_limps = probabilities[1:].reshape(len(self.kinds), len(STRENGTHS))
        # The strength of each kind is the mean over STRENGTHS, weighted by probability.
        strengths = [0.0, *(float(STRENGTHS @ limp / (limp.sum() or 1.0)) for limp in of_limps)]
        return _answer(
            [(NORMAL, ""), *self.kinds],
            [probabilities[0], *of_limps.sum(axis=1)],
            strengths,
            float(np.sqrt(squared_distances[np.argmax(scores)] / len(x))),
        )


def learn_grader(numbers: Iterable[int] | None = None, healthy: Array | None = None) -> Grader:
    """Learn from the walks of some people and the covariance (D, D) of healthy walks.

    numbers: which people, from 0; None: all. healthy: None: `healthy_covariance`.
    """
    values, classes = examples_of_people(numbers)
    names = list(features(*2 * (profile.healthy_profile([]),)))
    class_of_row = np.array(classes)
    impaired = [name for name in dict.fromkeys(classes) if name != NORMAL]  # such as "antalgic right"
    means = {_kind_of_class(name): values[class_of_row == name].mean(axis=0) for name in impaired}
    deviations = np.concatenate(
        [values[class_of_row == name] - means[_kind_of_class(name)] for name in impaired]
    )
    covariance = _shrunk(deviations.T @ deviations / len(deviations))
    kinds = {kind: (mean, covariance) for kind, mean in means.items()}

    def limited_to(changed: Sequence[str], mean: Array) -> tuple[Array, Array]:
        """Mean and covariance of a limp that differs from a healthy walk only in the features `changed`."""
        varies = np.isin(names, changed)
        return mean * varies, np.diag(np.diag(covariance) * varies)

    # A guarded arm of strength 1 swings as in the gait "antalgic".
    for side in SIDES:
        kinds[GUARDED_ARM, side] = limited_to((ARMS,), means["antalgic", side])
    # A leaning trunk of strength 1 leans as far as the trunk in the gait "lurch".
    lean = abs(means["lurch", RIGHT][names.index(TRUNK_FORWARD)])
    for direction, (forward, left) in LEANS.items():
        mean = np.zeros(len(names))
        mean[[names.index(TRUNK_FORWARD), names.index(TRUNK_LEFT)]] = lean * forward, lean * left
        kinds[LEANING, direction] = limited_to(TRUNK, mean)
    return Grader(kinds, HEALTHY_SPREAD * _shrunk(healthy_covariance() if healthy is None else healthy))


@cache
def grader_of_all_people() -> Grader:
    """The grader that learnt from all people in people.npz and all healthy walks in healthy.npz."""
    return learn_grader()


def healthy_covariance() -> Array:
    """(D, D) covariance of the features of healthy walks, relative to the same person's other walks.

    `benchmarks/derive_gait.py` derived it from walks of the CMU database.
    """
    data = load_npz(HEALTHY_FILE)
    return np.average(data["covariances"], axis=0, weights=data["clips"])


def grade_walk(walk: Profile, healthy: Profile) -> Answer:
    """What hurts in a walk, relative to the figure's healthy walk, by the graded recogniser."""
    return grader_of_all_people().grade(walk, healthy)


def _shrunk(covariance: Array) -> Array:
    """The covariance with smaller values off its diagonal."""
    return (1 - GRADED_SHRINKAGE) * covariance + GRADED_SHRINKAGE * np.diag(np.diag(covariance))


def _kind_of_class(name: str) -> tuple[str, str]:
    """(label, side) of a class of `examples_of_people`; the side of "normal" is empty."""
    label, _, side = name.partition(" ")
    return label, side


def _answer(
    kinds: Sequence[tuple[str, str]],
    probabilities: Iterable[float],
    strengths: Sequence[float] | None = None,
    distance: float = float("nan"),
) -> Answer:
    """The likeliest label, and its likeliest side.

    kinds: (label, side) of each kind of walk; the side of normal walks is empty. probabilities, strengths:
    for each kind.
    """
    of_kind = dict(zip(kinds, map(float, probabilities), strict=True))
    labels = {
        label: sum(p for kind, p in of_kind.items() if kind[0] == label)
        for label in PARTS
        if any(kind[0] == label for kind in kinds)
    }
    label = max(labels, key=labels.__getitem__)
    # Of two equally likely sides it is the first in SIDES.
    of_label = sorted((kind for kind in kinds if kind[0] == label), key=lambda kind: kind[1] == LEFT)
    likeliest = max(of_label, key=of_kind.__getitem__)
    side = likeliest[1] if likeliest[1] in SIDES else None
    strength = float("nan") if strengths is None else float(strengths[kinds.index(likeliest)])
    by_side = {kind: p for kind, p in of_kind.items() if kind[0] != NORMAL}
    return Answer(label, side, labels, by_side, strength, distance)
