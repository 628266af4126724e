"""Builds the package with the files of config/skeletons, which lie outside the package in a checkout."""

from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py


class BuildWithSkeletons(build_py):
    """Copies the skeleton files into the built package. An editable installation needs no copy."""

    def run(self) -> None:
        """Build the package, then copy the files."""
        super().run()
        if not self.editable_mode:
            target = Path(self.build_lib, "hobble", "skeletons")
            target.mkdir(parents=True, exist_ok=True)
            for file in Path("config/skeletons").glob("*.yaml"):
                (target / file.name).write_bytes(file.read_bytes())


setup(cmdclass={"build_py": BuildWithSkeletons})
