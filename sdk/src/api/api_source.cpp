#include <algorithm>
#include <cmath>
#include <cstddef>

#include "api/boundary.h"
#include "api/source_handle.h"

using namespace maq;

namespace {

constexpr const char* kConcealed =
    "A concealer takes the frames of this source; acquire them from the concealer, or destroy it.";

constexpr uint32_t kLargestPoolSize = 64;

maq_source_config default_source_config() {
  maq_source_config config{};
  config.struct_size = sizeof config;
  return config;
}

void require_control(const maq_source_control& control) {
  require_range("control", number_in(control), int32_t(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE),
                int32_t(MAQ_SOURCE_CONTROL_BRIGHTNESS));
}

}  // namespace

namespace maq {

maq_source_config read_source_config(const maq_source_config* given, const char* name) {
  return read_config(given, name, default_source_config());
}

SourceSettings source_settings(const maq_source_config& config, const char* name, const Log& log) {
  const auto field = [name](const char* of) { return concatenate(name, ".", of); };
  require_range(field("frame_pool_size"), config.frame_pool_size, 0u, kLargestPoolSize);
  require_range(field("queue_length"), config.queue_length, 0u, kLargestPoolSize);
  if (config.stall_ms != 0) require_range(field("stall_ms"), config.stall_ms, 50, 60000);
  require_range(field("reconnect_ms"), config.reconnect_ms, MAQ_NO_RECONNECT, 86400000);
  require_range(field("real_time"), config.real_time, 0, 1);
  require_range(field("loop"), config.loop, 0, 1);
  if (config.max_side_px != 0) require_range(field("max_side_px"), config.max_side_px, 1, MAQ_MAX_SIDE_PX);
  SourceSettings settings;
  if (config.frame_pool_size != 0) settings.pool_size = int(config.frame_pool_size);
  if (config.queue_length != 0) settings.queue_length = int(config.queue_length);
  if (config.stall_ms != 0) settings.stall_ms = config.stall_ms;
  if (config.reconnect_ms != 0) settings.reconnect_ms = std::max(config.reconnect_ms, 0);
  settings.real_time = config.real_time == 1;
  settings.loop = config.loop == 1;
  settings.max_side_px = config.max_side_px;
  settings.on_state = config.state_callback;
  settings.user_data = config.state_user_data;
  settings.log = log;
  return settings;
}

}  // namespace maq

maq_status maq_source_config_init(maq_source_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_source_config());
}

maq_status maq_source_create(maq_context* context, const char* uri, const maq_source_config* given,
                             maq_source** source) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(uri, "uri");
    require_argument(source, "source");
    const maq_source_config config = read_source_config(given, "config");
    const SourceSettings settings = source_settings(config, "config", context->state->log());
    *source = new maq_source(uri, open_source(uri, settings), size_t(settings.pool_size));
    return MAQ_OK;
  });
}

maq_status maq_source_stop(maq_source* source) {
  return guarded(source, __func__, [&] {
    require_argument(source, "source");
    source->stop();
    return MAQ_OK;
  });
}

// Allowed while another thread waits for a frame: that call returns first.
void maq_source_destroy(maq_source* source) { destroy(source, "source", __func__, WhileInUse::kAllowed); }

maq_status maq_source_get_info(const maq_source* source, maq_source_info* info) {
  return guarded(source, __func__, [&] {
    require_argument(source, "source");
    const SourceInfo& from = source->source->info();
    maq_source_info filled{};
    filled.width_px = from.width_px;
    filled.height_px = from.height_px;
    filled.fps = from.fps;
    filled.frame_count = from.frame_count;
    filled.is_live = from.is_live ? 1 : 0;
    filled.clock = from.clock;
    filled.frame_pool_size = uint32_t(source->frames.capacity());
    filled.dropped_frame_count = source->source->drops();
    write_struct(info, "info", filled);
    return MAQ_OK;
  });
}

