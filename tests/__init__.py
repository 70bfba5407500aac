import os

# Before NumPy loads it: OpenBLAS's threads wait by spinning, which costs tests that run beside more than it brings.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
