"""The `training` stage: network weights from a database.

Importing it sets, unless they are set, what PyTorch and numba read when they are first imported.
"""

import os

# Threads that wait soon sleep: on a machine with other work to do, spinning ones take the cores from those
# that they wait for. Samples a second at batch 32 on two cores, alone and with six other processes at work:
# 13,000 and 600 with OpenMP's own count of 300,000 turns, 9,000 and 4,000 with none, 12,500 and 4,200 with
# 1,000.
os.environ.setdefault("GOMP_SPINCOUNT", "1000")
# What makes cuBLAS give the same bits again.
os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
