#!/bin/sh
# Installs the packages of cmake/packages.txt that are missing. "run" leaves the tests' ones out.
# usage: cmake/install-packages.sh run|test
set -eu

list="$(dirname "$0")/packages.txt"
case "${1:-}" in
  run) wanted=$(sed '/^# tests/,$d' "$list" | sed 's/#.*//') ;;
  test) wanted=$(sed 's/#.*//' "$list") ;;
  *) echo "usage: $0 run|test" >&2; exit 2 ;;
esac

missing=""
for package in $wanted; do
  dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed ||
    missing="$missing $package"
done
[ -n "$missing" ] || exit 0

root=""
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "root rights (or sudo) are needed to install:$missing" >&2; exit 1; }
  root="sudo"
fi
echo "installing:$missing"
export DEBIAN_FRONTEND=noninteractive
$root apt-get update -qq
# shellcheck disable=SC2086  # a list of words on purpose
$root apt-get install -y -qq --no-install-recommends $missing >/dev/null
