"""Handles users who have no name, as in a container, or who may not write in this folder."""

from __future__ import annotations

import getpass
import os
import re
from collections.abc import Sequence
from pathlib import Path

from hobble.core.errors import InputError

OWN = Path(".snakemake")  # Snakemake's own folder, in the folder where it runs
DRY_RUN = re.compile(r"-[a-zA-Z]*n[a-zA-Z]*|--dry-?run")


def ensure_user_name() -> None:
    """If the user has no name, set the environment variable USER to the user's id. Jobs inherit it.

    Snakemake and PyTorch need a user name.
    """
    try:
        getpass.getuser()
    except (KeyError, OSError):  # Python 3.13 raises OSError
        os.environ["USER"] = str(os.getuid())


def check_may_write(arguments: Sequence[str], own: Path = OWN) -> None:
    """Raise InputError if Snakemake cannot write its lock here, as in another user's checkout.

    arguments: the command line. own: Snakemake's own folder. A dry run is allowed, because it writes nothing.
    """
    if any(DRY_RUN.fullmatch(argument) for argument in arguments):
        return
    for folder in (own / "locks", own, own.parent):
        if folder.is_dir():
            if not os.access(folder, os.W_OK | os.X_OK):
                fix = "Work in a clone of your own, or ask its owner for permission."
                raise InputError(folder, f"cannot be written by the user {getpass.getuser()}", fix=fix)
            return
