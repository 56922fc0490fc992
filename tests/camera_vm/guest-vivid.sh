# Runs in the virtual machine: vivid, the kernel's test camera driver, with pixels known from its colour bars.

check "vivid shows two cameras" modprobe vivid n_devs=2 node_types=0x1,0x1
for device in /dev/video0 /dev/video1; do
    check "$device takes the pattern of colour bars" \
        v4l2-ctl -d $device -c test_pattern=1,osd_text_mode=2
    # Frames of a real camera's pace: vivid starts at 5 per second at these sizes.
    v4l2-ctl -d $device --set-parm 30 >/dev/null 2>&1
done

check "vivid YUYV 640x480" capture /dev/video0 YUYV 640x480 10 bars
check "vivid NV12 1280x720" capture /dev/video1 NV12 1280x720 5 bars
check "vivid RGB3 640x480" capture /dev/video0 RGB3 640x480 5 bars
