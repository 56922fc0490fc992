// A field of displacements in half of its memory, for as long as it only has to be kept.
#pragma once

#include <cstdint>
#include <vector>

#include "prediction/optical_flow.h"

namespace maq {

// Numbers of 16 bits, in steps of the largest displacement by 32,767: of 20 pixels 1/1600. What is 0 stays 0.
class PackedFlow {
 public:
  // Whether any displacement, all of which are finite, is not 0. Takes nothing from the heap for a field of the same
  // size as the one before.
  bool pack(const FlowField& flow);
  void unpack(FlowField& flow) const;

 private:
  int width_px_ = 0, height_px_ = 0;
  float step_px_ = 0;
  std::vector<uint16_t> packed_;  // across, then down
};

}  // namespace maq
