// A frame as the input of a network: resized, normalised, padded.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/frame.h"

namespace maq {

// The size at which an image enters the network, without padding.
struct NetworkSize {
  int width_px = 0;
  int height_px = 0;
};

struct NetworkInputSpec {
  int multiple_of = 1;          // the padded sides are multiples of it
  std::array<float, 3> mean{};  // R, G, B, in 0..255
  std::array<float, 3> std{};
};

// How one side of an image is resized: for each new pixel the first of the old ones that it draws on, and their
// weights.
struct ResizeAxis {
  int from_px = 0;
  int to_px = 0;
  int taps = 0;               // weights of a new pixel; unneeded ones are zero
  std::vector<int> first;     // [to_px]; first + taps <= from_px
  std::vector<float> weight;  // [to_px, taps]

  // Area weights when shrinking, bilinear ones with half-pixel centres when growing, like OpenCV. Does nothing if it is
  // prepared for these sizes already.
  void prepare(int from, int to, bool shrinks);
};

struct NetworkInput {
  std::vector<float> values;  // [3, padded_height_px, padded_width_px]: R, G, B, normalised; zero in the padding
  int width_px = 0;           // size of the resized image
  int height_px = 0;
  int padded_width_px = 0;  // rounded up to the spec's multiple
  int padded_height_px = 0;

  // Scratch, kept so that frames of one size allocate nothing.
  ResizeAxis columns;
  ResizeAxis rows;
  std::vector<float> row;
  std::vector<uint8_t> converted;  // the image as BGR, where it comes in another format
};

// Returns the size for an image of `width_px` x `height_px`: the long side becomes `long_side_px`, the other side keeps
// the ratio (halves are rounded to even, like in Python) and is at least 1.
NetworkSize network_size(int width_px, int height_px, int long_side_px);

// Resizes to `size` (area when shrinking, bilinear when growing), normalises and pads, in one pass and without rounding
// to bytes in between. Memory of `input` is reused.
void make_network_input(const ImageView& image, const NetworkSize& size, const NetworkInputSpec& spec,
                        NetworkInput& input);

}  // namespace maq
