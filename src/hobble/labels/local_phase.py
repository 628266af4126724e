"""Local phases: a phase of its own for each foot and hand (after Starke, Zhao, Komura, Zaman 2020).

Motion such as a stumble has no gait cycle, but each foot still goes up and down, and each hand still swings.
A local phase is a vector (amplitude times cosine and sine of the angle). It shrinks to 0 where a part of the
body rests, so that there no angle has to be known.
"""

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import gaussian
from hobble.motion.root import local_pose, root_frames

# The parts of the body with a local phase, in the order of the columns; a part and its mirror image differ
# only in the side.
PARTS = ("left_foot", "right_foot", "left_hand", "right_hand")
MIRRORED_PARTS = (1, 0, 3, 2)
# Hz of the filters: from a slow step to a fast one, eight to an octave.
FREQUENCIES = 2.0 ** np.arange(-1.25, 1.5, 0.125)
WIDTH = 0.25  # standard deviation of a filter as a share of its frequency; the second harmonic is four away
SHARPNESS = 8  # the filters count as this power of their responses, so nearly only the strongest ones do
SWING = 40.0  # cm that a hand swings ahead and back, for an amplitude like that of a foot in a walk
STEADY = 4.0  # frames: standard deviation of the mean of the changes of an angle
LARGEST_STEP = 0.1  # cycles a frame: a larger change of an angle is a jump


def local_phases(clip: Clip, contacts: np.ndarray) -> tuple[Array, Array]:
    """Vectors (F, 4, 2) of the local phases of PARTS, and the change (F, 4) of their angles.

    contacts: (F, 4) of left heel, left toe, right heel, right toe. The change is that to the next frame, in
    cycles, 0 in the last frame.

    The signal of a foot is whether it is on the ground, that of a hand is how far it is ahead of the hips.
    Gaussian filters around many frequencies give complex responses, of which the strongest in each frame
    count: those at the rate of the steps, without their harmonics. Starke et al. fit sine waves by a genetic
    algorithm instead.
    """
    on_ground = np.asarray(contacts, float).reshape(-1, 2, 2).max(axis=2)
    position, _, _ = local_pose(clip, root_frames(clip, 20.0))
    position = np.concatenate([position, position[-1:]])
    hands = position[:, [clip.skeleton.role(f"{side}_wrist") for side in ("left", "right")], 2]
    hips = position[:, clip.skeleton.role("hips"), 2]
    signals = np.concatenate([on_ground, (hands - hips[:, None]) / SWING], axis=1)
    return vectors_and_change(_analytic(signals, clip.fps))


def vectors_and_change(waves: np.ndarray) -> tuple[Array, Array]:
    """Local phases (F, 4, 2), and the change (F, 4) of their angles, of complex numbers (F, 4).

    The angle jumps where a part of the body rests. So the change is a mean over some frames, in which short
    vectors count little.
    """
    change, turns = np.zeros(waves.shape), waves[1:] * np.conj(waves[:-1])
    change[:-1] = np.arctan2(gaussian(turns.imag, STEADY), gaussian(turns.real, STEADY)) / (2 * np.pi)
    return np.stack([waves.real, waves.imag], axis=-1), np.clip(change, -LARGEST_STEP, LARGEST_STEP)


def _analytic(signals: Array, fps: float) -> np.ndarray:
    """Complex (F, n): the waves in the signals (F, n), at the rate that is strongest in each frame.

    The signals are continued at both ends by their mirror images, so that the ends do not ring.
    """
    frames = len(signals)
    around = np.concatenate([signals[::-1], signals, signals[::-1]])
    spectrum, frequency = np.fft.fft(around, axis=0), np.fft.fftfreq(len(around), 1 / fps)
    total, weights = np.zeros(signals.shape, complex), np.zeros(signals.shape)
    for centre in FREQUENCIES:
        kept = 2 * np.exp(-0.5 * ((frequency - centre) / (WIDTH * centre)) ** 2)
        response = np.fft.ifft(spectrum * kept[:, None], axis=0)[frames : 2 * frames]
        weight = np.abs(response) ** SHARPNESS + 1e-30
        total, weights = total + weight * response, weights + weight
    return total / weights
