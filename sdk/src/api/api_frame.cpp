#include "api/boundary.h"
#include "api/frame_handle.h"
#include "core/clock.h"
#include "image/convert.h"
#include "image/files/depth_file.h"
#include "image/files/image_file.h"
#include "image/geometry/intrinsics.h"
#include "image/geometry/resize.h"
#include "image/yuv_planes.h"

using namespace maq;

namespace {

// Returns the intrinsics for an image of the frame: its own, or the depth image that shows the same view. `width_px` 0:
// unknown.
maq_intrinsics intrinsics_for(const ImageView& image, const Frame& frame) {
  const maq_intrinsics& known = frame.intrinsics;
  if (known.width_px <= 0 || known.height_px <= 0) return {};
  if (known.width_px == image.width_px && known.height_px == image.height_px) return known;
  const bool is_of_image = known.width_px == frame.image.width_px && known.height_px == frame.image.height_px;
  return is_of_image ? resized(known, image.width_px, image.height_px) : known;
}

maq_frame_desc description(const ImageView& image, const Frame& frame) {
  maq_frame_desc desc{};
  desc.format = image.format;
  desc.width_px = image.width_px;
  desc.height_px = image.height_px;
  for (int plane = 0; plane < plane_count(image.format); ++plane) {
    desc.planes[plane] = image.planes[plane].data;
    desc.stride_bytes[plane] = image.planes[plane].stride_bytes;
  }
  desc.timestamp_ns = frame.timestamp_ns;
  desc.clock = frame.clock;
  desc.sequence = frame.sequence;
  desc.intrinsics = intrinsics_for(image, frame);
  return desc;
}

void require_own_size(const maq_frame_desc& desc) {
  const maq_intrinsics& camera = desc.intrinsics;
  const bool is_unknown = camera.width_px == 0 && camera.height_px == 0;
  if (is_unknown || (camera.width_px == desc.width_px && camera.height_px == desc.height_px)) return;
  throw ArgumentError("desc.intrinsics are for ", camera.width_px, " x ", camera.height_px,
                      " pixels, but the frame has ", desc.width_px, " x ", desc.height_px,
                      "; scale them to its size, or set their size to 0 x 0 if they are unknown.");
}

maq_yuv_image default_yuv_image() {
  maq_yuv_image image{};
  image.clock = MAQ_CLOCK_MONOTONIC;
  return image;
}

}  // namespace

maq_status maq_frame_desc_init(maq_frame_desc* desc, uint32_t struct_size) {
  maq_frame_desc defaults{};
  defaults.clock = MAQ_CLOCK_MEDIA;
  return init_config(__func__, desc, struct_size, defaults, "desc");
}

maq_status maq_frame_wrap(maq_context* context, const maq_frame_desc* given,
                          maq_frame_release_callback release_callback, void* user_data, maq_frame** frame) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(given, "desc");
    require_argument(frame, "frame");
    const maq_frame_desc desc = read_config(given, "desc", maq_frame_desc{});
    require_range("desc.clock", number_in(desc.clock), int32_t(MAQ_CLOCK_MEDIA), int32_t(MAQ_CLOCK_MONOTONIC));
    require_own_size(desc);
    auto handle = std::make_unique<maq_frame>();
    handle->frame.image = checked_image_view(desc);
    handle->frame.timestamp_ns = desc.timestamp_ns;
    handle->frame.clock = desc.clock;
    handle->frame.sequence = desc.sequence;
    handle->frame.intrinsics = desc.intrinsics;
    handle->release_callback = release_callback;
    handle->user_data = user_data;
    *frame = handle.release();
    return MAQ_OK;
  });
}

maq_status maq_yuv_image_init(maq_yuv_image* image, uint32_t struct_size) {
  return init_config(__func__, image, struct_size, default_yuv_image(), "image");
}

maq_status maq_frame_convert_yuv(maq_context* context, const maq_yuv_image* image, maq_frame** frame) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(image, "image");
    require_argument(frame, "frame");
    const maq_yuv_image given = read_config(image, "image", default_yuv_image());
    require_range("image.is_video_range", given.is_video_range, 0, 1);
    require_range("image.clock", number_in(given.clock), int32_t(MAQ_CLOCK_MEDIA), int32_t(MAQ_CLOCK_MONOTONIC));
    if (given.rotation_deg % 90 != 0 || given.rotation_deg < 0 || given.rotation_deg > 270) {
      throw ArgumentError("image.rotation_deg is ", given.rotation_deg, ", but must be 0, 90, 180 or 270.");
    }
    YuvImage from{given.width_px, given.height_px, {}, given.is_video_range == 0};
    for (int i = 0; i < 3; ++i) {
      from.planes[i] = {given.planes[i], given.size_bytes[i], given.stride_bytes[i], given.pixel_stride_bytes[i]};
    }
    check_image_size(given.width_px, given.height_px, "The image");
    if (const auto problem = yuv_image_problem(from)) throw ArgumentError(*problem, ".");
    const int turns = given.rotation_deg / 90;
    const bool lies = turns % 2 == 1;
    auto handle = std::make_unique<maq_frame>();
    yuv_to_nv12(from, turns,
                handle->frame.allocate(MAQ_PIXEL_NV12, lies ? given.height_px : given.width_px,
                                       lies ? given.width_px : given.height_px));
    handle->frame.timestamp_ns = given.timestamp_ns;
    handle->frame.clock = given.clock;
    handle->frame.sequence = given.sequence;
    *frame = handle.release();
    return MAQ_OK;
  });
}

