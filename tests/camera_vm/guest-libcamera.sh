# Runs in the virtual machine: libcamera, and the SDK on top of it, with a virtual USB camera. First without udev, as in a
# container: nothing tells libcamera that a camera comes or goes. Then with udev.

export LD_LIBRARY_PATH=/opt/maquette/lib
maquette=/opt/maquette/bin/maquette
id='libcamera:\_SB_.VHCI-1:1.0-1d6b:0102'

# libcamera names a USB camera by the place of its controller in the firmware's tables and takes none without; a virtual
# controller has no such place. Its folder is shown with one, below which everything is as it was.
give_the_controller_a_place() {
    controller=/sys/devices/platform/vhci_hcd.0
    mkdir -p /run/controller
    mount --bind $controller /run/controller
    mount -t tmpfs controller $controller
    mkdir $controller/firmware_node $controller/usb1 $controller/usb2
    echo '\_SB_.VHCI' >$controller/firmware_node/path
    ln -s ../../../bus/platform $controller/subsystem
    for entry in usb1 usb2 uevent modalias status attach detach; do
        [ -e $controller/$entry ] || touch $controller/$entry
        mount --bind /run/controller/$entry $controller/$entry
    done
}
plug_in() {
    virtual_uvc_camera --jpeg /photo.jpg &
    camera=$!
    wait_until test -e /dev/video0 && wait_until test -e /dev/media0 && sleep 0.3 || return 1
    if [ -z "$has_udev" ]; then note_cameras_for_udev; else udevadm settle; fi
}
unplug() {
    kill $camera
    wait $camera 2>/dev/null
    wait_until test ! -e /dev/video0
}
# has_lines FILE TEXT...: it has each of the texts.
has_lines() {
    file="$1"
    shift
    cat "$file"
    for text in "$@"; do grep -qF "$text" "$file" || { echo "without: $text"; return 1; }; done
}
cam_lists() { cam -l >/tmp/cam 2>&1 && has_lines /tmp/cam "Virtual UVC Camera"; }
lists() {
    $maquette sources >/tmp/sources 2>/tmp/messages && has_lines /tmp/sources "$@" && [ ! -s /tmp/messages ]
}
# says TEXT URI: it cannot be opened, and the last line says why.
says() {
    ! $maquette densepose "$2" --out /tmp/results --max-frames 1 >/tmp/summary 2>&1 && tail -n 1 /tmp/summary | grep -F "$1"
}
# dense_pose URI FRAMES TEXT [OPTION...]: so many frames are taken, and the summary has the text.
dense_pose() {
    rm -rf /tmp/results
    uri=$1 frames=$2 text=$3
    shift 3
    $maquette densepose "$uri" --out /tmp/results --max-frames "$frames" "$@" >/tmp/summary 2>&1
    status=$?
    tail -n 4 /tmp/summary
    [ $status -eq 0 ] && [ "$(ls /tmp/results/*_IUV.png | wc -l)" -eq "$frames" ] && grep "$text" /tmp/summary
}
brightness_reaches_the_camera() {
    source_check "libcamera:0?format=YUYV" 0.5 brightness && v4l2-ctl -d /dev/video0 -C brightness | grep 'brightness: 192'
}
busy_while_another_program_has_it() {
    cam -c 1 --capture=100000 >/dev/null 2>&1 &
    other=$!
    sleep 3
    says "uses the camera; close it" libcamera:0
    status=$?
    kill $other
    wait $other
    return $status
}
# The camera is away for two seconds while frames are taken.
survives_unplugging() {
    source_check "libcamera:0?format=YUYV" 5 back >/tmp/summary 2>&1 &
    program=$!
    sleep 3
    unplug || return 1
    sleep 2
    plug_in || return 1
    wait $program
    status=$?
    cat /tmp/summary
    return $status
}
lost_for_good() {
    source_check "libcamera:0?format=YUYV" 1000 lost >/tmp/summary 2>&1 &
    program=$!
    sleep 3
    unplug || return 1
    wait $program
    status=$?
    cat /tmp/summary
    [ $status -eq 0 ] && grep "did not come back" /tmp/summary
}

check "drivers of USB cameras load" sh -c 'modprobe vhci-hcd && modprobe uvcvideo'
check "the controller has a place" give_the_controller_a_place
check "no camera is listed" lists "No camera is plugged in."
check "without a camera it says so" says "libcamera sees no camera" libcamera:0
check "the camera appears" plug_in
check "cam lists it" cam_lists
check "it is listed with its formats" lists "$id" "Virtual UVC Camera" "YUYV    640 x 480" "YUYV    320 x 240" "MJPG    640 x 480"
check "the gradient at 640x480, byte for byte" source_check "libcamera:0?format=YUYV" 20 gradient
check "the gradient at 320x240, byte for byte" source_check "libcamera:0?size=320x240" 20 gradient
check "by its id" source_check "$id?size=330x200" 5 gradient
check "brightness reaches the camera" brightness_reaches_the_camera
check "another id says what there is" says "libcamera sees 1 camera." libcamera:/another
check "a format that it has not says which it has" says "offers MJPG, YUYV, but not NV12" 'libcamera:0?format=NV12'
check "busy while another program has it" busy_while_another_program_has_it
check "the gradient at 320x240 shows no people" dense_pose "libcamera:0?size=320x240" 3 ", 0 people" --size 192
check "dense pose finds the people of the picture" dense_pose "libcamera:0?format=MJPG" 3 ", [1-9][0-9]* p"
check "without udev: survives being unplugged and plugged in again" survives_unplugging
check "without udev: a camera that stays away is lost" lost_for_good

has_udev=yes
rm -rf /run/udev
ln -s udevadm /bin/systemd-udevd
check "udev starts" sh -c 'systemd-udevd --daemon && udevadm trigger && udevadm settle'
check "with udev: the camera appears" plug_in
check "with udev: survives being unplugged and plugged in again" survives_unplugging
check "with udev: a camera that stays away is lost" lost_for_good
