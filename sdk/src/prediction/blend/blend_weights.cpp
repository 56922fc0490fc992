#include "prediction/blend/blend_weights.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/rounding.h"

namespace maq {
namespace {

constexpr int64_t kFirstHorizon_ns = 1000000000 / 30;  // each further one doubles
constexpr int64_t kMinStep_ns = 1000000000 / 32;       // between past frames
constexpr double kMaxRatio = 1.5;                      // between a past frame's age and its horizon
constexpr float kMinWeight = 0.1f;                     // of the newest frame in the running errors
constexpr int kFlowStep = 2;                           // pixels between samples of a past flow
constexpr int kCell_px = 8;                            // side, at half the size of the flow
constexpr float kRoundingError = 0.3f;                 // mean square left by rounding to grey levels
constexpr float kMeanFraction = 0.3f;  // of the mean error of all cells: few frames in one cell say little
constexpr float kAll = 0.97f;          // from this weight on, one method has the whole cell

double ratio(int64_t one_ns, int64_t other_ns) {
  return double(std::max(one_ns, other_ns)) / double(std::max<int64_t>(std::min(one_ns, other_ns), 1));
}

int squares_of_run(const uint8_t* __restrict one, const uint8_t* __restrict other, int count) {
  int sum = 0;  // at most 65,025 each
  for (int i = 0; i < count; ++i) sum += (one[i] - other[i]) * (one[i] - other[i]);
  return sum;
}

// Keeps every step-th displacement in both axes: the mean of the four in the middle, in pixels of the thin field.
void thin_out(const FlowField& flow, int step, FlowField& thin) {
  thin.resize(divide_up(flow.width_px, step), divide_up(flow.height_px, step));
  const float factor = 0.25f / float(step);
  for (const auto& [from, to] : {std::pair{&flow.dx_px, &thin.dx_px}, {&flow.dy_px, &thin.dy_px}}) {
    float* value = to->data();
    for (int y = 0; y < thin.height_px; ++y) {
      const int lower = std::min(y * step + step / 2, flow.height_px - 1), upper = std::max(lower - 1, y * step);
      const float* const above = from->data() + size_t(upper) * size_t(flow.width_px);
      const float* const below = from->data() + size_t(lower) * size_t(flow.width_px);
      for (int x = 0; x < thin.width_px; ++x) {
        const int right = std::min(x * step + step / 2, flow.width_px - 1), left = std::max(right - 1, x * step);
        *value++ = (above[left] + above[right] + (below[left] + below[right])) * factor;
      }
    }
  }
}

float mean_of(const std::vector<float>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0f) / float(values.size());
}

float mean_of_exponentials(const std::vector<float>& values) {
  float sum = 0;
  for (const float value : values) sum += std::exp(value);
  return sum / float(values.size());
}

}  // namespace

BlendWeights::BlendWeights() {
  int64_t ahead_ns = kFirstHorizon_ns;
  for (Horizon& horizon : horizons_) {
    horizon.ahead_ns = ahead_ns;
    ahead_ns *= 2;
  }
}

void BlendWeights::reset() {
  count_ = 0;
  for (Horizon& horizon : horizons_) horizon.count = 0;
}

// Updates the running means `errors`. Each cell is averaged with its eight neighbours.
void BlendWeights::add_errors(const Horizon& horizon, const PastFrame& now, const uint8_t* predicted,
                              std::vector<float>& latest, std::vector<float>& errors) const {
  latest.assign(size_t(columns_) * size_t(rows_), 0.0f);
  errors.resize(latest.size());
  const size_t width = size_t(now.width_px);
  for (int row = 0; row < rows_; ++row) {
    const int end = std::min((row + 1) * kCell_px, now.height_px);
    for (int column = 0; column < columns_; ++column) {
      const int left = column * kCell_px, count = std::min(kCell_px, now.width_px - left);
      int squares = 0;
      for (int y = row * kCell_px; y < end; ++y) {
        const size_t at = size_t(y) * width + size_t(left);
        squares += squares_of_run(predicted + at, now.luma.data() + at, count);
      }
      latest[size_t(row * columns_ + column)] = float(squares) / float(count * (end - row * kCell_px));
    }
  }
  const float weight = std::max(1.0f / float(horizon.count + 1), kMinWeight);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      float sum = 0;
      for (int y = row - 1; y <= row + 1; ++y) {
        for (int x = column - 1; x <= column + 1; ++x) {
          sum += latest[size_t(std::clamp(y, 0, rows_ - 1) * columns_ + std::clamp(x, 0, columns_ - 1))];
        }
      }
      float& error = errors[size_t(row * columns_ + column)];
      if (horizon.count == 0) error = 0;
      error += weight * (std::log(sum / 9 + kRoundingError) - error);
    }
  }
}

// Returns the past frame to drop, so that the ratios of the ages stay even, as between horizons.
size_t BlendWeights::redundant_frame(int64_t now_ns) const {
  const auto age_ns = [&](size_t index) { return double(now_ns - past_[index].timestamp_ns); };
  if (age_ns(kFrames - 1) > kMaxRatio * double(horizons_.back().ahead_ns)) return kFrames - 1;
  size_t found = 0;
  double smallest = 0;
  for (size_t i = 1; i + 1 < kFrames; ++i) {
    const double without = age_ns(i + 1) / age_ns(i - 1);
    if (found != 0 && without >= smallest) continue;
    found = i;
    smallest = without;
  }
  return found;
}

