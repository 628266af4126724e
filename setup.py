"""A built package carries the skeleton files of config/skeletons; in a checkout they stay where they are."""

from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py


class BuildWithSkeletons(build_py):
    """Copies them beside the code, except for an editable installation."""

    def run(self) -> None:
        """Build, then copy."""
        super().run()
        if not self.editable_mode:
            target = Path(self.build_lib, "hobble", "skeletons")
            target.mkdir(parents=True, exist_ok=True)
            for file in Path("config/skeletons").glob("*.yaml"):
                (target / file.name).write_bytes(file.read_bytes())


setup(cmdclass={"build_py": BuildWithSkeletons})
