#!/bin/sh
# Builds the scripts of report pages, web/ into src/qlb/results/static; where that fails qlb works, and its pages say so.
set -eu
cd "$(dirname "$0")/../web"

build() {
  if [ ! node_modules/.package-lock.json -nt package-lock.json ]; then
    npm ci --no-audit --no-fund --ignore-scripts --silent || return 1
  fi
  npm run --silent build
}

build || echo "The scripts of report pages were not built (npm failed): reports will hold pictures in their place." >&2