maq_status maq_frame_decode(maq_context* context, const void* data, size_t size_bytes, maq_frame** frame) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(data, "data");
    require_argument(frame, "frame");
    auto handle = std::make_unique<maq_frame>();
    decode_image({static_cast<const uint8_t*>(data), size_bytes}, "The image in memory", handle->frame);
    *frame = handle.release();
    return MAQ_OK;
  });
}

void maq_frame_release(maq_frame* frame) {
  return_handle(frame, "frame", __func__, [](maq_frame* taken) {
    const maq_frame_release_callback callback = std::exchange(taken->release_callback, nullptr);
    void* const user_data = taken->user_data;
    return_to_pool(taken);
    if (callback != nullptr) call_app("release_callback", [&] { callback(user_data); });
  });
}

maq_status maq_frame_get_desc(const maq_frame* frame, maq_frame_desc* desc) {
  return guarded(frame, __func__, [&] {
    require_argument(frame, "frame");
    write_struct(desc, "desc", description(frame->frame.image, frame->frame));
    return MAQ_OK;
  });
}

maq_status maq_frame_get_origin(const maq_frame* frame, maq_frame_origin* origin) {
  return guarded(frame, __func__, [&] {
    require_argument(frame, "frame");
    const FrameOrigin& from = frame->frame.origin;
    maq_frame_origin filled{};
    filled.kind = MAQ_FRAME_CAPTURED;
    if (from.is_predicted) {
      filled.kind = MAQ_FRAME_PREDICTED;
      filled.horizon_ns = filled.age_ns = from.horizon_ns;
      if (frame->frame.clock == MAQ_CLOCK_MONOTONIC) {
        const int64_t now_ns = monotonic_ns();
        if (__builtin_sub_overflow(now_ns, from.captured_timestamp_ns, &filled.age_ns)) filled.age_ns = INT64_MAX;
      }
      filled.captured_timestamp_ns = from.captured_timestamp_ns;
      filled.captured_sequence = from.captured_sequence;
    }
    write_struct(origin, "origin", filled);
    return MAQ_OK;
  });
}

maq_status maq_frame_get_depth(const maq_frame* frame, maq_frame_desc* desc) {
  return guarded(frame, __func__, [&] {
    require_argument(frame, "frame");
    const ImageView* depth = depth_of(frame->frame);
    if (depth == nullptr) throw Error(MAQ_ERROR_UNSUPPORTED, "The frame has no depth.");
    write_struct(desc, "desc", description(*depth, frame->frame));
    return MAQ_OK;
  });
}

maq_status maq_frame_get_dma_buf(const maq_frame* frame, int32_t* fd) {
  return guarded(frame, __func__, [&] {
    require_argument(frame, "frame");
    require_argument(fd, "fd");
    const int found = frame->frame.lease.dma_buf();
    if (found < 0)
      throw Error(MAQ_ERROR_UNSUPPORTED, "The frame's memory is not available as a dma-buf; use its planes.");
    *fd = found;
    return MAQ_OK;
  });
}

maq_status maq_frame_copy_pixels(const maq_frame* frame, maq_pixel_format format, uint8_t* pixels, size_t stride_bytes,
                                 size_t size_bytes) {
  return guarded(frame, __func__, [&] {
    require_argument(frame, "frame");
    require_argument(pixels, "pixels");
    copy_pixels(frame->frame.image, format, pixels, stride_bytes, size_bytes);
    return MAQ_OK;
  });
}

maq_status maq_frame_resize(const maq_frame* frame, int32_t width_px, int32_t height_px, maq_frame** resized) {
  return guarded(frame, __func__, [&] {
    require_argument(frame, "frame");
    require_argument(resized, "resized");
    check_image_size(width_px, height_px, "The size asked for");
    auto handle = std::make_unique<maq_frame>();
    resize_to_bgr(frame->frame.image, width_px, height_px, handle->frame);
    handle->frame.timestamp_ns = frame->frame.timestamp_ns;
    handle->frame.clock = frame->frame.clock;
    handle->frame.sequence = frame->frame.sequence;
    handle->frame.origin = frame->frame.origin;
    handle->frame.intrinsics = intrinsics_for(handle->frame.image, frame->frame);
    *resized = handle.release();
    return MAQ_OK;
  });
}

maq_status maq_frame_save(const maq_frame* frame, const char* path) {
  return guarded(frame, __func__, [&] {
    require_argument(frame, "frame");
    require_argument(path, "path");
    const ImageView& image = frame->frame.image;
    if (is_depth(image.format)) {
      write_depth_file(image, path);
    } else {
      write_image_file(image, path, frame->frame.origin);
    }
    return MAQ_OK;
  });
}
