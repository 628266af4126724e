"""A user without a name, as a container that runs under some number has: Snakemake and PyTorch ask for it."""

from __future__ import annotations

import getpass
import os


def ensure_user_name() -> None:
    """Set USER, which jobs inherit, to the number of the user where the system knows no name."""
    try:
        getpass.getuser()
    except (KeyError, OSError):  # Python 3.13 raises OSError
        os.environ["USER"] = str(os.getuid())
