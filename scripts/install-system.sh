#!/bin/sh
# Installs what qlb is built on, pictures are rendered with and report pages are built and tested with, where it is missing.
set -eu

packages="build-essential cmake ninja-build pkg-config python3-dev python3-venv
  libopenblas-dev libmetis-dev libsuitesparse-dev libxsimd-dev
  libegl1 libegl-mesa0 libgl1-mesa-dri"
command -v npm >/dev/null 2>&1 || packages="$packages nodejs npm"
command -v chromium >/dev/null 2>&1 || packages="$packages chromium"

if ! command -v apt-get >/dev/null 2>&1; then
  echo "No apt-get here. Needed: a C++20 compiler, cmake, ninja, pkg-config, METIS, xsimd, Node.js with npm (and OpenBLAS, SuiteSparse, Chromium for the tests)." >&2
  echo "  macOS:  brew install cmake ninja pkg-config metis xsimd libomp node" >&2
  echo "  conda:  conda install -c conda-forge cxx-compiler cmake ninja pkg-config metis xsimd nodejs" >&2
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
echo "Installing system packages, which takes some minutes:$missing"
$sudo apt-get update -qq
# shellcheck disable=SC2086  # a list of words on purpose
$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
