"""Gives a name to users who have none, as in a container. Stops users who may not write in this folder."""

from __future__ import annotations

import getpass
import os
import re
from collections.abc import Sequence
from pathlib import Path

from hobble.core.errors import InputError

SNAKEMAKE_FOLDER = Path(".snakemake")  # where Snakemake writes its locks, in the folder where it runs
# The option for a dry run, possibly with other one-letter options, as in -np.
DRY_RUN = re.compile(r"-[a-zA-Z]*n[a-zA-Z]*|--dry-?run")


def ensure_user_name() -> None:
    """If the user has no name, set the environment variable USER to the user's id.

    Snakemake and PyTorch need a user name. Jobs inherit the variable.
    """
    try:
        getpass.getuser()
    except (KeyError, OSError):  # Python 3.13 raises OSError
        os.environ["USER"] = str(os.getuid())


def check_may_write(arguments: Sequence[str], snakemake_folder: Path = SNAKEMAKE_FOLDER) -> None:
    """Raise InputError if Snakemake cannot write its lock here, as in another user's checkout.

    arguments: the command line; a dry run is always allowed, because it writes nothing. snakemake_folder: the
    folder .snakemake, which need not exist yet.
    """
    if any(DRY_RUN.fullmatch(argument) for argument in arguments):
        return
    # Only the first of these folders that exists is checked: Snakemake makes the missing ones in it.
    for folder in (snakemake_folder / "locks", snakemake_folder, snakemake_folder.parent):
        if folder.is_dir():
            if not os.access(folder, os.W_OK | os.X_OK):
                fix = "Work in a clone of your own, or ask the owner of this folder for permission."
                raise InputError(folder, f"cannot be written by the user {getpass.getuser()}", fix=fix)
            return
