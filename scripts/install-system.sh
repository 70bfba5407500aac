#!/bin/sh
# Installs the system libraries that qlb is built on and pictures are rendered with, where they are missing.
set -eu

packages="build-essential cmake ninja-build pkg-config python3-dev python3-venv
  libopenblas-dev libmetis-dev libsuitesparse-dev libxsimd-dev
  libegl1 libegl-mesa0 libgl1-mesa-dri"

if ! command -v apt-get >/dev/null 2>&1; then
  echo "No apt-get here. Needed: a C++20 compiler, cmake, ninja, pkg-config, METIS, xsimd (and OpenBLAS, SuiteSparse for the tests)." >&2
  echo "  macOS:  brew install cmake ninja pkg-config metis xsimd libomp" >&2
  echo "  conda:  conda install -c conda-forge cxx-compiler cmake ninja pkg-config metis xsimd" >&2
  exit 0
fi

missing=""
for package in $packages; do
  dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q "ok installed" || missing="$missing $package"
done
[ -z "$missing" ] && exit 0

sudo=""
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null 2>&1 || { echo "As root, run: apt-get install$missing" >&2; exit 1; }
  sudo="sudo"
fi
echo "Installing system packages:$missing"
$sudo apt-get update -qq
# shellcheck disable=SC2086  # a list of words on purpose
DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends $missing >/dev/null
