#include "prediction/method_choice.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace maq {
namespace {

constexpr int64_t kFirstHorizon_ns = 1000000000 / 30;  // each later one is twice as far
constexpr int64_t kMinStep_ns = 1000000000 / 32;       // between frames that are remembered
constexpr double kMaxRatio = 1.5;                      // of a frame's age to the horizon that it stands for
constexpr double kMinWeight = 0.1;                     // of the newest frame in the running errors
constexpr double kClearly = 0.02;                      // by which motion must be better, of the logarithms
constexpr double kRoundingError = 0.1;                 // mean square of what rounding to whole grey levels leaves

double ratio(int64_t one_ns, int64_t other_ns) {
  return double(std::max(one_ns, other_ns)) / double(std::max<int64_t>(std::min(one_ns, other_ns), 1));
}

int64_t squares_of_row(const uint8_t* __restrict one, const uint8_t* __restrict other, int count) {
  int sum = 0;  // at most 65,025 each, of at most 8,192
  for (int i = 0; i < count; ++i) sum += (one[i] - other[i]) * (one[i] - other[i]);
  return sum;
}

double log_mean_square(const std::vector<uint8_t>& one, const std::vector<uint8_t>& other, int width, int height) {
  int64_t sum = 0;
  for (size_t y = 0; y < size_t(height); ++y) {
    sum += squares_of_row(one.data() + y * size_t(width), other.data() + y * size_t(width), width);
  }
  return std::log(double(sum) / (double(width) * double(height)) + kRoundingError);
}

}  // namespace

MethodChoice::MethodChoice() {
  int64_t ahead_ns = kFirstHorizon_ns;
  for (Horizon& horizon : horizons_) {
    horizon.ahead_ns = ahead_ns;
    ahead_ns *= 2;
  }
}

void MethodChoice::reset() {
  count_ = 0;
  for (Horizon& horizon : horizons_) horizon.count = 0;
}

void MethodChoice::judge(Horizon& horizon, const Past& now) const {
  const Past* nearest = nullptr;
  for (size_t i = 0; i < std::min(count_, kFrames); ++i) {
    const Past& past = past_[(count_ - 1 - i) % kFrames];
    const auto away = [&](const Past& of) { return ratio(now.timestamp_ns - of.timestamp_ns, horizon.ahead_ns); };
    if (past.interval_ns > 0 && (nearest == nullptr || away(past) < away(*nearest))) nearest = &past;
  }
  if (nearest == nullptr || ratio(now.timestamp_ns - nearest->timestamp_ns, horizon.ahead_ns) > kMaxRatio) return;
  const double last = log_mean_square(nearest->grey, now.grey, now.width_px, now.height_px);
  double motion = last;
  if (nearest->moves) {
    const float intervals = float(double(now.timestamp_ns - nearest->timestamp_ns) / double(nearest->interval_ns));
    const ImageView image{
        MAQ_PIXEL_GREY8, now.width_px, now.height_px, {{nearest->grey.data(), size_t(now.width_px)}, {}}};
    horizon.predicted.resize(nearest->grey.size());
    horizon.extrapolation.fetch(image, horizon.extrapolation.project(nearest->flow, intervals), 1, horizon.alone,
                                horizon.predicted.data());
    motion = log_mean_square(horizon.predicted, now.grey, now.width_px, now.height_px);
  }
  const double weight = std::max(1.0 / (horizon.count + 1), kMinWeight);
  horizon.last_error += weight * (last - horizon.last_error);
  horizon.motion_error += weight * (motion - horizon.motion_error);
  horizon.count = std::min(horizon.count + 1, 1000);
}

void MethodChoice::add(const GreyPyramid& pyramid, int64_t timestamp_ns, const FlowField& flow, int64_t interval_ns,
                       WorkerThreads& threads) {
  // At half the size of the flow: it tells the methods apart, in a quarter of the time.
  const GreyLevel& level = pyramid.levels()[pyramid.levels().size() > 1 ? 1 : 0];
  const int step = pyramid.levels().size() > 1 ? 2 : 1;
  now_.timestamp_ns = timestamp_ns;
  now_.interval_ns = interval_ns;
  now_.width_px = level.width_px;
  now_.height_px = level.height_px;
  now_.grey.resize(size_t(level.width_px) * size_t(level.height_px) + 1);
  now_.flow.resize(level.width_px, level.height_px);
  now_.moves = false;
  for (int y = 0; y < level.height_px; ++y) {
    const size_t row = size_t(y) * size_t(level.width_px);
    const float* const grey = level.at(0, y);
    for (int x = 0; x < level.width_px; ++x) now_.grey[row + size_t(x)] = uint8_t(grey[x] + 0.5f);
    if (interval_ns <= 0) continue;
    const size_t from = size_t(y * step) * size_t(flow.width_px);
    for (int x = 0; x < level.width_px; ++x) {
      const size_t at = from + size_t(x * step);
      now_.flow.dx_px[row + size_t(x)] = flow.dx_px[at] / float(step);
      now_.flow.dy_px[row + size_t(x)] = flow.dy_px[at] / float(step);
      now_.moves = now_.moves || flow.dx_px[at] != 0 || flow.dy_px[at] != 0;
    }
  }
  threads.run(kHorizons, [&](size_t i, int) { judge(horizons_[i], now_); });
  // At more than 32 frames a second not each is remembered, so that they reach back far enough.
  if (count_ > 0 && timestamp_ns - past_[(count_ - 1) % kFrames].timestamp_ns < kMinStep_ns) return;
  std::swap(past_[count_ % kFrames], now_);
  ++count_;
}

maq_prediction_method MethodChoice::choose(int64_t ahead_ns) const {
  const Horizon* nearest = nullptr;
  for (const Horizon& horizon : horizons_) {
    const bool is_nearer = nearest == nullptr || ratio(horizon.ahead_ns, ahead_ns) < ratio(nearest->ahead_ns, ahead_ns);
    if (horizon.count > 0 && is_nearer) nearest = &horizon;
  }
  const bool moves = nearest != nullptr && nearest->motion_error < nearest->last_error - kClearly;
  return moves ? MAQ_PREDICTION_MOTION : MAQ_PREDICTION_LAST;
}

}  // namespace maq
