#!/bin/sh
# The first process of the virtual machine: prepares it, runs /test.sh, and switches it off.
# The second serial line takes results, so that messages of the kernel, on the first, never come between them.
export PATH=/bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
mkdir -p /dev/shm
mount -t tmpfs shm /dev/shm
exec >/dev/ttyS1 2>&1

# check NAME COMMAND...: a test that passes when the command succeeds; its last line of output says why it did not.
check() {
    check_name="$1"
    shift
    if "$@" >/tmp/output 2>&1; then
        echo "ok $check_name"
        sed 's/^/#   /' /tmp/output
    else
        check_status=$?
        head -n 20 /tmp/output | sed 's/^/#   /'
        echo "not ok $check_name: $(tail -n 1 /tmp/output | grep . || echo "exit status $check_status")"
    fi
}

# wait_until COMMAND...: for two minutes at most, since an emulated processor takes seconds for a frame.
wait_until() {
    wait_tries=0
    until "$@" >/dev/null 2>&1; do
        wait_tries=$((wait_tries + 1))
        if [ $wait_tries -ge 1200 ]; then
            echo "two minutes passed without: $*"
            return 1
        fi
        sleep 0.1
    done
}

# Writes udev's notes of each camera; libcamera uses no device without them.
note_cameras_for_udev() {
    mkdir -p /run/udev/data
    for device in /sys/class/video4linux/* /sys/bus/media/devices/*; do
        if [ -e "$device/dev" ]; then echo I:1 >"/run/udev/data/c$(cat "$device/dev")"; fi
    done
}

. /test.sh
echo "# the guest is done after $(cut -d' ' -f1 /proc/uptime) s"
poweroff -f
