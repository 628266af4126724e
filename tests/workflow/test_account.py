"""Where a user has no name and no HOME that can be written, as in a container."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ASK = """
import os
os.setgroups([]); os.setgid(54321); os.setuid(54321)
from hobble.workflow.account import ensure_user_name
ensure_user_name()
import getpass
print(getpass.getuser())
"""


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become a user without a name")
def test_a_user_without_a_name_is_called_by_the_number() -> None:
    """Imported first, as that user may not be able to read this Python."""
    names = {
        key: value for key, value in os.environ.items() if key not in ("USER", "LOGNAME", "LNAME", "USERNAME")
    }
    said = subprocess.run(
        [sys.executable, "-c", "import getpass, pwd, hobble.workflow.account\n" + ASK],
        env=names, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert said.stdout == "54321\n"


@pytest.mark.parametrize("home", [None, "/nonexistent", ""])
def test_make_gives_snakemake_a_home_that_it_may_write(root: Path, home: str | None) -> None:
    environment = {key: value for key, value in os.environ.items() if key != "HOME"}
    command = ["make", "--no-print-directory", "--eval", "home:; @echo $$HOME", "home"]
    given = environment if home is None else {**environment, "HOME": home}
    said = subprocess.run(command, cwd=root, env=given, capture_output=True, text=True, check=True)
    assert said.stdout.strip() == str(root / ".home")


def test_make_leaves_a_home_alone(root: Path, tmp_path: Path) -> None:
    command = ["make", "--no-print-directory", "--eval", "home:; @echo $$HOME", "home"]
    given = {**os.environ, "HOME": str(tmp_path)}
    said = subprocess.run(command, cwd=root, env=given, capture_output=True, text=True, check=True)
    assert said.stdout.strip() == str(tmp_path)
