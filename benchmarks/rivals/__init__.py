"""Other packages on qlb's falling bar: `python -m benchmarks rivals`.

Only `runner` and `qlb_itself` import qlb. All else runs under the rivals' own Python, which needs NumPy, SciPy and the
rival, so that no rival is ever a dependency of qlb.
"""
