# Runs in the virtual machine: a virtual USB camera at the kernel's UVC driver, unplugged and plugged in again.

plug_in() {
    virtual_uvc_camera "$@" &
    camera=$!
    wait_until test -e /dev/video0 && sleep 0.3 && note_cameras_for_udev
}
unplug() {
    kill $camera
    wait $camera 2>/dev/null
    wait_until test ! -e /dev/video0
}
brightness_reaches_the_camera() {
    v4l2-ctl -d /dev/video0 -c brightness=77 && v4l2-ctl -d /dev/video0 -C brightness | grep 'brightness: 77'
}
unplug_while_streaming() {
    (sleep 2; kill $camera) &
    capture /dev/video0 YUYV 640x480 1000 unplugged
}

# frame_is FORMAT FILE: one frame has the bytes of the file.
frame_is() {
    v4l2-ctl -d /dev/video0 --set-fmt-video "width=640,height=480,pixelformat=$1" --stream-mmap --stream-count 1 \
        --stream-to /tmp/frame && cmp /tmp/frame "$2"
}

check "drivers of USB cameras load" sh -c 'modprobe vhci-hcd && modprobe uvcvideo'

check "the camera appears when plugged in" plug_in
check "uvc YUYV 640x480" capture /dev/video0 YUYV 640x480 30 gradient
check "uvc YUYV 320x240" capture /dev/video0 YUYV 320x240 30 gradient
check "uvc brightness" brightness_reaches_the_camera
check "unplugged while streaming gives ENODEV" unplug_while_streaming
check "the device is gone after that" wait_until test ! -e /dev/video0

check "the camera appears when plugged in again" plug_in
check "uvc frames come again" capture /dev/video0 YUYV 640x480 10 gradient
check "the device is gone when unplugged while idle" unplug

head -c 614400 /dev/urandom >/tmp/picture.yuyv
check "a camera with a given picture appears" plug_in --picture /tmp/picture.yuyv --jpeg /photo.jpg
check "uvc YUYV gives the picture" frame_is YUYV /tmp/picture.yuyv
check "uvc MJPG gives the JPEG file" frame_is MJPG /photo.jpg
unplug
