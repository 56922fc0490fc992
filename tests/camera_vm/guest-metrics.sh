# Runs in the virtual machine: what maquette makes of cameras, as metrics. Each is a line `metric NAME JSON`, which
# benchmarks/cameras.py reads. run.sh says whose seconds these are.

export LD_LIBRARY_PATH=/opt/maquette/lib
maquette=/opt/maquette/bin/maquette
frames="${frames:-100}"  # asked of the kernel, which hands on what it does not know

metric() {
    [ ! -e "/tmp/$1.json" ] || echo "metric $1 $(tr -d '\n' <"/tmp/$1.json")"
}

# delivers NAME FRAMES URI
delivers() {
    LD_PRELOAD=/count_allocations.so $maquette play "$3" --frames "$2" --no-image --json "/tmp/$1.json" || return 1
    grep -q '"dropped_frames": 0' "/tmp/$1.json" || { echo "frames were lost"; return 1; }
}
# Delivers, and counts what is taken from the heap once a fifth of the frames has come.
delivers_from_no_heap() {
    export COUNT_FROM=$((frames / 5)) COUNT_TO="$frames" COUNT_FILE="/tmp/$1_allocations.json"
    delivers "$1" "$frames" "$2"
    delivered=$?
    unset COUNT_FROM COUNT_TO COUNT_FILE
    [ $delivered -eq 0 ] || return 1
    grep '"allocations": 0' "/tmp/$1_allocations.json"
}
# metrics_of NAME URI: of many frames, and of few, so that the costs of starting can be taken off.
metrics_of() {
    check "$1: $frames frames, none lost, none allocated" delivers_from_no_heap "$1" "$2"
    metric "$1"
    metric "$1_allocations"
    check "$1: a few frames" delivers "$1_few" $((frames / 10)) "$2"
    metric "$1_few"
}

appears() {
    tries=0
    until [ -e /dev/video0 ]; do
        tries=$((tries + 1))
        [ $tries -lt 1000 ] || return 1
        sleep 0.01
    done
}
now() { read -r "$1" rest </proc/uptime; }  # whole hundredths, on the clock of maquette's times

# Unplugged and plugged in again, at other times between two looks of the source each time.
plugs_again() {
    $maquette play "v4l2:/dev/video0?size=640x480" --no-image --json /tmp/plug_play.json &
    program=$!
    wait_until sh -c "ls -l /proc/$program/fd | grep -q video0"
    cycles=
    for pause in 1.00 1.02 1.04 1.06 1.08; do
        sleep 1
        now unplugged_s
        kill $camera
        wait $camera
        wait_until test ! -e /dev/video0 || return 1
        sleep $pause
        now plugged_in_s
        virtual_uvc_camera &
        camera=$!
        appears || return 1
        now appeared_s
        cycles="$cycles${cycles:+, }{\"unplugged_s\": $unplugged_s, \"plugged_in_s\": $plugged_in_s, \"appeared_s\": $appeared_s}"
    done
    sleep 2
    kill $program
    wait $program || return 1
    echo "{\"cycles\": [$cycles], \"play\": $(cat /tmp/plug_play.json)}" >/tmp/plug.json
    [ "$(grep -c '"state": "reconnected"' /tmp/plug_play.json)" -eq 5 ]
}

check "vivid loads" modprobe vivid n_devs=1 node_types=0x1
# At 640x480 it has no 30 frames a second.
metrics_of vivid "v4l2:/dev/video0?size=640x360&fps=30"
check "vivid at 640x480: a few frames, none lost" delivers vivid_640x480 $((frames / 10)) \
    "v4l2:/dev/video0?size=640x480&fps=30"
metric vivid_640x480
rmmod vivid

check "drivers of USB cameras load" sh -c 'modprobe vhci-hcd && modprobe uvcvideo'
virtual_uvc_camera &
camera=$!
check "the camera appears" wait_until test -e /dev/video0
sleep 0.3
metrics_of uvc "v4l2:/dev/video0?size=640x480&fps=30"
check "uvc: comes back five times" plugs_again
metric plug
kill $camera
