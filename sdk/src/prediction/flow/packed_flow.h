// Stores a flow field in half of its memory.
#pragma once

#include <cstdint>
#include <vector>

#include "prediction/flow/optical_flow.h"

namespace maq {

// 16 bits a number, in steps of the largest displacement / 32,767. 0 stays 0.
class PackedFlow {
 public:
  // Returns whether any displacement is not 0. All must be finite. Allocates nothing while the size stays the same.
  bool pack(const FlowField& flow);
  void unpack(FlowField& flow) const;

 private:
  int width_px_ = 0, height_px_ = 0;
  float step_px_ = 0;
  std::vector<uint16_t> packed_;  // dx, then dy
};

}  // namespace maq
