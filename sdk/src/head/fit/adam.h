// Adam (Kingma and Ba, arXiv 1412.6980, algorithm 1), with a rate of its own for each unknown.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace maq::head {

class Adam {
 public:
  explicit Adam(size_t count) : mean_(count), square_(count) {}

  // Forgets the past.
  void reset() {
    mean_.assign(mean_.size(), 0.0);
    square_.assign(square_.size(), 0.0);
    steps_ = 0;
  }

  // change[i] = -rates[i] * (the mean of the gradients so far by the root of the mean of their squares), which is at
  // most some rates[i]. An unknown whose gradient is 0 stays.
  void step(const std::vector<double>& gradient, const std::vector<double>& rates, std::vector<double>& change) {
    constexpr double kMean = 0.9, kSquare = 0.99, kTiny = 1e-12;
    ++steps_;
    const double mean_part = 1 - std::pow(kMean, steps_), square_part = 1 - std::pow(kSquare, steps_);
    for (size_t i = 0; i < mean_.size(); ++i) {
      mean_[i] += (1 - kMean) * (gradient[i] - mean_[i]);
      square_[i] += (1 - kSquare) * (gradient[i] * gradient[i] - square_[i]);
      change[i] = -rates[i] * (mean_[i] / mean_part) / (std::sqrt(square_[i] / square_part) + kTiny);
    }
  }

 private:
  std::vector<double> mean_, square_;
  int steps_ = 0;
};

}  // namespace maq::head
