// U and V of a person, computed only for the cells and parts that decoding reads.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace maq {

struct ChartPoint {
  float u = 0;
  float v = 0;
};

// Where decoding gets U and V of a part at a cell of the dense head's output. Parts count from 0 here.
class ChartValues {
 public:
  virtual ~ChartValues() = default;
  virtual ChartPoint at(int part, int row, int column) = 0;
};

// The last layer of the dense head for U and V: a transposed convolution (kernel 4, stride 2, padding 1) over the
// features `surface`. Each cell has values of 24 parts, but only one is used: values are computed one by one.
class ChartPredictor : public ChartValues {
 public:
  // `bytes`: float32 weight [2 (U, V), parts, 4, 4, channels], then bias [2, parts]. `name` names them in errors.
  // Throws MAQ_ERROR_BAD_BUNDLE for another size, or numbers that are not finite.
  ChartPredictor(const std::vector<uint8_t>& bytes, int parts, const std::string& name);

  int channels() const { return channels_; }
  // Turns to another person: `surface` [size, size, channels], which must stay until the next call.
  void begin(const float* surface, int size);
  // `row` and `column` are of the output, [2 * size, 2 * size].
  ChartPoint at(int part, int row, int column) override;

 private:
  int parts_;
  int channels_ = 0;
  int size_ = 0;
  std::vector<float> weight_;
  std::vector<float> bias_;
  const float* surface_ = nullptr;
  std::vector<ChartPoint> known_;      // [parts, 2 * size, 2 * size]
  std::vector<uint32_t> known_since_;  // the person for whom it was computed
  uint32_t person_ = 0;
};

}  // namespace maq
