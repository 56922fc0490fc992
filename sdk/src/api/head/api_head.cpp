#include <algorithm>

#include "api/boundary.h"
#include "api/camera_argument.h"
#include "api/frame_handle.h"
#include "api/head/head_handle.h"
#include "core/worker_threads.h"
#include "head/files/head_file.h"
#include "head/mesh/file_axes.h"
#include "head/reconstruction/head_scale.h"
#include "head/reconstruction/head_surface.h"

using namespace maq;

namespace {

// Copies the head with another size.
maq_head* scaled_copy(const maq_head& head, const head::HeadScale& scale) {
  head::StoredHead made = head.head;
  made.scale = scale;
  if (const std::string fault = head::stored_head_fault(made); !fault.empty()) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The head cannot have this size: ", fault, ".");
  }
  return new maq_head(std::move(made), head.threads, head.template_head);
}

}  // namespace

maq_status maq_head_open(maq_context* context, const char* path, maq_head** head) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(path, "path");
    require_argument(head, "head");
    *head = new maq_head(head::read_head_file(path), default_threads());
    return MAQ_OK;
  });
}

maq_status maq_head_open_memory(maq_context* context, const void* data, size_t size_bytes, maq_head** head) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(data, "data");
    require_argument(head, "head");
    *head = new maq_head(head::read_head(data, size_bytes, "The head in memory"), default_threads());
    return MAQ_OK;
  });
}

void maq_head_destroy(maq_head* head) { destroy(head, "head", __func__); }

maq_status maq_head_save(const maq_head* head, const char* path) {
  return guarded(head, __func__, [&] {
    require_argument(head, "head");
    require_argument(path, "path");
    head::write_head_file(head->head, path);
    return MAQ_OK;
  });
}

maq_status maq_head_get_info(const maq_head* head, maq_head_info* info) {
  return guarded(head, __func__, [&] {
    require_argument(head, "head");
    const head::StoredHead& from = head->head;
    maq_head_info filled{};
    filled.photo_count = uint32_t(from.cameras.size());
    filled.landmark_count = uint32_t(from.landmarks.size());
    filled.scale = maq_head_scale(from.scale.source);
    filled.scale_sigma = float(from.scale.sigma / from.scale.metres_per_unit);
    filled.texture_px = uint32_t(from.texture.side_px);
    write_struct(info, "info", filled);
    return MAQ_OK;
  });
}

const char* maq_head_get_landmark_name(const maq_head* head, uint32_t index) {
  const char* name = nullptr;
  guarded(head, __func__, [&] {
    require_argument(head, "head");
    if (index < head->head.landmarks.size()) name = head->head.landmarks[index].name.c_str();
    return MAQ_OK;
  });
  return name;
}

maq_status maq_head_get_landmark(const maq_head* head, const char* name, maq_head_landmark* landmark) {
  return guarded(head, __func__, [&] {
    require_argument(head, "head");
    require_argument(name, "name");
    const head::HeadLandmark found = head::find_head_landmark(head->head, name);
    const double metres = head->head.scale.metres_per_unit;
    maq_head_landmark filled{};
    filled.sigma_m = float(found.sigma * metres);
    const Vec3 point = metres * head::to_file_axes(found.point);
    filled.point_m[0] = point.x, filled.point_m[1] = point.y, filled.point_m[2] = point.z;
    write_struct(landmark, "landmark", filled);
    return MAQ_OK;
  });
}

maq_status maq_head_get_camera(const maq_head* head, uint32_t index, maq_pinhole_camera* camera) {
  return guarded(head, __func__, [&] {
    require_argument(head, "head");
    require_index("index", index, head->head.cameras.size());
    const head::HeadCamera& from = head->head.cameras[index];
    PinholeCamera made;
    made.intrinsics() = {from.width_px, from.height_px, from.focal_px, from.focal_px, from.cx_px, from.cy_px};
    made.rotation = head::rotation_from_file_axes(from.head_to_camera.rotation);
    const Vec3 centre =
        head->head.scale.metres_per_unit * head::to_file_axes(head::inverse(from.head_to_camera).translation);
    made.centre = {centre.x, centre.y, centre.z};
    write_struct(camera, "camera", camera_of(made));
    return MAQ_OK;
  });
}

maq_status maq_head_scale_by_distance(const maq_head* head, const char* from, const char* to, double distance_m,
                                      maq_head** scaled) {
  return guarded(head, __func__, [&] {
    require_argument(head, "head");
    require_argument(from, "from");
    require_argument(to, "to");
    require_argument(scaled, "scaled");
    *scaled = scaled_copy(*head, head::scale_by_distance(head->head, from, to, distance_m));
    return MAQ_OK;
  });
}

maq_status maq_head_scale_by_depth(const maq_head* head, uint32_t index, const maq_frame* frame, maq_head** scaled) {
  return guarded(head, __func__, [&] {
    require_argument(head, "head");
    require_argument(frame, "frame");
    require_argument(scaled, "scaled");
    require_index("index", index, head->head.cameras.size());
    const ImageView* const depth = depth_of(frame->frame);
    WorkerThreads threads(head->threads);
    *scaled = scaled_copy(
        *head, head::scale_by_depth(head->head, index, depth == nullptr ? frame->frame.image : *depth, threads));
    return MAQ_OK;
  });
}
