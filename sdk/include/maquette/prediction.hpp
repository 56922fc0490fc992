// Predicted frames, camera health, and live sources with short gaps filled, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_PREDICTION_HPP_
#define MAQUETTE_PREDICTION_HPP_

#include <optional>
#include <string>
#include <vector>

#include "maquette/camera_health.h"
#include "maquette/concealer.h"
#include "maquette/frame.hpp"
#include "maquette/prediction.h"
#include "maquette/source.hpp"

namespace maquette {

inline maq_predictor_config default_predictor_config() {
  maq_predictor_config config;
  check(maq_predictor_config_init(&config, sizeof config));
  return config;
}

class Predictor {
 public:
  explicit Predictor(const Context& context, const maq_predictor_config& config = default_predictor_config()) {
    maq_predictor* created = nullptr;
    check(maq_predictor_create(context.get(), &config, &created));
    owner_.reset(created);
  }

  maq_predictor* get() const { return owner_.get(); }

  void push(const Frame& frame) { check(maq_predictor_push(get(), frame.get())); }

  Frame predict(double ahead_s) {
    maq_frame* frame = nullptr;
    check(maq_predictor_predict(get(), ahead_s, &frame));
    return Frame(frame);
  }

  // Samples several futures. Then acquire_sample() decodes frame `frame_index` (1-based) of sample `sample_index`
  // (0-based), and entropy_map() returns its entropy in bits, one value per cell.
  void sample(uint32_t sample_count, uint32_t frame_count, double step_s) {
    check(maq_predictor_sample(get(), sample_count, frame_count, step_s));
  }

  Frame acquire_sample(uint32_t sample_index, uint32_t frame_index) {
    maq_frame* frame = nullptr;
    check(maq_predictor_acquire_sample(get(), sample_index, frame_index, &frame));
    return Frame(frame);
  }

  std::vector<float> entropy_map(uint32_t sample_index, uint32_t frame_index) const {
    std::vector<float> bits(stats().cell_count);
    check(maq_predictor_copy_entropy_map(get(), sample_index, frame_index, bits.data(), bits.size()));
    return bits;
  }

  // From any thread.
  void cancel() { check(maq_predictor_cancel(get())); }

  void reset() { check(maq_predictor_reset(get())); }

  maq_predictor_stats stats() const {
    maq_predictor_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_predictor_get_stats(get(), &stats));
    return stats;
  }

 private:
  Owner<maq_predictor, maq_predictor_destroy> owner_;
};

inline const char* name_of(maq_camera_event event) { return maq_camera_event_get_name(event); }

// Checks the camera of one stream.
class CameraHealth {
 public:
  explicit CameraHealth(const Context& context) {
    maq_camera_health* created = nullptr;
    check(maq_camera_health_create(context.get(), &created));
    owner_.reset(created);
  }

  maq_camera_health* get() const { return owner_.get(); }

  maq_camera_health_result push(const Frame& frame) {
    result_.struct_size = sizeof result_;
    check(maq_camera_health_push(get(), frame.get(), &result_));
    return result_;
  }

  // Returns the map of the latest frame: result.rows rows of result.columns cells.
  std::vector<float> map() const {
    std::vector<float> values(size_t(result_.columns) * size_t(result_.rows));
    check(maq_camera_health_copy_map(get(), values.data(), values.size()));
    return values;
  }

  void reset() { check(maq_camera_health_reset(get())); }

  maq_camera_health_stats stats() const {
    maq_camera_health_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_camera_health_get_stats(get(), &stats));
    return stats;
  }

 private:
  Owner<maq_camera_health, maq_camera_health_destroy> owner_;
  maq_camera_health_result result_{};
};

inline maq_concealer_config default_concealer_config() {
  maq_concealer_config config;
  check(maq_concealer_config_init(&config, sizeof config));
  return config;
}

// Delivers the frames of a live source with its short gaps filled. Frame::is_predicted tells predicted frames apart.
class Concealer {
 public:
  Concealer(const Context& context, Source& source, const maq_concealer_config& config = default_concealer_config()) {
    maq_concealer* created = nullptr;
    check(maq_concealer_create(context.get(), source.get(), &config, &created));
    owner_.reset(created);
  }

  maq_concealer* get() const { return owner_.get(); }

  // Like Source::next.
  std::optional<Frame> next(int64_t timeout_ns = MAQ_WAIT_FOREVER) {
    maq_frame* frame = nullptr;
    const maq_status status = maq_concealer_acquire_frame(get(), timeout_ns, &frame);
    if (status == MAQ_END_OF_STREAM || status == MAQ_CANCELLED) return std::nullopt;
    check(status);
    return Frame(frame);
  }

  maq_concealer_stats stats() const {
    maq_concealer_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_concealer_get_stats(get(), &stats));
    return stats;
  }

 private:
  Owner<maq_concealer, maq_concealer_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_PREDICTION_HPP_
