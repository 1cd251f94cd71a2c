#!/bin/sh
# Makes the pictures of docs/gallery.md, of simulated frames alone: docs/gallery.sh [BUILD]
set -eu
cd "$(dirname "$0")/.."
grapnel="${1:-build/release}/bin/grapnel"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p docs/gallery

# class preset, then picture=case of each picture that is kept
class() {
  part=$1
  preset=$2
  shift 2
  "$grapnel" simulate --set-of "$part" --split tune --positives 3 --either 4 --negatives 6 \
    --instances 2 -o "$work/$part" >/dev/null
  "$grapnel" evaluate "$work/$part/suite.toml" --presets "$preset" -o "$work/$part-out" \
    --jobs 2 --pictures 13 --picture-files --panel-px 130
  for pair in "$@"; do
    cp "$work/$part-out/pictures/$preset-${pair#*=}.png" "docs/gallery/$part-${pair%%=*}.png"
  done
}

# name scene model preset: one frame of several parts
scene() {
  "$grapnel" simulate "docs/gallery/$2.toml" -o "$work/$2" >/dev/null
  "$grapnel" register "config/models/$3.ply" "$work/$2#0" --preset "$4" --set max_objects=8 \
    --picture "docs/gallery/$1.png" --panel-px 220 || true
}

class carton carton accepted=00000-alone cluttered=00002-cluttered \
  half_hidden=00003-half_hidden larger=00009-larger
class box box accepted=00000-alone touching=00004-touching other_size=00008-other_size
class barrel barrel accepted=00000-alone half_hidden=00003-half_hidden other_size=00008-other_size
class sack sack accepted=00000-alone ambiguous=00001-alone half_hidden=00003-half_hidden
class nearly_symmetric object accepted=00001-alone ambiguous=00000-alone
scene several several carton carton
scene touching touching box box
