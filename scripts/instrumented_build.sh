#!/bin/sh
# An editable installation of its own, build/NAME/venv, whose native module is built with flags of a sanitizer or of gcov:
#   scripts/instrumented_build.sh NAME "FLAGS"
# Everything else is what .venv holds, and stays as it is. One SIMD level, little optimisation, the checks of the
# standard library.
set -eu
cd "$(dirname "$0")/.."
name=$1 flags=$2
work=$PWD/build/$name
mkdir -p "$work"

.venv/bin/python -m venv --without-pip "$work/venv"
site=$("$work/venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
.venv/bin/python -c 'import sys; print(*(path for path in sys.path if path.endswith("site-packages")), sep="\n")' \
  >"$site/packages_of_the_other.pth"

CMAKE_ARGS="-DQLB_ONE_SIMD_LEVEL=ON -DQLB_CHOLMOD=ON -DNPM=OFF" CXXFLAGS="$flags -D_GLIBCXX_ASSERTIONS" CFLAGS="$flags" \
  "$work/venv/bin/python" -m pip install --quiet --ignore-installed --no-deps --no-build-isolation --editable . \
  --config-settings=install.strip=false --config-settings=cmake.build-type=Debug \
  --config-settings=build-dir="$work/native"
