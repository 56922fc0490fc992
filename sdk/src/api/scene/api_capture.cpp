#include <memory>

#include "api/boundary.h"
#include "api/frame_handle.h"
#include "api/scene/scene_conversions.h"

using namespace maq;

maq_status maq_capture_open(maq_context* context, const char* folder, maq_capture** capture) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(folder, "folder");
    require_argument(capture, "capture");
    auto opened = std::make_unique<maq_capture>(open_capture(folder));
    for (const Dropped& dropped : opened->capture.dropped) {
      opened->dropped.push_back(dropped.reason_and_first());
    }
    *capture = opened.release();
    return MAQ_OK;
  });
}

void maq_capture_destroy(maq_capture* capture) { destroy(capture, "capture", __func__); }

maq_status maq_capture_get_info(const maq_capture* capture, maq_capture_info* info) {
  return guarded(capture, __func__, [&] {
    require_argument(capture, "capture");
    maq_capture_info filled{};
    filled.view_count = uint32_t(capture->capture.views.size());
    filled.point_count = capture->capture.cloud.count();
    filled.drop_count = uint32_t(capture->dropped.size());
    std::copy_n(capture->capture.up.begin(), 3, filled.up);
    write_struct(info, "info", filled);
    return MAQ_OK;
  });
}

maq_status maq_capture_get_view(const maq_capture* capture, uint32_t index, maq_capture_view* view) {
  return guarded(capture, __func__, [&] {
    require_argument(capture, "capture");
    require_argument(view, "view");
    require_index("index", index, capture->capture.views.size());
    const CaptureView& from = capture->capture.views[index];
    maq_capture_view filled{};
    filled.is_held_out = from.is_held_out ? 1 : 0;
    filled.name = from.name.c_str();
    filled.camera = camera_of(from.camera);
    filled.has_depth = from.depth_path.empty() ? 0 : 1;
    write_struct(view, "view", filled);
    return MAQ_OK;
  });
}

maq_status maq_capture_get_drop(const maq_capture* capture, uint32_t index, maq_capture_drop* drop) {
  return guarded(capture, __func__, [&] {
    require_argument(capture, "capture");
    require_index("index", index, capture->dropped.size());
    const maq_capture_drop filled{0, capture->dropped[index].c_str(), capture->capture.dropped[index].count};
    write_struct(drop, "drop", filled);
    return MAQ_OK;
  });
}

maq_status maq_capture_load_view(const maq_capture* capture, uint32_t index, maq_frame** frame) {
  return guarded(capture, __func__, [&] {
    require_argument(capture, "capture");
    require_argument(frame, "frame");
    require_index("index", index, capture->capture.views.size());
    auto made = std::make_unique<maq_frame>();
    std::vector<uint8_t> valid;
    load_view(capture->capture.views[index], made->frame, valid);
    made->frame.sequence = index;
    *frame = made.release();
    return MAQ_OK;
  });
}

maq_status maq_capture_load_depth(const maq_capture* capture, uint32_t index, maq_pinhole_camera* camera,
                                  maq_frame** frame) {
  return guarded(capture, __func__, [&] {
    require_argument(capture, "capture");
    require_argument(camera, "camera");
    require_argument(frame, "frame");
    require_index("index", index, capture->capture.views.size());
    auto made = std::make_unique<maq_frame>();
    PinholeCamera of_depth;
    load_depth(capture->capture.views[index], made->frame, of_depth);
    made->frame.sequence = index;
    const maq_pinhole_camera pinhole = camera_of(of_depth);
    made->frame.intrinsics = pinhole.intrinsics;
    write_struct(camera, "camera", pinhole);
    *frame = made.release();
    return MAQ_OK;
  });
}
