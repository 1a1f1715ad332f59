#!/bin/bash
# with-vcan.sh CMD [ARG...]: runs CMD in a real Linux kernel that has CAN, with vcan0 (CAN FD) up.
#
# For hosts whose kernel has no vcan. The kernel is user-mode-linux from Debian: an ordinary process,
# which sees the host's files (hostfs) and runs CMD as its root. Needs no root on the host, no KVM, no
# modules. CMD keeps the working directory, writes to stdout live and gives its exit code; 125 says
# that the guest did not come up. Everything temporary lies in one directory under TMPDIR and is removed.
#
#   apt-get install -y --no-install-recommends user-mode-linux iproute2 perl-base gcc libc6-dev
#
# VCAN_TIMEOUT (300 s) ends the guest, VCAN_MEM (512M) is its memory, UML_BIN and UML_MODULES tell where
# it is. One CPU and slow system calls (10-15x): for tests of function, never of time. Programs built
# with ASan or TSan cannot run in it.
set -u
[ $# -gt 0 ] || { echo "usage: with-vcan.sh CMD [ARG...]" >&2; exit 125; }
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
uml=${UML_BIN:-/usr/bin/linux.uml}
modules=$(echo "${UML_MODULES:-/usr/lib/uml/modules}"/*/kernel)
[ -x "$uml" ] || { echo "with-vcan: $uml is missing; install user-mode-linux" >&2; exit 125; }

work=$(mktemp -d "${TMPDIR:-/tmp}/vcan.XXXXXX") || exit 125
trap 'rm -rf "$work"' EXIT
mkdir "$work/home"
"${CC:-cc}" -O2 -shared -fPIC -o "$work/xstate.so" "$here/uml-xstate.c" || exit 125
printf '%q ' "$@" > "$work/cmd"
# 313: finit_module, 169: reboot (power off); the guest has no kmod and no init of its own.
cat > "$work/init" <<EOF
#!/bin/bash
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root TMPDIR=/dev/shm
export VCNC_CAN_IF=vcan0
mount -t proc proc /proc; mount -t sysfs sys /sys
mount -t tmpfs -o mode=1777 shm /dev/shm || { mkdir -p /dev/shm; mount -t tmpfs -o mode=1777 shm /dev/shm; }
mount -t tmpfs run /run
ip link set lo up
for m in net/can/can net/can/can-raw drivers/net/can/dev/can-dev drivers/net/can/vcan; do
  perl -e 'open F,"<",\$ARGV[0] or die; \$e="";syscall(313,fileno(F),\$e,0)==0 or die "insmod \$ARGV[0]: \$!\n"' "$modules/\$m.ko"
done
ip link add dev vcan0 type vcan && ip link set vcan0 mtu 72 up && {
  cd $(printf '%q' "$PWD") && bash "$work/cmd" </dev/null >"$work/out" 2>&1
  echo \$? >"$work/rc"
}
sync
perl -e 'syscall(169,0xfee1dead,672274793,0x4321fedc)'
EOF
chmod +x "$work/init"
: > "$work/out"
tail -f -n +1 --pid=$$ "$work/out" &
tail_pid=$!
HOME=$work/home TMPDIR=$work LD_PRELOAD=$work/xstate.so timeout -k 5 "${VCAN_TIMEOUT:-300}" "$uml" \
  mem="${VCAN_MEM:-512M}" rootfstype=hostfs rw init="$work/init" con=null con0=fd:0,fd:1 quiet \
  >"$work/console" 2>&1 </dev/null
sleep 0.1
kill "$tail_pid" 2>/dev/null
wait "$tail_pid" 2>/dev/null
[ -s "$work/rc" ] || {
  echo "with-vcan: the guest did not run; its console says:" >&2
  tail -20 "$work/console" >&2
  exit 125
}
exit "$(cat "$work/rc")"
