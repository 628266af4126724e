"""What the Snakefile and its scripts need: fingerprints of code, paths, and a frame for every job."""
