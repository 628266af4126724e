"""Local phases from a periodic autoencoder (after Starke, Mason, Komura 2022), which needs no contacts.

An encoder makes some signals of the speeds of the joints within two seconds. Of each signal only the wave
A sin(2 pi (F t + S)) + B is kept, and a decoder must make the speeds of the waves again. So the encoder finds
signals that are periodic as long as the motion is. The time t is 0 in the middle of the window, so S is the
phase there.

The encoder sees a motion and its mirror image. Its signals of the one are those of the left, its signals of
the other those of the right, so a mirrored clip has the phases of the other side.
"""

import logging
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from hobble.core.clip import Clip
from hobble.core.declared import ArrayOf, load_declared
from hobble.core.files import save_npz
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.labels.local_phase import PARTS, vectors_and_change
from hobble.motion.root import local_pose, root_frames

log = logging.getLogger("hobble.labels")

PAIRS = len(PARTS) // 2  # signals of each side: as many phases as there are parts of the body
SAMPLES, EVERY, RATE = 61, 2, 30.0  # of a window: samples, frames between two of them, samples a second
HIDDEN, KERNEL = 32, 25  # channels between the two convolutions, and samples that a convolution sees
STEPS, BATCH, LEARNING_RATE = 2000, 32, 2e-3
REPORTS = 5  # lines in the log


