// A frame as the detector wants it.
#pragma once

#include <array>
#include <vector>

#include "core/frame.h"

namespace maq {

struct NetworkInputSpec {
  int long_side_px = 0;
  int multiple_of = 1;          // the padded sides are multiples of it
  std::array<float, 3> mean{};  // of R, G, B, in 0..255
  std::array<float, 3> std{};
};

struct NetworkInput {
  std::vector<float> values;  // [3, padded_height_px, padded_width_px]: R, G, B, normalised; zero in the padding
  int width_px = 0;           // of the resized image
  int height_px = 0;
  int padded_width_px = 0;  // rounded up to the spec's multiple
  int padded_height_px = 0;
};

// The size at which an image enters the network: its long side becomes `long_side_px`, the other follows (halves are
// rounded to even, as in Python), no side less than 1.
void network_size(int width_px, int height_px, int long_side_px, int* network_width_px, int* network_height_px);

// Resizes (area when shrinking, bilinear when growing), normalises and pads. Memory of `input` is reused.
void make_network_input(const ImageView& image, const NetworkInputSpec& spec, NetworkInput& input);

}  // namespace maq
