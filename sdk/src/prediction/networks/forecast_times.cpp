#include "prediction/networks/forecast_times.h"

#include <algorithm>
#include <cmath>

namespace maq {

ForecastTimes ForecastTimes::read(const ManifestNode& node) {
  ForecastTimes times;
  times.max_ahead = float(node.at("max_ahead").integer(1, 1000));
  const auto fps = node.at("fps").numbers<2>(0.1, 1000);
  times.min_fps = fps[0], times.max_fps = fps[1];
  if (times.max_fps < times.min_fps) node.at("fps").fail("ends before it begins");
  return times;
}

void ForecastTimes::tell(float step_s, float ahead_s, float* two) const {
  const float step = std::clamp(step_s, 1 / max_fps, 1 / min_fps);
  two[0] = std::log2(10 * step);
  two[1] = std::log2(10 * std::clamp(ahead_s, 1 / max_fps, max_ahead * step));
}

}  // namespace maq