maq_status maq_source_acquire_frame(maq_source* source, int64_t timeout_ns, maq_frame** frame) {
  const SourceCall call(source);
  return guarded_alone(source, "source", __func__, [&] {
    require_argument(frame, "frame");
    if (*source->is_concealed) {
      throw Error(MAQ_ERROR_BUSY, kConcealed);
    }
    BoundedPool<maq_frame>::Pooled handle = source->frames.acquire();
    switch (source->is_stopped ? NextFrame::kStopped : source->source->next(timeout_ns, handle->frame)) {
      case NextFrame::kFrame: break;
      case NextFrame::kEnd: return MAQ_END_OF_STREAM;
      case NextFrame::kTimeout:
        return keep_error(source, MAQ_TIMEOUT, nullptr,
                          concatenate("No frame came within ", timeout_ns / 1000000, " ms.").c_str());
      case NextFrame::kStopped: return keep_error(source, MAQ_CANCELLED, nullptr, "The source was stopped.");
    }
    *frame = lend<maq_frame>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_source_get_event_fd(maq_source* source, int32_t* fd) {
  return guarded(source, __func__, [&] {
    require_argument(source, "source");
    require_argument(fd, "fd");
    *fd = source->source->event_fd();
    return MAQ_OK;
  });
}

maq_status maq_source_get_intrinsics(const maq_source* source, maq_intrinsics* intrinsics) {
  return guarded(source, __func__, [&] {
    require_argument(source, "source");
    require_argument(intrinsics, "intrinsics");
    const maq_intrinsics* found = source->source->intrinsics();
    if (found == nullptr)
      throw Error(MAQ_ERROR_UNSUPPORTED,
                  "The intrinsics of the source are unknown; add fov=60 (degrees) or fx=380 (pixels) to its URI.");
    *intrinsics = *found;
    return MAQ_OK;
  });
}

maq_status maq_source_get_control(maq_source* source, maq_source_control control, maq_source_control_info* info) {
  return guarded(source, __func__, [&] {
    require_argument(source, "source");
    require_argument(info, "info");
    require_control(control);
    write_struct(info, "info", source->source->control(control));
    return MAQ_OK;
  });
}

maq_status maq_source_set_control(maq_source* source, maq_source_control control, double value) {
  return guarded(source, __func__, [&] {
    require_argument(source, "source");
    require_control(control);
    if (!std::isfinite(value)) throw ArgumentError("value is ", value, ".");
    source->source->set_control(control, value);
    return MAQ_OK;
  });
}

maq_status maq_source_seek(maq_source* source, int64_t time_ns) {
  return guarded_alone(source, "source", __func__, [&] {
    if (time_ns < 0) throw ArgumentError("time_ns is ", time_ns, ", but must not be negative.");
    source->source->seek(time_ns);
    return MAQ_OK;
  });
}

uint32_t maq_source_get_scheme_count(void) {
  try {
    return uint32_t(source_schemes().size());
  } catch (...) {
    return 0;
  }
}

maq_status maq_source_get_scheme(uint32_t index, maq_source_scheme* scheme) {
  return guarded(nullptr, __func__, [&] {
    const std::vector<SourceScheme>& schemes = source_schemes();
    require_index("index", index, schemes.size());
    const SourceScheme& from = schemes[index];
    write_struct(scheme, "scheme", maq_source_scheme{0, from.name, from.example, from.summary, from.is_camera ? 1 : 0});
    return MAQ_OK;
  });
}

maq_status maq_camera_list_create(maq_context* context, maq_camera_list** list) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(list, "list");
    auto made = std::make_unique<maq_camera_list>();
    made->cameras = list_cameras();
    *list = made.release();
    return MAQ_OK;
  });
}

void maq_camera_list_destroy(maq_camera_list* list) { destroy(list, "list", __func__); }

uint32_t maq_camera_list_get_count(const maq_camera_list* list) {
  return list == nullptr ? 0 : uint32_t(list->cameras.size());
}

maq_status maq_camera_list_get_camera(const maq_camera_list* list, uint32_t index, maq_camera_info* info) {
  return guarded(list, __func__, [&] {
    require_argument(list, "list");
    require_index("index", index, list->cameras.size());
    const CameraListing& from = list->cameras[index];
    write_struct(info, "info",
                 maq_camera_info{0, from.uri.c_str(), from.name.c_str(), from.bus.c_str(), from.status,
                                 from.problem.c_str(), uint32_t(from.modes.size())});
    return MAQ_OK;
  });
}

maq_status maq_camera_list_get_mode(const maq_camera_list* list, uint32_t index, uint32_t mode_index,
                                    maq_camera_mode* mode) {
  return guarded(list, __func__, [&] {
    require_argument(list, "list");
    require_index("index", index, list->cameras.size());
    const std::vector<CameraMode>& modes = list->cameras[index].modes;
    require_index("mode_index", mode_index, modes.size());
    const CameraMode& from = modes[mode_index];
    maq_camera_mode filled{};
    from.format.copy(filled.format, sizeof filled.format - 1);
    filled.is_usable = from.usable ? 1 : 0;
    filled.width_px = from.width_px;
    filled.height_px = from.height_px;
    filled.fps = from.fps;
    write_struct(mode, "mode", filled);
    return MAQ_OK;
  });
}
