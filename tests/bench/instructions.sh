#!/bin/sh
# Counts instructions from frame to verdict by callgrind, so that two revisions compare without the
# machine's noise: tests/bench/instructions.sh [GRAPNEL_BENCH]. Prints the total a preset and its
# dearest functions, and where GRAPNEL_DATA names the recorded data the same for pairs of views.
# Vectors are counted once however wide: GRAPNEL_TARGET says which are used.
set -eu
bench=${1:-build/release/bin/grapnel_bench}
target=${GRAPNEL_TARGET:-AVX2}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
echo "SIMD target $target, millions of instructions:"

# count NAME FUNCTION ARGUMENT...: of one run of the bench, inside of FUNCTION.
count() {
  name=$1
  function=$2
  shift 2
  GRAPNEL_TARGET=$target valgrind --tool=callgrind --collect-atstart=no \
    --toggle-collect="$function" --callgrind-out-file="$folder/$name" \
    "$bench" "$@" >"$folder/log" 2>&1 || { cat "$folder/log" >&2; exit 1; }
  echo
  echo "$name"
  callgrind_annotate "$folder/$name" |
    sed -n '/PROGRAM TOTALS/p; /grapnel::/p' | head -n 9 |
    sed 's/ \[[^]]*\]$//; s/([^%]*)$//' |
    awk '{ gsub(",", "", $1); printf "%10.1f ", $1 / 1e6; $1 = ""; print }'
}

for model in sack box barrel carton; do
  count "$model" '*Registrar::run(grapnel::DepthFrame*' frame "$model"
done
[ -n "${GRAPNEL_DATA:-}" ] || exit 0
count bunny '*Registrar::register_pair(*' pair bunny 4 8
count kitchen '*Registrar::register_pair(*' pair kitchen 0 20
