"""The injury channel: how much each link of the body hurts, in each frame.

A link is a pair of neighbouring joints. A status file beside a clip says which links hurt in it, and when.
"""

from hobble.channels.injury.channel import CHANNEL

__all__ = ["CHANNEL"]