void BlendWeights::measure(Horizon& horizon, const PastFrame& now, HorizonWorkspace& work) const {
  const PastFrame* nearest = nullptr;
  for (size_t i = 0; i < count_; ++i) {
    const PastFrame& past = past_[i];
    const auto away = [&](const PastFrame& of) { return ratio(now.timestamp_ns - of.timestamp_ns, horizon.ahead_ns); };
    if (past.interval_ns > 0 && (nearest == nullptr || away(past) < away(*nearest))) nearest = &past;
  }
  if (nearest == nullptr || ratio(now.timestamp_ns - nearest->timestamp_ns, horizon.ahead_ns) > kMaxRatio) return;
  add_errors(horizon, now, nearest->luma.data(), work.latest, horizon.last_errors);
  const uint8_t* moved = nearest->luma.data();
  if (nearest->moves) {
    const float intervals = float(double(now.timestamp_ns - nearest->timestamp_ns) / double(nearest->interval_ns));
    const ImageView image{
        MAQ_PIXEL_GREY8, now.width_px, now.height_px, {{nearest->luma.data(), size_t(now.width_px)}, {}}};
    work.predicted.resize(nearest->luma.size());
    nearest->flow.unpack(work.flow);
    work.extrapolation.warp(image, work.extrapolation.project(work.flow, intervals), kFlowStep, nullptr, work.alone,
                            work.predicted.data());
    moved = work.predicted.data();
  }
  add_errors(horizon, now, moved, work.latest, horizon.motion_errors);
  horizon.count = std::min(horizon.count + 1, 1000);
}

void BlendWeights::add(const LumaPyramid& pyramid, int64_t timestamp_ns, const FlowField& flow, int64_t interval_ns,
                       WorkerThreads& threads, BlendWorkspace& work) {
  // Half the size of the flow separates the methods as well, in a quarter of the time.
  const LumaLevel& level = pyramid.level(pyramid.level_count() > 1 ? 1 : 0);
  const int step = pyramid.level_count() > 1 ? 2 : 1;
  columns_ = divide_up(level.width_px, kCell_px);
  rows_ = divide_up(level.height_px, kCell_px);
  cell_px_ = step * kCell_px;
  FlowField& thin = work.horizons[0].flow;
  PastFrame& now = work.now;
  now.timestamp_ns = timestamp_ns;
  now.interval_ns = interval_ns;
  now.width_px = level.width_px;
  now.height_px = level.height_px;
  now.luma.resize(size_t(level.width_px) * size_t(level.height_px) + 1);
  for (int y = 0; y < level.height_px; ++y) {
    const float* const luma = level.at(0, y);
    uint8_t* const row = now.luma.data() + size_t(y) * size_t(level.width_px);
    for (int x = 0; x < level.width_px; ++x) row[x] = uint8_t(luma[x] + 0.5f);
  }
  now.moves = false;
  if (interval_ns > 0) {
    thin_out(flow, step * kFlowStep, thin);
    now.moves = now.flow.pack(thin);
  }
  threads.run(kHorizons, [&](size_t i, int) { measure(horizons_[i], now, work.horizons[i]); });
  // Above 32 frames per second some frames are dropped, so that the past ones reach back far enough.
  if (count_ > 0 && timestamp_ns - past_[0].timestamp_ns < kMinStep_ns) return;
  size_t at = count_ < kFrames ? count_++ : redundant_frame(timestamp_ns);
  past_[at] = now;
  for (; at > 0; --at) std::swap(past_[at], past_[at - 1]);
}

const CellWeights& BlendWeights::at(int64_t ahead_ns) {
  const Horizon* nearest = nullptr;
  for (const Horizon& horizon : horizons_) {
    const bool is_nearer = nearest == nullptr || ratio(horizon.ahead_ns, ahead_ns) < ratio(nearest->ahead_ns, ahead_ns);
    if (horizon.count > 0 && is_nearer) nearest = &horizon;
  }
  weights_.columns = columns_;
  weights_.rows = rows_;
  weights_.cell_px = cell_px_;
  weights_.weights.assign(size_t(columns_) * size_t(rows_), 0.0f);
  weights_.mean = 0;
  if (nearest == nullptr) return weights_;
  const float last_everywhere = kMeanFraction * mean_of_exponentials(nearest->last_errors),
              motion_everywhere = kMeanFraction * mean_of_exponentials(nearest->motion_errors);
  for (size_t i = 0; i < weights_.weights.size(); ++i) {
    // Squares would be right for independent errors; the cube decides more clearly.
    const float last = std::exp(nearest->last_errors[i]) + last_everywhere,
                motion = std::exp(nearest->motion_errors[i]) + motion_everywhere;
    const float last3 = last * last * last, motion3 = motion * motion * motion;
    const float weight = last3 / (last3 + motion3);
    weights_.weights[i] = weight > kAll ? 1.0f : weight < 1 - kAll ? 0.0f : weight;
  }
  weights_.mean = mean_of(weights_.weights);
  return weights_;
}

}  // namespace maq