class PhaseAutoencoder(nn.Module):
    """A periodic autoencoder for the motion of a skeleton whose left and right form pairs.

    In shapes, B is the number of windows and C the number of columns: x, y, z of each joint that is not
    `unseen`.
    """

    scale: Tensor  # () cm a frame: the speeds are divided by it

    def __init__(self, skeleton: Skeleton) -> None:
        super().__init__()
        self.joints = [j for j, name in enumerate(skeleton.joints) if name not in skeleton.unseen]
        columns, of_mirror = 3 * len(self.joints), skeleton.mirror_joints[self.joints]
        places = 3 * np.searchsorted(self.joints, of_mirror)[:, None] + np.arange(3)
        self.source, self.sign = torch.from_numpy(places.ravel()), torch.tensor([-1.0, 1.0, 1.0])
        self.register_buffer("scale", torch.ones(()))
        self.encoder = nn.Sequential(_convolution(columns, HIDDEN), nn.Tanh(), _convolution(HIDDEN, PAIRS))
        self.decoder = nn.Sequential(_convolution(PAIRS, HIDDEN), nn.Tanh(), _convolution(HIDDEN, columns))
        self.angles = nn.Parameter(torch.randn(PAIRS, 2, SAMPLES) / SAMPLES**0.5)

    def mirrored(self, windows: Tensor) -> Tensor:
        """The windows (B, C, SAMPLES) of the mirrored motion."""
        return windows[:, self.source] * self.sign.repeat(len(self.joints))[:, None]

    def encode(self, windows: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Amplitude, frequency (Hz), offset, phase (radians) of the waves: (2 B, PAIRS) each, left first."""
        windows = windows - windows.mean(dim=2, keepdim=True)
        signals = self.encoder(torch.cat([windows, self.mirrored(windows)]) / self.scale)
        sine, cosine = torch.einsum("bcn,ckn->kbc", signals, self.angles)
        return *wave_of(signals), torch.atan2(sine, cosine)

    def forward(self, windows: Tensor) -> Tensor:
        """The windows (B, C, SAMPLES) without their means, as the decoder makes them from the waves."""
        amplitude, frequency, offset, phase = (value[..., None] for value in self.encode(windows))
        seconds = (torch.arange(SAMPLES) - SAMPLES // 2) / RATE
        waves = amplitude * torch.sin(2 * torch.pi * frequency * seconds + phase) + offset
        left, right = self.decoder(waves).chunk(2)
        return (left + self.mirrored(right)) * self.scale

    def local_phases(self, clip: Clip) -> tuple[Array, Array]:
        """Vectors and change of angles as in `hobble.labels.local_phase.local_phases`.

        The parts are the left and the right of each pair of signals.
        """
        speeds, frames = self.speeds(clip), torch.arange(len(clip))
        with torch.no_grad():
            found = [self.encode(_windows(speeds, part)) for part in frames.split(1024)]
        vectors = [torch.polar(a, phase).reshape(2, -1, PAIRS).permute(1, 2, 0) for a, _, _, phase in found]
        return vectors_and_change(torch.cat(vectors).reshape(len(clip), len(PARTS)).numpy().astype(complex))

    def speeds(self, clip: Clip) -> Tensor:
        """(F + a margin at both ends, C) speeds relative to the root, cm a frame, mirrored at the ends."""
        position, _, _ = local_pose(clip, root_frames(clip, 20.0))
        speeds = np.gradient(position[:, self.joints].reshape(len(position), -1), axis=0)
        margin = EVERY * (SAMPLES // 2)
        return torch.from_numpy(
            np.pad(speeds, ((margin, margin + 1), (0, 0)), "symmetric").astype(np.float32)
        )


def wave_of(signals: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Amplitude, frequency (Hz) and offset (...) of the waves in signals (..., SAMPLES), from their spectrum.

    The amplitude is that of a sine of the same power, the frequency is the mean of all, by their power.
    """
    spectrum = torch.fft.rfft(signals)
    power = spectrum[..., 1:].abs().square()
    total, frequencies = power.sum(dim=-1), torch.fft.rfftfreq(signals.shape[-1], 1 / RATE)[1:]
    frequency = (power * frequencies).sum(dim=-1) / (total + 1e-12)
    return 2 / SAMPLES * torch.sqrt(total + 1e-12), frequency, spectrum[..., 0].real / SAMPLES


def train(clips: Iterable[Clip], seed: int = 1, steps: int = STEPS) -> PhaseAutoencoder:
    """An autoencoder of these clips, which share a skeleton. Same seed, same bits."""
    torch.manual_seed(seed)
    network: PhaseAutoencoder | None = None
    pieces, frames, end = list[Tensor](), list[Tensor](), 0
    for clip in clips:
        network = network or PhaseAutoencoder(clip.skeleton)
        pieces.append(network.speeds(clip))
        frames.append(torch.arange(len(clip)) + end)
        end += len(pieces[-1])
    assert network is not None, "a data set has training clips"
    speeds, middles = torch.cat(pieces), torch.cat(frames)
    network.scale.copy_(speeds.square().mean().sqrt())
    optimiser = torch.optim.Adam(network.parameters(), LEARNING_RATE, fused=True)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    began, errors = time.perf_counter(), []
    for step in range(1, steps + 1):
        windows = _windows(speeds, middles[torch.randint(len(middles), (BATCH,))])
        wanted = windows - windows.mean(dim=2, keepdim=True)
        error = (network(windows) - wanted).square().mean() / network.scale**2
        optimiser.zero_grad()
        error.backward()
        optimiser.step()
        schedule.step()
        errors.append(error.item())
        if step % max(1, steps // REPORTS) == 0:
            mean, seconds = np.mean(errors[-steps // REPORTS :]), time.perf_counter() - began
            log.info("%d %% done, error %.3f of the variance, %.0f s", 100 * step // steps, mean, seconds)
    return network


def save_autoencoder(path: str | Path, network: PhaseAutoencoder) -> None:
    """Write the weights as an npz."""
    save_npz(path, **{name: tensor.numpy() for name, tensor in network.state_dict().items()})


def load_autoencoder(path: str | Path, skeleton: Skeleton) -> PhaseAutoencoder:
    """Read what `save_autoencoder` wrote, for clips of the same skeleton."""
    network = PhaseAutoencoder(skeleton)
    declared = {name: ArrayOf(tuple(tensor.shape)) for name, tensor in network.state_dict().items()}
    arrays = load_declared(path, declared)
    network.load_state_dict({name: torch.from_numpy(arrays[name]) for name in declared})
    return network


def _convolution(inputs: int, outputs: int) -> nn.Conv1d:
    return nn.Conv1d(inputs, outputs, KERNEL, padding=KERNEL // 2)


def _windows(speeds: Tensor, frames: Tensor) -> Tensor:
    """(B, C, SAMPLES) the windows around frames (B,). speeds: with a margin before the first frame."""
    return speeds[frames[:, None] + EVERY * torch.arange(SAMPLES)].transpose(1, 2)
