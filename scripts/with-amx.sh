#!/bin/sh
# Runs a command with AMX where a virtual machine hides how its tiles look (scripts/amx_cpuid.c says how):
#
#     scripts/with-amx.sh torchrun --nproc-per-node 2 -m export.densepose.train …
#
# Training then is about twice as fast. Elsewhere it changes nothing, and without AMX it refuses.
set -eu
if [ $# -eq 0 ] || [ "$1" = --help ]; then
  sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "$0"
  exit 0
fi
if ! grep -qw amx_bf16 /proc/cpuinfo; then
  echo "with-amx: this processor has no AMX; run the command without it" >&2
  exit 1
fi
root=$(cd "$(dirname "$0")/.." && pwd)
library=$root/build/amx_cpuid.so
if [ ! -e "$library" ] || [ "$root/scripts/amx_cpuid.c" -nt "$library" ]; then
  mkdir -p "$root/build"
  "${CC:-cc}" -O1 -Wall -Wextra -shared -fPIC -o "$library.$$" "$root/scripts/amx_cpuid.c" -ldl
  mv "$library.$$" "$library"
fi
LD_PRELOAD=$library${LD_PRELOAD:+:$LD_PRELOAD} exec "$@"
