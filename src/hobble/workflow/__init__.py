"""Code for the Snakefile and its scripts: paths, options, fingerprints of code, and the context of a job."""
