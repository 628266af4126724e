"""A user without a name and without a writable HOME, as in a container."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

ASK = """
import os
os.setgroups([]); os.setgid(54321); os.setuid(54321)
from hobble.workflow.user_account import ensure_user_name
ensure_user_name()
import getpass
print(getpass.getuser())
"""


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become a user without a name")
def test_a_user_without_a_name_is_called_by_the_number() -> None:
    """The module is imported first, because that user may not be able to read this Python."""
    names = {
        key: value for key, value in os.environ.items() if key not in ("USER", "LOGNAME", "LNAME", "USERNAME")
    }
    said = subprocess.run(
        [sys.executable, "-c", "import getpass, pwd, hobble.workflow.user_account\n" + ASK],
        env=names, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert said.stdout == "54321\n"


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become another user")
@pytest.mark.parametrize("closed", [".", ".snakemake", ".snakemake/locks"])
def test_in_another_users_checkout_only_a_dry_run_starts(closed: str) -> None:
    """Snakemake itself would end in a traceback when it takes its lock."""
    with tempfile.TemporaryDirectory() as checkout:
        folder = Path(checkout, closed)
        folder.mkdir(parents=True, exist_ok=True)
        Path(checkout).chmod(0o755)
        folder.chmod(0o755)

        def said(*arguments: str) -> str:
            check = f"user_account.check_may_write({arguments!r}, Path({checkout!r}, '.snakemake'))"
            code = f"from pathlib import Path\nfrom hobble.workflow import user_account\n{ASK}\n{check}"
            return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stderr

        assert f"{folder}: cannot be written by the user 54321" in said("-c2", "results/x")
        for dry in ("-n", "-np", "--dry-run"):
            assert said(dry, "results/x") == ""
        folder.chmod(0o777)
        assert said("-c2", "results/x") == ""


@pytest.mark.parametrize("home", [None, "/nonexistent", ""])
def test_make_gives_snakemake_a_home_that_it_may_write(root: Path, home: str | None) -> None:
    environment = {key: value for key, value in os.environ.items() if key != "HOME"}
    command = ["make", "--no-print-directory", "--eval", "home:; @echo $$HOME", "home"]
    given = environment if home is None else {**environment, "HOME": home}
    said = subprocess.run(command, cwd=root, env=given, capture_output=True, text=True, check=True)
    assert said.stdout.strip() == str(root / ".home")


def test_make_does_not_change_a_writable_home(root: Path, tmp_path: Path) -> None:
    command = ["make", "--no-print-directory", "--eval", "home:; @echo $$HOME", "home"]
    given = {**os.environ, "HOME": str(tmp_path)}
    said = subprocess.run(command, cwd=root, env=given, capture_output=True, text=True, check=True)
    assert said.stdout.strip() == str(tmp_path)
