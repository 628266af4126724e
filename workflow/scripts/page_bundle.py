"""Creates results/page/bundle.js from the page's scripts and the npm packages that they import.

The packages of the lock file go to results/page/node_modules/ and stay there for the next bundle.
"""

from pathlib import Path

from hobble.report.bundle import bundle_page_scripts, install_npm_packages
from hobble.workflow.job import job

with job(snakemake):
    folder = Path(snakemake.output.js).parent
    lock, installed = folder / "package-lock.json", folder / "node_modules" / ".package-lock.json"
    wanted = next(file for file in snakemake.input.packages if Path(file).name == lock.name)
    if not (installed.is_file() and lock.is_file() and lock.read_bytes() == Path(wanted).read_bytes()):
        installed.unlink(missing_ok=True)  # npm writes it last, so half an installation is made again
        install_npm_packages(folder)
    bundle_page_scripts(folder / "node_modules", snakemake.input.wasm, snakemake.output.js)
