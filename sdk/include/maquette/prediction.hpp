// What a stream will show next, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_PREDICTION_HPP_
#define MAQUETTE_PREDICTION_HPP_

#include "maquette/frame.hpp"
#include "maquette/prediction.h"

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

  void restart() { check(maq_predictor_restart(get())); }

  maq_predictor_stats stats() const {
    maq_predictor_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_predictor_get_stats(get(), &stats));
    return stats;
  }

 private:
  Owner<maq_predictor, maq_predictor_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_PREDICTION_HPP_
