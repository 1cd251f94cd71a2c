#!/bin/sh
# Makes simulated cases, judges them and throws them away, round after round; then puts the results
# together. A round's scenes are of instances and a seed of its own. Stops at the number of rounds,
# or between rounds when OUT/stop exists; what is done stays and is merged.
#
#   qualification.sh GRAPNEL PRESETS OUT SPLIT ROUNDS POSITIVES EITHER NEGATIVES [CLASS…]
#
# GRAPNEL is the program, PRESETS the folder of the shipped presets, SPLIT tune, validate or
# lockbox; the counts are of each round and class.
set -eu
if [ $# -lt 8 ]; then
  sed -n '6,9s/^# *//p' "$0" >&2
  exit 2
fi
grapnel=$1 presets=$2 out=$3 split=$4 rounds=$5 positives=$6 either=$7 negatives=$8
shift 8
[ $# -gt 0 ] || set -- box barrel carton sack nearly_symmetric

# What was said is progress, unless it was the last.
fail() {
  tail -n 3 "$out/said" >&2
  exit 1
}

mkdir -p "$out"
round=1
while [ "$round" -le "$rounds" ] && [ ! -e "$out/stop" ]; do
  for class in "$@"; do
    preset=$class
    [ "$class" = nearly_symmetric ] && preset=carton
    result=$out/$class-$round
    [ -e "$result/summary.json" ] && continue
    rm -rf "$out/set" "$result"
    "$grapnel" simulate --set-of "$class" --split "$split" --seed "$round" --instances 20 \
      --positives "$positives" --either "$either" --negatives "$negatives" -o "$out/set" 2>"$out/said" || fail
    "$grapnel" evaluate "$out/set/suite.toml" --presets "$presets"/[0-9]*-"$preset".toml \
      --pictures 0 -o "$result" 2>"$out/said" || fail
  done
  rm -rf "$out/set" "$out/said"
  round=$((round + 1))
done
for class in "$@"; do
  echo "$class:"
  "$grapnel" merge "$out/$class"-[0-9]* -o "$out/$class"
done
