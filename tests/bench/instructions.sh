#!/bin/sh
# Counts instructions from frame to verdict by callgrind, so that two revisions compare without the
# machine's noise: tests/bench/instructions.sh [GRAPNEL_BENCH]. Prints the total a preset and its
# dearest functions. Vectors are counted once however wide: GRAPNEL_TARGET says which are used.
set -eu
bench=${1:-build/release/bin/grapnel_bench}
target=${GRAPNEL_TARGET:-AVX2}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
echo "SIMD target $target, one frame a preset, millions of instructions:"
for model in sack box barrel carton; do
  GRAPNEL_TARGET=$target valgrind --tool=callgrind --collect-atstart=no \
    --toggle-collect='*Registrar::run(grapnel::DepthFrame*' \
    --callgrind-out-file="$folder/$model" "$bench" frame "$model" >"$folder/log" 2>&1 ||
    { cat "$folder/log" >&2; exit 1; }
  echo
  echo "$model"
  callgrind_annotate "$folder/$model" |
    sed -n '/PROGRAM TOTALS/p; /grapnel::/p' | head -n 9 |
    sed 's/ \[[^]]*\]$//; s/([^%]*)$//' |
    awk '{ gsub(",", "", $1); printf "%10.1f ", $1 / 1e6; $1 = ""; print }'
done
