# Runs in the virtual machine: the SDK's own program on the kernel's test driver and on a virtual USB camera.

export LD_LIBRARY_PATH=/opt/maquette/lib
maquette=/opt/maquette/bin/maquette

plug_in() {
    virtual_uvc_camera "$@" &
    camera=$!
    wait_until test -e /dev/video0 && sleep 0.3
}
unplug() {
    kill $camera
    wait $camera 2>/dev/null
    wait_until test ! -e /dev/video0
}
lists() {
    $maquette sources >/tmp/sources
    grep -A8 "$1" /tmp/sources && grep -q "$2" /tmp/sources
}

# dense_pose URI FRAMES TEXT: so many frames are taken, and the summary has the text.
dense_pose() {
    rm -rf /tmp/results
    $maquette densepose "$1" --out /tmp/results --max-frames "$2" >/tmp/summary 2>&1
    status=$?
    tail -n 4 /tmp/summary
    [ $status -eq 0 ] && [ "$(ls /tmp/results/*_IUV.png | wc -l)" -eq "$2" ] && grep "$3" /tmp/summary
}

# The camera is away for two seconds while frames are taken.
survives_unplugging() {
    $maquette densepose v4l2:/dev/video0 --out /tmp/results --max-frames 12 >/tmp/summary 2>&1 &
    program=$!
    sleep 3
    unplug || return 1
    sleep 2
    plug_in --jpeg /photo.jpg || return 1
    wait $program
    status=$?
    tail -n 4 /tmp/summary
    [ $status -eq 0 ] && grep "12 frames" /tmp/summary
}

check "vivid loads" modprobe vivid n_devs=1 node_types=0x1
check "vivid is listed" lists "v4l2:/dev/video0" "vivid"
for size in 320x240 640x480 1280x720; do
    check "vivid $size: colour bars show nobody" dense_pose "v4l2:/dev/video0?size=$size" 3 ", 0 people"
done
rmmod vivid

check "drivers of USB cameras load" sh -c 'modprobe vhci-hcd && modprobe uvcvideo'
check "the camera appears" plug_in --jpeg /photo.jpg
check "the camera is listed" lists "v4l2:/dev/video0" "MJPG"
check "the gradient at 320x240 shows nobody" dense_pose "v4l2:/dev/video0?size=320x240" 3 ", 0 people"
unplug
check "a camera that shows a picture appears" plug_in --jpeg /photo.jpg
check "dense pose finds the people of the picture" dense_pose "v4l2:/dev/video0?format=MJPG" 3 ", [1-9][0-9]* p"
check "survives being unplugged and plugged in again" survives_unplugging
unplug
check "without a camera it says what to do" sh -c "! $maquette densepose v4l2:/dev/video0 --out /tmp/x 2>&1 | grep 'plugged in' && exit 1; true"
