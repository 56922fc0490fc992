#include <algorithm>
#include <iterator>

#include "api/boundary.h"
#include "api/prediction/prediction_handles.h"
#include "core/clock.h"

using namespace maq;

namespace maq {

maq_camera_health_result result_of(const HealthResult& found, const Frame& frame, const PictureMatch& match) {
  maq_camera_health_result result{};
  result.event = maq_camera_event(int(found.event));
  result.state = maq_camera_event(int(found.state));
  result.began_ns = found.began_ns;
  const auto width = float(frame.image.width_px), height = float(frame.image.height_px);
  if (found.event == CameraEvent::kObject) {
    result.x_px = found.object_x * width;
    result.y_px = found.object_y * height;
  } else {
    result.x_px = found.shift_x * width;
    result.y_px = found.shift_y * width;
  }
  result.unexplained = found.unexplained;
  result.columns = match.columns();
  result.rows = match.rows();
  result.is_stream_start = found.is_stream_start ? 1 : 0;
  return result;
}

}  // namespace maq

const char* maq_camera_event_get_name(maq_camera_event event) {
  constexpr const char* kNames[] = {"ok", "cut", "freeze", "black", "covered", "moved", "object"};
  const auto index = unsigned(number_in(event));
  return index < std::size(kNames) ? kNames[index] : "unknown";
}

maq_status maq_camera_health_create(maq_context* context, maq_camera_health** health) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(health, "health");
    *health = new maq_camera_health;
    return MAQ_OK;
  });
}

void maq_camera_health_destroy(maq_camera_health* health) { destroy(health, "health", __func__); }

maq_status maq_camera_health_push(maq_camera_health* health, const maq_frame* frame, maq_camera_health_result* result) {
  return guarded_alone(health, "health", __func__, [&] {
    require_argument(frame, "frame");
    require_argument(result, "result");
    require_struct_size("result", result->struct_size, sizeof *result);
    const Stopwatch whole;
    const HealthResult found = health->health.push(frame->frame);
    health->push_ms = float(whole.elapsed_ms());
    health->pushed += 1;
    health->events += found.event != CameraEvent::kNone ? 1 : 0;
    health->starts += found.is_stream_start ? 1 : 0;
    write_struct(result, "result", result_of(found, frame->frame, health->health.match()));
    return MAQ_OK;
  });
}

maq_status maq_camera_health_copy_map(const maq_camera_health* health, float* values, size_t capacity) {
  return guarded_alone(health, "health", __func__, [&] {
    require_argument(values, "values");
    const std::vector<float>& map = health->health.match().unexplained();
    if (health->pushed == 0) throw ArgumentError("No frame was pushed, so there is no map; push one first.");
    if (capacity < map.size()) {
      throw ArgumentError("capacity is ", capacity, ", but the map has ", map.size(), " cells.");
    }
    std::copy(map.begin(), map.end(), values);
    return MAQ_OK;
  });
}

maq_status maq_camera_health_reset(maq_camera_health* health) {
  return guarded_alone(health, "health", __func__, [&] {
    health->health.reset();
    return MAQ_OK;
  });
}

maq_status maq_camera_health_get_stats(const maq_camera_health* health, maq_camera_health_stats* stats) {
  return guarded_alone(health, "health", __func__, [&] {
    write_struct(stats, "stats",
                 maq_camera_health_stats{0, health->push_ms, health->pushed, health->events, health->starts});
    return MAQ_OK;
  });
}
