"""The stage `training` of the workflow: trains a network on a database and writes its weights.

Importing this package sets two environment variables that libraries of PyTorch and numba read when they are
loaded. Values that are already set are kept.
"""

import os

# Let waiting threads sleep soon. On a busy machine, spinning threads take the cores from the threads that
# they wait for. Samples a second at batch 32 on two cores, first alone on the machine, then beside six other
# processes: with OpenMP's default of 300,000 spins 13,000, then 600; without spinning 9,000, then 4,000; with
# 1,000 spins 12,500, then 4,200.
os.environ.setdefault("GOMP_SPINCOUNT", "1000")
# Makes the matrix products of cuBLAS deterministic.
os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
