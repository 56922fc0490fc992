// What every source is.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/log.h"

namespace maq {

struct SourceInfo {
  int width_px = 0;
  int height_px = 0;
  double fps = 0;            // 0 for a single image
  int64_t frame_count = -1;  // -1: not known, or endless
  bool is_live = false;
  maq_clock clock = MAQ_CLOCK_MEDIA;
};

class Source {
 public:
  virtual ~Source() = default;
  virtual const SourceInfo& info() const = 0;
  // Fills `frame` (pixels, time, sequence) with the next frame; false after the last one.
  virtual bool next(int64_t timeout_ns, Frame& frame) = 0;
};

struct SourceScheme {
  const char* name;
  const char* example;
  const char* summary;
};

// Every scheme of this build.
const std::vector<SourceScheme>& source_schemes();

// Throws MAQ_ERROR_UNSUPPORTED for a scheme that is not in the list, and what the source throws.
std::unique_ptr<Source> open_source(const std::string& uri);

}  // namespace maq
