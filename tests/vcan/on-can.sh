#!/bin/bash
# on-can.sh CMD [ARG...]: runs CMD where there is a CAN interface: here if VCNC_CAN_IF (vcan0) is up,
# otherwise through with-vcan.sh.
set -u
if [ -d "/sys/class/net/${VCNC_CAN_IF:-vcan0}" ]; then
  exec "$@"
fi
exec "$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/with-vcan.sh" "$@"
