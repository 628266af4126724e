"""The `training` stage: network weights from a database.

Importing this package sets environment variables that PyTorch and numba read at import, if they are not set
yet.
"""

import os

# Let waiting threads sleep soon. On a busy machine, spinning threads take the cores from the threads that
# they wait for. Samples a second at batch 32 on two cores, alone on the machine and beside six other
# processes: 13,000 and 600 with OpenMP's default of 300,000 spins; 9,000 and 4,000 without spinning; 12,500
# and 4,200 with 1,000 spins.
os.environ.setdefault("GOMP_SPINCOUNT", "1000")
# Makes cuBLAS deterministic.
os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
