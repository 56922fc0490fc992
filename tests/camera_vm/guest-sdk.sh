# Runs in the virtual machine: the SDK's own program on the kernel's test driver and on a virtual USB camera.

export LD_LIBRARY_PATH=/opt/maquette/lib
maquette=/opt/maquette/bin/maquette

# The number may differ: while a program holds a frame of the lost camera, the next camera gets another number.
has_camera() { ls /dev/video[0-9]*; }
has_no_camera() { ! has_camera; }
plug_in() {
    virtual_uvc_camera "$@" &
    camera=$!
    wait_until has_camera && sleep 0.3
}
unplug() {
    kill $camera
    wait $camera 2>/dev/null
    wait_until has_no_camera
}
lists() {
    $maquette sources >/tmp/sources
    grep -A8 "$1" /tmp/sources && grep -q "$2" /tmp/sources
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
# An emulated processor takes seconds for a frame; where nobody is to be found, a small input of the network is enough.
small="--size 192"

# controls_arrive OPTIONS CONTROL=VALUE...: opened with the options of a URI, the driver has the values.
controls_arrive() {
    dma_buf "v4l2:/dev/video0?$1" 1 || return 1
    shift
    for wanted in "$@"; do
        v4l2-ctl -d /dev/video0 -C "${wanted%=*}" | grep -x "${wanted%=*}: ${wanted#*=}[^0-9]*" || {
            v4l2-ctl -d /dev/video0 -C "${wanted%=*}"
            return 1
        }
    done
}
# Refused with a sentence that has the text.
refuses() {
    ! dma_buf "v4l2:/dev/video0?$1" 1 >/tmp/summary && grep "$2" /tmp/summary
}
dma_buf_outlives_the_camera() {
    (sleep 3; kill $camera) &
    dma_buf v4l2:/dev/video0 unplugged && wait_until test ! -e /dev/video0
}

# The camera is away for two seconds while frames are taken.
survives_unplugging() {
    rm -rf /tmp/results
    $maquette densepose v4l2:/dev/video0 --out /tmp/results --max-frames 12 $small >/tmp/summary 2>&1 &
    program=$!
    has_a_frame() { ls /tmp/results/*_IUV.png; }
    wait_until has_a_frame || return 1
    unplug || return 1
    sleep 2
    plug_in --jpeg /photo.jpg || return 1
    wait $program
    status=$?
    tail -n 4 /tmp/summary
    [ $status -eq 0 ] && grep "12 frames" /tmp/summary
}

# doctor_says STATUS TEXT...: its exit status, and texts that it prints.
doctor_says() {
    expected=$1
    shift
    $maquette doctor >/tmp/doctor 2>&1
    status=$?
    cat /tmp/doctor
    for text in "$@"; do grep -qF "$text" /tmp/doctor || { echo "without: $text"; return 1; }; done
    [ $status -eq "$expected" ] || { echo "exit status $status"; return 1; }
}
# As a user who is in no group.
doctor_says_to_nobody() {
    chmod 0755 / /opt
    chmod 0660 /dev/video0
    printf 'root:x:0:0::/:/bin/sh\nnobody:x:65534:65534::/:/bin/sh\n' >/etc/passwd
    printf 'video:x:44:\n' >/etc/group
    chown 0:44 /dev/video0
    su nobody -c "LD_LIBRARY_PATH=$LD_LIBRARY_PATH $maquette doctor" >/tmp/doctor 2>&1
    status=$?
    cat /tmp/doctor
    grep -qF 'it belongs to the group "video", in which you are not' /tmp/doctor || return 1
    grep -qF 'sudo usermod -aG video $USER' /tmp/doctor && [ $status -eq 1 ]
}
doctor_names_who_uses_it() {
    $maquette play "v4l2:/dev/video0?size=320x240" --seconds 60 >/dev/null 2>&1 &
    other=$!
    sleep 2
    doctor_says 0 "open in maquette (process $other)"
    status=$?
    kill $other
    wait $other
    return $status
}
# A recording is replayed, frame by frame.
records_and_plays() {
    $maquette record "v4l2:/dev/video0?size=320x240&format=YUYV" /tmp/take.maqrec --frames 20 && \
        $maquette play /tmp/take.maqrec --speed 4 && $maquette play /tmp/take.maqrec --frames 3 | grep "^3 frames of 320 x 180"
}

check "vivid loads" modprobe vivid n_devs=1 node_types=0x1
check "vivid is listed" lists "v4l2:/dev/video0" "vivid"
for size in 320x240 640x480 1280x720; do
    check "vivid $size: colour bars show no people" dense_pose "v4l2:/dev/video0?size=$size" 3 ", 0 people" $small
done
check "vivid: controls arrive, and switch their automatic off" \
    controls_arrive "brightness=77&gain=33" brightness=77 gain_automatic=0 gain=33
check "vivid: a value out of range is refused with the range" refuses brightness=1000 "goes from 0 to 255, not to 1000"
check "vivid: what it does not have is refused" refuses focus=3 "has no focus"
check "the doctor finds it well" doctor_says 0 "may be opened" "1 of 1 cameras can be used"
check "the doctor says who may not open it" doctor_says_to_nobody
check "the doctor says who uses it" doctor_names_who_uses_it
check "vivid is recorded and replayed" records_and_plays
check "vivid YUYV: frames are dma-bufs" dma_buf "v4l2:/dev/video0?size=640x480&format=YUYV" 5
check "vivid NV12: frames are dma-bufs" dma_buf "v4l2:/dev/video0?size=640x480&format=NV12" 5
rmmod vivid

check "vivid of two planes loads" modprobe vivid n_devs=1 node_types=0x1 multiplanar=2
check "vivid of two planes shows no people" dense_pose "v4l2:/dev/video0?size=640x480&format=NM12" 1 ", 0 people" $small
check "vivid NV12: frames are dma-bufs by the multi-planar interface" \
    dma_buf "v4l2:/dev/video0?size=640x480&format=NV12" 5
rmmod vivid

check "drivers of USB cameras load" sh -c 'modprobe vhci-hcd && modprobe uvcvideo'
check "the camera appears" plug_in --jpeg /photo.jpg
check "the camera is listed" lists "v4l2:/dev/video0" "MJPG"
check "the gradient at 320x240 shows no people" dense_pose "v4l2:/dev/video0?size=320x240" 3 ", 0 people" $small
unplug
check "a camera that shows a picture appears" plug_in --jpeg /photo.jpg
check "dense pose finds the people of the picture" dense_pose "v4l2:/dev/video0?format=MJPG" 3 ", [1-9][0-9]* p"
check "its brightness arrives" controls_arrive brightness=77 brightness=77
check "what it does not have is refused" refuses exposure=10000 "has no exposure"
check "survives being unplugged and plugged in again" survives_unplugging
unplug
check "a camera appears for its dma-bufs" plug_in
check "a frame's dma-buf is readable when the camera is unplugged" dma_buf_outlives_the_camera
wait $camera 2>/dev/null
check "a depth camera appears" plug_in --depth
check "the depth camera is listed" lists "v4l2:/dev/video0" "Z16"
check "its depth is in millimetres, without calibration" depth_check "v4l2:/dev/video0?format=Z16" 5 0.001 0
check "its depth is in the unit and has the calibration that are given" \
    depth_check "v4l2:/dev/video0?format=Z16&size=320x240&depth_unit=0.0001&fov=90" 5 0.0001 160
check "its depth is a dma-buf" dma_buf "v4l2:/dev/video0?format=Z16" 3
check "its depth is recorded with the calibration" $maquette record "v4l2:/dev/video0?format=Z16&fx=600" \
    /tmp/depth.maqrec --frames 5
check "its depth is replayed with the calibration" depth_check rec:/tmp/depth.maqrec 5 0.001 600
check "as a camera of pictures it is refused, with what to do" refuses "size=320x240" "open depth with format=Z16"
unplug
check "the doctor says that there is none" doctor_says 1 "no camera is plugged in" "0 of 0 cameras"
check "without a camera it says what to do" sh -c "! $maquette densepose v4l2:/dev/video0 --out /tmp/x 2>&1 | grep 'plugged in' && exit 1; true"
