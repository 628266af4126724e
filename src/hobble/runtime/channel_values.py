"""Checks the channel values that the caller gives, and converts them for the character's state."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from hobble.channels import CHANNEL_NAMES, channel
from hobble.core.quat import Array
from hobble.models.network import Network


class UnknownName(KeyError):
    """The network does not have this gait or this label.

    A label names a column of a channel, such as the link "LeftUpLeg-LeftLeg" of the channel "injury".

    what: start of the message, such as "no gait". name: what the caller gave. known: the names that exist.
    The message lists the known names that are similar, or all of them if none is.
    """

    def __init__(self, what: str, name: object, known: Iterable[str]) -> None:
        names = list(known)
        similar = difflib.get_close_matches(str(name), names, 3, 0.5)
        hint = f"; did you mean {' or '.join(similar)}?" if similar else f": there are {', '.join(names)}"
        super().__init__(f"{what} {name!r}{hint}")

    def __str__(self) -> str:
        return str(self.args[0])


class ChannelValues:
    """Checks and converts values for the channels of a network.

    labels: channel -> label -> index of the label's column among those of the channel. columns: channel ->
    the channel's columns in the character's state, which holds all channels side by side. scales: channel ->
    number by which the caller's values are divided before the network gets them.
    """

    def __init__(self, network: Network, scales: Mapping[str, float]) -> None:
        self.labels = {
            name: {label: i for i, label in enumerate(column_labels)}
            for name, column_labels in network.channels.items()
        }
        self.scales = dict(scales)
        self.columns: dict[str, slice] = {}
        start = 0
        for name, count in network.layout.channels:
            self.columns[name] = slice(start, start + count)
            start += count

    def convert(self, name: str, given: Any, characters: int) -> tuple[slice, Array]:
        """The columns of channel `name` in the character's state, and their new values (C, columns).

        given: label -> one value or (C,) values, where labels that are not named get 0; or an array
        (columns,) or (C, columns). characters: C. Raises the errors listed in
        `ProceduralAnimation.next_pose`.
        """
        if name not in CHANNEL_NAMES:
            raise TypeError(f"next_pose() got an unexpected keyword argument {name!r}")
        definition, labels = channel(name), self.labels.get(name, {})
        values = np.zeros((characters, len(labels)))
        if isinstance(given, Mapping):
            for label, value in given.items():
                self._check_label(name, label)
                if np.shape(value) not in ((), (1,), (characters,)):
                    shape = np.shape(value)
                    raise ValueError(
                        f"{label} has to be one {definition.value_word} for all characters, or an array of "
                        f"{characters}, one for each; its shape is {shape}"
                    )
                values[:, labels[label]] = value
        else:
            array = np.asarray(given, float)
            if not labels and array.size:
                raise ValueError(f"{array.size} numbers given for {name}, but {_no_input(name)}")
            if array.shape not in (values.shape, values.shape[1:]):
                raise ValueError(
                    f"{name} has to have shape {values.shape[1:]} or {values.shape}, not {array.shape}"
                )
            values[:] = array
        wrong = ~((values >= 0) & (values <= definition.highest))
        if wrong.any():
            c, k = np.argwhere(wrong)[0]
            raise ValueError(
                f"the {definition.value_word} of {list(labels)[k]} is {values[c, k]:g}, but has to be from 0 "
                f"to {definition.highest:g}"
            )
        return self.columns.get(name, slice(0, 0)), values / self.scales.get(name, 1.0)

    def _check_label(self, name: str, label: str) -> None:
        """Raise ValueError or UnknownName if the network has no input for this label of channel `name`."""
        labels = self.labels.get(name, {})
        if not labels:
            raise ValueError(f"{label} cannot be set: {_no_input(name)}")
        if label not in labels:
            raise UnknownName(f"{name} has no", label, labels)


def _no_input(name: str) -> str:
    """The end of a message: what is wrong with channel `name`, and what to do."""
    return f"this network has no input for {name}; train a configuration with `channels: [{name}]`"
