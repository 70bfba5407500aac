#!/bin/sh
# Builds the native module under sanitizers and runs tests of it, the fast ones unless arguments say otherwise:
#   scripts/sanitize.sh address [pytest arguments]   AddressSanitizer, UndefinedBehaviorSanitizer, bounds of the library
#   scripts/sanitize.sh thread [pytest arguments]    ThreadSanitizer
# The first finding ends the run. What is not built here (CPython, NumPy, METIS, CHOLMOD) is not looked into, but its use of
# memory is. Leaks are left out: CPython keeps what it has at exit.
set -eu
cd "$(dirname "$0")/.."
kind=$1
shift
frames="-O1 -g1 -fno-omit-frame-pointer"
case $kind in
address)
  scripts/instrumented_build.sh address "$frames -fsanitize=address,undefined"
  # libstdc++ as well: the sanitizer looks for __cxa_throw when it starts.
  preload="$(gcc -print-file-name=libasan.so) $(gcc -print-file-name=libstdc++.so.6)"
  tests="tests/linalg tests/contact tests/materials tests/energies tests/system tests/shapes"
  ;;
thread)
  # GCC's OpenMP is not built for it, so that every barrier would look like a race. LLVM's says to Archer what its
  # constructs order.
  export CC="${CC:-clang-14}" CXX="${CXX:-clang++-14}"
  command -v "$CXX" >/dev/null || { echo "Needed: apt-get install clang-14 libomp-14-dev libclang-rt-14-dev" >&2; exit 1; }
  scripts/instrumented_build.sh thread "$frames -fsanitize=thread"
  preload=$(gcc -print-file-name=libtsan.so)  # that of LLVM 14 cannot be preloaded; the interface is one
  tests="tests/linalg tests/system/test_threads.py tests/contact/test_repeatability.py tests/contact/test_candidates.py
    tests/contact/test_step_bound.py tests/energies/test_damping.py"
  export OMP_TOOL_LIBRARIES="$(llvm-config-14 --libdir)/libarcher.so"
  ;;
*)
  echo "usage: $0 address|thread [pytest arguments]" >&2
  exit 2
  ;;
esac
# shellcheck disable=SC2086  # a list of words on purpose
[ $# -gt 0 ] || set -- -m "not slow" $tests

export ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
export TSAN_OPTIONS="halt_on_error=1:ignore_noninstrumented_modules=1"
# Capture by Python alone: a sanitizer writes to the terminal, and ends the process.
LD_PRELOAD=$preload exec setarch -R "build/$kind/venv/bin/python" -m pytest --capture=sys -p no:cacheprovider "$@"
