#!/bin/sh
# Installs what is missing, builds the release preset and runs every test.
# Recorded data is looked for in $GRAPNEL_DATA; without it the tests that need it are skipped and say so.
set -eu
cd "$(dirname "$0")"

cmake/install-packages.sh test
cmake --preset release -DGRAPNEL_TESTS=ON >/dev/null
cmake --build --preset release
exec ctest --preset release --parallel "$(nproc)" "$@"
