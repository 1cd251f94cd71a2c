#!/bin/bash
# A PLC triggers twelve parts on a simulated conveyor and reads their poses over Modbus TCP.
#   ./demo.sh                    runs the line once and compares every answer with the truth
#   ./demo.sh --serve [--port N] leaves daemon and recording running for a Modbus client of your own
# The first run installs what is missing and builds; later ones reuse it.
set -euo pipefail
cd "$(dirname "$0")"

usage() { sed -n '2,4s/^# \{0,1\}//p' "$0"; }
serve=no
port=1502
port_given=no
while [ $# -gt 0 ]; do
  case "$1" in
    --serve) serve=yes ;;
    --port) [ $# -ge 2 ] || { echo "--port: a number must follow" >&2; exit 2; }
      port="$2"; port_given=yes; shift ;;
    --port=*) port="${1#--port=}"; port_given=yes ;;
    -h|--help) usage; exit 0 ;;
    *) echo "$1: unknown option; --serve, --port N and --help are allowed" >&2; exit 2 ;;
  esac
  shift
done
if ! [[ "$port" =~ ^[0-9]{1,5}$ ]] || [ "$port" -gt 65535 ]; then
  echo "--port $port: not allowed; 0 to 65535 is, 0 takes a free one" >&2
  exit 2
fi

daemon=""
stop() {
  local status=$?
  trap - EXIT TERM INT
  if [ -n "$daemon" ] && kill -0 "$daemon" 2>/dev/null; then
    kill -TERM "$daemon" 2>/dev/null || true
    wait "$daemon" 2>/dev/null || true
  fi
  exit "$status"
}
trap stop EXIT
trap 'exit 0' TERM INT

# What takes long runs in the background, so that a signal ends the script at once.
step() { "$@" & daemon=$!; wait "$daemon"; daemon=""; }

step cmake/install-packages.sh run
if [ ! -x build/release/bin/grapneld ] || [ ! -x build/release/bin/grapnel ] || [ "$serve" = no ]; then
  # The demo needs the programs alone; test.sh's build tree is taken as it is.
  [ -f build/release/build.ninja ] || step cmake --preset release -DGRAPNEL_TESTS=OFF >build-demo.log 2>&1 \
    || { cat build-demo.log >&2; exit 1; }
  rm -f build-demo.log
  [ -x build/release/bin/grapneld ] || echo "building (some minutes the first time)"
  step cmake --build --preset release --target grapneld grapnel >build/release/demo-build.log \
    || { tail -40 build/release/demo-build.log >&2; exit 1; }
fi

demo="$PWD/build/demo"
recording="$demo/recording"
key=$(cat config/scenes/demo.toml drivers/synthetic/*.cpp drivers/synthetic/*.h | sha256sum | cut -d' ' -f1)
mkdir -p "$demo/state"
if [ "$(cat "$demo/recording.key" 2>/dev/null)" != "$key" ]; then
  rm -rf "$recording" "$demo/recording.key"
  echo "making the conveyor recording"
  step build/release/bin/grapnel simulate config/scenes/demo.toml -o "$recording" >/dev/null
  echo "$key" >"$demo/recording.key"
fi

log="$demo/grapneld.log"
start_daemon() {
  build/release/bin/grapneld --config config/grapnel.toml --set "camera.path=\"$recording\"" \
    --set "state.folder=\"$demo/state\"" --set "fieldbus.port=$1" >"$log" 2>&1 &
  daemon=$!
}
# The port that the daemon serves, once it is ready.
ready_port() { sed -n 's/.*ready, Modbus port \([0-9]*\).*/\1/p' "$log" 2>/dev/null; }
wait_until_ready() {
  for _ in $(seq 600); do
    [ -n "$(ready_port)" ] && return 0
    kill -0 "$daemon" 2>/dev/null || return 1
    sleep 0.05
  done
  return 1
}

start_daemon "$port"
if ! wait_until_ready; then
  if [ "$port_given" = yes ]; then
    cat "$log" >&2
    exit 1
  fi
  # Somebody else has the port: any free one will do.
  wait "$daemon" 2>/dev/null || true
  start_daemon 0
  wait_until_ready || { cat "$log" >&2; exit 1; }
fi
port=$(ready_port)

if [ "$serve" = yes ]; then
  echo "serving on $port"
  status=0
  wait "$daemon" || status=$?
  daemon=""
  cat "$log" >&2
  exit "$status"
fi

echo "grapneld plays the recording and serves Modbus on 127.0.0.1:$port (its log: build/demo/grapneld.log)"
status=0
build/release/bin/grapnel plc "127.0.0.1:$port" --events "$recording/events.jsonl" \
  --config config/grapnel.toml || status=$?
exit "$status"
