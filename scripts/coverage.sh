#!/bin/sh
# Line coverage of Python and of C++ by the fast tests, or by what the arguments say; pages in build/coverage:
#   scripts/coverage.sh [pytest arguments]
# C++ is what is compiled for one SIMD level: code for the others is the same source.
set -eu
cd "$(dirname "$0")/.."
work=build/coverage
export COVERAGE_FILE="$PWD/$work/python.data"
scripts/instrumented_build.sh coverage "-O1 --coverage -fprofile-update=prefer-atomic -fprofile-filter-files=/native/"
find "$work/native" -name '*.gcda' -delete
[ $# -gt 0 ] || set -- -n 2 -m "not slow"

status=0
"$work/venv/bin/python" -m pytest -p no:cacheprovider --cov --cov-report= "$@" || status=$?

.venv/bin/python -m coverage html --quiet --directory "$work/python"
.venv/bin/python -m coverage json --quiet -o "$work/python.json"
# A line of a template counts once; kernels run lines more often than gcovr thinks possible.
.venv/bin/python -m gcovr --root . --filter native/ --merge-lines --gcov-suspicious-hits-threshold 0 \
  --html-nested "$work/cpp.html" --json-summary "$work/cpp.json" "$work/native"
.venv/bin/python scripts/coverage_by_folder.py "$work/python.json" "$work/cpp.json"
exit $status
