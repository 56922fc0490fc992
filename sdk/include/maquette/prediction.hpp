// What a stream will show next, how surprising what it shows is, and live sources with short gaps bridged, for C++17; a
// part of maquette.hpp.
#ifndef MAQUETTE_PREDICTION_HPP_
#define MAQUETTE_PREDICTION_HPP_

#include <optional>
#include <string>
#include <vector>

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
    maq_predictor* made = nullptr;
    check(maq_predictor_create(context.get(), &config, &made));
    owner_.reset(made);
  }

  maq_predictor* get() const { return owner_.get(); }

  void push(const Frame& frame) { check(maq_predictor_push(get(), frame.get())); }

  Frame predict(double ahead_s) {
    maq_frame* made = nullptr;
    check(maq_predictor_predict(get(), ahead_s, &made));
    return Frame(made);
  }

  // maq_predictor_draw; then frame `number`, from 1, of each sample, from 0, and its uncertainty by cell.
  void draw(uint32_t sample_count, uint32_t frame_count, double step_s) {
    check(maq_predictor_draw(get(), sample_count, frame_count, step_s));
  }

  Frame drawn(uint32_t sample, uint32_t number) {
    maq_frame* made = nullptr;
    check(maq_predictor_acquire_drawn(get(), sample, number, &made));
    return Frame(made);
  }

  std::vector<float> uncertainty(uint32_t sample, uint32_t number) const {
    std::vector<float> bits(stats().cell_count);
    check(maq_predictor_copy_uncertainty(get(), sample, number, bits.data(), bits.size()));
    return bits;
  }

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

inline maq_surprise_config default_surprise_config() {
  maq_surprise_config config;
  check(maq_surprise_config_init(&config, sizeof config));
  return config;
}

// How surprising the frames of one stream are. Several share networks by networks_of of their configs.
class Surprise {
 public:
  explicit Surprise(const Context& context, const maq_surprise_config& config = default_surprise_config()) {
    maq_surprise* made = nullptr;
    check(maq_surprise_create(context.get(), &config, &made));
    owner_.reset(made);
  }

  maq_surprise* get() const { return owner_.get(); }

  maq_surprise_score push(const Frame& frame) {
    score_.struct_size = sizeof score_;
    check(maq_surprise_push(get(), frame.get(), &score_));
    return score_;
  }

  // Of the latest frame: score.rows rows of score.columns cells.
  std::vector<float> map() const {
    std::vector<float> bits(size_t(score_.columns) * size_t(score_.rows));
    check(maq_surprise_copy_map(get(), bits.data(), bits.size()));
    return bits;
  }

  // What the network saw of the latest frame.
  Frame rebuilt() {
    maq_frame* made = nullptr;
    check(maq_surprise_acquire_rebuilt(get(), &made));
    return Frame(made);
  }

  void reset() { check(maq_surprise_reset(get())); }

  maq_surprise_stats stats() const {
    maq_surprise_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_surprise_get_stats(get(), &stats));
    return stats;
  }

 private:
  Owner<maq_surprise, maq_surprise_destroy> owner_;
  maq_surprise_score score_{};
};

inline maq_concealer_config default_concealer_config() {
  maq_concealer_config config;
  check(maq_concealer_config_init(&config, sizeof config));
  return config;
}

// The frames of a live source with its short gaps bridged; Frame::is_predicted tells which were made up.
class Concealer {
 public:
  Concealer(const Context& context, Source& source, const maq_concealer_config& config = default_concealer_config()) {
    maq_concealer* made = nullptr;
    check(maq_concealer_create(context.get(), source.get(), &config, &made));
    owner_.reset(made);
  }

  maq_concealer* get() const { return owner_.get(); }

  // As Source::next.
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
