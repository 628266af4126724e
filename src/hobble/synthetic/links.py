"""The links that the walker knows how to hurt, apart from how, since a workflow asks before anything runs."""

from __future__ import annotations

from hobble.core.errors import HobbleError

LEFT, RIGHT = 0, 1
WRITES = ("_footsteps.txt", "_gait.txt", "_injuries.txt")  # beside each clip
LINKS = {
    "LeftUpLeg-LeftLeg": ("thigh", LEFT),
    "RightUpLeg-RightLeg": ("thigh", RIGHT),
    "LeftLeg-LeftFoot": ("shank", LEFT),
    "RightLeg-RightFoot": ("shank", RIGHT),
    "LeftFoot-LeftToeBase": ("foot", LEFT),
    "RightFoot-RightToeBase": ("foot", RIGHT),
    "LowerBack-Spine": ("back", LEFT),
    "LeftArm-LeftForeArm": ("upper arm", LEFT),
    "RightArm-RightForeArm": ("upper arm", RIGHT),
    "LeftForeArm-LeftHand": ("forearm", LEFT),
    "RightForeArm-RightHand": ("forearm", RIGHT),
}


def check_link(link: str, where: str) -> None:
    """Raise HobbleError that names `where` for a link that the walker does not know how to hurt."""
    if link not in LINKS:
        raise HobbleError(f"{where}: injured: the walker cannot hurt {link!r}. It can: {', '.join(LINKS)}.")
